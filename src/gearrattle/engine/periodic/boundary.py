"""Events of a branch, located again after a small change of the driveline.

An event is a point w of the branch at which a test function tau vanishes. In the changed driveline Newton's method
gives a motion in the plane at right angles to the branch; from there the secant method goes along the new branch to
where tau vanishes.

Takes an event and what follows the changed driveline; gives the event there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.drift import test_of
from gearrattle.engine.periodic.events import Event
from gearrattle.engine.periodic.family import Family
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.point import Point, turned_around
from gearrattle.engine.periodic.touch import depth
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

_SECANTS = 12
_LOCATED = 1e-11  # arclength
_FIRST = 1e-6  # arclength of the first step along the branch: a fold may be sharp, or lie beside another event
_SOONER = 1e-5  # of the size of the state: what comes back so near after fewer periods repeats after these


def relocated(event: Event, curve: Continuation, change: Array, farthest: float) -> Event:
    """Return the event at its place in the changed driveline.

    Parameters
    ----------
    event
        where it was, of one of ``drift.KINDS``.
    curve
        the Continuation of the changed driveline, in the units of the event's point.
    change
        (N + 1,) predicted change of w, in these units.
    farthest
        largest arclength along the branch from the predicted point to the event.

    Raises
    ------
    ConvergenceError
        it is not near.
    """
    begin = curve.in_plane(replace(event.point, w=event.point.w + change))
    point = _by_secants(event, curve, begin, farthest)
    located = replace(event, point=_oriented(point, event.point))
    if event.touch is None:
        return located
    motion = curve.family.map_at(point.parameter), point.motion.start
    return replace(located, touch=depth(*motion, event.touch)[1])


def repeats_sooner(family: Family, point: Point) -> bool:
    """Return whether a motion repeats after fewer periods than those of its family."""
    state, cycles = point.motion.start, family.cycles
    nearest = _SOONER * max(family.size, float(np.linalg.norm(point.state * point.scale)))
    for fewer in (number for number in range(1, cycles) if cycles % number == 0):
        later = PeriodMap(family.map_at(point.parameter).system, fewer).later(state)
        if np.linalg.norm((later.y - state.y) * point.scale) < nearest:
            return True
    return False


def _by_secants(event: Event, curve: Continuation, point: Point, farthest: float) -> Point:
    """The point on a branch, from one nearby, at which the test function of an event vanishes."""
    test, along, step = test_of(event, curve.family, point), 0.0, _FIRST
    for _ in range(_SECANTS):
        following = curve.moved_along(point, step)
        value = test_of(event, curve.family, following)
        along += step
        if abs(along) > farthest or value == test:
            break
        next_step = -value * step / (value - test)
        point, test = following, value
        if abs(next_step) < _LOCATED:
            return curve.moved_along(point, next_step)
        step = float(np.clip(next_step, -farthest, farthest))
    raise ConvergenceError("the event is not near")


def _oriented(point: Point, like: Point) -> Point:
    """A point with its tangent turned to the side of the tangent of another."""
    return point if float(point.tangent @ like.tangent) >= 0.0 else turned_around(point)
