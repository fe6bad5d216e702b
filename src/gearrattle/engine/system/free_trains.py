"""Free trains of a system: bodies that turn together without deflecting any element that can push."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.derived_values import kept
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.engine.system.equilibrium import elastic_elements
from gearrattle.engine.system.piecewise import PiecewiseSystem


class Train(NamedTuple):
    """Bodies that turn together."""

    bodies: NDArray[np.int64]  # (b,) indices, ascending
    motion: NDArray[np.float64]  # (b, f) angles of the bodies in f rigid motions, which span all that there are

    @property
    def freedoms(self) -> int:
        """Number of rigid motions."""
        return int(self.motion.shape[1])


@kept
def trains(system: PiecewiseSystem) -> tuple[Train, ...]:
    """Return every free train, in order."""
    every = []
    motions = relative_coordinates(system, elastic_elements(system)).angle_from_reference
    moves = motions != 0.0
    left = list(range(motions.shape[1]))
    while left:
        columns = [left[0]]
        left = left[1:]
        bodies = moves[:, columns[0]].copy()
        while joined := [p for p in left if np.any(bodies & moves[:, p])]:
            columns += joined
            left = [p for p in left if p not in joined]
            bodies |= np.any(moves[:, joined], axis=1)
        every.append(Train(np.flatnonzero(bodies), motions[np.ix_(bodies, columns)]))
    return tuple(every)


def refined(system: PiecewiseSystem, train: Train) -> NDArray[np.float64]:
    """Return (b, f) the motions of a train with their last digits.

    Those that an inverse gave deflect the elements by some roundings; the deflections, summed exactly, are taken back.
    """
    coordinates = relative_coordinates(system, elastic_elements(system))
    basis = coordinates.basis[:, train.bodies]
    deflection = np.array([[_product(row, angle) for angle in train.motion.T] for row in basis])
    correction = coordinates.angle_from_basis[train.bodies] @ deflection.reshape(len(basis), train.freedoms)
    return np.asarray(train.motion - correction)


def _product(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """The scalar product of two vectors, rounded once."""
    terms = ((float(one[i]), float(other[i])) for i in np.flatnonzero(one).tolist())
    return float(sum(Fraction(a) * Fraction(b) for a, b in terms))
