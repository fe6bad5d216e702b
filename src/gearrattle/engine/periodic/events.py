"""Events of a branch: where motions appear or vanish, gain or lose stability, or touch other corners.

Between two points of a branch a test function changes its sign (T_p: the tangent's part along the parameter, M: the
gradient of the period map):

    fold               T_p
    period doubling    det(I + M)
    symmetry breaking  det(I - M), where T_p keeps its sign: another branch crosses
    Neimark-Sacker     number of complex multipliers outside the unit circle
    grazing            two crossings of one corner appear or vanish; they meet at velocity zero, so the square of
                       their velocity is a test function on the side where they exist
    pattern            the same crossings in another order; the time between two of them is the test function

Where a slider begins to slip the gradient jumps (``grazing``): then a determinant may change its sign without being
zero, and the motion folds or doubles its period in a corner of the branch (*border collision*). Patterns are compared
by the crossings of clearances first; where these are the same, by those of sliders and limiters as well.

Takes a Continuation and two of its Points; gives Events, in the order of the branch.

Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, 4th ed., Springer 2023; M. di Bernardo, C. J. Budd, A. R.
Champneys, P. Kowalczyk, Piecewise-smooth Dynamical Systems, Springer 2008.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from gearrattle.engine.periodic.continuation import Continuation, Pattern, Point, rotated
from gearrattle.engine.periodic.grazing import JUMP, Grazing, grazing_of
from gearrattle.engine.periodic.touch import Touch
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

FOLD, DOUBLING, BREAKING, NEIMARK_SACKER, GRAZING, PATTERN = (
    "fold",
    "period doubling",
    "symmetry breaking",
    "Neimark-Sacker",
    "grazing",
    "pattern",
)
_LOCATED = 1e-13  # of the way between two points, and of arclength
_JUMP = 1e-3  # a test function that stays farther from zero than this on both sides jumps over zero
REAL = 1e-9
"""A multiplier with a smaller imaginary part is real but for rounding."""
_DEEPEST = 12  # halvings of a step that holds more than one change of the pattern
_TOUCHES = 40  # most motions followed to locate a grazing
_ASIDE = 1e-8  # arclength from a jump of the gradient to the points on either side
_NEARER = 0.02  # share of the way to the expected grazing that the next motion leaves, at least


@dataclass(frozen=True)
class View:
    """The crossings that patterns are compared by: those of the first ``watches`` that may cross; None: of all."""

    watches: int | None = None

    def __call__(self, point: Point) -> Pattern:
        """Return the pattern of a motion."""
        return point.pattern if self.watches is None else rotated(self.crossings(point)[2])

    def crossings(self, point: Point) -> tuple[Array, Array, list[tuple[int, int]]]:
        """Return instants [s], velocities [SI], and what crosses which bound (1: the upper one)."""
        crossings = point.motion.crossings
        is_seen = crossings.watch < (np.inf if self.watches is None else self.watches)
        watch, upward = crossings.watch[is_seen].tolist(), crossings.upward[is_seen].tolist()
        return crossings.time[is_seen], crossings.velocity[is_seen], list(zip(watch, upward, strict=True))


@dataclass(frozen=True)
class Event:
    """Something that happens along a branch.

    Attributes
    ----------
    kind
        of event.
    point
        of the branch at the event, located to rounding.
    watch
        index of what touches or crosses its bound: clearances first, then auxiliary elements; -1: none.
    is_collision
        whether the gradient jumps there.
    touch
        of a grazing: the corner and the instant.
    grazing
        of a grazing: what it does to the gradient.
    """

    kind: str
    point: Point
    watch: int = -1
    is_collision: bool = False
    touch: Touch | None = None
    grazing: Grazing | None = None


def events_between(curve: Continuation, before: Point, after: Point, depth: int = 0) -> list[Event]:
    """Locate what happens between two points that follow one another, in the order of the branch.

    Raises
    ------
    ConvergenceError
        the branch cannot be followed in between.
    """
    view = _view_of(curve, before, after)
    if not _is_one_change(view(before), view(after)) and depth < _DEEPEST:
        return _events_of_halves(curve, before, after, depth)
    try:
        changes = list(_changes_of_pattern(curve, before, after, view))
    except ConvergenceError:
        if depth >= _DEEPEST:
            raise
        return _events_of_halves(curve, before, after, depth)
    if len(changes) == 1 and changes[0].grazing is not None and changes[0].grazing.kind == JUMP:
        left, right = _sides(curve, before, after, changes[0].point)
        smooth = [*_losses(curve, before, left), *_losses(curve, right, after)]
        changes += _collisions(left, right, changes[0])
    else:
        smooth = list(_losses(curve, before, after))
    return sorted([*changes, *smooth], key=lambda event: event.point.length)


def _view_of(curve: Continuation, before: Point, after: Point) -> View:
    """What two patterns are compared by: crossings of clearances, or where these are the same all of them."""
    if before.pattern == after.pattern:
        return View()
    corners = View(len(curve.family.map_at(before.parameter).system.clearances))
    return View() if corners(before) == corners(after) else corners


def _events_of_halves(curve: Continuation, before: Point, after: Point, depth: int) -> list[Event]:
    """The events of both halves of a step."""
    middle = curve.between(before, after, 0.5)
    return [*events_between(curve, before, middle, depth + 1), *events_between(curve, middle, after, depth + 1)]


def _losses(curve: Continuation, before: Point, after: Point) -> Iterator[Event]:
    """Yield the folds, doublings, breakings and Neimark-Sacker bifurcations between two points."""
    for kind in _changed(before, after):
        yield _located(curve, before, after, kind, TESTS[kind])
    if _pairs_change(before, after):
        count = _pairs_outside(before)
        yield _located(curve, before, after, NEIMARK_SACKER, lambda p: _sign(_pairs_outside(p) == count))


def _changed(before: Point, after: Point) -> list[str]:
    """The kinds of events whose test functions have different signs at two points."""
    kinds = [kind for kind, test in TESTS.items() if test(before) * test(after) < 0.0]
    if FOLD in kinds and BREAKING in kinds:  # at a fold det(I - M) is zero as well
        kinds.remove(BREAKING)
    return kinds


def _sides(curve: Continuation, before: Point, after: Point, jump: Point) -> tuple[Point, Point]:
    """The points just before and just beyond a jump of the gradient between two points."""
    step = after.length - before.length
    share, aside = (jump.length - before.length) / step, min(_ASIDE / step, 1e-3)
    left, right = (curve.between(before, after, share + side * aside) for side in (-1.0, 1.0))
    return left, right


def _collisions(left: Point, right: Point, grazing: Event) -> list[Event]:
    """What happens to the motion in a jump of the gradient, by the signs of the test functions on either side."""
    kinds = _changed(left, right)
    if _pairs_change(left, right):
        kinds.append(NEIMARK_SACKER)
    return [Event(kind, grazing.point, is_collision=True) for kind in kinds]


def _is_one_change(one: Pattern, other: Pattern) -> bool:
    """Whether two patterns are the same, or differ by one touch or by one exchange."""
    changes = (_touch(one, other), _touch(other, one), _swapped(one, other))
    return one == other or any(change is not None for change in changes)


def _located(curve: Continuation, before: Point, after: Point, kind: str, test: Callable[[Point], float]) -> Event:
    """The event where a test function changes its sign."""
    points: dict[float, Point] = {}

    def value(share: float) -> float:
        points[share] = curve.between(before, after, share)
        return test(points[share])

    share = float(brentq(value, 0.0, 1.0, xtol=_located_within(before, after), rtol=1e-14))
    nearest = sorted(points, key=lambda other: abs(other - share))[:4]
    sides = [test(points[other]) for other in nearest]
    jumps = kind in TESTS and min(map(abs, sides)) > _JUMP and min(sides) < 0.0 < max(sides)
    return Event(kind, points[share], is_collision=jumps)


def _changes_of_pattern(curve: Continuation, before: Point, after: Point, view: View) -> Iterator[Event]:
    """Yield the grazing or the exchange of two crossings between two points whose patterns differ."""
    one, other = view(before), view(after)
    if one == other:
        return
    if len(one) != len(other):  # by more than two crossings: several touch at once
        yield _grazing(curve, before, after, view)
        return
    watch = _swapped(one, other)
    if watch is None:
        yield Event(PATTERN, _located(curve, before, after, PATTERN, lambda p: _sign(view(p) == one)).point)
        return

    def apart_by(point: Point) -> float:
        return _time_between(point, other, view) if view(point) == one else -_time_between(point, one, view)

    yield replace(_located(curve, before, after, PATTERN, apart_by), watch=watch, is_collision=False)


def _touch(fewer: Pattern, more: Pattern) -> int | None:
    """Index of what touches, if ``more`` is ``fewer`` with two more crossings of one corner; else None."""
    if len(more) != len(fewer) + 2:
        return None
    return next((more[i][0] for i in range(len(more)) if _without(more, i) == fewer), None)


def _without(pattern: Pattern, i: int) -> Pattern | None:
    """The pattern without crossings i and i + 1, if these cross one corner out and back; else None."""
    j = (i + 1) % len(pattern)
    if pattern[i][0] != pattern[j][0] or pattern[i][1] == pattern[j][1]:
        return None
    return rotated([item for k, item in enumerate(pattern) if k not in (i, j)])


def _grazing(curve: Continuation, before: Point, after: Point, view: View) -> Event:
    """The grazing, where two crossings meet: near it their velocity v grows with the square root of the distance s.

    Motions that cross are followed nearer and nearer to the point where v^2, as a function of s, reaches zero.
    """
    is_after = len(view(after)) > len(view(before))
    apart, touching = (before, after) if is_after else (after, before)
    fewer = view(apart)
    inner, outer = (1.0, 0.0) if is_after else (0.0, 1.0)  # shares with and without the crossings
    samples = [(inner, *softest_touch(touching, fewer, view))]
    limit, expected, nearer, located = 0.5, np.inf, _NEARER, _located_within(before, after)
    for _ in range(_TOUCHES):
        near, (low, high) = samples[-3:], sorted((inner, outer))
        previous, expected = expected, _extrapolated([v for _, v, _ in near], [share for share, _, _ in near], outer)
        is_inside = low <= expected <= high
        limit = expected if is_inside else 0.5 * (inner + outer)
        if high - low < located or (is_inside and len(near) == 3 and abs(expected - previous) < 10.0 * located):
            break
        nearest = float(np.clip(expected, low, high)) if np.isfinite(expected) else limit
        share = nearest + nearer * (inner - nearest)
        point = curve.between(before, after, share)
        if view(point) == fewer:
            outer, expected, nearer = share, np.inf, min(0.5, 4.0 * nearer)
        else:
            inner, nearer = share, max(_NEARER, 0.5 * nearer)
            samples.append((share, *softest_touch(point, fewer, view)))
    touch, point = samples[-1][2], curve.between(before, after, limit)
    grazing = grazing_of(curve, point, touch, 1.0 if is_after else -1.0)
    return Event(GRAZING, point, touch.watch, touch=touch, grazing=grazing)


def _located_within(before: Point, after: Point) -> float:
    """How near an event is located, as a share of the way: no motion is known better than to so much arclength."""
    return min(0.1, _LOCATED * max(1.0, 1.0 / (after.length - before.length)))


def _extrapolated(velocities: list[float], shares: list[float], outer: float) -> float:
    """The share at which the velocity is zero: s = s0 + a v^2 + b v^3 through the last samples."""
    if len(velocities) == 1:
        return 0.5 * (shares[0] + outer)
    powers = [0, 2, 3][: len(velocities)]
    matrix = np.array([[v**power for power in powers] for v in velocities])
    scale = np.abs(matrix).max(axis=0)
    try:
        return float(np.linalg.solve(matrix / scale, np.array(shares))[0] / scale[0])
    except np.linalg.LinAlgError:
        return 0.5 * (shares[-1] + outer)


def softest_touch(point: Point, fewer: Pattern, view: View) -> tuple[float, Touch]:
    """Return velocity [SI] and Touch of the slowest two crossings without which the pattern is ``fewer``."""
    time, velocity, order = view.crossings(point)
    count = len(order)
    pairs = [(i, (i + 1) % count) for i in range(count) if _without(tuple(order), i) == fewer]
    if not pairs:  # several touch at once
        following = [_next_of_same(order, i) for i in range(count)]
        pairs = [(i, j) for i, j in enumerate(following) if order[j] == (order[i][0], 1 - order[i][1])]
    touches, motion = [], point.motion
    for i, j in pairs:
        lasts = (time[j] - time[i]) % (motion.cycles * motion.period)
        middle = float((time[i] + 0.5 * lasts) / motion.period)
        speed = 0.5 * abs(velocity[i] - velocity[j])
        touches.append((speed, Touch(order[i][0], order[i][1], middle)))
    if not touches:
        raise ConvergenceError("the pattern of crossings changes more than once")
    return min(touches, key=lambda touch: touch[0])


def _next_of_same(order: list[tuple[int, int]], i: int) -> int:
    """Index of the next crossing of what crosses at i."""
    count = len(order)
    return next((i + k) % count for k in range(1, count + 1) if order[(i + k) % count][0] == order[i][0])


def _swapped(one: Pattern, other: Pattern) -> int | None:
    """Index of what crosses first, if one pattern is the other with two neighbours exchanged; else None."""
    if sorted(one) != sorted(other):
        return None
    return next((one[i][0] for i in range(len(one)) if _exchanged(one, i) == other), None)


def _exchanged(pattern: Pattern, i: int) -> Pattern:
    order, j = list(pattern), (i + 1) % len(pattern)
    order[i], order[j] = order[j], order[i]
    return rotated(order)


def _time_between(point: Point, other: Pattern, view: View) -> float:
    """The shortest time between two crossings whose exchange gives the other pattern [s]; 0 if there are none."""
    time, _, order = view.crossings(point)
    lasts = point.motion.cycles * point.motion.period
    gaps = [
        (time[(i + 1) % len(order)] - time[i]) % lasts
        for i in range(len(order))
        if _exchanged(tuple(order), i) == other
    ]
    return float(min(gaps, default=0.0))


def _sign(holds: bool) -> float:
    return 1.0 if holds else -1.0


def _fold(point: Point) -> float:
    return float(point.tangent[-1])


def _determinant(matrix: np.ndarray, free: int) -> float:
    """Determinant of a matrix without its ``free`` eigenvalues nearest to zero."""
    values = np.linalg.eigvals(matrix)
    kept = values[np.argsort(np.abs(values))[free:]]
    return float(np.prod(kept).real)


def _doubling(point: Point) -> float:
    return float(np.linalg.det(np.eye(len(point.scale)) + point.gradient))


def _breaking(point: Point) -> float:
    return _determinant(np.eye(len(point.scale)) - point.gradient, point.free)


TESTS: dict[str, Callable[[Point], float]] = {FOLD: _fold, DOUBLING: _doubling, BREAKING: _breaking}
"""By kind of event, a test function that is smooth along a branch and zero at the event."""


def _pairs_outside(point: Point) -> int:
    values = point.multipliers
    return int(np.sum((np.abs(values.imag) > REAL) & (np.abs(values) > 1.0)))


def _pairs_change(before: Point, after: Point) -> bool:
    """Whether a complex pair crosses the unit circle: both points have equally many complex multipliers."""
    counts = [int(np.sum(np.abs(point.multipliers.imag) > REAL)) for point in (before, after)]
    return counts[0] == counts[1] and _pairs_outside(before) != _pairs_outside(after)
