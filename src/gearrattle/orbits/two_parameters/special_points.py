"""Special points of the curve of an event over two values: where it ends, or meets that of another event.

Let q be the second value. Along the branch over the first one, at the arclength s, the test function of an event is
tau(s; q). Two events of one kind meet and vanish where

    tau = 0,      d tau / ds = 0:

for folds a *cusp*, for other events a *turning point* of their curve. Two ends of families meet where their length is
least: their test function is that length. Where a curve of folds turns back over q, an isolated branch shrinks to a
point, or two branches join: a turning point as well. A *fold meets a grazing* where the tangent's part along the first
value vanishes at the grazing, in the limit from the side without contact; beyond the grazing it changes like a square
root, so there the curve of folds bends into that of grazings, or goes on beyond.

Other ends are not named: where the pair of a Neimark-Sacker bifurcation comes to the real axis (1:1 and 1:2
resonances), where an event of a doubled branch comes to the doubling, and where the extremum that grazes meets the next
one (cubic tangencies). Beside a resonance the test function is so flat that it seems to have a meeting of two.

Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, 4th ed., Springer 2023, chapter 8.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import FOLD, GRAZING, NEIMARK_SACKER, Event
from gearrattle.engine.periodic.events.events_of_step import events_between
from gearrattle.engine.periodic.events.losses import LOSSES
from gearrattle.engine.periodic.events.neimark_sacker import nearest_pair
from gearrattle.engine.periodic.two_parameters.event_gradient import test_of
from gearrattle.engine.periodic.two_parameters.relocation import polynomial_at, relocated
from gearrattle.errors import ConvergenceError, ModelError
from gearrattle.orbits.family_ends import EDGE

if TYPE_CHECKING:
    import xarray as xr


CUSP = "cusp"
TURNING = "turning point"
MEETING = "fold meets grazing"
KINDS = (CUSP, TURNING, MEETING)
FARTHEST = 0.2  # largest distance that an event may move in a step, in units of w
PREDICTED_FROM = 3  # last points, by a parabola through them
SAME = 1e-5  # of both ranges: special points of two curves that lie nearer are the same
_REACH = 0.1  # of the range: a special point farther from the last known event is another one's
_MET = 1e-3  # of the last step: the event was met there, so a point at which it vanishes lies no farther back
_BEHIND = 1.0  # the same where a fold meets a grazing: rounding may have hidden that it stays there
_BACK = 7  # last points of a fold from which a grazing near is sought
_NEAR_FEWER = 1e-3  # of the size of the state: what misses by less nearly repeats after fewer periods
_NEAR_AXIS = 0.999  # real part of a pair on the unit circle from which it comes to a resonance
# of the search for where two events of one kind meet
_STEP = 1e-4  # arclength of differences along the branch: the largest one
_SHORTEST = 1e-7  # and the smallest
_PARABOLA = 0.2, 0.01
"""Differences over a step and half of it, at most: of second derivatives, of extrema over the step."""
_AWAY = 0.3  # arclength from a known event to a special point
_LONGER = 100.0  # times the step before: over a short one rounding may be most of the change of a slope
_GAINED = 1e-15  # of a test function: nothing nearer to its extremum is sought for less
_SECANTS = 30
_LOCATED = 1e-12  # of q
# of the search for where a fold meets a grazing
_TRIED = 0.1  # of the distance between two points: the first step from there
_NEAR = 4e-6  # arclength from a grazing to the motions by which its limit is extrapolated
_EXTRAPOLATED = (5.0, -10.0, 10.0, -5.0, 1.0)  # weights of the values at 1, 2, ... times that for the one at 0
_FIRST = 1e-6  # arclength of the first step from a fold
_AROUND = 0.03  # and within which its grazing is sought
# of the search for where a curve turns back
_AT_TURNING = 1e-8  # of the value: to so much is known where a curve of folds does
_MOST_VALUES = 60  # that are tried for that
_INSIDE = 0.02  # of where that is sought: so far from both ends it must lie
_SPACED = 1.4  # of the slope of a length: that of the next one for the extrapolation, at least
_LEVEL = 0.2  # of the same: what must be left of it, at most

Follower = Callable[[float], Continuation]
"""The branch over the value, by the second value."""


class OverBoth(NamedTuple):
    """The branches through an event over both values."""

    value: Follower
    second: Callable[[float, float], Continuation]  # by the value and a second value near


@dataclass(frozen=True)
class Located:
    """An event at a second value; what is special about it."""

    second: float
    event: Event
    special: str = ""
    slope: float = np.nan  # of its test function along the branch
    word: str = ""  # of its pattern, except for its touch
    missed: float = np.inf  # by how much its motion fails to repeat after fewer periods, over its size


@dataclass(frozen=True)
class SpecialPoint:
    """A point at which curves of events end or meet.

    Attributes
    ----------
    kind
        one of ``special`` in ``Branch.boundary``.
    value, second
        where [SI].
    """

    kind: str
    value: float
    second: float


def special_points_of(curves: Sequence[xr.Dataset], spans: tuple[float, float]) -> list[SpecialPoint]:
    """Return the special points of curves, once each: a cusp is the end of two folds; ``spans`` of both values [SI]."""
    points: list[SpecialPoint] = []
    for curve in curves:
        columns = (curve[name].values.tolist() for name in ("special", "value", "second"))
        for kind, value, second in zip(*columns, strict=True):
            is_known = any(
                point.kind == kind
                and abs(point.value - value) < SAME * spans[0]
                and abs(point.second - second) < SAME * spans[1]
                for point in points
            )
            if kind and not is_known:
                points.append(SpecialPoint(str(kind), float(value), float(second)))
    return points


def with_special_points(over: OverBoth, rows: list[Located], end: float) -> list[Located]:
    """The rows from the model's own value to an end with their special points, the last one where the curve ends."""
    if rows[-1].second != end and len(rows) > 1:
        rows = _last(over, rows, end)
    out = rows[:1]
    for before, after in pairwise(rows):
        out += [after] if after.special else [*_between(over.value, before, after), after]
    return out


