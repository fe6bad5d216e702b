"""Events of a branch, located again after a small change of the driveline.

An event is a point w of the branch at which a test function tau vanishes. In the changed driveline Newton's method
gives a motion in the plane at right angles to the branch; from there the secant method goes along the new branch to
where tau vanishes. Beside a grazing, where tau has the root of a distance, it is enclosed between two signs.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import NEIMARK_SACKER, Event
from gearrattle.engine.periodic.events.neimark_sacker import nearest_pair
from gearrattle.engine.periodic.families import Family
from gearrattle.engine.periodic.grazing_depth import depth
from gearrattle.engine.periodic.multiplier_counts import is_conservative
from gearrattle.engine.periodic.patterns import rotated, word_of
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.point import Point, turned_around
from gearrattle.engine.periodic.two_parameters.event_gradient import test_of
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

_SECANTS = 10
_SHORTER = 0.1  # of a step: the one tried where it leads too far
_AT_TOUCH = 1e-4  # periods: crossings of the same corner so near to a touch are the touch
_ON_CIRCLE = 1e-5  # from the unit circle: a pair is no farther from it
_TOUCHES = 1e-9  # of the size of its corner: a motion that grazes is no farther from it
_JUMP = 0.05  # of the test function nearby, and of one: more is left where it jumps and has no root
# of a step: the distance to a point of the same branch, at most; and of w
_BENT = 2.0
_ROUNDING = 1e-9
_LOCATED = 1e-11  # arclength
_FIRST = 1e-6  # arclength of the first step along the branch: a fold may be sharp, or lie beside another event


def relocated(event: Event, curve: Continuation, change: Array, farthest: float) -> Event:
    """Return the event at its place in the changed driveline.

    event: where it was, of one of ``event_gradient.KINDS``.
    change: (N + 1,) predicted change of w, in these units.
    ConvergenceError: it is not near.
    """
    begin = curve.in_plane(replace(event.point, w=event.point.w + change))
    point = _by_secants(event, curve, begin, farthest)
    is_pair = event.kind == NEIMARK_SACKER and not is_conservative(point)
    if is_pair and nearest_pair(point)[1] > _ON_CIRCLE:
        raise ConvergenceError("the pair on the unit circle has become real")
    located = replace(event, point=_oriented(point, event.point))
    if event.touch is None:
        return located
    period_map = curve.family.map_at(point.parameter)
    beyond, touch = depth(period_map, point.motion.start, event.touch)
    if abs(beyond) > _TOUCHES * period_map.flow.corner_scale[touch.watch]:
        raise ConvergenceError("the extremum at a corner is lost")
    return replace(located, touch=replace(touch, time=touch.time % curve.family.cycles))


def polynomial_at(known: Sequence[tuple[float, Array]], at: float) -> Array:
    """Return the value at a number of Lagrange's polynomial through known pairs of a number and a value."""
    numbers = [number for number, _ in known]
    shares = [np.prod([(at - other) / (own - other) for other in numbers if other != own]) for own in numbers]
    return np.asarray(np.sum([share * value for share, (_, value) in zip(shares, known, strict=True)], axis=0))


def word_but_for_touch(event: Event) -> str:
    """Return the pattern of an event's motion, a word of ``patterns``, without what it crosses at its touch."""
    motion = event.point.motion
    touch = event.touch
    if touch is None:
        return event.point.word
    crossings = motion.crossings
    later = np.mod(crossings.time / motion.period - touch.time, motion.cycles)
    is_touch = (crossings.watch == touch.watch) & (np.minimum(later, motion.cycles - later) < _AT_TOUCH)
    return rotated(word_of(crossings.where(~is_touch)))


def missed_after(family: Family, point: Point, cycles: int) -> float:
    """Return by how much a motion fails to repeat after fewer periods than its own, over its size in units of w."""
    state = point.motion.start
    later = PeriodMap(family.map_at(point.parameter).system, cycles).later(state)
    missed = (later.y - state.y) * point.scale / point.size
    return float(np.linalg.norm(missed)) / max(1.0, float(np.linalg.norm(point.w[:-1])))


def _by_secants(event: Event, curve: Continuation, begin: Point, farthest: float) -> Point:
    """The point on a branch, from one nearby, at which the test function of an event vanishes."""
    point = begin
    test = test_of(event, curve.family, begin)
    along = 0.0
    step = _FIRST
    tried = [(along, test, begin)]
    for _ in range(_SECANTS):
        following = _ahead(curve, point, step)
        if following is None:
            step *= _SHORTER
            continue
        value = test_of(event, curve.family, following)
        along += step
        tried.append((along, value, following))
        if abs(along) > farthest or value == test:
            break
        next_step = -value * step / (value - test)
        point = following
        test = value
        if abs(next_step) < _LOCATED:
            return curve.moved_along(point, next_step)
        step = float(np.clip(next_step, -farthest, farthest))
    return _enclosed(event, curve, tried)


def _enclosed(event: Event, curve: Continuation, tried: list[tuple[float, float, Point]]) -> Point:
    """The point between two of those tried: near a grazing a test function may have a root like that of a distance.

    Each has arclength from the first one, test function and point.
    """
    pairs = [(one, other) for one in tried for other in tried if one[1] < 0.0 < other[1]]
    if not pairs:
        raise ConvergenceError("the event is not near")
    nearest = min(pairs, key=lambda pair: (max(abs(along) for along, *_ in pair), abs(pair[1][0] - pair[0][0])))
    before, after = sorted(nearest, key=lambda one: one[0])
    if before[0] == after[0]:
        raise ConvergenceError("the test function jumps there")
    ends = {0.0: before[1], 1.0: after[1]}

    def test_at(share: float) -> float:
        return ends[share] if share in ends else test_of(event, curve.family, point_at(share))

    def point_at(share: float) -> Point:
        return curve.between(before[2], after[2], share)

    point = point_at(brentq(test_at, 0.0, 1.0, xtol=_LOCATED / (after[0] - before[0])))
    if abs(test_of(event, curve.family, point)) > _JUMP * min(1.0, max(abs(test) for test in ends.values())):
        raise ConvergenceError("the test function jumps there")
    return point


def _ahead(curve: Continuation, point: Point, step: float) -> Point | None:
    """The point a step along a branch; None if none is near, or only one of another branch."""
    with suppress(ConvergenceError):
        following = curve.moved_along(point, step)
        if np.linalg.norm(following.w - point.w) < _BENT * abs(step) + _ROUNDING:
            return following
    return None


def _oriented(point: Point, like: Point) -> Point:
    """A point with its tangent turned to the side of the tangent of another."""
    return point if float(point.tangent @ like.tangent) >= 0.0 else turned_around(point)
