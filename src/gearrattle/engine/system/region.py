"""One region made ready for marching: its motion split into a free and a forced part, exponential tables, rows, bounds.

The steps have the lengths of the levels 0 ... fine (``march_arrays.step_of``). A table holds E(h) = exp(A h) - I. The
first one is built at a step at which the Taylor series converges in a dozen terms; tables of steps twice and 1.5 times
as long follow from E(a + b) = E(a) + E(b) + E(b) E(a), which keeps small increments accurate to their own size.
At the finest step a Taylor series of order ``ORDER`` represents the motion to rounding: crossings are located there.

A acts on y = (w, kept inputs), w = x - P u: see ``forced_response``. Regions are built in compiled code
(``kernels.region_rates``) and packed (``region_store``); here one is unpacked, for code that needs its matrices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.march_arrays import DEEPEST, LONGEST, ORDER, level_within, step_of, window_norm
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.forced_response import Split
from gearrattle.engine.system.majorant import Majorant
from gearrattle.engine.system.region_store import Store

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Region:
    """Arrays of one region for the march; y has Y = N + kept inputs entries, u has U."""

    pieces: Pieces
    split: Split
    generator: Array  # (Y, Y) A, rates of y
    carried: Array  # (C, Y) rates of the carried quantities
    # carried_particular, drift: (C, U) and (C,) what the inputs split off do to them: Q u + drift s
    carried_particular: Array
    drift: Array
    tables: Array  # (fine + 1, Y + C, Y) increments over the step of every level
    watched: Array  # (4, K, Y) deflections and their first three derivatives by s, corner scales
    calm: Array  # (4, K, Y) the same without the fast modes
    forced: Array  # (K, U) the deflections' forced part
    bound: Majorant  # majorants of the fourth derivatives and of the fast modes
    # lower, upper: (K,) corners around the current piece in corner scales; infinite where there is none
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
    return min(DEEPEST, level_within(window_norm(ORDER + 1) / max(float(power), 1e-300)))


def strips(rows: Array) -> Array:
    """(..., rows, Z) in strips of four rows, the last filled up with zeros: (..., strips, Z, 4)."""
    *stack, count, width = rows.shape
    strip_count = -(-count // 4)
    filled = np.zeros((*stack, 4 * strip_count, width))
    filled[..., :count, :] = rows
    return np.ascontiguousarray(filled.reshape(*stack, strip_count, 4, width).swapaxes(-1, -2))


def unpacked(packed: Array, *rows: int) -> list[Array]:
    """Undo ``strips`` for groups of so many rows, each in strips of its own: (strips, Z, 4) to (rows, Z) each."""
    out = []
    first = 0
    for count in rows:
        behind = first - (-count // 4)
        group = packed[first:behind].transpose(0, 2, 1).reshape(4 * (behind - first), packed.shape[1])
        out.append(np.ascontiguousarray(group[:count]))
        first = behind
    return out


def exponential_increments(matrix: Array, carried: Array, fine: int) -> Array:
    """E of every level's step, longest first.

    matrix: (Z, Z) M.
    carried: (C, Z) rates integrated beside z.
    Returns (fine + 1, Z + C, Z) increments of z and of the carried quantities.
    """
    octaves = (fine + 1) // 2
    norm = float(np.linalg.norm(matrix, 1)) * LONGEST / 2.0**octaves
    below = max(1, int(np.ceil(np.log2(max(norm, 1e-300) / 0.25))))
    h = LONGEST / 2.0 ** (octaves + below)
    width = matrix.shape[0]
    stacked = np.vstack([matrix, carried]) * h
    increment = stacked.copy()
    term = stacked.copy()
    for j in range(2, 17):
        term = np.vstack([matrix * h @ term[:width], stacked[width:] @ term[:width]]) / j
        increment += term
    out = np.empty((fine + 1, *increment.shape))
    for octave in range(below + octaves - 1, -1, -1):
        half = increment
        increment = 2.0 * increment + increment @ increment[:width]
        if 2 * octave <= fine:
            out[2 * octave] = increment
        if 0 <= 2 * octave - 1 <= fine:
            out[2 * octave - 1] = half + increment + increment @ half[:width]
    return out


def build_region(flow: Flow, pieces: Pieces) -> Region:
    """Tables, rows and bounds of the region in which every element is in the piece given."""
    store = Store(flow)
    store.add(pieces)
    return region_in(store, 0)


def region_in(store: Store, slot: int) -> Region:
    """The region in a slot, its arrays unpacked."""
    # sizes
    a = store.packed
    c = store.size.carried
    k = store.size.watched
    n = store.flow.states
    width = int(a.width[slot])
    modes = int(a.modes[slot])
    first = int(a.first_table[slot])
    kept = a.kept[slot, : width - n].copy()
    chains = _rates_of_chains(store.flow, width)
    moved_rows = width - len(chains)
    # increments over every level's step; those of chains are not in the tables
    tables = []
    for level, packed in enumerate(a.tables[first : first + store.fine(slot) + 1]):
        carried, moved = unpacked(packed[:, :width], c, moved_rows)
        tables.append(np.vstack([moved, _increments_of_chains(chains, step_of(level)), carried]))
    # rates, and the particular solution of the inputs split off
    rates = unpacked(a.powers[4 * slot][:, :width], c, moved_rows)
    per_step = step_of(store.fine(slot))
    integral, particular = unpacked(a.particular[slot], c, n)
    # rows of what is watched, and the bounds
    watched, calm = (rows[slot][:, :width].transpose(2, 0, 1).copy() for rows in (a.probe, a.calm))
    # real and imaginary parts of the bounds' rows, in strips of four
    parts = unpacked(a.bounds[slot][:, :width], 8 * -(-modes // 4))[0].reshape(-(-modes // 4), 2, 4, width)
    rows = (parts[:, 0] + 1j * parts[:, 1]).reshape(4 * len(parts), width)[:modes]
    weights = unpacked(a.weights[slot][:, :modes], 3 * k)[0].reshape(3, k, modes)
    pushes = unpacked(a.pushes[slot], 3 * k)[0].reshape(3, k, a.pushes.shape[2])
    constant = a.constant[slot, : 3 * k].reshape(3, k).copy()
    bound = Majorant(rows, weights, pushes, constant, watched[0] - calm[0])
    return Region(
        pieces=store.pieces[slot],
        split=Split(particular, kept),
        generator=np.vstack([rates[1] / per_step, chains]),
        carried=rates[0] / per_step,
        carried_particular=integral,
        drift=a.drift[slot, :c].copy(),
        tables=np.array(tables),
        watched=watched,
        calm=calm,
        forced=a.forced[slot][:, :, 0].copy(),
        bound=bound,
        lower=a.lower[slot].copy(),
        upper=a.upper[slot].copy(),
    )


def _rates_of_chains(flow: Flow, width: int) -> Array:
    """(Q, Y) rates of the chains, which no array holds: every link takes the next one."""
    signals = flow.system.signals
    count = flow.chain.size
    rates = np.zeros((count, width))
    if signals is not None:
        links = signals.degree + 1
        pace = signals.pace(flow.system.inputs.period)
        for j in range(count):
            if (j + 1) % links:
                rates[j, width - count + j + 1] = pace
    return rates


def _increments_of_chains(rates: Array, h: float) -> Array:
    """(Q, Y) their increments over a step: the series ends with the last link."""
    count = len(rates)
    increment = h * rates
    term = h * rates
    for order in range(2, count + 1):
        if not term.any():
            break
        term = (h / order) * term[:, rates.shape[1] - count :] @ rates
        increment = increment + term
    return increment
