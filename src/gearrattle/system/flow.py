"""What the exact engine sees of a piecewise system: rows over one augmented state.

    z = (x, v, u),   u = (1, cos 2 pi p_1 s, ... cos 2 pi p_H s, sin 2 pi p_1 s, ...),   s = t / T,

all scaled (``scaling.py``). The inputs are states of their own (oscillators), so inside a region dz/ds = M z with one
constant matrix: free motion, forced motion, resonance, drift under a mean torque are one and the same case. Every
quantity anyone asks for - an angle, a deflection, a force, an acceleration - is a row of numbers times z.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.system.coordinates import RelativeCoordinates, relative_coordinates
from gearrattle.system.forced import oscillation
from gearrattle.system.piecewise import PiecewiseSystem
from gearrattle.system.scaling import Scaling, energy_scaling, power_of_two

Array = NDArray[np.float64]
Pieces = tuple[int, ...]


@dataclass(frozen=True)
class Flow:
    """Rows over z, shape (., Z) with Z = N + 1 + 2 H, that do not depend on the region.

    Attributes:
        system, coordinates, scaling: what it was made from.
        states: N, the number of deflections and velocities in z.
        deflection, rate, curvature_of_error: (m, Z) delta_k, delta_k', and e_k'' of every element [SI].
        velocity: (n, Z) q' [SI].
        torque: (n, Z) applied torque [SI].
        frequency: (H,) 2 pi p_j, radians a period.
        corner_scale: (K,) power of two near the largest corner of each clearance.
    """

    system: PiecewiseSystem
    coordinates: RelativeCoordinates
    scaling: Scaling
    states: int
    deflection: Array
    rate: Array
    curvature_of_error: Array
    velocity: Array
    torque: Array
    frequency: Array
    corner_scale: Array

    @property
    def width(self) -> int:
        """Z, the length of z."""
        return int(self.deflection.shape[1])

    @cached_property
    def input_size(self) -> Array:
        """(1 + 2 H,) amplitude of every input column."""
        return np.asarray(self.scaling.inputs[_column_scale(self.frequency.size)])

    def force_rows(self, pieces: Pieces) -> Array:
        """(m, Z) force of every element with the elements in the pieces given [SI]."""
        rows = np.empty_like(self.deflection)
        for k, (law, piece) in enumerate(zip(self.system.laws, pieces, strict=True)):
            rows[k] = law.stiffness[piece] * self.deflection[k] + law.damping[piece] * self.rate[k]
            rows[k, self.states] += law.offset[piece] / self.scaling.inputs[0]
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
        matrix[r : self.states] = period * self.scaling.velocity[:, None] * self.acceleration_rows(pieces)
        matrix[self.states :, self.states :] = oscillation(self.frequency)
        return matrix

    def carried_rows(self, pieces: Pieces) -> Array:
        """(R + K, Z) rates a period of what is integrated beside z: reference angles, then force integrals [SI]."""
        clearances = list(self.system.clearances)
        angles = self.velocity[list(self.coordinates.references)]
        return np.asarray(self.system.inputs.period * np.vstack([angles, self.force_rows(pieces)[clearances]]))

    def probe_rows(self, pieces: Pieces) -> tuple[Array, Array, Array]:
        """(K, Z) deflection, its first and second derivative by s of every clearance, in corner scales."""
        clearances = list(self.system.clearances)
        period = self.system.inputs.period
        unit = 1.0 / self.corner_scale[:, None]
        second = self.system.rows[clearances] @ self.acceleration_rows(pieces) - self.curvature_of_error[clearances]
        return (
            self.deflection[clearances] * unit,
            self.rate[clearances] * unit * period,
            second * unit * period**2,
        )

    def inputs_at(self, cycle: Array, fraction: Array) -> Array:
        """(t, 1 + 2 H) scaled inputs at times cycle + fraction, in periods, each (t,)."""
        high, low = split_cycles(self.system.inputs.cycles)
        turn = np.remainder(np.multiply.outer(cycle, high), 1.0) + np.multiply.outer(cycle, low)
        angle = 2 * np.pi * np.remainder(turn + np.multiply.outer(fraction, high + low), 1.0)
        waves = np.hstack([np.cos(angle), np.sin(angle)])
        return np.hstack([np.ones((len(fraction), 1)), waves]) * self.input_size


def split_cycles(cycles: Array) -> tuple[Array, Array]:
    """Leading 24 bits and the rest, so that a whole number of cycles times the first part is exact."""
    high = cycles.astype(np.float32).astype(np.float64)
    return high, cycles - high


def _column_scale(harmonics: int) -> NDArray[np.int64]:
    """Index of the input scale of every input column: 0, 1 ... H, 1 ... H."""
    return np.concatenate([[0], *2 * [np.arange(1, harmonics + 1)]]).astype(np.int64)


def flow_of(system: PiecewiseSystem) -> Flow:
    """Choose coordinates and scales, and write the rows down."""
    coordinates = relative_coordinates(system)
    scaling = energy_scaling(system, coordinates)
    inputs = system.inputs
    r, n, m = len(coordinates.elements), system.size, len(system.laws)
    states = r + n
    width = states + 1 + 2 * inputs.count
    cosine = np.arange(states + 1, states + 1 + inputs.count)
    sine = cosine + inputs.count
    size = scaling.inputs[1:]
    omega = 2 * np.pi * inputs.cycles / inputs.period

    velocity = np.zeros((n, width))
    velocity[:, r:states] = np.diag(1.0 / scaling.velocity)
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
    torque = np.zeros((n, width))
    torque[:, states] = inputs.mean / scaling.inputs[0]
    torque[:, cosine] = inputs.torque_cosine / size
    torque[:, sine] = inputs.torque_sine / size

    corners = [float(np.abs(system.laws[k].corners).max()) for k in system.clearances]
    at_rest = [float(np.abs(deflection[k]).max()) for k in system.clearances]  # corner at zero only: any scale serves
    scale = power_of_two(np.array([c if c > 0 else a for c, a in zip(corners, at_rest, strict=True)]))
    return Flow(
        system,
        coordinates,
        scaling,
        states,
        deflection,
        rate,
        curvature,
        velocity,
        torque,
        2 * np.pi * inputs.cycles,
        scale,
    )
