"""The change (du, dp) that keeps the difference of end and start of a motion, and the turning points along it.

    (M - I) du + s dp = 0,      row . (du, dp) = 1

u is the state at the start, p the parameter; M and s are the derivatives of the state at the end by u and by p.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import strict_entry
from gearrattle.engine.kernels.arrays import IntVector, Matrix, Vector
from gearrattle.engine.kernels.dense import factorise, substitute
from gearrattle.engine.kernels.perturbed_motion import write_course
from gearrattle.engine.kernels.turning_point_depths import write_outside

_IDLE = 1e-9  # a memory whose row and column of M - I are below this is not coupled to the motion


class Direction(NamedTuple):
    """A change of a motion, and its equations; n = N + 1."""

    matrix: Matrix  # (n, n) [[M - I, s], row], overwritten by its factors
    pivots: IntVector  # (n,)
    change: Vector  # (n,) of the state at the start, scaled, and of p


@strict_entry
def write_direction(columns, scale, row, memories, direction):
    """Write the solution of these equations; return False if they are singular.

    The change of a memory that is not coupled to the motion, because its auxiliary is released all along, is zero.

    columns: (N, N + 1) M and s, scaled.
    scale: (N,) scaled states over states in SI units.
    row: (N + 1,) over the state at the start [SI], and p.
    memories: number of memories, the last entries of the state.
    """
    states = scale.size
    matrix = direction.matrix
    change = direction.change
    # the equations: M - I and s, and below them the row
    for i in range(states):
        for j in range(states + 1):
            matrix[i, j] = columns[i, j]
        matrix[i, i] -= 1.0
        matrix[states, i] = row[i] / scale[i]
        change[i] = 0.0
    matrix[states, states] = row[states]
    change[states] = 1.0
    # a memory that is not coupled to the motion: its change is zero
    for i in range(states - memories, states):
        largest = 0.0
        for j in range(states):
            largest = max(largest, abs(matrix[i, j]), abs(matrix[j, i]))
        if largest < _IDLE:
            for j in range(states + 1):
                matrix[i, j] = 0.0
                matrix[j, i] = 0.0
            matrix[i, i] = 1.0
    if not factorise(direction, states + 1):
        return False
    substitute(direction, states + 1, change)
    return True


@strict_entry
def write_course_along(driven, path, z, columns, scale, row, memories, trace):
    """Write the turning points of a periodic motion, with slopes along that change; return False if there is none.

    driven, path, z, trace: see ``write_course``; ``path.outside`` is written.
    columns, scale, row, memories: see ``write_direction``.
    """
    size = scale.size + 1
    direction = Direction(np.empty((size, size)), np.empty(size, np.int64), np.empty(size))
    if not write_direction(columns, scale, row, memories, direction):
        return False
    write_outside(path.clearance, path.upward, np.zeros(2, np.int64), path.outside)
    write_course(driven, path, z, direction.change, trace)
    return True
