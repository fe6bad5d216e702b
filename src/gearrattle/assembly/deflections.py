"""Deflection of an element along a motion, and its derivatives; linear elements, too, have them.

delta_k = w_k . theta - e_k(t)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.prescribed_motion import coordinates_of
from gearrattle.assembly.system import assemble
from gearrattle.model import Model
from gearrattle.trajectory import Trajectory

Array = NDArray[np.float64]


def deflection(model: Model, trajectory: Trajectory, element: int) -> Array:
    """(t,) deflection of an element at every sample [rad or m]."""
    return _less_error(model, trajectory, element, derivative=0)


def deflection_rate(model: Model, trajectory: Trajectory, element: int) -> Array:
    """(t,) rate of an element's deflection at every sample [rad/s or m/s]."""
    return _less_error(model, trajectory, element, derivative=1)


def deflection_acceleration(model: Model, trajectory: Trajectory, element: int) -> Array:
    """(t,) second derivative of an element's deflection at every sample [rad/s^2 or m/s^2]."""
    return _less_error(model, trajectory, element, derivative=2)


def _less_error(model: Model, trajectory: Trajectory, element: int, *, derivative: int) -> Array:
    """Subtract the error of an element from the deflection of its bodies: harmonics, and prescribed motions."""
    system = assemble(model).system
    inputs = system.inputs
    signals = system.signals
    time = trajectory.time
    seen = coordinates_of(model, trajectory, derivative) @ system.rows[element]
    omega = 2.0 * np.pi * inputs.cycles / inputs.period
    for rate, sine, cosine in zip(omega, inputs.error_sine[element], inputs.error_cosine[element], strict=True):
        if sine or cosine:
            phase = rate * time + 0.5 * np.pi * derivative
            seen = seen - rate**derivative * (sine * np.sin(phase) + cosine * np.cos(phase))
    return seen if signals is None else np.asarray(seen - signals.at(time, derivative) @ signals.error[element])
