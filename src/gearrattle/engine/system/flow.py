"""The piecewise system for the exact engine: rows over one augmented state.

    z = (x, v, e, u, q),   u = (1, cos 2 pi p_1 s, ... cos 2 pi p_H s, sin 2 pi p_1 s, ...),   s = t / T,

all scaled (``energy_scaling``); e are the memories of auxiliaries and q the chains of signals. The inputs are states
too (oscillators, polynomials), so inside a region dz/ds = M z with a constant matrix M: free motion, forced motion,
resonance and drift under a mean torque need no separate cases. Every quantity - an angle, a deflection, a force, an
acceleration - is a row of numbers times z.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.engine.system.auxiliary import Auxiliary
from gearrattle.engine.system.coordinates import RelativeCoordinates, relative_coordinates
from gearrattle.engine.system.energy_scaling import Scaling, energy_scaling, power_of_two
from gearrattle.engine.system.forced_response import oscillation
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.piecewise_signals import ROUNDED, Signals, interval_of
from gearrattle.slices import slices

Array = NDArray[np.float64]
_DYADIC = 2.0**30
Pieces = tuple[int, ...]


@dataclass(frozen=True)
class Flow:
    """Rows over z, shape (., Z) with Z = N + U + Q, U = 1 + 2 H, that do not depend on the region."""

    system: PiecewiseSystem
    coordinates: RelativeCoordinates
    scaling: Scaling
    states: int  # N, the number of deflections, velocities and memories in z
    # deflection, rate, curvature_of_error: (m, Z) delta_k, delta_k', and e_k'' of every element [SI]
    deflection: Array
    rate: Array
    curvature_of_error: Array
    velocity: Array  # (n, Z) q' [SI]
    torque: Array  # (n, Z) applied torque [SI]
    frequency: Array  # (H,) 2 pi p_j, radians per period
    # (W,) power of two near the largest corner of each clearance, then the size of what each auxiliary watches
    corner_scale: Array
    memory: Array  # (S,) scale of every memory: a power of two by which it is multiplied in z
    chain: Array  # (Q,) scale of every entry of the signals' chains

    @property
    def inputs(self) -> int:
        """U, the number of inputs other than signals."""
        return 1 + 2 * self.frequency.size

    @property
    def width(self) -> int:
        """Z, the length of z."""
        return int(self.deflection.shape[1])

    @cached_property
    def input_size(self) -> Array:
        """(1 + 2 H,) amplitude of every input column."""
        return np.asarray(self.scaling.inputs[_column_scale(self.frequency.size)])

    def force_rows(self, pieces: Pieces) -> Array:
        """(m, Z) force of every element, its auxiliaries' included, with all in the pieces given [SI].

        Without pieces of auxiliaries their forces are omitted.
        """
        rows = np.empty_like(self.deflection)
        unit = 1.0 / self.scaling.inputs[0]
        for k, (law, piece) in enumerate(zip(self.system.laws, pieces, strict=False)):
            rows[k] = law.stiffness[piece] * self.deflection[k] + law.damping[piece] * self.rate[k]
            rows[k, self.states] += law.offset[piece] * unit
        for auxiliary, piece, memory in self.beside(pieces):
            k = auxiliary.element
            rows[k] += auxiliary.stiffness[piece] * self.deflection[k] + auxiliary.damping[piece] * self.rate[k]
            rows[k] += auxiliary.memory[piece] * memory
            rows[k, self.states] += auxiliary.offset[piece] * unit
        return rows

    def beside(self, pieces: Pieces) -> Iterator[tuple[Auxiliary, int, Array]]:
        """Yield for every auxiliary: the auxiliary, its piece, and the row (Z,) of its memory [SI]."""
        return zip(self.system.auxiliaries, pieces[len(self.system.laws) :], self.memory_rows, strict=False)

    @cached_property
    def memory_rows(self) -> Array:
        """(auxiliaries, Z) e of every auxiliary [SI]; zero without a memory."""
        rows = np.zeros((len(self.system.auxiliaries), self.width))
        first = self.states - self.memory.size
        for i, c in enumerate(self.system.memories):
            rows[c, first + i] = 1.0 / self.memory[i]
        return rows

    def acceleration_rows(self, pieces: Pieces) -> Array:
        """(n, Z) q'' with the elements in the pieces given [SI]."""
        system = self.system
        balance = self.torque - system.drag[:, None] * self.velocity - system.rows.T @ self.force_rows(pieces)
        return np.asarray(balance / system.inertia[:, None])

    def generator(self, pieces: Pieces) -> Array:
        """(Z, Z) M of dz/ds = M z in one region."""
        period = self.system.inputs.period
        r = len(self.coordinates.elements)
        matrix = np.zeros((self.width, self.width))
        matrix[:r] = period * self.scaling.deflection[:, None] * (self.coordinates.basis @ self.velocity)
        moving = r + self.system.size
        matrix[r:moving] = period * self.scaling.velocity[:, None] * self.acceleration_rows(pieces)
        for i, (auxiliary, piece) in enumerate(self.remembering(pieces)):
            matrix[moving + i] = auxiliary.moves[piece] * period * self.memory[i] * self.rate[auxiliary.element]
        chained = self.states + self.inputs
        matrix[self.states : chained, self.states : chained] = oscillation(self.frequency)
        matrix[chained:, chained:] = self.pace_of_chains
        return matrix

    @cached_property
    def pace_of_chains(self) -> Array:
        """(Q, Q) generator of the chains: dq_j/ds = w q_(j+1) for every channel."""
        signals = self.system.signals
        rates = np.zeros((self.chain.size, self.chain.size))
        for j in range(self.chain.size):
            if signals is not None and j % (signals.degree + 1) < signals.degree:
                rates[j, j + 1] = signals.pace(self.system.inputs.period)
        return rates

    @cached_property
    def chains(self) -> Array:
        """(G, Q) scaled chains at the start of every interval of the signals; (0, 0) without."""
        signals = self.system.signals
        return np.zeros((0, 0)) if signals is None else signals.chains(self.system.inputs.period) * self.chain

    @cached_property
    def fourth_of_chains(self) -> Array:
        """(G, Q) bounds on the fourth derivatives of the scaled chains, all through every interval."""
        signals = self.system.signals
        return np.zeros((0, 0)) if signals is None else signals.fourth(self.system.inputs.period) * self.chain

    @cached_property
    def knots(self) -> Array:
        """(G + 1,) ends of the signals' intervals, in periods; without signals one interval without end."""
        signals = self.system.signals
        if signals is None:
            return np.array([0.0, np.inf])
        return in_periods(signals.knots, self.system.inputs.period)

    def remembering(self, pieces: Pieces) -> list[tuple[Auxiliary, int]]:
        """The auxiliaries with a memory, with their pieces; none without pieces of auxiliaries."""
        first = len(self.system.laws)
        auxiliaries = self.system.auxiliaries
        return [(auxiliaries[c], pieces[first + c]) for c in self.system.memories if len(pieces) > first]

    def known(self, pieces: Pieces) -> Array:
        """(S,) known values of the memories in a region, scaled; NaN: a memory keeps its value."""
        values = [auxiliary.known[piece] for auxiliary, piece in self.remembering(pieces)]
        return np.array(values) * self.memory if values else np.full(self.memory.size, np.nan)

    def carried_rows(self, pieces: Pieces) -> Array:
        """(R + K, Z) rates per period of the carried quantities: reference angles, then force integrals [SI]."""
        clearances = list(self.system.clearances)
        angles = self.velocity[list(self.coordinates.references)]
        return np.asarray(self.system.inputs.period * np.vstack([angles, self.force_rows(pieces)[clearances]]))

    def probe_rows(self, pieces: Pieces) -> tuple[Array, Array, Array]:
        """(W, Z) watched quantities, and their first and second derivatives by s, in corner scales."""
        clearances = list(self.system.clearances)
        period = self.system.inputs.period
        count = len(clearances)
        unit = 1.0 / self.corner_scale[:count, None]
        second = self.system.rows[clearances] @ self.acceleration_rows(pieces) - self.curvature_of_error[clearances]
        limits = self.limit_rows(pieces)
        matrix = self.generator(pieces)
        return (
            np.vstack([self.deflection[clearances] * unit, limits]),
            np.vstack([self.rate[clearances] * unit * period, limits @ matrix]),
            np.vstack([second * unit * period**2, limits @ matrix @ matrix]),
        )

    def limit_rows(self, pieces: Pieces) -> Array:
        """(auxiliaries, Z) watched quantity of every auxiliary in its piece, in corner scales."""
        rows = np.zeros((len(self.system.auxiliaries), self.width))
        scales = self.corner_scale[len(self.system.clearances) :]
        for c, (auxiliary, piece, memory) in enumerate(self.beside(pieces)):
            of_deflection, of_rate, of_memory = auxiliary.watched[piece]
            row = of_deflection * self.deflection[auxiliary.element] + of_rate * self.rate[auxiliary.element]
            rows[c] = (row + of_memory * memory) / scales[c]
        return rows

    def inputs_at(self, cycle: Array, fraction: Array) -> Array:
        """(t, U + Q) scaled inputs at times cycle + fraction, in periods, each (t,)."""
        return np.hstack([self._waves_at(cycle, fraction) * self.input_size, self.chains_at(cycle, fraction)])

    def waves(self, per_cycle: int) -> Array:
        """(per_cycle, U) inputs without their sizes at the samples of any period; (0, U) if periods are not equal."""
        last = _last_waves(self)
        waves = last.get(per_cycle)
        if waves is None:
            waves = self._new_waves(per_cycle)
            last.clear()
            last[per_cycle] = waves
        return waves

    def _new_waves(self, per_cycle: int) -> Array:
        if np.any(np.remainder(self.system.inputs.cycles, 1.0)):
            return np.zeros((0, self.inputs))
        return self._waves_at(np.zeros(per_cycle), np.arange(per_cycle) / per_cycle)

    def _waves_at(self, cycle: Array, fraction: Array) -> Array:
        """(t, U) 1, cosines and sines at such times."""
        high, low = split_cycles(self.system.inputs.cycles)
        out = np.ones((len(fraction), self.inputs))
        for part in slices(*out.shape):
            turn = np.remainder(np.multiply.outer(cycle[part], high), 1.0) + np.multiply.outer(cycle[part], low)
            angle = 2 * np.pi * np.remainder(turn + np.multiply.outer(fraction[part], high + low), 1.0)
            out[part, 1 : 1 + high.size] = np.cos(angle)
            out[part, 1 + high.size :] = np.sin(angle)
        return out

    def chains_at(self, cycle: Array, fraction: Array) -> Array:
        """(t, Q) scaled chains of the signals at such times; at a jump of a signal, the values after it."""
        signals = self.system.signals
        if signals is None:
            return np.zeros((len(fraction), 0))
        whole = np.floor(self.knots)
        interval = interval_of(cycle + fraction, self.knots)
        since = (cycle - whole[interval]) + (fraction - (self.knots - whole)[interval])
        order = signals.degree + 1
        start = self.chains[interval].reshape(len(interval), signals.channels, order)
        move = signals.pace(self.system.inputs.period) * since[:, None]
        out = np.zeros_like(start)
        for j in range(order):
            for k in range(order - 1, j - 1, -1):
                out[:, :, j] = out[:, :, j] * move / (k - j + 1) + start[:, :, k]
        return np.asarray(out.reshape(len(interval), -1))


