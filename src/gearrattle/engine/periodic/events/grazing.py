"""Grazings: two crossings of one corner appear or vanish, and meet there at velocity zero. Location and effect.

*Search.* On the side without contact the depth of the touch (``grazing_depth``) is smooth. The share of the step at
which it is zero is extrapolated from the last motions; the next motion is a little before that share, so that it does
not touch. If a motion cannot be followed, the next one is nearer to those that do not touch. The depth of the located
motion must be zero. Where there is no depth, as at the bounds of sliders, motions
that touch are followed instead: the duration of their touch grows with the square root of the distance, so its square
is extrapolated.

*Effect on the gradient M.* At a distance s beyond a grazing a bound is crossed out and back; the visit to the region
beyond lasts a time tau ~ √s.

    compliant  The force is continuous at the bound; its slope or its damping changes. M changes by the effect of that
               change within tau, so M = M(0) + C √s + ...: continuous, with a square-root cusp. The same holds for
               clipped damping, whose force is continuous.
    jump       A slider begins to slip. M then has no part of the earlier stretch of its spring, however short the slip
               is: M jumps.
    release    A slider is released with the torque that its spring holds: the motion itself jumps (``slider_release``).
    rigid      The law of a compliant corner, too stiff or too damped to be resolved. A touch of the depth d, at which
               the deflection has the acceleration a, lasts sqrt(8 d / a). Where that is longer than the contact's own
               time 1 / w, it is an impact that reverses the velocity, and M falls like 1 / √s. If a depth of 1e-8
               of a T^2 is such an impact, M is unbounded on one side for all that is resolved.

w is the larger of sqrt(k / m) and c / m, with k and c the increases of stiffness and damping at the corner, and m the
moving mass. With A the rates of the region before the touch, W the row of the deflection and u the rates of the
velocities per unit force, the rate of the flow changes by -(k u + c A u) W during the touch, saltations included. So

    tr M(s) - tr M(0) = -W C (k u + c A u) sqrt(8 d / a),

with C the gradient over one motion from the touch on. d grows in proportion to s, so the strength of the root follows
from the motion that grazes.

M. di Bernardo, C. J. Budd, A. R. Champneys, P. Kowalczyk, Piecewise-smooth Dynamical Systems, Springer 2008.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from gearrattle.engine.periodic import turning_points
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.fold import VERTICAL
from gearrattle.engine.periodic.events.location import Stretch
from gearrattle.engine.periodic.events.pattern_changes import View, touch_between
from gearrattle.engine.periodic.events.slider_release import is_release
from gearrattle.engine.periodic.grazing_depth import before_touch, depth, pieces_before, without_touch
from gearrattle.engine.periodic.motion import Touch
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.perturbation_growth import variation
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

COMPLIANT = "compliant"
JUMP = "jump"
RELEASE = "release"
RIGID = "rigid"
RESOLVED = 1e-8
"""Depth to which a touch is resolved, in units of a T^2."""
_AT_ONCE = 1e-9  # periods: a crossing less than this before a touch is simultaneous with it
_ASIDE = (1e-11, 1e-10, 1e-9, 1e-8)  # arclengths from a grazing at which a motion without touch is tried
_MOST = 40  # most motions followed
_NEARER = 0.02  # least share of the way to the expected grazing that the next motion leaves
_FIRST_LEFT = 0.25  # the same, if the grazing is expected by a tangent only
_WIDEST_LEFT = 0.5  # largest share of the way that the next motion leaves
_FEW = 4  # most depths from which a grazing is extrapolated
_ENOUGH = 3  # the same for durations of touches; and the least number of values for a result that is accepted
_FIRST_ASIDE = 1e-3  # share of the step from the first motion without contact to the next
_OUTSIDE = 0.1  # distance of the located motion from the grazing, over its accuracy or its largest error
_ROUNDING = 1e-2  # share of the last depth: a positive depth below it is rounding
_LITTLE = 1e-4  # share of the step: last change of the expected grazing
_LITTLE_ARC = 1e-10  # arclength: last change of the expected grazing
_MISSED = 1e-9  # arclength: largest error of a grazing
_SAME = 1e-9  # change of w below which motions are equal
_SAME_INSTANT = 1e-4  # periods: largest difference between two computed instants of one extremum
_ANOTHER = 1.0 / 64.0  # periods: touches with a larger difference are different ones
_NOT_LOCATED = "the motion that grazes is not reached"


@dataclass(frozen=True)
class Grazing:
    """The effect of a grazing on the gradient M.

    root: (tr M at s - tr M(0+)) / √s in the limit s -> 0, with s > 0 the distance in the parameter. NaN if M or the
    motion jumps or M is unbounded, at the bound of a limiter, and if the parameter does not change along the branch:
    the grazing lies in a fold, or at the end of a vertical part. The change of M has essentially one eigenvalue other
    than zero, its trace: if that is positive, multipliers move towards a fold, if negative, towards a period doubling.
    """

    kind: str  # COMPLIANT, JUMP, RELEASE or RIGID
    root: float = np.nan


class _Effect(NamedTuple):
    """The effect of the region beyond a corner that is grazed; NaN: not known."""

    rate: float  # w, the rate of the contact [rad/s]
    acceleration: float = np.nan  # of the deflection at the extremum [SI]
    gain: float = np.nan  # change of the trace of the gradient per second beyond the corner [1/s]


def grazing_of(curve: Continuation, point: Point, touch: Touch) -> Grazing:
    """Return the kind of a grazing and the strength of its square root."""
    family = curve.family
    if touch.watch >= family.clearances:
        system = family.map_at(point.parameter).system
        is_slider = system.auxiliaries[touch.watch - len(system.clearances)].kind == "slider"
        return Grazing(JUMP if is_slider else COMPLIANT)
    with suppress(ConvergenceError):
        if family.memories and is_release(family.map_at(point.parameter), point, touch):
            return Grazing(RELEASE)
    without_contact = apart(curve, point, touch)
    effect = _effect_of(family.map_at(without_contact.parameter), without_contact, touch)
    if np.sqrt(8.0 * RESOLVED) * point.motion.period * effect.rate > 1.0:
        return Grazing(RIGID)
    steep = _slope(curve, without_contact, touch)
    return Grazing(COMPLIANT, float(effect.gain * np.sqrt(8.0 * steep / abs(effect.acceleration))))


def apart(curve: Continuation, point: Point, touch: Touch) -> Point:
    """Return the motion that grazes, or if rounding makes it touch, the nearest motion without touch."""
    if _is_apart(point, touch):
        return point
    for distance in _ASIDE:
        for side in (-distance, distance):
            with suppress(ConvergenceError):
                motion = curve.moved_along(point, side)
                if _is_apart(motion, touch):
                    return motion
    return point


def _is_apart(point: Point, touch: Touch) -> bool:
    """Whether a motion does not touch."""
    return len(without_touch(point.motion, touch).time) == len(point.motion.crossings.time)


def _slope(curve: Continuation, point: Point, touch: Touch) -> float:
    """The derivative of the depth of a touch along the branch by the parameter, its modulus [SI]; NaN: not known."""
    along = abs(float(point.tangent[-1]))
    if along < VERTICAL:
        return np.nan
    own = point if point.motion.approach else curve.near(point.w, point.tangent, point, slack=_SAME, touch=touch)
    approach = own.motion.approach
    if approach is None:
        return np.nan
    change = own.change_of(approach.part) * np.append(own.size / own.scale, curve.family.unit)
    return abs(float(approach.slope @ change)) / (along * curve.family.unit)


def _effect_of(period_map: PeriodMap, point: Point, touch: Touch) -> _Effect:
    """The effect of the region that a motion beyond the grazing would enter."""
    flow = period_map.flow
    system = period_map.system
    pieces = pieces_before(period_map, point.motion, touch)
    beyond = system.beyond(pieces, touch.watch, touch.upward)
    element = system.clearances[touch.watch]
    kick = system.rows[element] / system.inertia
    lightness = float(system.rows[element] @ kick)
    (stiffness, damping), (other, more) = (_slopes(flow, element, p) for p in (pieces, beyond))
    rate = float(max(np.sqrt(abs(other - stiffness) * lightness), abs(more - damping) * lightness))
    try:
        located = _located(period_map, point, touch)
        begin = replace(located, time=located.time - _AT_ONCE)
        z, last, since = before_touch(period_map, point.motion.start, begin, is_located=True)
    except ConvergenceError:
        return _Effect(rate)
    period = system.inputs.period
    n = flow.states
    generator = flow.generator(last)
    acceleration = flow.rate[element] @ generator @ expm(generator * (located.time - since)) @ z / period
    first = len(flow.coordinates.elements)
    pushed = np.zeros(n)
    pushed[first : first + system.size] = kick * flow.scaling.velocity
    beyond = system.beyond(last, touch.watch, touch.upward)
    (stiffness, damping), (other, more) = (_slopes(flow, element, p, is_mean=True) for p in (last, beyond))
    added = period * (other - stiffness) * pushed + (more - damping) * generator[:n, :n] @ pushed
    crossings = without_touch(point.motion, located)
    path = _from_then_on(crossings, (begin.time * period, located.time * period), period_map.length)
    if not _is_possible(system, last, path):  # another touch is so near that the crossings do not form separate visits
        return _Effect(rate, float(acceleration))
    cycle = variation(flow, last, path, end=period_map.length)
    grown = period_map.scale * (cycle.gradient() @ (added / period_map.scale))
    gain = -float(flow.deflection[element, :n] @ grown) / period
    return _Effect(rate, float(acceleration), gain)


def _located(period_map: PeriodMap, point: Point, touch: Touch) -> Touch:
    """A touch with the instant of its extremum, taken from its approach if that is known.

    If other short visits are near, a search from the instant of the touch may converge to one of them.
    """
    approach = point.motion.approach
    if approach is not None and abs(approach.time % point.motion.cycles - touch.time) < _SAME_INSTANT:
        return replace(touch, time=approach.time % point.motion.cycles)
    return depth(period_map, point.motion.start, touch)[1]


def _from_then_on(crossings: Passages, instants: tuple[float, float], length: float) -> Passages:
    """The crossings of a periodic motion that begins at the second of two instants [s].

    Crossings between both instants follow the second one: a slider sticks where the deflection is extreme, that is, at
    the touch.
    """
    begin, time = instants
    after = crossings.where(crossings.time >= begin)
    before = crossings.where(crossings.time < begin)
    watch, upward, velocity, memory = (
        np.concatenate([getattr(part, name) for part in (after, before)])
        for name in ("watch", "upward", "velocity", "memory")
    )
    times = np.concatenate([np.maximum(after.time - time, 0.0), before.time + (length - time)])
    return Passages(times, watch, upward, velocity, memory)


def _is_possible(system: PiecewiseSystem, pieces: Pieces, path: Passages) -> bool:
    """Whether crossings lead through existing pieces only."""
    for watch, upward in zip(path.watch.tolist(), path.upward.tolist(), strict=True):
        if watch < len(system.clearances):
            element = system.clearances[watch]
            if not 0 <= pieces[element] + (1 if upward else -1) < system.laws[element].pieces:
                return False
        pieces = system.beyond(pieces, watch, upward)
    return True


def _slopes(flow: Flow, element: int, pieces: Pieces, *, is_mean: bool = False) -> tuple[float, float]:
    """Stiffness and damping of an element in its piece, with its auxiliaries.

    is_mean: whether the mean over a short touch is taken, in which the bounds of a clipped damping add no stiffness:
    their effects on the way in and out cancel.
    """
    law = flow.system.laws[element]
    piece = pieces[element]
    stiffness = float(law.stiffness[piece])
    damping = float(law.damping[piece])
    for auxiliary, p, _ in flow.beside(pieces):
        if auxiliary.element == element:
            if auxiliary.remembers or not is_mean:
                stiffness += float(auxiliary.stiffness[p] + auxiliary.memory[p] * auxiliary.moves[p])
            damping += float(auxiliary.damping[p])
    return stiffness, damping


class _Depth(NamedTuple):
    """The depth of a touch in one motion."""

    share: float  # of the step
    depth: float  # [SI]
    time: float  # [periods]


class Search:
    """The search for a grazing between two successive points."""

    def __init__(self, curve: Continuation, before: Point, after: Point, view: View) -> None:
        is_after = len(view(after)) > len(view(before))
        self._curve = curve
        self._stretch = Stretch(curve, before, after)
        self._view = view
        self._inner, self._outer = (1.0, 0.0) if is_after else (0.0, 1.0)
        self._refused: float | None = None  # the share of the last motion, if it could not be followed
        apart, touching = (before, after) if is_after else (after, before)
        self._fewer = view(apart)
        self._more = view(touching)
        self._nearest = apart
        duration, touch = touch_between(apart, touching, view)
        self._durations = [(self._inner, duration)]
        self._touch = touch
        self._depths: list[_Depth] = []
        self._left = _NEARER
        passed = turning_points.passed_between(apart, touching)
        if passed is None:
            self._add_nearest_depth(touch)
        else:
            self._begin_with(passed)

    def grazing(self) -> tuple[Point, Touch]:
        """Return the motion that grazes, if there is a depth from the side without contact, and its touch.

        ConvergenceError: the branch cannot be followed in between, or the pattern changes more than once.
        """
        expected = np.inf
        for _ in range(_MOST):
            previous = expected
            expected = self._expected()
            width = abs(self._inner - self._outer)
            if width < self._stretch.located or self._is_settled(expected, previous):
                break
            is_sample = self._follow(expected)
            expected = expected if is_sample else np.inf  # a repeated value would count as converged
        return self._limit(expected)

    def _begin_with(self, passed: turning_points.Passed) -> None:
        """Begin with the depth of the motion without contact, and with a second depth by its slope."""
        self._touch = passed.touch
        towards = self._inner - self._outer
        for aside in (0.0, _FIRST_ASIDE):
            depth = passed.depth + aside * passed.slope
            time = passed.touch.time + aside * passed.time_slope
            self._depths.append(_Depth(self._outer + aside * towards, depth, time))

    def _is_settled(self, expected: float, previous: float) -> bool:
        """Whether an expected share is enclosed, and differs little from the one expected before.

        With depths its error is far smaller than that difference.
        """
        little = 10.0 * self._stretch.located
        if self._depths:
            little = max(little, min(_LITTLE, _LITTLE_ARC / self._stretch.distance))
        return self._is_enclosed(expected) and abs(expected - previous) < little

    def _is_enclosed(self, share: float) -> bool:
        """Whether a share lies between motions with and without touch, and follows from enough motions."""
        has_enough = len(self._depths) > _ENOUGH or (not self._depths and len(self._durations) >= _ENOUGH)
        return has_enough and min(self._inner, self._outer) <= share <= max(self._inner, self._outer)

    def _expected(self) -> float:
        """The share at which the grazing is expected; infinity while it is not known."""
        if len(self._depths) > 1:
            return _zero_of(self._depths[-_FEW:])
        if self._depths:
            return np.inf
        shares, durations = zip(*self._durations[-_ENOUGH:], strict=True)
        return _extrapolated(durations, shares, self._outer)

    def _follow(self, expected: float) -> bool:
        """Follow the next motion; return whether it adds a value for the extrapolation."""
        if len(self._depths) == 1:
            share = self._outer + _FIRST_ASIDE * (self._inner - self._outer)
        else:
            start = self._outer if self._depths else self._inner
            limit = 0.5 * (self._inner + self._outer)
            if np.isfinite(expected):
                low, high = sorted((self._inner, self._outer))
                limit = min(max(expected, low), high)
            left = max(_FIRST_LEFT, self._left) if len(self._depths) == 2 else self._left
            share = limit + left * (start - limit) if np.isfinite(expected) else limit
        if self._refused is not None and abs(share - self._outer) >= abs(self._refused - self._outer):
            share = 0.5 * (self._outer + self._refused)
        return self._follow_apart(share) if self._depths else self._follow_any(share)

    def _follow_apart(self, share: float) -> bool:
        """Follow a motion that is expected not to touch; return whether it does not."""
        try:
            touch = replace(self._touch, time=self._time_at(share))
            point = self._stretch.at(share, is_trial=True, touch=touch, among=self._is_apart)
        except ConvergenceError:  # such as Newton's method that alternates at a stiff contact
            self._refused = share
            return False
        self._refused = None
        if not self._is_apart(point):
            self._inner = share
            self._left = min(_WIDEST_LEFT, 4.0 * self._left)
            return False
        self._outer = share
        self._nearest = point
        self._left = max(_NEARER, 0.5 * self._left)
        self._add_depth(share, point)
        return True

    def _follow_any(self, share: float) -> bool:
        """Follow a motion that is expected to touch; return whether it does."""
        point = self._stretch.at(share, touch=self._touch)
        if self._is_apart(point):
            self._outer = share
            self._nearest = point
            self._left = min(_WIDEST_LEFT, 4.0 * self._left)
            self._add_depth(share, point)
            return False
        duration, touch = touch_between(self._nearest, point, self._view)
        self._inner = share
        self._left = max(_NEARER, 0.5 * self._left)
        self._durations.append((share, duration))
        is_other = (touch.watch, touch.upward) != (self._touch.watch, self._touch.upward)
        if is_other or abs(touch.time - self._touch.time) > _ANOTHER:
            self._add_nearest_depth(touch)
        self._touch = touch
        return True

    def _limit(self, expected: float) -> tuple[Point, Touch]:
        """The motion at the expected share, and its touch."""
        is_enclosed = self._is_enclosed(expected)
        share = expected if is_enclosed else 0.5 * (self._inner + self._outer)
        if not self._depths:
            if not is_enclosed and abs(self._inner - self._outer) * self._stretch.distance > _MISSED:
                raise ConvergenceError(_NOT_LOCATED)
            return self._stretch.at(share), self._touch
        towards = np.sign(self._outer - self._inner)
        for outside in (_OUTSIDE * self._stretch.located, _OUTSIDE * _MISSED / self._stretch.distance):
            nearby = share + towards * min(outside, abs(share - self._outer))
            self._stretch.at(nearby, is_trial=True, among=self._is_apart)
            point = self._stretch.at(nearby, among=self._is_apart, touch=self._touch)
            if self._is_at_corner(nearby, point):
                return point, self._touch
        raise ConvergenceError(_NOT_LOCATED)

    def _is_at_corner(self, share: float, point: Point) -> bool:
        """Whether the depth of a motion is zero within the largest error of a grazing."""
        first = self._depths[0]
        way = self._stretch.distance * abs(share - first.share)
        try:
            own = depth(self._curve.family.map_at(point.parameter), point.motion.start, self._touch)[0]
        except ConvergenceError:
            return False
        return abs(own) * way <= _MISSED * abs(own - first.depth)

    def _is_apart(self, point: Point) -> bool:
        """Whether a motion has the pattern of motions that do not touch.

        ConvergenceError: it has a third pattern, because the step contains an exchange of crossings too.
        """
        pattern = self._view(point)
        if len(self._more) == len(self._fewer) + 2 and pattern not in (self._fewer, self._more):
            raise ConvergenceError("more than one thing changes between two points")
        return pattern == self._fewer

    def _add_nearest_depth(self, touch: Touch) -> None:
        """Compute the depth of the nearest motion without contact at a touch."""
        near = self._nearest
        self._touch = touch
        self._add_depth(self._outer, self._curve.near(near.w, near.tangent, near, slack=_SAME, touch=touch))

    def _add_depth(self, share: float, point: Point) -> None:
        """Store the depth of a motion that does not touch.

        A depth that is positive, or larger in modulus than the last one, belongs to another extremum.
        """
        approach = point.motion.approach
        last = abs(self._depths[-1].depth) if len(self._depths) > 1 else np.inf
        rounding = _ROUNDING * last if np.isfinite(last) else 0.0
        if approach is None or not -last < approach.depth <= rounding:
            self._depths.clear()
            return
        self._depths.append(_Depth(share, approach.depth, approach.time))
        self._touch = replace(self._touch, time=approach.time)

    def _time_at(self, share: float) -> float:
        """The expected instant of the touch in a motion, from the last two depths [periods]."""
        if len(self._depths) < 2 or self._depths[-1].share == self._depths[-2].share:
            return self._touch.time
        one, other = self._depths[-2:]
        return other.time + (other.time - one.time) * (share - other.share) / (other.share - one.share)


def _zero_of(samples: list[_Depth]) -> float:
    """The share at which the depth is zero, by inverse interpolation."""
    shares = [sample.share for sample in samples]
    depths = [sample.depth for sample in samples]
    if len(set(depths)) < len(depths):
        return np.inf
    for width in range(1, len(shares)):
        for i in range(len(shares) - width):
            low = depths[i]
            high = depths[i + width]
            shares[i] = (high * shares[i] - low * shares[i + 1]) / (high - low)
    return shares[0]


def _extrapolated(durations: Sequence[float], shares: Sequence[float], outer: float) -> float:
    """The share at which the duration d of the touch is zero: s = s0 + a d^2 + b d^3 through the last samples."""
    if len(durations) == 1:
        return 0.5 * (shares[0] + outer)
    powers = [0, 2, 3][: len(durations)]
    matrix = np.array([[d**power for power in powers] for d in durations])
    scale = np.abs(matrix).max(axis=0)
    try:
        return float(np.linalg.solve(matrix / scale, np.array(shares))[0] / scale[0])
    except np.linalg.LinAlgError:
        return 0.5 * (shares[-1] + outer)
