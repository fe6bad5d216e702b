"""A grazing: two crossings of one corner appear or vanish, and meet there at velocity zero. Its place, its effect.

*Search.* From the side without contact the depth of the touch (``grazing_depth``) is smooth. The share of the way at
which it is zero is extrapolated from the last motions, and the next motion leaves a little of the way to there, so that
it does not touch. A motion that cannot be followed tells nothing: the next one is nearer to those that do not touch. At
last the depth of the motion that is located must be zero. Where there is no depth, as at the bounds of sliders, motions
that cross are followed instead: their velocity v grows with the square root of the distance, so v^2 is extrapolated.

*What it does to the gradient.* A distance s beyond a grazing a bound is crossed there and back; what is entered lasts
for a time tau ~ √s.

    compliant  The force is continuous at the bound; its slope or its damping changes. M gains what this change does
               within tau, so M = M(0) + C √s + ...: continuous, with a square-root cusp. Clipped damping is no
               exception: its force is continuous, and M differs only while the regions differ.
    jump       A slider begins to slip. What its spring held is forgotten, however short the slip is: M jumps.
    release    A slider is released with the torque that its spring holds: the motion itself jumps (``slider_release``).
    rigid      The law of a compliant corner, too stiff or too damped to be resolved. A touch of the depth d, at which
               the deflection has the acceleration a, lasts sqrt(8 d / a). Where that is longer than the contact's own
               time 1 / w, it is an impact that reverses the velocity, and M falls like 1 / √s. If a depth of 1e-8
               of a T^2 is such an impact, M is unbounded on one side for all that is resolved.

w is the larger of sqrt(k / m) and c / m: k and c what stiffness and damping gain at the corner, m the moving mass. With
A the rates of the region left, W the row of the deflection and u what a torque does to the velocities, the flow gains,
its saltations on the way in and out included, -(k u + c A u) W for as long as the touch lasts. So

    tr M(s) - tr M(0) = -W C (k u + c A u) sqrt(8 d / a),

C the gradient over one motion from the touch on, and d grows in proportion to s: the strength of the root is known from
the motion that grazes.

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
from gearrattle.engine.periodic.events.pattern import View, touch_between
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
_AT_ONCE = 1e-9  # periods: crossings so shortly before a touch happen with it
_ASIDE = (1e-11, 1e-10, 1e-9, 1e-8)  # arclength from a grazing to one that does not touch by rounding
_MOST = 40  # motions followed
_NEARER = 0.02  # share of the way to the expected grazing that the next motion leaves, at least
_FIRST_LEFT = 0.25  # the same, where only a tangent leads to the expected grazing
_WIDEST_LEFT = 0.5
# motions that a grazing is extrapolated from: at most by depths, and by velocities
_FEW = 4
_ENOUGH = 3
_FIRST_ASIDE = 1e-3  # share of the way from the first motion without contact to the next
_OUTSIDE = 0.1  # times what a grazing is located to, or may be missed by: so far from it its motion does not touch
_ROUNDING = 1e-2  # of the depth before: one that lies beyond zero by less does so by rounding
# by which an expected grazing may move at last: share of the way, and arclength
_LITTLE = 1e-4
_LITTLE_ARC = 1e-10
_MISSED = 1e-9  # arclength by which a grazing may be missed
_SAME = 1e-9  # change of w below which a motion is the same
_SAME_INSTANT = 1e-4  # periods between the instants of one extremum: its search ends a little before it is located
_ANOTHER = 1.0 / 64.0  # periods: touches farther apart are different ones
_NOT_LOCATED = "the motion that grazes is not reached"


@dataclass(frozen=True)
class Grazing:
    """What a grazing does to the gradient.

    root: (tr M at s - tr M(0+)) / √s in the limit s -> 0, s > 0 the distance in the parameter; NaN where M or the
    motion jumps or M is not bounded, at the bound of a limiter, and where the parameter does not change along the
    branch: the grazing lies in a fold, or at the end of a vertical part. What M gains has hardly more than one
    eigenvalue that is not zero, its trace: where that is positive multipliers move towards a fold, where it is negative
    towards a period doubling.
    """

    kind: str  # COMPLIANT, JUMP, RELEASE or RIGID
    root: float = np.nan


class _Effect(NamedTuple):
    """What lies beyond a corner that is grazed; NaN where it is not known."""

    rate: float  # of what is entered there [rad/s]
    acceleration: float = np.nan  # of the deflection at the extremum [SI]
    gain: float = np.nan  # of the trace of the gradient for a second beyond the corner [1/s]


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
    """Return a motion that grazes, or one as near as can be if rounding makes it touch.

    A limiter then does something else.
    """
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
    """How the depth of a touch grows along the branch, over the distance in the parameter [SI]; NaN: not known."""
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
    """What a motion that grazes would enter, and what that would add to the gradient."""
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
    if not _is_possible(system, last, path):  # another touch lies so near that its crossings are not those of one visit
        return _Effect(rate, float(acceleration))
    cycle = variation(flow, last, path, end=period_map.length)
    grown = period_map.scale * (cycle.gradient() @ (added / period_map.scale))
    gain = -float(flow.deflection[element, :n] @ grown) / period
    return _Effect(rate, float(acceleration), gain)


def _located(period_map: PeriodMap, point: Point, touch: Touch) -> Touch:
    """A touch with the instant of its extremum: that of its approach, where that is known.

    Where other short visits are near, a search from the instant of the touch may end in one of them.
    """
    approach = point.motion.approach
    if approach is not None and abs(approach.time % point.motion.cycles - touch.time) < _SAME_INSTANT:
        return replace(touch, time=approach.time % point.motion.cycles)
    return depth(period_map, point.motion.start, touch)[1]


def _from_then_on(crossings: Passages, instants: tuple[float, float], length: float) -> Passages:
    """The crossings of a motion that begins at the second of two instants [s] of a period of a given length.

    Those between both come after it: a slider sticks where the deflection is extreme, and there a corner is touched.
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
    """Whether crossings lead through pieces that there are."""
    for watch, upward in zip(path.watch.tolist(), path.upward.tolist(), strict=True):
        if watch < len(system.clearances):
            element = system.clearances[watch]
            if not 0 <= pieces[element] + (1 if upward else -1) < system.laws[element].pieces:
                return False
        pieces = system.beyond(pieces, watch, upward)
    return True