@kept
def _last_waves(_: Flow) -> dict[int, Array]:
    """The last waves, by the number of samples per period."""
    return {}


@kept
def inputs_at_start(flow: Flow) -> Array:
    """(U + Q,) scaled inputs at t = 0."""
    inputs: Array = flow.inputs_at(np.zeros(1), np.zeros(1))[0]
    return inputs


def in_periods(knots: Array, period: float) -> Array:
    """(k,) ends of intervals [s], in periods.

    A value that is a dyadic fraction of a period to rounding is replaced by it, so that dyadic steps end there.
    """
    knots = knots / period
    dyadic = np.round(knots * _DYADIC) / _DYADIC
    return np.where(np.abs(knots - dyadic) <= ROUNDED * np.spacing(knots), dyadic, knots)


def split_cycles(cycles: Array) -> tuple[Array, Array]:
    """Leading 24 bits and remaining bits: a whole number of cycles times the leading part is exact."""
    high = cycles.astype(np.float32).astype(np.float64)
    return high, cycles - high


def _column_scale(harmonics: int) -> NDArray[np.int64]:
    """Index of the input scale of every input column: 0, 1 ... H, 1 ... H."""
    return np.concatenate([[0], *2 * [np.arange(1, harmonics + 1)]]).astype(np.int64)


