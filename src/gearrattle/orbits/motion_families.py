"""Families of periodic motions of one model: which states are free, and between which values.

If I - M is singular with null vector d, the motions from y + s d repeat as well. As long as the regions and their order
stay the same, the map is linear in s, so the family is an interval of s. Bisection finds its ends.

Beyond an end the motions touch a corner and do not repeat. A touch of depth h leaves a residual of only about h^(3/2).
So Newton's method may end at a motion that touches so lightly that its residual does not show it. Such a motion counts
as a member of the family: without the touch its I - M is singular, and all motions from there on along d repeat.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr

from gearrattle.assembly import assemble, coordinate_names
from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.motion import Pass, State, idle_memories
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.point import pattern_along, pattern_of
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.errors import ConvergenceError
from gearrattle.model import Model

Array = NDArray[np.float64]

_FARTHEST = 1e3  # sizes of the state: a family that reaches so far counts as endless
_REPEATS = 1e-9  # share of the size of the state: residual of a motion that repeats
_HALVINGS = 50  # most steps of a bisection
_EXACT = 1e-14  # share of the size of the state: width at which a bisection ends
_BRIEF = 1e-2  # share of the period: a longer touch has a residual above rounding
_LIGHT = 1e-4  # share of the period: a shorter touch has a residual below rounding
_NEARLY = 1e-6  # singular value of I - M below which a direction may be free
_NEAREST = 1e-10  # share of the size of the state: first step from a light touch into a family
_FURTHER = 4.0  # ratio of a step to the step before
_WITHIN = 1e-3  # share of the size of the state: longest step


@dataclass(frozen=True)
class Interval:
    """A state that is free at the start of the period, and the values that it may take.

    Attributes
    ----------
    name
        "deflection.ELEMENT", "velocity.INERTIA" or "slider.NAME": the state that moves most along the family.
    low, high
        ends of the interval [rad, m or rad/s]; infinite where there is no end.
    value
        value of that state in the motion itself [rad, m or rad/s].
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
    names += [f"velocity.{name}" for name in coordinate_names(model)]
    return (*names, *(f"slider.{layout.auxiliary_names[c]}" for c in driveline.system.memories))


def intervals_of(model: Model, period_map: PeriodMap, motion: Pass) -> tuple[Interval, ...]:
    """Return the free states of a periodic motion, one interval for every free direction.

    With several free directions one state is chosen for each; along a direction the other chosen states are constant.
    """
    names = state_names(model)
    scale = period_map.scale
    intervals = []
    for chosen, direction in directions_of(period_map, motion):
        unit = direction / np.linalg.norm(direction * scale)
        value = float(motion.start.y[chosen])
        pace = float(unit[chosen])
        ends = [value + side * pace * reach_of(period_map, motion, side * unit) for side in (-1.0, 1.0)]
        intervals.append(Interval(names[chosen], min(ends), max(ends), value))
    return tuple(intervals)


def size_of(period_map: PeriodMap, state: State) -> float:
    """Return the norm of a balanced state, but at least the size of the largest corner."""
    return max(period_map.size, float(np.linalg.norm(state.y * period_map.scale)))


def free_space_of(period_map: PeriodMap, motion: Pass) -> Array:
    """Return the directions (N, F) [SI] in which neighbours of a motion repeat as well."""
    return shooting.newton_step(period_map, motion)[1]


def free_count(period_map: PeriodMap, motion: Pass) -> int:
    """Return the number of directions in which neighbours of a motion repeat as well."""
    return int(free_space_of(period_map, motion).shape[1])


def without_free(multipliers: NDArray[np.complex128], free: int) -> NDArray[np.complex128]:
    """Return multipliers without those that belong to the free directions: the ``free`` nearest to 1."""
    return np.asarray(np.delete(multipliers, np.argsort(np.abs(multipliers - 1.0))[:free]))


def directions_of(period_map: PeriodMap, motion: Pass) -> Iterator[tuple[int, Array]]:
    """Yield a state's index and the free direction (N,) [SI] that moves this state, and no other state yielded."""
    yield from _one_by_one(period_map, free_space_of(period_map, motion))


