"""Matrices of the linear system in which every element has one slope, and their projection on a subspace.

    M q'' + C q' + E^T E q = f,        E = diag(sqrt k) W

The stiffness is kept as its factor E, so that natural frequencies are singular values, of E L^-T with M = L L^T, and a
soft mode beside stiff ones keeps its digits. In a subspace q = T p (Rayleigh and Ritz) the matrices become T^T M T,
T^T C T and the factor E T; the frequencies found there are never below the true ones of the same rank.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]

_RIGID = 1e-11  # of the highest frequency: below it lies rounding of the singular values


@dataclass(frozen=True)
class LinearSystem:
    """M q'' + C q' + E^T E q = f.

    Attributes
    ----------
    mass, damping
        (n, n).
    elastic
        (m, n) E, one row per element.
    """

    mass: Array
    damping: Array
    elastic: Array

    @property
    def stiffness(self) -> Array:
        """(n, n) K = E^T E."""
        return np.asarray(self.elastic.T @ self.elastic)

    def within(self, basis: Array) -> LinearSystem:
        """Return the system in the subspace q = T p; ``basis`` is T, (n, r)."""
        return LinearSystem(basis.T @ self.mass @ basis, basis.T @ self.damping @ basis, self.elastic @ basis)

    def natural(self) -> tuple[Array, Array]:
        """Return (n,) frequencies, ascending, 0 for rigid motion, and (n, n) shapes of unit modal mass, in columns."""
        lower = np.linalg.cholesky(self.mass)
        values, vectors = np.linalg.svd(np.linalg.solve(lower, self.elastic.T).T, full_matrices=True)[1:]
        omega = _padded(values, len(lower))
        return omega[::-1], np.linalg.solve(lower.T, vectors[::-1].T)

    def frequencies(self) -> Array:
        """Return the frequencies alone, in a third of the time."""
        return _frequencies(_scaled(self.elastic, self.mass))


def _scaled(rows: Array, mass: Array) -> Array:
    """(m, n) rows L^-T, with M = L L^T."""
    diagonal = np.diagonal(mass)
    if np.count_nonzero(mass) == diagonal.size:
        return np.asarray(rows / np.sqrt(diagonal))
    return np.asarray(np.linalg.solve(np.linalg.cholesky(mass), rows.T).T)


def _frequencies(scaled: Array) -> Array:
    """(..., n) singular values of (..., m, n), ascending."""
    return _padded(np.asarray(np.linalg.svd(scaled, compute_uv=False)), scaled.shape[-1])[..., ::-1]


def _padded(values: Array, size: int) -> Array:
    """All frequencies, descending; singular values within rounding, and those that a flat matrix lacks, are zero."""
    omega = np.zeros((*values.shape[:-1], size))
    omega[..., : values.shape[-1]] = values
    omega[omega <= _RIGID * omega.max(axis=-1, keepdims=True, initial=0.0)] = 0.0
    return omega


def linearised(system: PiecewiseSystem, stiffness: Array, damping: Array) -> LinearSystem:
    """Return the matrices with the slope (m,) and the damping (m,) of every element given [SI]."""
    dissipation = (system.rows.T * damping) @ system.rows + np.diag(system.drag)
    return LinearSystem(np.diag(system.inertia), dissipation, np.sqrt(stiffness)[:, None] * system.rows)


def frequencies_of(system: PiecewiseSystem, stiffness: Array, basis: Array) -> Array:
    """(S, r) frequencies in the subspace q = T p, ascending, with the slopes (S, m) given [SI].

    They are those of ``linearised(...).within(basis).frequencies()``, many at a time.

    Parameters
    ----------
    stiffness
        (S, m) slope of every element, state by state.
    basis
        (n, r) T.
    """
    rows = _scaled(system.rows @ basis, basis.T @ (system.inertia[:, None] * basis))
    return _frequencies(np.sqrt(stiffness)[:, :, None] * rows)
