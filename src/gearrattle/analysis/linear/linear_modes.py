"""Modes of the linear system in which every element has one slope.

Undamped: K phi = omega^2 J phi with K = W^T diag(k) W. Rigid motions (the null space of the rows that have a slope) are
set apart first and have frequency zero exactly; the others are the singular values of E = diag(sqrt k) W J^-1/2 on
their complement, which loses no digits to squaring. Bodies that no slope ties together are solved apart: a mode belongs
to one of them even if another has the same frequency.

The singular vectors are the shares of energy. With E v = omega u, |u| = |v| = 1, phi = J^-1/2 v,

    u_k^2 = k_k (w_k phi)^2 / (phi^T K phi)        strain energy in element k
    v_i^2 = J_i phi_i^2 / (phi^T J phi)            kinetic energy of inertia i

They are also the derivatives of ln omega^2 by ln k_k and, negative, by ln J_i (Fox, Kapoor, AIAA J. 6 (1968) 2426).
Each mode gets the damping ratio phi^T D phi / (2 omega phi^T J phi), exact for proportional damping and the first-order
estimate otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class ModalData:
    """Modes in ascending order.

    Attributes
    ----------
    frequencies
        (n,) undamped natural frequencies [rad/s]; 0 for rigid motion.
    damping_ratios
        (n,); NaN for rigid motion.
    shapes
        (n, n) one column per mode, largest entry 1.
    modal_inertia
        (n,) phi^T J phi of these shapes [kg m^2].
    strain_energy
        (m, n) share of every element in a mode's strain energy; NaN for rigid motion.
    kinetic_energy
        (n, n) share of every inertia in a mode's kinetic energy.
    """

    frequencies: Array
    damping_ratios: Array
    shapes: Array
    modal_inertia: Array
    strain_energy: Array
    kinetic_energy: Array


def modes(system: PiecewiseSystem, stiffness: Array, damping: Array) -> ModalData:
    """Modes with the slope (m,) and damping (m,) of every element given [SI]."""
    # rigid motions of the bodies that slopes tie together
    size = system.size
    root = np.sqrt(system.inertia)
    tied = relative_coordinates(system, np.flatnonzero(stiffness > 0.0).tolist())
    omega = np.zeros(size)
    normal = np.zeros((size, size))
    strain = np.full((stiffness.size, size), np.nan)
    first = 0
    # modes and strain energies, train by train
    for bodies in _trains(system.rows[stiffness > 0.0]):
        column = slice(first, first + bodies.size)
        held = np.flatnonzero((stiffness > 0.0) & np.any(system.rows[:, bodies] != 0.0, axis=1))
        own = np.flatnonzero(np.isin(tied.references, bodies))
        rigid = tied.angle_from_reference[np.ix_(bodies, own)]
        factor = np.sqrt(stiffness[held])[:, None] * (system.rows[np.ix_(held, bodies)] / root[bodies])
        frequencies, kinetic, stored = _train(rigid * root[bodies, None], factor)
        omega[column] = frequencies
        normal[bodies, column] = kinetic
        strain[:, first + own.size : column.stop] = 0.0
        strain[held, first + own.size : column.stop] = stored**2
        first = column.stop
    # ascending frequencies
    order = np.argsort(omega, kind="stable")
    omega = omega[order]
    normal = normal[:, order]
    strain = strain[:, order]
    shapes = normal / root[:, None]
    # modal damping ratios
    dissipation = (system.rows.T * damping) @ system.rows + np.diag(system.drag)
    modal = np.einsum("ij,ik,kj->j", shapes, dissipation, shapes)
    ratio = np.full(size, np.nan)
    np.divide(modal, 2.0 * omega, out=ratio, where=omega > 0.0)
    # shapes with a largest entry of 1
    largest = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(size)]
    return ModalData(omega, ratio, shapes / largest, 1.0 / largest**2, strain, normal**2)


def _train(rigid: Array, factor: Array) -> tuple[Array, Array, Array]:
    """Modes of bodies that are connected.

    Parameters
    ----------
    rigid
        (p, r) their rigid motions, in coordinates sqrt(J) q.
    factor
        (s, p) E, of the elements with a slope.

    Returns
    -------
    tuple[Array, Array, Array]
        omega: (p,) ascending.
        normal: (p, p) orthonormal v, one column per mode.
        stored: (s, p - r) orthonormal u of the elastic modes.
    """
    size, count = rigid.shape
    basis = np.linalg.qr(np.hstack([rigid, np.eye(size)]))[0]
    if count == size:
        return np.zeros(size), basis, np.zeros((len(factor), 0))
    stored, values, vectors = np.linalg.svd(factor @ basis[:, count:], full_matrices=False)
    normal = np.hstack([basis[:, :count], basis[:, count:] @ vectors[::-1].T])
    return np.concatenate([np.zeros(count), values[::-1]]), normal, stored[:, ::-1]


def _trains(rows: Array) -> list[IntArray]:
    """Indices of the bodies that are connected by these rows, each ascending, by their first body."""
    label = np.arange(rows.shape[1])
    ends = [np.flatnonzero(row) for row in rows]
    for pair in ends:
        together = np.isin(label, label[pair])
        label[together] = label[together].min(initial=rows.shape[1])
    return [np.flatnonzero(label == first) for first in np.unique(label)]
