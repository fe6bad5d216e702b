"""Releases: a slider is released while its spring holds a torque.

The friction of a later stage of a clutch ends at a corner. When a motion crosses that corner, the torque of the
slider's spring vanishes at once. It also vanishes if the motion only touches the corner from the side on which the
slider is engaged, however short the visit beyond is. So the motion itself jumps there, not only its gradient, and a
branch ends: on one side in the motion that grazes, on the other side in motions whose visit beyond the corner vanishes,
where the speed v at the corner goes to 0. Their gradient grows like 1 / v; along the branch v falls in proportion to
the distance from its end.

If a crossing that releases a slider moves over the begin of the period, the state at the begin jumps, but not the
motion.
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

_ROUNDING = 1e-9  # share of the slip torque below which a torque counts as zero
_SHORT = 1e-3  # periods: longest visit that may vanish at the end of a branch
_NEAR = 1e-5  # arclength: largest distance of the end of a branch from its last point
_AT_BEGIN = 1e-3  # periods: largest distance of a crossing that may move over the begin of the period
_FASTER = 0.9  # largest ratio of the speeds of a visit that vanishes at successive points


def lets_go(system: PiecewiseSystem) -> bool:
    """Return whether a driveline has sliders that are released: its period map jumps where they hold a torque."""
    return any(auxiliary.is_let_go for auxiliary in system.auxiliaries)


def is_release(period_map: PeriodMap, point: Point, touch: Touch) -> bool:
    """Return whether a motion that grazes a corner loses the torque of a slider as soon as it touches it.

    ConvergenceError: the touch is not found.
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
    """Return the end of a branch at which a visit that releases a slider vanishes, and the touch; None if none does."""
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
    """Return whether a motion has a short visit beyond a corner that releases a slider with a torque."""
    return bool(_visits(period_map, point))


def passes_begin(period_map: PeriodMap, before: Point, after: Point) -> bool:
    """Return whether a crossing that releases a slider moves over the begin of the period between two points."""
    starts = before.motion.start.auxiliary_pieces, after.motion.start.auxiliary_pieces
    if starts[0] is None or starts[1] is None:
        return False
    is_let_go = np.array([auxiliary.is_let_go for auxiliary in period_map.system.auxiliaries], dtype=np.bool_)
    is_off = [pieces == OFF for pieces in starts]
    return bool(np.any(is_let_go & (is_off[0] != is_off[1]))) and all(
        _is_at_begin(point.motion) for point in (before, after)
    )


def _is_at_begin(motion: Pass) -> bool:
    """Whether a crossing is so near to the begin of the period that it may move over it."""
    length = motion.cycles * motion.period
    away = np.minimum(motion.crossings.time, length - motion.crossings.time)
    return bool(away.min(initial=np.inf) < _AT_BEGIN * motion.period)


def passed_begin(period_map: PeriodMap, motion: Pass) -> State | None:
    """Return the start of a motion after a crossing that releases a slider has moved over the begin of the period.

    Before that crossing the slider has a torque, after it it has none: when the crossing moves from the end of the
    period to its begin or back, the motion does not change, but its start does.

    Returns None if no such crossing is near the begin.
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
    """The short visits of a motion beyond corners that release a slider with a torque, and their speeds [SI]."""
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
    """Whether a torque is larger than the rounding of slip torques."""
    limits = [float(np.abs(a.offset).max()) for a in system.auxiliaries if a.is_let_go]
    return abs(torque) > _ROUNDING * max(limits, default=np.inf)