def _between(follower: Follower, before: Located, after: Located) -> list[Located]:
    """The point between two rows at which a fold meets a grazing; none if there is none."""
    kind = before.event.kind
    points = list[Located]()
    if kind == GRAZING and before.event.point.tangent[-1] * after.event.point.tangent[-1] < 0.0:
        known = {row.second: row.event for row in (before, after)}
        step = 0.5 * (after.second - before.second)
        is_apart = min(before.missed, after.missed) > _NEAR_FEWER  # else the tangent is upright by itself
        points = _sought(lambda: _meeting_of_grazing(known, follower, step), MEETING) if is_apart else []
    elif kind == FOLD and before.event.point.pattern != after.event.point.pattern:
        points = _meeting_of_fold(follower, before, after) or _meeting_of_fold(follower, after, before)
    ends = sorted((before.second, after.second))
    return [point for point in points if ends[0] < point.second < ends[1]]


def _last(over: OverBoth, rows: list[Located], end: float) -> list[Located]:
    """The rows up to where the curve ends, with the special point there if one is near."""
    step = rows[-1].second - rows[-2].second
    farthest = _REACH * abs(end - rows[0].second)
    near = list[tuple[float, Located]]()
    for point in _ends(over, rows):
        ahead = (point.second - rows[-1].second) * np.sign(step)
        behind = _BEHIND if point.special == MEETING else _MET
        if -behind * abs(step) <= ahead < farthest:
            near.append((ahead, point))
    if not near:
        return rows
    _, point = min(near, key=lambda pair: pair[0])
    return [*(row for row in rows if (point.second - row.second) * step > 0.0), point]


def _ends(over: OverBoth, rows: list[Located]) -> list[Located]:
    """The special points near the last row at which its curve may end."""
    before, last = rows[-2:]
    kind = last.event.kind
    if kind == EDGE:
        return _sought(lambda: _turning_of_end(rows), TURNING)
    if kind == NEIMARK_SACKER and abs(nearest_pair(last.event.point)[0].real) > _NEAR_AXIS:
        return []
    follower = over.value
    step = last.second - before.second
    points = _sought(
        lambda: _meeting_of_two(last.event, follower, last.second, step), CUSP if kind == FOLD else TURNING
    )
    if kind == FOLD:
        meetings = (_meeting_of_fold(follower, after, before) for before, after in reversed([*pairwise(rows[-_BACK:])]))
        points += next((meeting for meeting in meetings if meeting), [])
        points += _sought(lambda: _turning(rows, over.second), TURNING)
    return points


def _sought(find: Callable[[], tuple[float, Event]], special: str) -> list[Located]:
    """The special point that is sought; none where there is none near."""
    with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
        return [Located(*find(), special)]
    return []


