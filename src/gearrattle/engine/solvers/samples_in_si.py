"""Samples and crossings in SI units from what the kernels of ``exact`` store, for both its marches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.engine.kernels import march_arrays
from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.sampling import Lines, Quantities, quantities_at, rows_at
from gearrattle.engine.kernels.variant_arrays import Crossings
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.engine.system.flow import Flow
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.region import strips
from gearrattle.slices import slices

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

FIRST_LOG = 8192
_MOST_A_PERIOD = 1_000_000  # crossings per period; more is chatter
_MOST_STEPS = 2_000_000  # steps after which a march is judged
_MOST_OF_EXACT = 1024.0 * _MOST_STEPS  # most steps in a period of the fastest input
MOST_CHOSEN = 1e6
"""Steps in a period of the fastest input that an algorithm which chooses them may take: a second or more."""
_SIMULTANEOUS = 4 * np.finfo(float).eps  # periods


def empty_log(memories: int = 0) -> march_arrays.Log:
    """Room for some crossings."""
    kinds = (np.int64, float, np.int64, np.int64, np.int64, float, float)
    return march_arrays.Log._make([*(np.empty(FIRST_LOG, kind) for kind in kinds), np.empty((FIRST_LOG, memories))])


def doubled(log: march_arrays.Log) -> march_arrays.Log:
    """The log with twice the room."""
    return march_arrays.Log(*(np.concatenate([a, np.empty_like(a)]) for a in log))


def chatters(log: march_arrays.Log, count: int, now: float) -> bool:
    """Whether more than a million crossings, of those logged, lie in the period before now (in periods)."""
    first = count - _MOST_A_PERIOD
    return first >= 0 and bool(now - (log.cycle[first] + log.fraction[first]) < 1.0)


class StepLimit:
    """Whether a march takes too many steps: by default two million within 1/1024 of the fastest input's period.

    Such a march needs more than two thousand million steps for that period, that is, hours. The limit is for the period
    of the fastest input and not for T, which is long if orders have no small common multiple.

    most: steps after which a march is judged; fewer for steps in Python.
    a_period: most steps in a period of the fastest input.
    average: mean step of a march that exceeded the limit, in periods; None: the limit is not exceeded.
    """

    def __init__(self, system: PiecewiseSystem, most: int = _MOST_STEPS, a_period: float = _MOST_OF_EXACT) -> None:
        self._most = most
        self._least = most / a_period / max(1.0, float(system.inputs.cycles.max(initial=1.0)))
        self._steps = 0
        self._time = -1.0
        self.average: float | None = None

    def is_exceeded(self, steps: int, now: float) -> bool:
        """Whether ``steps`` up to a time in periods exceed the limit; a lower number or time begins another run."""
        if steps < self._steps or now < self._time or now - self._time >= self._least:
            self._steps = steps
            self._time = now
        if steps - self._steps <= self._most:
            return False
        self.average = (now - self._time) / (steps - self._steps)
        return True


def fastest_of(system: PiecewiseSystem, pieces: Sequence[int]) -> int | None:
    """The element with the largest rate (see ``rates_of``); None if all rates are zero."""
    rates = rates_of(system, pieces)
    return int(np.argmax(rates)) if rates.any() else None


def rates_of(system: PiecewiseSystem, pieces: Sequence[int]) -> Array:
    """(m,) rates of the elements alone [rad/s]: sqrt(k / m) or c / m, 1 / m the sum of w_i^2 / J_i of a row.

    pieces: (m,) piece of every element.
    """
    lightness = (system.rows**2 / system.inertia).sum(axis=1)
    pairs = list(zip(system.laws, pieces, strict=False))
    stiffness, damping = (np.array([getattr(law, kind)[p] for law, p in pairs]) for kind in ("stiffness", "damping"))
    rates: Array = np.maximum(np.sqrt(stiffness * lightness), damping * lightness)
    return rates


def sampled_z(flow: Flow, samples: march_arrays.Samples, rows: IntArray | None = None) -> Array:
    """(t, Z) states and inputs at the samples, or at those of some rows."""
    chosen = np.arange(len(samples.states)) if rows is None else rows
    out = np.empty((len(chosen), flow.width))
    for part in slices(*out.shape):
        out[part, : flow.states] = samples.states[chosen[part], : flow.states]
        out[part, flow.states :] = _inputs_at(flow, samples, chosen[part])
    return out


def _inputs_at(flow: Flow, samples: march_arrays.Samples, rows: IntArray) -> Array:
    """(t, U + Q) inputs at the samples of some rows."""
    cycle, remainder = np.divmod(samples.first + rows, samples.per_cycle)
    if not len(samples.waves):
        return flow.inputs_at(cycle, remainder / samples.per_cycle)
    waves = samples.waves[remainder] * flow.input_size
    return np.hstack([waves, flow.chains_at(cycle, remainder / samples.per_cycle)]) if flow.chain.size else waves


def sampled_quantities(flow: Flow, samples: march_arrays.Samples) -> tuple[dict[str, Any], tuple[Array, Array]]:
    """Angles, velocities, accelerations, deflections, forces and pieces of every sample; (t, C) of auxiliaries [SI].

    Returns the fields of ``Motion`` by name; forces and memories of auxiliaries.
    """
    system = flow.system
    count = len(samples.states)
    clearances = len(flow.system.clearances)
    of_body = (count, system.size)
    of_element = (count, len(system.laws))
    angle = np.empty(of_body)
    velocity = np.empty(of_body)
    acceleration = np.empty(of_body)
    out = Quantities(angle, velocity, acceleration, np.zeros(of_element), np.empty((clearances, count)))
    forces, memory = np.empty((2, count, len(system.auxiliaries)))
    lines = lines_of(flow)
    repeats = len(samples.waves) > 0 and not flow.chain.size
    table = samples.waves * flow.input_size
    for part in slices(count, max(flow.width, lines.rows.size // 16)):
        rows = np.arange(part.start, part.stop)
        states = samples.states[part]
        pieces = samples.pieces[part]
        phase = (samples.first + part.start) % samples.per_cycle
        if not repeats:
            table = _inputs_at(flow, samples, rows)
            phase = 0
        if system.auxiliaries:
            z = np.hstack([states[:, : flow.states], table[(phase + rows - part.start) % len(table)]])
            forces[part], memory[part] = forces_beside(flow, z, pieces)
            for c, auxiliary in enumerate(system.auxiliaries):
                out.force[part, auxiliary.element] += forces[part, c]
        vectorised(quantities_at)(lines, states, pieces, table, phase, out, part.start)
    sampled = out._asdict()
    # one clearance after the other, as criteria read it
    return sampled | {"deflection": out.deflection.T, "piece": samples.pieces[:, :clearances]}, (forces, memory)


@kept
def lines_of(flow: Flow) -> Lines:
    """Rows and laws from which the samples of a driveline are computed."""
    system = flow.system
    coordinates = flow.coordinates
    shape = np.zeros((system.size, flow.width))
    shape[:, : len(coordinates.elements)] = coordinates.angle_from_basis / flow.scaling.deflection
    rows = np.vstack([shape, flow.velocity, flow.torque, flow.deflection, flow.rate])
    watch = np.full(len(system.laws), -1)
    for column, element in enumerate(system.places):
        if element < len(system.laws):
            watch[element] = column
    sizes = [law.stiffness.size for law in system.laws]
    return Lines(
        rows=strips(rows)[None],
        turned=np.ascontiguousarray(coordinates.angle_from_reference, dtype=float),
        stiffness=np.array([value for law in system.laws for value in law.stiffness], dtype=float),
        damping=np.array([value for law in system.laws for value in law.damping], dtype=float),
        offset=np.array([value for law in system.laws for value in law.offset], dtype=float),
        first=np.cumsum([0, *sizes], dtype=np.int64)[:-1],
        watch=watch,
        elements=np.ascontiguousarray(system.rows, dtype=float),
        drag=np.ascontiguousarray(system.drag, dtype=float),
        inertia=np.ascontiguousarray(system.inertia, dtype=float),
        clearances=np.array(system.clearances, dtype=np.int64),
    )


def _by_row(rows: tuple[Array, int], states: Array) -> Array:
    """states @ rows.T; the bits of a product do not depend on the other states."""
    stack, count = rows
    out = np.empty((len(states), 4 * stack.shape[1]))
    vectorised(rows_at)(stack, np.zeros(len(states), np.int64), states, out)
    return out[:, :count]


@kept
def _rows_beside(flow: Flow) -> list[tuple[Array, int]]:
    """Rows of deflections, rates and memories, in strips, and how many."""
    return [(strips(rows)[None], len(rows)) for rows in (flow.deflection, flow.rate, flow.memory_rows)]


def forces_beside(flow: Flow, z: Array, pieces: IntArray) -> tuple[Array, Array]:
    """Force and state e of every auxiliary at some samples z, (t, C) each [SI], each sample by itself."""
    deflection, rate, memory = (_by_row(rows, z) for rows in _rows_beside(flow))
    force = np.empty_like(memory)
    first = len(flow.system.clearances)
    for c, auxiliary in enumerate(flow.system.auxiliaries):
        k = auxiliary.element
        piece = pieces[:, first + c]
        force[:, c] = (
            auxiliary.stiffness[piece] * deflection[:, k]
            + auxiliary.damping[piece] * rate[:, k]
            + auxiliary.offset[piece]
        )
        force[:, c] += auxiliary.memory[piece] * memory[:, c]
    return force, memory


def first_of(log: march_arrays.Log, count: int) -> march_arrays.Log:
    """The first crossings of a log."""
    return march_arrays.Log._make(a[:count] for a in log)


def crossings_of(flow: Flow, log: march_arrays.Log) -> Crossings:
    """The clearances' among the crossings of a log, those of one instant in element order and with one time."""
    own = np.flatnonzero(log.clearance < len(flow.system.clearances))
    order = own[_element_order(log.cycle[own], log.fraction[own], log.clearance[own])]
    log = march_arrays.Log._make(a[order] for a in log)
    period = flow.system.inputs.period
    return Crossings(
        time=np.minimum.accumulate(((log.cycle + log.fraction) * period)[::-1])[::-1],  # one time if simultaneous
        clearance=log.clearance,
        from_piece=log.piece,
        to_piece=log.piece + 2 * log.upward - 1,
        velocity=log.rate * flow.corner_scale[log.clearance] / period,
        force_integral=log.integral,
    )


def passages_of(flow: Flow, log: march_arrays.Log) -> Passages:
    """All crossings of a log in its order, in copied arrays, because the log is overwritten later."""
    period = flow.system.inputs.period
    count = len(flow.system.clearances)
    velocity = np.where(log.clearance < count, log.rate * flow.corner_scale[log.clearance] / period, np.nan)
    time = (log.cycle + log.fraction) * period
    watch = log.clearance.copy()
    upward = log.upward.copy()
    return Passages(time, watch, upward, velocity, log.memory / flow.memory)


def _element_order(cycle: IntArray, fraction: Array, clearance: IntArray) -> IntArray:
    """Order of crossings with simultaneous ones (to rounding) of different elements in element order."""
    order = np.arange(len(cycle))
    while True:
        times = (cycle[order], fraction[order])
        elements = clearance[order]
        apart = sum(time[1:] - time[:-1] for time in times)
        together = (apart <= _SIMULTANEOUS) & (elements[1:] < elements[:-1])
        if not together.any():
            return order.astype(np.int64)
        at = int(np.flatnonzero(together)[0])
        order[[at, at + 1]] = order[[at + 1, at]]
