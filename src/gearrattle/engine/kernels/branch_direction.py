"""The change along which a motion keeps the way from its start to its end, and its turning points along that.

    (M - I) du + s dp = 0,      row . (du, dp) = 1

M and s are the derivatives of the end of the motion by the state u at its start and by the parameter p.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import strict_entry
from gearrattle.engine.kernels.arrays import IntVector, Matrix, Vector
from gearrattle.engine.kernels.dense import factorise, substitute
from gearrattle.engine.kernels.perturbed_motion import write_course
from gearrattle.engine.kernels.turning_point_depths import write_outside

_IDLE = 1e-9  # a memory that nothing depends on, and that depends on nothing, to so much


class Direction(NamedTuple):
    """A change of a motion, and its equations; n = N + 1."""

    matrix: Matrix  # (n, n) [[M - I, s], row], overwritten by its factors
    pivots: IntVector  # (n,)
    change: Vector  # (n,) of the state at the start, balanced, and of p


@strict_entry
def write_direction(columns, scale, row, memories, direction):
    """Write the change that keeps the way from start to end, and of which the product with a row is 1.

    A memory that may be anything, because it is released all along, stays as it is. Returns whether there is a change.

    columns: (N, N + 1) M and s, balanced.
    scale: (N,) balanced = scale * SI.
    row: (N + 1,) over the state at the start [SI], and p.
    memories: how many of the last entries of the state are some.
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
    # a memory that nothing depends on stays as it is
    for i in range(states - memories, states):
        largest = 0.0
        for j in range(states):
            largest = max(largest, abs(matrix[i, j]), abs(matrix[j, i]))
        if largest < _IDLE:
            for j in range(states + 1):
                matrix[i, j] = 0.0
                matrix[j, i] = 0.0
            matrix[i, i] = 1.0
    # solve them
    if not factorise(direction, states + 1):
        return False
    substitute(direction, states + 1, change)
    return True


@strict_entry
def write_course_along(driven, path, z, columns, scale, row, memories, trace):
    """Write the turning points of a motion that repeats, with slopes along that change; returns whether there is one.

    driven, path, z, trace: of ``write_course``; ``path.outside`` is written.
    columns, scale, row, memories: of ``write_direction``.
    """
    size = scale.size + 1
    direction = Direction(np.empty((size, size)), np.empty(size, np.int64), np.empty(size))
    if not write_direction(columns, scale, row, memories, direction):
        return False
    write_outside(path.clearance, path.upward, np.zeros(2, np.int64), path.outside)
    write_course(driven, path, z, direction.change, trace)
    return True
