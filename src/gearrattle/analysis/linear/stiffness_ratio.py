"""Numerical stiffness of the linear system in which every element has one slope: eigenvalues and R_lambda.

    R_lambda = max |lambda| / min |lambda|

over the eigenvalues of the state matrix (Padmanabhan et al. 1995, sec. 6, after R. C. Aiken 1985), *without* those of
rigid motion: a free train has lambda = 0 for its angle and its mean drag rate for its speed, and the ratio with the
latter would describe the drag. So every rigid motion (the null space of the elements that have a slope) takes a pair
out, and they are kept apart. They are identified by the share of their energy in rigid velocities.

The classes are Aiken's, as the paper prints them: mild below 1e2, strong 1e3 to 1e5, extreme 1e6 to 1e8, pathological
above 1e9. They leave gaps; here the lower class goes on up to the next bound.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.system.coordinates import RelativeCoordinates, relative_coordinates
from gearrattle.engine.system.piecewise import PiecewiseSystem

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
StiffnessClass = Literal["mild", "strong", "extreme", "pathological", "rigid"]

BOUNDS: tuple[tuple[float, StiffnessClass], ...] = ((1e3, "mild"), (1e6, "strong"), (1e9, "extreme"))
"""Padmanabhan et al. 1995, sec. 6, gaps closed: each class lies below its bound; the last has none."""


@dataclass(frozen=True)
class Eigenvalues:
    """Eigenvalues of one state matrix [1/s], by ascending magnitude, those of rigid motions apart.

    These are a pair for each rigid motion: zero, and a drag rate.
    """

    elastic: Complex
    rigid: Complex

    @property
    def r_lambda(self) -> float:
        """Largest over smallest magnitude; NaN if all motion is rigid."""
        size = np.abs(self.elastic)
        return float(size[-1] / size[0]) if size.size else float("nan")

    @property
    def fastest(self) -> float:
        """Largest magnitude of all [1/s]."""
        return float(np.abs(np.concatenate([self.elastic, self.rigid])).max())

    @property
    def stiffness_class(self) -> StiffnessClass:
        """Class of R_lambda."""
        return stiffness_class(self.r_lambda)


def stiffness_class(r_lambda: float) -> StiffnessClass:
    """Return the class of a ratio of eigenvalues; "rigid" of NaN, where nothing is elastic."""
    if math.isnan(r_lambda):
        return "rigid"
    return next((name for bound, name in BOUNDS if r_lambda < bound), "pathological")


def rigid_motions(system: PiecewiseSystem, stiffness: Array) -> int:
    """Return how many rigid motions there are with the slopes (m,) given."""
    return len(_tied(system, stiffness).references)


def _tied(system: PiecewiseSystem, stiffness: Array) -> RelativeCoordinates:
    return relative_coordinates(system, np.flatnonzero(stiffness > 0.0).tolist())


@dataclass(frozen=True)
class EnergyForm:
    """dy/dt = A y in energy coordinates, y = (B x, sqrt(J) v) with B^T B the stiffness of independent deflections x.

    Zeros of rigid angles do not occur there, and A is skew-symmetric except for damping.

    Attributes
    ----------
    matrix
        (r + n, r + n) A.
    rigid
        (n, p) orthonormal rigid velocities, in the coordinates sqrt(J) v.
    elements
        their number m.
    held
        (s,) those that have a slope.
    stored
        (s, r) orthonormal: sqrt(k) times the deflection of each of them is ``stored @ B x``.
    """

    matrix: Array
    rigid: Array
    elements: int
    held: NDArray[np.int64]
    stored: Array

    @property
    def count(self) -> int:
        """Number r of independent deflections."""
        return int(self.stored.shape[1])

    def is_rigid(self, vectors: Complex) -> NDArray[np.bool_]:
        """Return which of the eigenvectors, in columns, are rigid motions: those with most energy in their speeds."""
        share = np.sum(np.abs(self.rigid.T @ vectors[self.count :]) ** 2, axis=0)
        apart = np.zeros(vectors.shape[1], dtype=np.bool_)
        apart[np.argsort(-share, kind="stable")[: self.rigid.shape[1]]] = True
        return apart


def energy_form(system: PiecewiseSystem, stiffness: Array, damping: Array) -> EnergyForm:
    """Return the system with the slope (m,) and the damping (m,) of every element given, in energy coordinates."""
    coordinates = _tied(system, stiffness)
    root = np.sqrt(system.inertia)
    held = np.flatnonzero(stiffness > 0.0)
    stored, factor = np.linalg.qr(np.sqrt(stiffness[held])[:, None] * coordinates.combination)
    gyroscopic = factor @ coordinates.basis / root
    loss = (system.rows.T * damping) @ system.rows + np.diag(system.drag)
    count = len(factor)
    matrix = np.zeros((count + system.size, count + system.size))
    matrix[:count, count:] = gyroscopic
    matrix[count:, :count] = -gyroscopic.T
    matrix[count:, count:] = -loss / np.outer(root, root)
    rigid = np.linalg.qr(root[:, None] * coordinates.angle_from_reference)[0]
    return EnergyForm(matrix, rigid, stiffness.size, held, stored)


def eigenvalues(system: PiecewiseSystem, stiffness: Array, damping: Array) -> Eigenvalues:
    """Eigenvalues with the slope (m,) and the damping (m,) of every element given, found in energy coordinates."""
    form = energy_form(system, stiffness, damping)
    values, vectors = np.linalg.eig(form.matrix)
    apart = form.is_rigid(vectors)
    zeros = np.zeros(form.rigid.shape[1])
    return Eigenvalues(_ascending(values[~apart]), _ascending(np.concatenate([zeros, values[apart]])))


def _ascending(values: Array | Complex) -> Complex:
    """Sort by magnitude, pairs by imaginary part."""
    every: Complex = np.asarray(values, dtype=np.complex128)
    order = np.lexsort((np.imag(every), np.asarray(np.round(np.abs(every), 12))))
    return np.asarray(every[order], dtype=np.complex128)
