"""Shooting: the state that the period map takes to itself, by Newton's method.

    (I - M) d = P(y) - y,      M = dP/dy exact,

solved by singular values. Where I - M is singular the motion is one of a family: a free train without drag may have any
speed, a slider that never slips any offset, a body that floats in its gap any place. Then d is the shortest step, so
the motion found lies near the start; the directions of the family are given with it. Where M is large over several
periods, the states at the start of every period are sought together (``multiple_shooting``).

R. Seydel, Practical Bifurcation and Stability Analysis, 3rd ed., Springer 2010, chapter 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.equations import shortest_solution
from gearrattle.engine.periodic.motion import Pass, State, joined
from gearrattle.engine.periodic.multiple_shooting import (
    LARGEST_SYSTEM,
    maps_of_parts,
    newton_step_in_parts,
    residual_of_parts,
)
from gearrattle.engine.periodic.multipliers import multipliers_of
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.errors import ConvergenceError
from gearrattle.wording import counted

Array = NDArray[np.float64]

TOLERANCE = 1e-12
"""Largest residual of an orbit, in units of the largest corner or of the state, whichever is larger."""
_ROUNDING = 1e-10  # largest residual accepted where a sensitive motion magnifies rounding
_LARGE = 1e4  # norm of M, balanced, from which several periods are followed one by one
_SETTLING = 8  # passes, the first time
# passes of one attempt, and halvings of a step: of whole motions, and of motions in parts
_MOST_PASSES = (60, 40)
_HALVINGS = (6, 8)


@dataclass(frozen=True)
class Orbit:
    """A motion that repeats after n periods.

    residual: |P(y) - y|, in units of the largest corner or of the state; of multiple shooting, the largest of all
    periods.
    """

    motion: Pass  # over n periods
    residual: float
    free: Array  # (N, F) directions in which neighbouring motions repeat as well [SI]; F = 0 for an isolated motion.
    passes: int  # how many times the period map was applied

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        """(N,) Floquet multipliers, the largest first: the eigenvalues of the gradient."""
        return multipliers_of(self.motion.gradient)


def shoot(
    period_map: PeriodMap, state: State, *, tolerance: float = TOLERANCE, settle: int = 0, parts_of_period: int = 0
) -> Orbit:
    """Find the periodic motion that Newton's method leads to from a state.

    Because of corners Newton's method may stop short, or go round in circles. Then the motion is followed for some
    passes, and Newton's method begins again from there, and from where the motion came nearest to repeating itself.

    settle: how often Newton's method may begin again, each time after twice as many passes; a motion found then is most
    likely stable. Before the last time Newton's method is given up as soon as a step does not halve the residual.
    parts_of_period: 1 or 8: multiple shooting, so many parts per period; 0: only where disturbances grow much over
    several periods.
    ConvergenceError: none was found from there.
    """
    if parts_of_period:
        motion, residual, passes = shoot_in_parts(period_map, state, tolerance, parts_of_period)
    else:
        motion, residual, passes = _newton(period_map, state, tolerance, is_quick=settle > 0)
    for attempt in range(settle):
        if residual <= _ROUNDING:
            break
        is_quick = attempt < settle - 1
        state, nearest = _later_states(period_map, state, _SETTLING << attempt)
        passes += _SETTLING << attempt
        for begin in (state, nearest):
            motion, residual, taken = _newton(period_map, begin, tolerance, is_quick=is_quick)
            passes += taken
            if residual <= _ROUNDING:
                break
    if not residual <= _ROUNDING:
        message = f"no motion that repeats after {counted(period_map.cycles, 'period')} was found from this start"
        remedy = "another start, for example the end of a simulation"
        raise ConvergenceError(f"{message} (residual {residual:.2g})", remedy=remedy)
    return Orbit(motion, residual, newton_step(period_map, motion)[1], passes)


def _later_states(period_map: PeriodMap, state: State, passes: int) -> tuple[State, State]:
    """The state so many passes later, and the one before that comes nearest to itself one pass later."""
    march = period_map.marched(state, passes)
    states = [period_map.sampled(march, row) for row in range(passes * period_map.cycles + 1)]
    y = np.array([state.y for state in states]) * period_map.scale
    distances = np.linalg.norm(y[period_map.cycles :] - y[: -period_map.cycles], axis=1)
    return states[-1], states[int(np.argmin(distances))]


def _newton(
    period_map: PeriodMap, state: State, tolerance: float, *, is_quick: bool = False
) -> tuple[Pass, float, int]:
    """Newton's method until the residual is small or does not fall: the motion, its residual, the passes used.

    If it is to be quick, it ends where a full step does not halve the residual.
    """
    motion = period_map(state)
    if _is_sensitive(period_map, motion):
        return shoot_in_parts(period_map, motion.start, tolerance)
    return _closed(period_map, [period_map], [motion], tolerance, is_quick=is_quick)


def shoot_in_parts(
    period_map: PeriodMap, state: State, tolerance: float, parts_of_period: int = 1
) -> tuple[Pass, float, int]:
    """Return the motion near a state by multiple shooting, its residual, and how many passes were used."""
    maps = maps_of_parts(period_map, parts_of_period)
    parts = [maps[0](state)]
    for part_map in maps[1:]:
        parts.append(part_map(parts[-1].end))
    return _closed(period_map, maps, parts, tolerance)


def _closed(
    period_map: PeriodMap, maps: Sequence[PeriodMap], parts: list[Pass], tolerance: float, *, is_quick: bool = False
) -> tuple[Pass, float, int]:
    """Newton's method from a motion, as a whole or in parts; see ``_newton``."""
    is_parted = len(maps) > 1
    residual = residual_of_parts(period_map, parts)
    passes = 1
    while residual > tolerance and passes < _MOST_PASSES[is_parted]:
        trial, taken, tried = _shortened(maps, parts, residual, 0 if is_quick else _HALVINGS[is_parted])
        passes += tried
        is_slow = is_quick and taken > 0.5 * residual
        if trial is None or is_slow:
            break
        parts = trial
        residual = taken
    return joined(parts, period_map.system.inputs.period, period_map.cycles), residual, passes


