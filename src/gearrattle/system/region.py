"""One region made ready for marching: its motion split into a free and a forced part, exponential tables, rows, bounds.

Steps are LONGEST / 2^l, l = 0 ... fine. Tables hold E(h) = exp(A h) - I, built at a step where the Taylor series
converges in a dozen terms and doubled by E(2 h) = 2 E + E E, which keeps small increments accurate to their own size.
At the finest step a Taylor series of order ``ORDER`` represents the motion to rounding: crossings are located there.

A acts on y = (w, kept inputs), w = x - P u: see ``forced``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, log2

import numpy as np
from numpy.typing import NDArray

from gearrattle.kernels.packed import LONGEST, ORDER, window_norm
from gearrattle.system.flow import Flow, Pieces
from gearrattle.system.forced import Split, integral, largest, oscillation, split_inputs
from gearrattle.system.majorant import SLACK, Majorant, majorant

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

DEEPEST = 60  # finest step: LONGEST / 2^60
FAST = 4.0  # times the highest input frequency: modes beyond are bounded by their amplitude where they are small
FAST_ROUNDING = 1e-10  # corner scales, added to the bound on fast modes: what the decomposition itself may round
_WIDEST_TURN = 0.5  # of an input over the finest step, radians


@dataclass(frozen=True)
class Region:
    """All the march needs about one region; y has Y = N + kept inputs entries, u has U.

    Attributes:
        pieces: the piece of every element.
        split: the particular solution, and which inputs are kept.
        generator: (Y, Y) A, rates of y.
        carried: (C, Y) rates of the carried quantities.
        carried_particular, drift: (C, U) and (C,) what the inputs split off do to them: Q u + drift s.
        tables: (fine + 1, Y + C, Y) increments over LONGEST / 2^l.
        watched: (4, K, Y) deflections and their first three derivatives by s, corner scales.
        calm: (4, K, Y) the same without the fast modes.
        forced: (K, U) the deflections' forced part.
        bound: majorants of the fourth derivatives and of the fast modes.
        lower, upper: (K,) corners around the current piece in corner scales; infinite where there is none.
    """

    pieces: Pieces
    split: Split
    generator: Array
    carried: Array
    carried_particular: Array
    drift: Array
    tables: Array
    watched: Array
    calm: Array
    forced: Array
    bound: Majorant
    lower: Array
    upper: Array

    @property
    def fine(self) -> int:
        """Level of the finest step."""
        return len(self.tables) - 1

    @property
    def rates(self) -> Array:
        """(C + Y, Y) rates of the carried quantities, then of y."""
        return np.vstack([self.carried, self.generator])

    def powers(self, count: int) -> Array:
        """(count, C + Y, Y) the first powers of h A, h the finest step; carried rows go with one power less of A."""
        step = LONGEST / 2.0**self.fine
        out, power = [], np.eye(len(self.generator))
        for _ in range(count):
            out.append(step * self.rates @ power)
            power = step * self.generator @ power
        return np.array(out)

    def series(self, oscillators: Array) -> tuple[Array, Array]:
        """(K, ORDER + 1, Y) and (K, ORDER + 1, U) Taylor coefficients of every deflection over the finest step."""
        step, free, forced = LONGEST / 2.0**self.fine, [self.watched[0]], [self.forced]
        for order in range(1, ORDER + 1):
            free.append(step / order * free[-1] @ self.generator)
            forced.append(step / order * forced[-1] @ oscillators)
        return np.stack(free, axis=1), np.stack(forced, axis=1)


def finest_level(matrix: Array) -> int:
    """Smallest level at which ORDER Taylor terms leave a negligible remainder."""
    norm = float(np.linalg.norm(matrix, 1))
    if norm == 0.0:
        return 0
    power = np.linalg.norm(np.linalg.matrix_power(matrix / norm, ORDER + 1), 1) ** (1.0 / (ORDER + 1)) * norm
    level = ceil(log2(LONGEST * max(float(power), 1e-300) / window_norm(ORDER + 1)))
    return min(DEEPEST, max(0, level))


def strips(rows: Array) -> Array:
    """(rows, Z) in strips of four rows, the last filled up with zeros: (strips, Z, 4)."""
    filled = np.vstack([rows, np.zeros((-len(rows) % 4, rows.shape[1]))])
    return np.ascontiguousarray(filled.reshape(len(filled) // 4, 4, rows.shape[1]).transpose(0, 2, 1))


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
    n, matrix, oscillators = flow.states, flow.generator(pieces), oscillation(flow.frequency)
    deflection, rate, curvature = flow.probe_rows(pieces)
    amplitude = flow.scaling.inputs
    split = split_inputs(
        matrix[:n, :n], matrix[:n, n:], flow.frequency,
        amplitude=amplitude, watched=deflection[:, :n], typical=flow.typical,
    )  # fmt: skip
    columns = np.r_[0:n, n + split.kept]
    generator, carried = matrix[np.ix_(columns, columns)], flow.carried_rows(pieces)
    forced = _forced_rows(deflection, split, n)
    flowing = _forced_rows(carried, split, n)
    fourth = largest(forced @ np.linalg.matrix_power(oscillators, 4), amplitude).sum(axis=1)
    fourth = np.stack([fourth, fourth, np.full(len(fourth), FAST_ROUNDING)])
    bound = _bound(flow, matrix, split, deflection=deflection, columns=columns)
    calm = [deflection[:, columns] - bound.fast]
    calm += [calm[0] @ np.linalg.matrix_power(generator, j) for j in (1, 2, 3)]
    watched = [deflection[:, columns], rate[:, columns], curvature[:, columns], curvature[:, columns] @ generator]
    fine = max(finest_level(generator), _level_of_turns(flow.frequency))
    increments = exponential_increments(generator, carried[:, columns], LONGEST / 2.0**fine, fine)
    corners = [flow.system.laws[k].bounds(pieces[k]) for k in flow.system.clearances]
    limits = np.array(corners).reshape(-1, 2) / flow.corner_scale[:, None]
    return Region(
        pieces, split, generator, carried[:, columns],
        integral(flowing, flow.frequency), flowing[:, 0] * amplitude[0], increments,
        np.stack(watched), np.stack(calm), forced,
        replace(bound, constant=bound.constant + SLACK * fourth), limits[:, 0], limits[:, 1],
    )  # fmt: skip


def _forced_rows(rows: Array, split: Split, states: int) -> Array:
    """(., U) what rows over z make of the inputs split off."""
    direct = rows[:, states:].copy()
    direct[:, split.kept] = 0.0
    return direct + rows[:, :states] @ split.particular


def _bound(flow: Flow, matrix: Array, split: Split, *, deflection: Array, columns: IntArray) -> Majorant:
    """The majorant of the free motion and the kept inputs, its rows over y."""
    n, count = flow.states, flow.frequency.size
    harmonics = split.kept[(split.kept > 0) & (split.kept <= count)] - 1
    reduced = np.concatenate([np.arange(n + 1), n + 1 + harmonics, n + 1 + count + harmonics])
    inner = matrix[np.ix_(reduced, reduced)]
    if 0 not in split.kept:
        inner[:, n] = 0.0
    bound = majorant(
        inner, n, frequency=flow.frequency[harmonics], amplitude=flow.scaling.inputs[np.r_[0, 1 + harmonics]],
        deflection=deflection[:, reduced], horizon=2 * LONGEST,
        fast=FAST * float(flow.frequency.max(initial=2 * np.pi)),
    )  # fmt: skip
    present = np.isin(reduced, columns)
    return replace(bound, rows=bound.rows[:, present], fast=bound.fast[:, present])


def _level_of_turns(frequency: Array) -> int:
    """Smallest level at which every input turns by less than ``_WIDEST_TURN``."""
    fastest = float(frequency.max(initial=0.0)) * LONGEST / _WIDEST_TURN
    return min(DEEPEST, max(0, ceil(log2(fastest)))) if fastest > 0.0 else 0
