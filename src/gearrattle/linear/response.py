"""Frequency response of a linear system: acceleration by torque.

    H(omega) = -omega^2 V (K - omega^2 M + i omega C)^-1 f

The accelerance, not the receptance: a free train follows a slow torque with a finite acceleration, while its angle
grows without bound (Ewins, Modal Testing, 2nd ed. 2000, sec. 2.5).

Takes a linear system; gives complex amplitudes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.linear.matrices import LinearSystem

Array = NDArray[np.float64]


def accelerance(linear: LinearSystem, omega: Array, drive: Array, watch: Array) -> NDArray[np.complex128]:
    """Return (len(omega), p) accelerations of ``watch @ q`` by the torque distribution ``drive``.

    Args:
        linear: the system.
        omega: (F,) angular frequencies, > 0 [rad/s].
        drive: (n,) how a unit torque acts on the coordinates.
        watch: (p, n) what is watched.
    """
    square = omega[:, None, None] ** 2
    dynamic = linear.stiffness - square * linear.mass + 1j * omega[:, None, None] * linear.damping
    motion = np.linalg.solve(dynamic, np.broadcast_to(drive[:, None].astype(complex), (omega.size, drive.size, 1)))
    return np.asarray(-square[:, 0] * (motion[:, :, 0] @ watch.T))
