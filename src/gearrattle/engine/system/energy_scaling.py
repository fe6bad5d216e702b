"""The exact engine's own units: the period as unit of time, energy-balanced states.

Time is counted in periods T, so that every harmonic has a whole number of oscillations a unit and phases reduce
exactly. Deflection i is multiplied by about sqrt(k_i), velocity j by about sqrt(J_j): then the state matrix of a
conservative system is skew-symmetric up to a factor below two, its norm is about its largest eigenvalue, and all
entries of the state are of comparable size (square roots of energies). The factors are powers of two, so that scaling
itself rounds nothing; the forcing columns are scaled the same way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels._jit import compact
from gearrattle.engine.kernels.state_scaling import scale
from gearrattle.engine.kernels.variant_arrays import Scales
from gearrattle.engine.system.coordinates import RelativeCoordinates
from gearrattle.engine.system.piecewise import PiecewiseSystem
from gearrattle.engine.system.plain_arrays import coefficients_of, frame_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scaling:
    """Powers of two: scaled deflection = deflection * x, scaled velocity = velocity * v, scaled input = input * u."""

    deflection: Array
    velocity: Array
    inputs: Array


def power_of_two(values: Array) -> Array:
    """The power of two nearest below each positive value."""
    values = np.asarray(values, dtype=float)
    return np.where(values < np.inf, np.ldexp(1.0, np.frexp(values)[1] - 1), values)


def energy_scaling(system: PiecewiseSystem, coordinates: RelativeCoordinates) -> Scaling:
    """Balance the states by energy, and each input column by the size of its force (``kernels.state_scaling``)."""
    sizes = len(coordinates.elements), system.size, 1 + system.inputs.count, len(system.clearances)
    scales = Scales(*(np.empty(size) for size in sizes))
    compact(scale)(coefficients_of(system), frame_of(system, coordinates), scales)
    return Scaling(scales.deflection, scales.velocity, scales.inputs)