def _meeting_of_two(event: Event, follower: Follower, q: float, step: float) -> tuple[float, Event]:
    """The q at which an event meets another one of its kind and both vanish, and the event there."""
    along = _step_along(event, follower(q))
    return _root(lambda value: _extremum(event, follower(value), along), q, step)


def _step_along(event: Event, curve: Continuation) -> float:
    """The largest arclength along the branch within which the test function of an event is a parabola."""

    def derivatives(step: float) -> tuple[float, float]:
        tests = [test_of(event, curve.family, curve.moved_along(event.point, way * step)) for way in (-1.0, 0.0, 1.0)]
        return (tests[2] - tests[0]) / (2.0 * step), (tests[0] - 2.0 * tests[1] + tests[2]) / step**2

    step = _STEP
    while step > _SHORTEST:
        with suppress(ConvergenceError):
            (slope, bend) = derivatives(step)
            (slope_over_half, bend_over_half) = derivatives(0.5 * step)
            change = abs(bend - bend_over_half)
            shift = abs(slope - slope_over_half)
            if change < _PARABOLA[0] * abs(bend) and shift < _PARABOLA[1] * abs(bend) * step:
                return step
        step *= 0.25
    return step


def _extremum(event: Event, curve: Continuation, step: float) -> tuple[float, Event]:
    """The extremum of the test function along the branch near an event: its value, and the event moved there."""
    origin = curve.in_plane(event.point)

    def slope(length: float) -> float:
        behind, ahead = (curve.moved_along(origin, length + side * step) for side in (-1.0, 1.0))
        tests = [test_of(event, curve.family, point) for point in (behind, ahead)]
        return (tests[1] - tests[0]) / (2.0 * step)

    length = 0.0
    now = slope(0.0)
    change = step
    for _ in range(_SECANTS):
        before = now
        now = slope(length + change)
        length = length + change
        if now == before or abs(length) > _AWAY:
            break
        farthest = min(0.5 * _AWAY, _LONGER * abs(change))
        change = float(np.clip(-now * change / (now - before), -farthest, farthest))
        if abs(change) < 1e-2 * step or abs(now * change) < _GAINED:
            point = curve.moved_along(origin, length + change)
            return test_of(event, curve.family, point), replace(event, point=point)
    raise ConvergenceError("the test function has no extremum near")


def _meeting_of_fold(follower: Follower, row: Located, other: Located) -> list[Located]:
    """The point near a row of a fold, and another one, at which it meets a grazing; none if none is near."""
    known = dict[float, Event]()
    for fold in (row, other):
        with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
            if grazing := _grazing_near(fold.event, follower(fold.second)):
                known[fold.second] = grazing
    step = _TRIED * abs(other.second - row.second)
    points = _sought(lambda: _meeting_of_grazing(known, follower, step), MEETING)
    return [replace(point, event=replace(point.event, kind=FOLD)) for point in points]


def _grazing_near(fold: Event, curve: Continuation) -> Event | None:
    """The grazing nearest to a fold on its branch; None if there is none near."""
    nearest = []
    for side in (-1.0, 1.0):
        before = replace(fold.point, length=0.0)
        step = side * _FIRST
        while abs(before.length) < _AROUND:
            try:
                after = replace(curve.moved_along(before, step), length=before.length + step)
                events = events_between(curve, *((before, after) if side > 0.0 else (after, before)))
            except ConvergenceError:
                break
            grazings = [event for event in events if event.kind == GRAZING and event.touch is not None]
            if grazings:
                nearest.append(min(grazings, key=lambda event: abs(event.point.length)))
                break
            before = after
            step = 2.0 * step
    return min(nearest, key=lambda event: abs(event.point.length), default=None)


def _meeting_of_grazing(grazings: Mapping[float, Event], follower: Follower, step: float) -> tuple[float, Event]:
    """The q at which a grazing meets a fold, and the grazing there; what is known of it, by q, begins with the nearest.

    ConvergenceError: they do not meet near.
    """
    known = dict(grazings)
    if not known:
        raise ConvergenceError("no grazing is near")

    def limit(q: float) -> tuple[float, Event]:
        curve = follower(q)
        if q not in known:
            nearest, *others = sorted(known, key=lambda other: abs(other - q))
            event = known[nearest]
            change = np.zeros_like(known[nearest].point.w)
            if others:
                change = (known[others[0]].point.w - event.point.w) * (q - nearest) / (others[0] - nearest)
            known[q] = relocated(event, curve, change, _AWAY)
        return _fold_test_at(known[q], curve), known[q]

    return _root(limit, next(iter(known)), step)


