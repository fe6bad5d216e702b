"""Modes of the linear system that remains when every element has one slope.

Undamped: K phi = omega^2 J phi with K = W^T diag(k) W. Rigid motions (the null space of the rows that have a slope) are
set apart first and have frequency zero exactly; the others are the singular values of diag(sqrt k) W J^-1/2 on their
complement, which loses no digits to squaring. Each mode gets the damping ratio phi^T D phi / (2 omega phi^T J phi),
exact for proportional damping and the first-order estimate otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.system.coordinates import relative_coordinates
from gearrattle.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]


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
    rigid = relative_coordinates(system, np.flatnonzero(stiffness > 0.0).tolist()).angle_from_reference
    count = rigid.shape[1]
    basis = np.linalg.qr(np.hstack([rigid * root[:, None], np.eye(system.size)]))[0]
    elastic = np.sqrt(stiffness)[:, None] * (system.rows / root) @ basis[:, count:]
    values, vectors = np.linalg.svd(elastic, full_matrices=True)[1:]
    order = np.argsort(values)
    omega = np.concatenate([np.zeros(count), values[order]])
    normal = np.hstack([basis[:, :count], basis[:, count:] @ vectors[order].T])
    dissipation = (system.rows.T * damping) @ system.rows + np.diag(system.drag)
    shapes = normal / root[:, None]
    modal = np.einsum("ij,ik,kj->j", shapes, dissipation, shapes)
    ratio = np.full(system.size, np.nan)
    ratio[count:] = modal[count:] / (2.0 * omega[count:])
    largest = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(system.size)]
    return ModalData(omega, ratio, shapes / largest)
