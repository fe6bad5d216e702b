"""Responses of linear systems: accelerations by a torque, and the steady deflections under all inputs.

    H(omega) = -omega^2 V (K - omega^2 M + i omega C)^-1 f

The accelerance, not the receptance: a free train follows a slow torque with a finite acceleration, while its angle
grows without bound (Ewins, Modal Testing, 2nd ed. 2000, sec. 2.5). With every element in one piece of its law a
driveline is linear too; while its steady deflections stay inside these pieces they are a motion of the driveline.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.matrices import LinearSystem
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

_SAMPLES = 64  # a period of the highest order
_MOST_SAMPLES = 1 << 16


def accelerance(linear: LinearSystem, omega: Array, drive: Array, watch: Array) -> Complex:
    """Return (len(omega), p) accelerations of ``watch @ q`` by the torque distribution ``drive``.

    Parameters
    ----------
    omega
        (F,) angular frequencies, > 0 [rad/s].
    drive
        (n,) how a unit torque acts on the coordinates.
    watch
        (p, n) what is watched.
    """
    square = omega[:, None, None] ** 2
    dynamic = linear.stiffness - square * linear.mass + 1j * omega[:, None, None] * linear.damping
    motion = np.linalg.solve(dynamic, np.broadcast_to(drive[:, None].astype(complex), (omega.size, drive.size, 1)))
    return np.asarray(-square[:, 0] * (motion[:, :, 0] @ watch.T))


def steady_angles(system: PiecewiseSystem, stiffness: Array, damping: Array) -> Complex:
    """Return (n, H) complex amplitudes of every inertia's angle at the orders that turn.

    The motion is the real part of sum amplitude exp(i omega t); H counts the inputs' orders above zero. Slope and
    damping are (m,), of every element.
    """
    inputs = system.inputs
    turning = inputs.cycles > 0.0
    torque = (inputs.torque_cosine - 1j * inputs.torque_sine)[:, turning]
    error = (inputs.error_cosine - 1j * inputs.error_sine)[:, turning]
    spring = (system.rows.T * stiffness) @ system.rows
    loss = (system.rows.T * damping) @ system.rows + np.diag(system.drag)
    angles = np.empty(torque.shape, dtype=np.complex128)
    for j, w in enumerate(turning_rates(system)):
        push = torque[:, j] + system.rows.T @ ((stiffness + 1j * w * damping) * error[:, j])
        dynamic = spring - w * w * np.diag(system.inertia) + 1j * w * loss
        angles[:, j] = np.linalg.solve(dynamic, push)
    return angles


def turning_rates(system: PiecewiseSystem) -> Array:
    """Return (H,) the angular frequencies of the orders that turn [rad/s]."""
    inputs = system.inputs
    return 2.0 * np.pi * inputs.cycles[inputs.cycles > 0.0] / inputs.period


def steady_deflections(system: PiecewiseSystem, stiffness: Array, damping: Array) -> Complex:
    """Return (m, H) complex amplitudes of every element's deflection, w . q - e; arguments as ``steady_angles``."""
    error = (system.inputs.error_cosine - 1j * system.inputs.error_sine)[:, system.inputs.cycles > 0.0]
    return np.asarray(system.rows @ steady_angles(system, stiffness, damping) - error)


def steady_extremes(system: PiecewiseSystem, amplitudes: Complex) -> tuple[Array, Array]:
    """Return (m,) lower and (m,) upper bounds on the oscillation that amplitudes (m, H) make; no sample exceeds them.

    Where all orders are whole the extremes of N samples over a period are multiplied by 1 / cos(pi p / N), p the
    highest order: a trigonometric polynomial cannot rise higher between them (H. Ehlich, K. Zeller 1964, Math. Z. 86,
    41-44; 0.12 % here). Otherwise the amplitudes are added up.
    """
    inputs = system.inputs
    orders = inputs.cycles[inputs.cycles > 0.0]
    if not orders.size:
        return np.zeros(len(amplitudes)), np.zeros(len(amplitudes))
    highest = float(orders.max())
    count = int(_SAMPLES * np.ceil(highest))
    if np.any(np.abs(orders - np.rint(orders)) > 1e-9) or count > _MOST_SAMPLES:
        reach = np.abs(amplitudes).sum(axis=1)
        return -reach, reach
    spectrum = np.zeros((len(amplitudes), count // 2 + 1), dtype=np.complex128)
    for order, column in zip(np.rint(orders).astype(np.int64).tolist(), amplitudes.T, strict=True):
        spectrum[:, order] += column
    motion = np.fft.irfft(spectrum, count, axis=1) * (0.5 * count)
    reach = np.abs(motion).max(axis=1) * (1.0 / np.cos(np.pi * highest / count) - 1.0)
    return motion.min(axis=1) - reach, motion.max(axis=1) + reach