def _fold_test_at(grazing: Event, curve: Continuation) -> float:
    """The test function of a fold at a grazing, in the limit from the side without contact.

    ConvergenceError: no motions without contact are near.
    """
    for side in (_NEAR, -_NEAR):
        with suppress(ConvergenceError):  # where motions touch, they may change too fast
            points = [curve.moved_along(grazing.point, (i + 1.0) * side) for i in range(len(_EXTRAPOLATED))]
            if test_of(grazing, curve.family, points[0]) < 0.0:
                return float(np.dot(_EXTRAPOLATED, [LOSSES[FOLD].test(point) for point in points]))
    raise ConvergenceError("no motions without contact are near the grazing")


def _root(function: Callable[[float], tuple[float, Event]], q: float, step: float) -> tuple[float, Event]:
    """The zero of a function of q by the secant method, and the event there."""
    value, _ = function(q)
    change = step
    scale = abs(step)
    for _ in range(_SECANTS):
        following, event = function(q + change)
        q = q + change
        before = value
        value = following
        if value == before or abs(change) > 1e3 * scale:
            break
        change = -value * change / (value - before)
        if abs(change) <= _LOCATED * max(abs(q), scale):
            return q, event
    raise ConvergenceError("no special point is near")


def _turning(rows: list[Located], across: Callable[[float, float], Continuation]) -> tuple[float, Event]:
    """The point ahead at which a curve of folds turns back: an extremum of the second value over the value.

    A fold of the branch over the value is one of the branch over the second value as well, and has the same tangent.
    """
    last = rows[-1]
    side = np.sign(rows[-1].second - rows[-2].second)
    begin = last.event.point.parameter
    width = _twice_to_turning(rows)
    curve = across(begin, last.second)
    w = np.append(last.event.point.w[:-1], last.second / curve.family.unit)
    known = {begin: replace(last.event, point=replace(last.event.point, parameter=last.second, w=w))}

    def way_back(value: float) -> float:
        event = known[min(known, key=lambda other: abs(other - value))]
        known[value] = relocated(event, across(value, event.point.parameter), np.zeros_like(w), FARTHEST)
        return float(-side * known[value].point.parameter)

    options = {"xatol": _AT_TURNING * abs(begin), "maxiter": _MOST_VALUES}
    bounds = sorted((begin, begin + width))
    value = float(minimize_scalar(way_back, bounds=bounds, method="bounded", options=options).x)
    if not _INSIDE < (value - begin) / width < 1.0 - _INSIDE:
        raise ConvergenceError("the curve does not turn back near")
    point = known[value].point
    return point.parameter, replace(last.event, point=replace(point, parameter=value))


def _twice_to_turning(rows: list[Located]) -> float:
    """Twice the change of the value from the last point to where a parabola through the last three turns back."""
    if len(rows) < PREDICTED_FROM:
        raise ConvergenceError("too few points are known")
    one, two, three = rows[-PREDICTED_FROM:]
    values = [row.event.point.parameter for row in (one, two, three)]
    if len(set(values)) < len(values):
        raise ConvergenceError("the value does not move")
    earlier = (two.second - one.second) / (values[1] - values[0])
    later = (three.second - two.second) / (values[2] - values[1])
    bend = (later - earlier) / (values[2] - values[0])
    slope = later + bend * (values[2] - values[1])
    if bend * slope * (values[2] - values[1]) >= 0.0:
        raise ConvergenceError("the curve does not turn back ahead")
    return -slope / bend


def _turning_of_end(rows: list[Located]) -> tuple[float, Event]:
    """The point ahead at which a curve of ends of families turns back: the length of the family has no slope there.

    The second value has an extremum over that slope, so it is extrapolated over its square and cube.
    """
    spaced = [rows[-1]]
    for row in reversed(rows):
        if abs(row.slope) > _SPACED * abs(spaced[-1].slope):
            spaced.append(row)
    if len(spaced) < PREDICTED_FROM or abs(rows[-1].slope) > _LEVEL * abs(spaced[-1].slope):
        raise ConvergenceError("the length of the family keeps its slope")
    known = spaced[:PREDICTED_FROM]
    powers = np.array([row.slope for row in known])[:, None] ** (0, 2, 3)
    second = float(np.linalg.solve(powers, [row.second for row in known])[0])
    value = float(polynomial_at([(row.slope, np.array([row.event.point.parameter])) for row in known], 0.0)[0])
    last = rows[-1].event
    return second, replace(last, point=replace(last.point, parameter=value))
