"""Multiple shooting: a motion of n periods as shorter motions, joined by Newton's method.

Over n periods a small disturbance may grow a million times, as in chaos; then no state at the start is accurate enough
for the end. Over a part of them it grows little. So the states at the start of every part are unknown together,

    P_1(y_1) - y_2 = 0,   P_2(y_2) - y_3 = 0,   ...   P_m(y_m) - y_1 = 0.

A part is a period, or an eighth of one: with many impacts a disturbance may grow a million times within one period.

H. B. Keller, Numerical Methods for Two-Point Boundary-Value Problems, Blaisdell 1968, section 2.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.equations import Factored
from gearrattle.engine.periodic.motion import Pass, State, joined
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

LARGEST_SYSTEM = 1024
"""Unknowns, parts times N, up to which multiple shooting is used."""
EIGHTHS = 8
"""Parts of a period: one, or so many."""
_MOST_STEPS = 40
_HALVINGS = 8


def maps_of_parts(period_map: PeriodMap, parts: int) -> Sequence[PeriodMap]:
    """Return the maps over the parts of n periods, 1 or 8 a period.

    A part is a whole period where ``parts_of`` allows no shorter ones.
    """
    system = period_map.system
    cycles = period_map.cycles
    if parts == 1 or parts_of(period_map) <= cycles:
        return [PeriodMap(system, 1)] * cycles
    inputs = [system.inputs.part(index / EIGHTHS, 1.0 / EIGHTHS) for index in range(EIGHTHS)]
    return [PeriodMap(replace(system, inputs=own), 1, repeats=False) for own in inputs] * cycles


def parts_of(period_map: PeriodMap) -> int:
    """Return into how many parts of equal length n periods are cut: eighths of periods, whole ones, or none."""
    cycles = period_map.cycles
    for parts in (EIGHTHS * cycles, cycles):
        if (parts == cycles or period_map.system.clock is None) and parts * len(period_map.scale) <= LARGEST_SYSTEM:
            return parts
    return 1


def shoot_in_parts(
    period_map: PeriodMap, state: State, tolerance: float, parts_of_period: int = 1
) -> tuple[Pass, float, int]:
    """Return the motion near a state, its residual over the size of the state, and how many passes were used."""
    maps = maps_of_parts(period_map, parts_of_period)
    parts = [maps[0](state)]
    for part_map in maps[1:]:
        parts.append(part_map(parts[-1].end))
    residual = _residual(period_map, parts)
    passes = 1
    while residual > tolerance and passes < _MOST_STEPS:
        shortened, tried = _shortened(maps, parts, residual)
        passes += tried
        if shortened is None:
            break
        parts = shortened
        residual = _residual(period_map, parts)
    return joined(parts, period_map.system.inputs.period, period_map.cycles), residual, passes


def _jumps(parts: list[Pass]) -> list[Array]:
    """From the end of every part to the start of the next [SI]; after the last comes the first."""
    return [part.end.y - following.start.y for part, following in zip(parts, [*parts[1:], parts[0]], strict=True)]


def _residual(period_map: PeriodMap, parts: list[Pass]) -> float:
    scale = period_map.scale
    size = max([period_map.size, *(float(np.linalg.norm(part.start.y * scale)) for part in parts)])
    return max(float(np.linalg.norm(jump * scale)) for jump in _jumps(parts)) / size


def _shortened(maps: Sequence[PeriodMap], parts: list[Pass], residual: float) -> tuple[list[Pass] | None, int]:
    """The parts after Newton's step, half of it, a quarter, ...: the first with a smaller residual, or None.

    Also returns how many steps were tried.
    """
    changes = _newton_step(maps[0].scale, parts)
    for halvings in range(_HALVINGS + 1):
        share = 0.5**halvings
        pieces = [parts[-1].end.auxiliary_pieces, *(part.end.auxiliary_pieces for part in parts[:-1])]
        states = [
            State(part.start.y + share * change, piece)
            for part, change, piece in zip(parts, changes, pieces, strict=True)
        ]
        try:
            trial = [part_map(state) for part_map, state in zip(maps, states, strict=True)]
        except ConvergenceError:
            continue
        if _residual(maps[0], trial) < residual:
            return trial, halvings + 1
    return None, _HALVINGS + 1


def _newton_step(scale: Array, parts: list[Pass]) -> Array:
    """(n, N) changes of the states at the start of every part [SI]: M_i d_i - d_(i+1) = -(end_i - start_(i+1))."""
    count = len(parts)
    size = len(scale)
    matrix = np.zeros((count, size, count, size))
    for i, part in enumerate(parts):
        matrix[i, :, i] += scale[:, None] * part.gradient / scale
        matrix[i, :, (i + 1) % count] -= np.eye(size)
    right = -np.concatenate([jump * scale for jump in _jumps(parts)])
    change = Factored(matrix.reshape(count * size, count * size)).solution(right)
    return np.asarray(change.reshape(count, size) / scale)
