"""One region made ready for marching: exponential tables on a dyadic grid, rows to watch, bounds.

Steps are h_top / 2^l, l = 0 ... fine. Tables hold E(h) = exp(M h) - I, built at a step where the Taylor series
converges in a dozen terms and doubled by E(2 h) = 2 E + E E, which keeps small increments accurate to their own size.
At the finest step a Taylor series of ``ORDER`` terms represents the motion to rounding: crossings are located there.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, factorial, log2

import numpy as np
from numpy.typing import NDArray

from gearrattle.kernels.packed import LONGEST
from gearrattle.system.flow import Flow, Pieces
from gearrattle.system.majorant import Majorant, majorant

Array = NDArray[np.float64]

ORDER = 16  # terms of the Taylor window
NEGLIGIBLE = 1e-19  # largest remainder of that series, relative to the state's norm
DEEPEST = 60  # finest step: LONGEST / 2^60


@dataclass(frozen=True)
class Region:
    """All the march needs about one region.

    Attributes:
        pieces: the piece of every element.
        generator: (N + C, Z) rates of the states, then of the carried quantities, by z.
        tables: (fine + 1, N + C, Z) increments over LONGEST / 2^l.
        deflection, rate, curvature: (K, Z) rows in corner scales, derivatives by s.
        bound: majorant of the third derivative.
        lower, upper: (K,) corners around the current piece in corner scales; infinite where there is none.
    """

    pieces: Pieces
    generator: Array
    tables: Array
    deflection: Array
    rate: Array
    curvature: Array
    bound: Majorant
    lower: Array
    upper: Array

    @property
    def fine(self) -> int:
        """Level of the finest step."""
        return len(self.tables) - 1


def finest_level(matrix: Array) -> int:
    """Smallest level at which ORDER Taylor terms leave a negligible remainder."""
    norm = float(np.linalg.norm(matrix, 1))
    if norm == 0.0:
        return 0
    power = np.linalg.norm(np.linalg.matrix_power(matrix / norm, ORDER + 1), 1) ** (1.0 / (ORDER + 1)) * norm
    step = (NEGLIGIBLE * factorial(ORDER + 1)) ** (1.0 / (ORDER + 1)) / max(float(power), 1e-300)
    level = ceil(log2(LONGEST / float(step)))
    return min(DEEPEST, max(0, level))


def strips(rows: Array) -> Array:
    """(rows, Z) in strips of four rows, the last filled up with zeros: (strips, Z, 4)."""
    filled = np.vstack([rows, np.zeros((-len(rows) % 4, rows.shape[1]))])
    return np.ascontiguousarray(filled.reshape(-1, 4, rows.shape[1]).transpose(0, 2, 1))


def exponential_increments(matrix: Array, carried: Array, step: float, doublings: int) -> Array:
    """E(step 2^l) for l = doublings ... 0, longest first.

    Args:
        matrix: (Z, Z) M.
        carried: (C, Z) rates integrated beside z.
        step: shortest step wanted.
        doublings: how many times it is doubled.

    Returns:
        (doublings + 1, Z + C, Z) increments of z and of the carried quantities.
    """
    norm = float(np.linalg.norm(matrix, 1)) * step
    below = max(0, int(np.ceil(np.log2(max(norm, 1e-300) / 0.25))))
    h = step / 2.0**below
    width = matrix.shape[0]
    stacked = np.vstack([matrix, carried]) * h
    increment = stacked.copy()
    term = stacked.copy()
    for j in range(2, 17):
        term = np.vstack([matrix * h @ term[:width], stacked[width:] @ term[:width]]) / j
        increment += term
    out = np.empty((doublings + 1, *increment.shape))
    for level in range(below + doublings + 1):
        if level >= below:
            out[doublings - (level - below)] = increment
        increment = 2.0 * increment + increment @ increment[:width]
    return out


def build_region(flow: Flow, pieces: Pieces) -> Region:
    """Tables, rows and bounds of the region in which every element is in the piece given."""
    matrix = flow.generator(pieces)
    carried = flow.carried_rows(pieces)
    fine = finest_level(matrix)
    increments = exponential_increments(matrix, carried, LONGEST / 2.0**fine, fine)
    n = flow.states
    kept = np.r_[0:n, flow.width : flow.width + carried.shape[0]]
    deflection, rate, curvature = flow.probe_rows(pieces)
    bound = majorant(
        matrix, n, frequency=flow.frequency, amplitude=flow.scaling.inputs, deflection=deflection, horizon=LONGEST
    )
    corners = [flow.system.laws[k].bounds(pieces[k]) for k in flow.system.clearances]
    limits = np.array(corners).reshape(-1, 2) / flow.corner_scale[:, None]
    return Region(
        pieces, np.vstack([matrix[:n], carried]), increments[:, kept], deflection, rate, curvature, bound,
        limits[:, 0], limits[:, 1],
    )  # fmt: skip