def _one_by_one(period_map: PeriodMap, free: Array) -> Iterator[tuple[int, Array]]:
    """Directions (N,) [SI] that span the columns of (N, F), each with the index of a state that only it moves."""
    balanced = free * period_map.scale[:, None]
    chosen = np.sort(qr(balanced.T, mode="r", pivoting=True)[1][: free.shape[1]])
    yield from zip(chosen.tolist(), (free @ np.linalg.inv(balanced[chosen])).T, strict=True)


def moving_directions_of(period_map: PeriodMap, motion: Pass) -> list[Array]:
    """Return the free directions (N,) [SI] of a motion, without the memories of sliders that stay released."""
    idle = idle_memories(motion, period_map.scale, period_map.flow.memory.size)
    return [direction for chosen, direction in directions_of(period_map, motion) if chosen not in idle]


def room_of(period_map: PeriodMap, motion: Pass) -> tuple[Array, float] | None:
    """Return the change (N,) [SI] from a motion to the middle of its family, and the length of the family.

    None if the motion is isolated, or if its family has no end or several free directions.
    """
    directions = moving_directions_of(period_map, motion)
    return _room_along(period_map, motion, directions[0]) if len(directions) == 1 else None


def _room_along(period_map: PeriodMap, motion: Pass, direction: Array) -> tuple[Array, float] | None:
    """The change (N,) [SI] to the middle of a family along a direction, and its length; None if it has no end."""
    unit = direction / np.linalg.norm(direction * period_map.scale)
    behind, ahead = (reach_of(period_map, motion, side * unit) for side in (-1.0, 1.0))
    return (0.5 * (ahead - behind) * unit, ahead + behind) if np.isfinite(ahead + behind) else None


def off_edge(period_map: PeriodMap, motion: Pass) -> Pass:
    """Return, for a motion with a light touch at the edge of a family, a motion in the middle of that family.

    Any other motion is returned unchanged.
    """
    inside = within_family(period_map, motion)
    if inside is motion:
        return motion
    for _, direction in directions_of(period_map, inside):
        room = _room_along(period_map, inside, direction)
        with suppress(ConvergenceError):
            state = State(inside.start.y + (0.0 if room is None else room[0]), inside.end.auxiliary_pieces)
            middle = shooting.shoot(period_map, state)
            inside = middle.motion if middle.free.shape[1] == free_count(period_map, inside) else inside
    return inside


def touches_lightly(motion: Pass) -> bool:
    """Return whether a motion crosses a corner to and fro so quickly that it may lie at the edge of a family."""
    if not _soon_followed(motion, motion.crossings.time, _LIGHT).any():
        return False
    return any(_comes_back_soon(motion, watch, _LIGHT) for watch in np.unique(motion.crossings.watch).tolist())


def _comes_back_soon(motion: Pass, watch: int, share: float) -> bool:
    """Whether a watched element crosses one of its bounds to and fro within a share of the period."""
    own = motion.crossings.where(motion.crossings.watch == watch)
    is_back = own.upward != np.roll(own.upward, -1)  # False where it passes through a narrow gap
    return bool((is_back & _soon_followed(motion, own.time, share)).any())


def _soon_followed(motion: Pass, times: Array, share: float) -> NDArray[np.bool_]:
    """(E,) whether the next of some ascending instants of a motion comes within a share of the period."""
    if not times.size:
        return np.zeros(0, dtype=np.bool_)
    following = np.append(times[1:], times[0] + motion.period * motion.cycles)
    return np.asarray(following - times < share * motion.period)


def _slipping_lightly(period_map: PeriodMap, motion: Pass) -> Iterator[Array]:
    """Yield the directions (N,) [SI] of the memories of sliders that slip for a short time."""
    system = period_map.system
    size = len(motion.gap)
    for memory, auxiliary in enumerate(system.memories):
        if _comes_back_soon(motion, len(system.clearances) + auxiliary, _BRIEF):
            yield np.eye(size)[size - len(system.memories) + memory]


def within_family(period_map: PeriodMap, motion: Pass) -> Pass:
    """Return, for a motion with a light touch at the edge of a family, a nearby motion of that family.

    Any other motion is returned unchanged.
    """
    while True:
        inside = next(_steps_inside(period_map, motion), None)
        if inside is None:
            return motion
        motion = inside


