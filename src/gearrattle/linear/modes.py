"""Modes of the linear system that remains when every element has one slope.

Undamped: K phi = omega^2 J phi, a symmetric problem in mass-normalised coordinates. Damped: the state matrix's
eigenvalues; each undamped mode gets the damping ratio phi^T D phi / (2 omega phi^T J phi), exact for proportional
damping and the first-order estimate otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from gearrattle.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]

_RIGID = 1e-9  # of the largest omega^2 that a body alone on its springs would have


@dataclass(frozen=True)
class ModalData:
    """Modes in ascending order.

    Attributes:
        frequencies: (n,) undamped natural frequencies [rad/s]; 0 for rigid motion.
        damping_ratios: (n,); NaN for rigid motion.
        shapes: (n, n) one column a mode, largest entry 1.
    """

    frequencies: Array
    damping_ratios: Array
    shapes: Array


def modes(system: PiecewiseSystem, stiffness: Array, damping: Array) -> ModalData:
    """Modes with the slope (m,) and damping (m,) of every element given [SI]."""
    root = np.sqrt(system.inertia)
    rows = system.rows / root
    values, vectors = eigh((rows.T * stiffness) @ rows)
    free = np.diagonal((rows.T * stiffness) @ rows).max(initial=0.0)
    rigid = values <= _RIGID * _RIGID * free
    omega = np.where(rigid, 0.0, np.sqrt(np.maximum(values, 0.0)))
    dissipation = (rows.T * damping) @ rows + np.diag(system.drag / system.inertia)
    modal = np.einsum("ij,ik,kj->j", vectors, dissipation, vectors)
    ratio = np.where(rigid, np.nan, modal / np.where(rigid, 1.0, 2.0 * omega))
    shapes = vectors / root[:, None]
    largest = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(system.size)]
    return ModalData(omega, ratio, shapes / largest)
