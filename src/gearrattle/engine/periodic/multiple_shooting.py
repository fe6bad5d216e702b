"""Multiple shooting: a motion of n periods as shorter motions, joined by Newton's method.

Over n periods a small disturbance may grow a million times, as in chaos; then no state at the start is accurate enough
for the end. Over a part of the motion it grows little. So the states at the starts of all parts are unknowns,

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
from gearrattle.engine.periodic.motion import Pass
from gearrattle.engine.periodic.period_map import PeriodMap

Array = NDArray[np.float64]

LARGEST_SYSTEM = 1024
"""Largest number of unknowns, parts times N, for multiple shooting."""
EIGHTHS = 8
"""Parts of a period, if it is divided."""


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
    """Return the number of equal parts of n periods: eighths of periods, whole periods, or one part."""
    cycles = period_map.cycles
    for parts in (EIGHTHS * cycles, cycles):
        if (parts == cycles or period_map.system.clock is None) and parts * len(period_map.scale) <= LARGEST_SYSTEM:
            return parts
    return 1


def _jumps(parts: list[Pass]) -> list[Array]:
    """Differences from the end of every part to the start of the next [SI]; the first part follows the last."""
    return [part.end.y - following.start.y for part, following in zip(parts, [*parts[1:], parts[0]], strict=True)]


def residual_of_parts(period_map: PeriodMap, parts: list[Pass]) -> float:
    """Return the largest distance between the end of a part and the start of the next.

    It is divided by the largest corner, or by the size of the largest state at a start.
    """
    scale = period_map.scale
    size = max([period_map.size, *(float(np.linalg.norm(part.start.y * scale)) for part in parts)])
    return max(float(np.linalg.norm(jump * scale)) for jump in _jumps(parts)) / size


def newton_step_in_parts(scale: Array, parts: list[Pass]) -> Array:
    """Return the change (m, N) of the states at the start of every part [SI].

    M_i d_i - d_(i+1) = -(end_i - start_(i+1))
    """
    count = len(parts)
    size = len(scale)
    matrix = np.zeros((count, size, count, size))
    for i, part in enumerate(parts):
        matrix[i, :, i] += scale[:, None] * part.gradient / scale
        matrix[i, :, (i + 1) % count] -= np.eye(size)
    right = -np.concatenate([jump * scale for jump in _jumps(parts)])
    change = Factored(matrix.reshape(count * size, count * size)).solution(right)
    return np.asarray(change.reshape(count, size) / scale)