def _steps_inside(period_map: PeriodMap, motion: Pass) -> Iterator[Pass]:
    """Motions with more free directions than a motion that touches lightly, if all motions between them repeat."""
    free = _free_without_touches(period_map, motion)
    count = free_count(period_map, motion)
    touching = [direction for _, direction in _one_by_one(period_map, free)] if free.shape[1] > count else []
    for direction in [*touching, *_slipping_lightly(period_map, motion)]:
        unit = direction / np.linalg.norm(direction * period_map.scale)
        for side in (-1.0, 1.0):
            inside = _first_inside(period_map, motion, side * unit, count)
            if inside is not None:
                yield inside


def _first_inside(period_map: PeriodMap, motion: Pass, unit: Array, count: int) -> Pass | None:
    """The first motion along a unit vector (N,) [SI] with more than ``count`` free directions.

    None if there is none, or if a motion on the way does not repeat.
    """
    size = size_of(period_map, motion.start)
    step = _NEAREST * size
    with suppress(ConvergenceError):
        while step < _WITHIN * size:
            trial = period_map(State(motion.start.y + step * unit, motion.end.auxiliary_pieces))
            if shooting.residual_of(period_map, trial) > _REPEATS:
                return None
            if _singular(period_map, trial.gradient).shape[1] > count:
                orbit = shooting.shoot(period_map, trial.start)
                if orbit.free.shape[1] > count:
                    return orbit.motion
            step *= _FURTHER
    return None


def _free_without_touches(period_map: PeriodMap, motion: Pass) -> Array:
    """The directions (N, F) [SI] that would be free, or nearly, if a motion had no light touches."""
    is_kept, changed = _without_light_touches(period_map, motion)
    if is_kept.all():
        return np.zeros((len(motion.gap), 0))
    march = period_map.marched(motion.start)
    crossings = period_map.passages(march)
    if len(crossings.time) != len(is_kept):  # a motion simulated in parts may cross otherwise
        return np.zeros((len(motion.gap), 0))
    initial = march.initial.copy()
    initial[: len(changed)] += changed
    march = march._replace(initial=initial)
    return _singular(period_map, period_map.gradient_along(march, crossings.where(is_kept)))


def _singular(period_map: PeriodMap, gradient: Array) -> Array:
    """The directions (N, F) [SI] along which I - M is singular, or nearly."""
    scale = period_map.scale
    _, values, rows = np.linalg.svd(np.eye(len(scale)) - scale[:, None] * gradient / scale)
    return np.asarray(rows[values < _NEARLY].T / scale[:, None])


def _without_light_touches(period_map: PeriodMap, motion: Pass) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """(E,) whether crossings of a motion are kept: those of clearances that cross back at once are not.

    Also (K,) the change of the pieces of clearances at the start, because a touch may last beyond the period's end.
    """
    crossings = motion.crossings
    system = period_map.system
    elements = np.array([*system.clearances, *(auxiliary.element for auxiliary in system.auxiliaries)])
    is_kept = np.ones(len(crossings.time), dtype=np.bool_)
    changed = np.zeros(len(system.clearances), dtype=np.int64)
    for watch, element in enumerate(system.clearances):
        rows = np.flatnonzero(crossings.watch == watch)
        for out, back in zip(rows, np.roll(rows, -1), strict=True):
            lasts = crossings.time[back] - crossings.time[out] + (period_map.length if back < out else 0.0)
            is_opposite = crossings.upward[out] != crossings.upward[back]
            if lasts >= _BRIEF * motion.period or not is_opposite or not is_kept[[out, back]].all():
                continue
            if out < back:
                within = np.arange(out, back + 1)
                is_kept[within[elements[crossings.watch[within]] == element]] = False
            elif not np.any(elements[len(changed) :] == element):
                is_kept[[out, back]] = False
                changed[watch] = 1 if crossings.upward[back] else -1
    return is_kept, changed


def reach_of(period_map: PeriodMap, motion: Pass, direction: Array) -> float:
    """Return the largest s for which the motion from y + s d repeats, d a direction (N,) [SI]; infinite: no end."""
    size = size_of(period_map, motion.start)
    near = 0.0
    far = _FARTHEST * size
    if _repeats(period_map, motion, far * direction, size):
        return np.inf
    step = 1e-6 * size
    while step < far and _repeats(period_map, motion, step * direction, size):
        near = step
        step = 2.0 * step
    far = min(far, step)
    for _ in range(_HALVINGS):
        if far - near < _EXACT * size:
            break
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