def _slopes(flow: Flow, element: int, pieces: Pieces, *, is_mean: bool = False) -> tuple[float, float]:
    """Stiffness and damping of an element in its piece, its auxiliaries' included.

    In the mean of a short touch the bounds of a clipped damping add no stiffness: on the way in they add what they take
    on the way out.
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
    """How near a motion comes to the corner."""

    share: float  # of the way
    depth: float  # [SI]
    time: float  # [periods]


class Search:
    """The search for a grazing between two points that follow one another."""

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
        velocity, touch = touch_between(apart, touching, view)
        self._velocities = [(self._inner, velocity)]
        self._touch = touch
        self._depths: list[_Depth] = []
        self._left = _NEARER
        passed = turning_points.passed_between(apart, touching)
        if passed is None:
            self._ask(touch)
        else:
            self._begin_with(passed)

    def grazing(self) -> tuple[Point, Touch]:
        """Return the motion that grazes, from the side without contact where there is a depth, and its touch.

        ConvergenceError: the branch cannot be followed in between, or more than one thing changes there.
        """
        expected = np.inf
        for _ in range(_MOST):
            previous = expected
            expected = self._expected()
            width = abs(self._inner - self._outer)
            if width < self._stretch.located or self._is_settled(expected, previous):
                break
            is_sample = self._follow(expected)
            expected = expected if is_sample else np.inf  # which would not change
        return self._limit(expected)

    def _begin_with(self, passed: turning_points.Passed) -> None:
        """Begin with the depth of the motion without contact, and with one on its tangent."""
        self._touch = passed.touch
        towards = self._inner - self._outer
        for aside in (0.0, _FIRST_ASIDE):
            depth = passed.depth + aside * passed.slope
            time = passed.touch.time + aside * passed.time_slope
            self._depths.append(_Depth(self._outer + aside * towards, depth, time))

    def _is_settled(self, expected: float, previous: float) -> bool:
        """Whether a share lies between both sides, and differs little from the one expected before.

        By depths its own error is far smaller than the difference.
        """
        little = 10.0 * self._stretch.located
        if self._depths:
            little = max(little, min(_LITTLE, _LITTLE_ARC / self._stretch.distance))
        return self._is_enclosed(expected) and abs(expected - previous) < little

    def _is_enclosed(self, share: float) -> bool:
        """Whether a share lies between both sides, and enough motions are known to trust it."""
        has_enough = len(self._depths) > _ENOUGH or (not self._depths and len(self._velocities) >= _ENOUGH)
        return has_enough and min(self._inner, self._outer) <= share <= max(self._inner, self._outer)

    def _expected(self) -> float:
        """The share at which the touch is expected; infinite while nothing is known of it."""
        if len(self._depths) > 1:
            return _zero_of(self._depths[-_FEW:])
        if self._depths:
            return np.inf
        shares, velocities = zip(*self._velocities[-_ENOUGH:], strict=True)
        return _extrapolated(velocities, shares, self._outer)

    def _follow(self, expected: float) -> bool:
        """Follow the next motion, and say whether it helps to locate the expected touch."""
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
        """Follow a motion that does not touch, as is expected."""
        try:
            touch = replace(self._touch, time=self._time_at(share))
            point = self._stretch.at(share, is_trial=True, touch=touch, among=self._is_apart)
        except ConvergenceError:  # such as contact so stiff that Newton's method goes round in circles
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
        """Follow a motion that touches, as is expected."""
        point = self._stretch.at(share, touch=self._touch)
        if self._is_apart(point):
            self._outer = share
            self._nearest = point
            self._left = min(_WIDEST_LEFT, 4.0 * self._left)
            self._add_depth(share, point)
            return False
        velocity, touch = touch_between(self._nearest, point, self._view)
        self._inner = share
        self._left = max(_NEARER, 0.5 * self._left)
        self._velocities.append((share, velocity))
        is_other = (touch.watch, touch.upward) != (self._touch.watch, self._touch.upward)
        if is_other or abs(touch.time - self._touch.time) > _ANOTHER:
            self._ask(touch)
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
        """Whether a motion is as near to its corner as a grazing can be located, as its depth tells."""
        first = self._depths[0]
        way = self._stretch.distance * abs(share - first.share)
        try:
            own = depth(self._curve.family.map_at(point.parameter), point.motion.start, self._touch)[0]
        except ConvergenceError:
            return False
        return abs(own) * way <= _MISSED * abs(own - first.depth)

    def _is_apart(self, point: Point) -> bool:
        """Whether a motion has the pattern of those that do not touch.

        ConvergenceError: it has neither that pattern nor the one of those that touch: the step holds an exchange as
        well.
        """
        pattern = self._view(point)
        if len(self._more) == len(self._fewer) + 2 and pattern not in (self._fewer, self._more):
            raise ConvergenceError("more than one thing changes between two points")
        return pattern == self._fewer

    def _ask(self, touch: Touch) -> None:
        """Ask the nearest motion without contact for its depth at a touch."""
        near = self._nearest
        self._touch = touch
        self._add_depth(self._outer, self._curve.near(near.w, near.tangent, near, slack=_SAME, touch=touch))

    def _add_depth(self, share: float, point: Point) -> None:
        """Note the depth of a motion that does not touch.

        One that is not below zero, or farther from it than before, is that of another extremum.
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
        """When the touch is expected in a motion, from the last two whose depths are known [periods]."""
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


def _extrapolated(velocities: Sequence[float], shares: Sequence[float], outer: float) -> float:
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
