"""Families of periodic motions of one model: which states are free, and between which values.

Where I - M is singular with null vector d, the motions from y + s d repeat as well. As long as the regions and their
order stay the same the map is linear in s, so the family is an interval of s. Its ends are found by bisection.

Takes a periodic motion; gives Intervals.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from gearrattle.assembly import assemble, free_names
from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.general_turns import idle_memories
from gearrattle.engine.periodic.period_map import Pass, PeriodMap, State
from gearrattle.engine.periodic.point import pattern_along, pattern_of
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.errors import ConvergenceError
from gearrattle.model import Model

Array = NDArray[np.float64]

_FARTHEST = 1e3  # of the size of the state: a family that reaches so far counts as endless
_REPEATS = 1e-9  # of the size of the state
_HALVINGS = 50


@dataclass(frozen=True)
class Interval:
    """A state that is free at the start of the period, and the values that it may take.

    Attributes
    ----------
    name
        "deflection.ELEMENT", "velocity.INERTIA" or "slider.NAME": the state that moves most along the family.
    low, high
        its ends [rad, m or rad/s]; infinite where there is none.
    value
        of that state in the given motion.
    """

    name: str
    low: float
    high: float
    value: float


def state_names(model: Model) -> tuple[str, ...]:
    """Return the names of the states of a driveline: deflections, velocities, stretches of sliders."""
    driveline = assemble(model)
    layout = driveline.layout
    names = [f"deflection.{layout.element_names[k]}" for k in relative_coordinates(driveline.system).elements]
    names += [f"velocity.{name}" for name in free_names(model)]
    return (*names, *(f"slider.{layout.auxiliary_names[c]}" for c in driveline.system.memories))


def intervals_of(model: Model, period_map: PeriodMap, motion: Pass) -> tuple[Interval, ...]:
    """Return the free states of a periodic motion, one interval for every free direction.

    With several free directions one state each is chosen, and the others of these stay as they are.
    """
    names, scale = state_names(model), period_map.scale
    intervals = []
    for chosen, direction in directions_of(period_map, motion):
        unit = direction / np.linalg.norm(direction * scale)
        value, pace = float(motion.start.y[chosen]), float(unit[chosen])
        ends = [value + side * pace * reach_of(period_map, motion, side * unit) for side in (-1.0, 1.0)]
        intervals.append(Interval(names[chosen], min(ends), max(ends), value))
    return tuple(intervals)


def directions_of(period_map: PeriodMap, motion: Pass) -> Iterator[tuple[int, Array]]:
    """Yield a state's index and the free direction (N,) [SI] that moves it and none of the other states yielded."""
    free = shooting.newton_step(period_map, motion)[1]
    balanced = free * period_map.scale[:, None]
    chosen = np.sort(qr(balanced.T, mode="r", pivoting=True)[1][: free.shape[1]])
    yield from zip(chosen.tolist(), (free @ np.linalg.inv(balanced[chosen])).T, strict=True)


def moving_directions_of(period_map: PeriodMap, motion: Pass) -> list[Array]:
    """Return the free directions (N,) [SI] of a motion but for memories of sliders that are let go all along."""
    idle = idle_memories(motion, period_map.scale, period_map.flow.memory.size)
    return [direction for chosen, direction in directions_of(period_map, motion) if chosen not in idle]


def room_of(period_map: PeriodMap, motion: Pass) -> tuple[Array, float] | None:
    """Return the change (N,) [SI] from a motion of a family to the middle of it, and the length of the family.

    None for a motion of no family, of one without an end, and of one with several free directions.
    """
    directions = moving_directions_of(period_map, motion)
    if len(directions) != 1:
        return None
    unit = directions[0] / np.linalg.norm(directions[0] * period_map.scale)
    behind, ahead = (reach_of(period_map, motion, side * unit) for side in (-1.0, 1.0))
    return (0.5 * (ahead - behind) * unit, ahead + behind) if np.isfinite(ahead + behind) else None


def reach_of(period_map: PeriodMap, motion: Pass, direction: Array) -> float:
    """Return the largest s for which the motion from y + s direction (N,) [SI] repeats; infinite if there is no end."""
    size = max(period_map.size, float(np.linalg.norm(motion.start.y * period_map.scale)))
    near, far = 0.0, _FARTHEST * size
    if _repeats(period_map, motion, far * direction, size):
        return np.inf
    step = 1e-6 * size
    while step < far and _repeats(period_map, motion, step * direction, size):
        near, step = step, 2.0 * step
    far = min(far, step)
    for _ in range(_HALVINGS):
        middle = 0.5 * (near + far)
        if _repeats(period_map, motion, middle * direction, size):
            near = middle
        else:
            far = middle
    return near


def _repeats(period_map: PeriodMap, motion: Pass, change: Array, size: float) -> bool:
    """Whether a motion with a changed start (N,) [SI] repeats, with the same crossings in the same order."""
    start = motion.start.y + change
    try:
        march = period_map.marched(State(start, motion.end.auxiliary_pieces))
    except ConvergenceError:
        return False
    gap = float(np.linalg.norm((period_map.sampled(march, -1).y - start) * period_map.scale))
    return gap < _REPEATS * size and pattern_along(period_map.passages(march)) == pattern_of(motion)