def flow_of(system: PiecewiseSystem) -> Flow:
    """Choose coordinates and scales, and compute the rows."""
    # coordinates, scales and sizes
    coordinates = relative_coordinates(system)
    scaling = energy_scaling(system, coordinates)
    inputs = system.inputs
    r = len(coordinates.elements)
    n = system.size
    m = len(system.laws)
    moving = r + n
    states = moving + len(system.memories)
    signals = system.signals
    chained = states + 1 + 2 * inputs.count
    width = chained + (0 if signals is None else signals.chain)
    # columns of the inputs: mean, cosines, sines
    cosine = np.arange(states + 1, states + 1 + inputs.count)
    sine = cosine + inputs.count
    size = scaling.inputs[1:]
    omega = 2 * np.pi * inputs.cycles / inputs.period

    # rows of velocities, deflections and rates; transmission errors are subtracted
    velocity = np.zeros((n, width))
    velocity[:, r:moving] = np.diag(1.0 / scaling.velocity)
    deflection = np.zeros((m, width))
    deflection[:, :r] = coordinates.combination / scaling.deflection
    rate = system.rows @ velocity
    curvature = np.zeros((m, width))
    deflection[:, cosine] -= inputs.error_cosine / size
    deflection[:, sine] -= inputs.error_sine / size
    rate[:, cosine] -= inputs.error_sine * omega / size
    rate[:, sine] += inputs.error_cosine * omega / size
    curvature[:, cosine] = -inputs.error_cosine * omega**2 / size
    curvature[:, sine] = -inputs.error_sine * omega**2 / size
    # torques
    torque = np.zeros((n, width))
    torque[:, states] = inputs.mean / scaling.inputs[0]
    torque[:, cosine] = inputs.torque_cosine / size
    torque[:, sine] = inputs.torque_sine / size

    # signals
    chain = np.ones(width - chained)
    if signals is not None:
        chain = _write_signals(system, signals, chained, (deflection, rate, curvature, torque))
    # scales of the watched quantities: the largest corner, or if that is zero the size of the deflection
    corners = [float(np.abs(system.laws[k].corners).max()) for k in system.clearances]
    at_rest = [float(np.abs(deflection[k]).max()) for k in system.clearances]  # if the only corner is zero
    sizes = [c if c > 0 else a for c, a in zip(corners, at_rest, strict=True)]
    scale = power_of_two(np.array([*sizes, *(auxiliary.scale for auxiliary in system.auxiliaries)]))
    return Flow(
        system=system,
        coordinates=coordinates,
        scaling=scaling,
        states=states,
        deflection=deflection,
        rate=rate,
        curvature_of_error=curvature,
        velocity=velocity,
        torque=torque,
        frequency=2 * np.pi * inputs.cycles,
        corner_scale=scale,
        memory=power_of_two(np.array([np.sqrt(system.auxiliaries[c].memory.max()) for c in system.memories])),
        chain=chain,
    )


def _write_signals(system: PiecewiseSystem, signals: Signals, first: int, rows: tuple[Array, ...]) -> Array:
    """Write the columns of the chains; return their scales, powers of two from the torque of every channel."""
    # scale of each channel: its torque, and the torque of the stiffest pieces by its error
    deflection, rate, curvature, torque = rows
    stiffest = np.array([law.stiffness.max() for law in system.laws])
    pushed = np.abs(signals.torque) + np.abs(system.rows).T @ (stiffest[:, None] * np.abs(signals.error))
    period = system.inputs.period
    order = signals.degree + 1
    size = period * np.linalg.norm(pushed / np.sqrt(system.inertia)[:, None], axis=0)
    scale = power_of_two(np.where(size > 0.0, size, 1.0))
    # q_j = T^j p^(j) / w^j: the first link is the signal, the next ones its derivatives
    step = signals.pace(period) / period
    for c in range(signals.channels):
        at = first + c * order
        torque[:, at] = signals.torque[:, c] / scale[c]
        for j, (out, sign) in enumerate(((deflection, -1.0), (rate, -1.0), (curvature, 1.0))):
            if j < order:
                out[:, at + j] = sign * signals.error[:, c] * step**j / scale[c]
    return np.repeat(scale, order)
