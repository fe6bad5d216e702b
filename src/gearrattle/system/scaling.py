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

from gearrattle.system.coordinates import RelativeCoordinates
from gearrattle.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scaling:
    """Powers of two: scaled deflection = deflection * x, scaled velocity = velocity * v, scaled input = input * u."""

    deflection: Array
    velocity: Array
    inputs: Array


def power_of_two(values: Array) -> Array:
    """The power of two nearest below each positive value."""
    return np.asarray(2.0 ** np.floor(np.log2(values)))


def energy_scaling(system: PiecewiseSystem, coordinates: RelativeCoordinates) -> Scaling:
    """Balance the states by energy and each input column by the size of the force it makes."""
    velocity = np.sqrt(system.inertia)
    stiffness = np.zeros(len(coordinates.elements))
    for i, k in enumerate(coordinates.elements):
        mobility = float(system.rows[k] ** 2 @ (1.0 / system.inertia))
        floor = (1.0 / system.inputs.period) ** 2 / mobility  # an element without stiffness: one radian a period
        stiffness[i] = max(float(system.laws[k].stiffness.max()), floor)
    inputs = system.inputs
    torque = np.abs(inputs.torque_sine) + np.abs(inputs.torque_cosine)
    peak = np.abs(system.rows).T @ (
        np.array([law.stiffness.max() for law in system.laws])[:, None]
        * (np.abs(inputs.error_sine) + np.abs(inputs.error_cosine))
    )
    constant = np.abs(inputs.mean) + np.abs(system.rows).T @ [float(np.abs(law.offset).max()) for law in system.laws]
    columns = np.hstack([constant[:, None], torque + peak]) / velocity[:, None]
    size = np.linalg.norm(columns, axis=0) * inputs.period
    size = size / (2 * np.pi * np.maximum(1.0, np.concatenate([[1.0], inputs.cycles])))
    return Scaling(
        power_of_two(np.sqrt(stiffness)), power_of_two(velocity), power_of_two(np.where(size > 0, size, 1.0))
    )
