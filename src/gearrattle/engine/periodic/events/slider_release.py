"""Releases: a slider is released while its spring holds a torque.

The friction of a later stage of a clutch ends at a corner. Where a motion crosses that corner, the torque that the
spring holds is gone at once. Where it only touches the corner from the side on which the slider is engaged, the same
happens: however short the visit beyond, the torque is gone. So the motion itself jumps there, not only its gradient,
and a branch ends: from the one side in the motion that grazes, from the other side in motions whose visit beyond the
corner vanishes, the corner crossed at a speed v -> 0. The gradient of these grows like 1 / v. Over the branch v falls
in proportion to the distance from its end.

Where a crossing that lets a slider go passes the begin of the period, only the state there jumps, not the motion.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import expm

from gearrattle.engine.periodic.grazing_depth import before_touch, depth
from gearrattle.engine.periodic.motion import Pass, State, Touch
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.system.auxiliary import OFF
from gearrattle.engine.system.perturbation_growth import torque_let_go
from gearrattle.engine.system.piecewise import PiecewiseSystem

_ROUNDING = 1e-9  # of the torque at which a slider slips: one that holds less is released without a jump
_SHORT = 1e-3  # periods: a visit that vanishes where the branch ends lasts less
_NEAR = 1e-5  # arclength: the end of a branch is no farther from its last point
_AT_BEGIN = 1e-3  # periods: a crossing so near to the begin of a period may pass it
_FASTER = 0.9  # times the speed of the visit at the point before: that of one that vanishes is less


def lets_go(system: PiecewiseSystem) -> bool:
    """Return whether a driveline has sliders that are released: its period map jumps where they hold a torque."""
    return any(auxiliary.is_let_go for auxiliary in system.auxiliaries)


def is_release(period_map: PeriodMap, point: Point, touch: Touch) -> bool:
    """Return whether a motion that grazes a corner loses the torque of a slider as soon as it touches it.

    ConvergenceError: the touch is lost.
    """
    flow = period_map.flow
    system = period_map.system
    if not lets_go(system):
        return False
    located = depth(period_map, point.motion.start, touch)[1]
    z, pieces, since = before_touch(period_map, point.motion.start, located)
    memories = flow.states - flow.memory.size
    z = expm(flow.generator(pieces) * (located.time - since)) @ z
    memory = z[memories : flow.states] / flow.memory
    beyond = system.beyond(pieces, touch.watch, touch.upward)
    return _is_torque(system, torque_let_go(flow, system.clearances[touch.watch], pieces, beyond, memory))


def end_in_release(period_map: PeriodMap, before: Point, last: Point) -> tuple[Point, Touch] | None:
    """Return where a branch ends because a visit that lets a slider go vanishes, and the touch; None if none does."""
    visits = _visits(period_map, last)
    earlier_visits = _visits(period_map, before)
    if not visits or not earlier_visits:
        return None
    touch, speed = min(visits, key=lambda visit: visit[1])
    earlier, earlier_speed = min(earlier_visits, key=lambda visit: visit[1])
    if touch.watch != earlier.watch or speed > _FASTER * earlier_speed:
        return None
    share = speed / (earlier_speed - speed)
    change = share * (last.w - before.w)
    distance = float(np.linalg.norm(change))
    if distance > _NEAR:
        return None
    parameter = last.parameter + share * (last.parameter - before.parameter)
    return replace(last, w=last.w + change, parameter=parameter, length=last.length + distance), touch


def is_near_release(period_map: PeriodMap, point: Point) -> bool:
    """Return whether a motion has a short visit beyond a corner that lets a slider go with its torque."""
    return bool(_visits(period_map, point))


def passes_begin(period_map: PeriodMap, before: Point, after: Point) -> bool:
    """Return whether a crossing that lets a slider go passes the begin of the period between two points of a branch."""
    starts = before.motion.start.auxiliary_pieces, after.motion.start.auxiliary_pieces
    if starts[0] is None or starts[1] is None:
        return False
    is_let_go = np.array([auxiliary.is_let_go for auxiliary in period_map.system.auxiliaries], dtype=np.bool_)
    is_off = [pieces == OFF for pieces in starts]
    return bool(np.any(is_let_go & (is_off[0] != is_off[1]))) and all(
        _is_at_begin(point.motion) for point in (before, after)
    )


def _is_at_begin(motion: Pass) -> bool:
    """Whether a crossing lies so near to the begin of the period that it may pass it."""
    length = motion.cycles * motion.period
    away = np.minimum(motion.crossings.time, length - motion.crossings.time)
    return bool(away.min(initial=np.inf) < _AT_BEGIN * motion.period)


def passed_begin(period_map: PeriodMap, motion: Pass) -> State | None:
    """Return the start of a motion as it is once a crossing that lets a slider go has passed the begin of the period.

    Just before that crossing the slider holds its torque, just behind it it holds none: where the crossing passes from
    the end of the period to its begin or back the motion stays as it is, but its start does not.

    Returns None if no such crossing is near.
    """
    system = period_map.system
    crossings = motion.crossings
    pieces = period_map.along(motion)[0]
    length = motion.cycles * motion.period
    nearest = _AT_BEGIN * motion.period
    passed = None
    for i, (watch, upward) in enumerate(zip(crossings.watch.tolist(), crossings.upward.tolist(), strict=True)):
        before = pieces
        pieces = system.beyond(pieces, watch, upward)
        first = len(system.laws)
        let_go = [c for c in system.memories if before[first + c] != OFF == pieces[first + c]]
        away = min(crossings.time[i], length - crossings.time[i])
        if let_go and away < nearest:
            is_at_end = bool(crossings.time[i] > 0.5 * length)
            nearest = away
            kept = [before[first + c] if is_at_end else OFF for c in let_go]
            memory = [crossings.memory[i, system.memories.index(c)] if is_at_end else 0.0 for c in let_go]
            passed = let_go, kept, memory
    if passed is None or motion.start.auxiliary_pieces is None:
        return None
    y = motion.start.y.copy()
    own = motion.start.auxiliary_pieces.copy()
    own[passed[0]] = passed[1]
    y[[len(y) - len(system.memories) + system.memories.index(c) for c in passed[0]]] = passed[2]
    return State(y, own)


def _visits(period_map: PeriodMap, point: Point) -> list[tuple[Touch, float]]:
    """The short visits of a motion beyond corners that let a slider go with its torque, and their speeds [SI]."""
    flow = period_map.flow
    system = period_map.system
    crossings = point.motion.crossings
    pieces = period_map.along(point.motion)[0]
    visits = list[tuple[Touch, float]]()
    times = crossings.time / point.motion.period
    for i, (watch, upward) in enumerate(zip(crossings.watch.tolist(), crossings.upward.tolist(), strict=True)):
        after = system.beyond(pieces, watch, upward)
        if watch < len(system.clearances):
            torque = torque_let_go(flow, system.clearances[watch], pieces, after, crossings.memory[i])
            back = np.flatnonzero((crossings.watch == watch) & (times > times[i]))
            if _is_torque(system, torque) and back.size and times[back[0]] - times[i] < _SHORT:
                middle = 0.5 * float(times[i] + times[back[0]])
                visits.append((Touch(watch, upward, middle), abs(float(crossings.velocity[i]))))
        pieces = after
    return visits


def _is_torque(system: PiecewiseSystem, torque: float) -> bool:
    """Whether a torque is more than rounding of those at which sliders slip."""
    limits = [float(np.abs(a.offset).max()) for a in system.auxiliaries if a.is_let_go]
    return abs(torque) > _ROUNDING * max(limits, default=np.inf)