def _is_sensitive(period_map: PeriodMap, motion: Pass) -> bool:
    """Whether disturbances grow so much over several periods that these are better followed one by one."""
    grown = float(np.linalg.norm(period_map.scale[:, None] * motion.gradient / period_map.scale))
    return period_map.repeats_one_period and grown > _LARGE and period_map.cycles * len(motion.gap) <= LARGEST_SYSTEM


def residual_of(period_map: PeriodMap, motion: Pass) -> float:
    """Return the distance between end and start of a motion, over the largest corner or the size of the state."""
    return residual_of_parts(period_map, [motion])


def newton_step(period_map: PeriodMap, motion: Pass) -> tuple[Array, Array]:
    """Return the shortest d with (I - M) d = P(y) - y, and (N, F) the free directions [SI]."""
    scale = period_map.scale
    balanced = scale[:, None] * motion.gradient / scale
    step, free = shortest_solution(np.eye(len(scale)) - balanced, motion.gap * scale)
    return step / scale, free / scale[:, None]


def _shortened(
    maps: Sequence[PeriodMap], parts: list[Pass], residual: float, most_halvings: int
) -> tuple[list[Pass] | None, float, int]:
    """The parts after a step of Newton's method, half of it, a quarter, ...: the first whose residual falls, or None.

    Also returns that residual, and how many steps were tried.
    """
    is_parted = len(parts) > 1
    steps = newton_step_in_parts(maps[0].scale, parts) if is_parted else newton_step(maps[0], parts[0])[:1]
    pieces = [parts[i - 1].end.auxiliary_pieces for i in range(len(parts))]
    for halvings in range(most_halvings + 1):
        share = 0.5**halvings
        starts = [part.start.y + share * step for part, step in zip(parts, steps, strict=True)]
        try:
            trial = [maps[i](State(y, pieces[i])) for i, y in enumerate(starts)]
        except ConvergenceError:
            continue
        taken = residual_of_parts(maps[0], trial)
        if taken < residual:
            return trial, taken, halvings + 1
    return None, residual, most_halvings + 1
