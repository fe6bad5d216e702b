"""Constraint modes: static displacements of the other bodies when masters are moved one by one.

With the masters held, the others may still have rigid motions (a train without a master); those belong to the basis as
well, since nothing holds them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.matrices import LinearSystem

Array = NDArray[np.float64]


def held(linear: LinearSystem, masters: tuple[int, ...]) -> tuple[Array, Array, tuple[int, ...]]:
    """Frequencies and shapes of the other coordinates with the masters held, and which those coordinates are."""
    others = tuple(i for i in range(len(linear.mass)) if i not in masters)
    if not others:
        return np.zeros(0), np.zeros((0, 0)), ()
    omega, shapes = linear.within(np.eye(len(linear.mass))[:, list(others)]).natural()
    return omega, shapes, others


def constraint_modes(linear: LinearSystem, masters: tuple[int, ...]) -> Array:
    """(n, r) one static shape a master, of unit angle there; then the rigid motions that no master holds."""
    omega, shapes, others = held(linear, masters)
    size = len(linear.mass)
    basis = np.zeros((size, len(masters)))
    basis[list(masters)] = np.eye(len(masters))
    if not others:
        return basis
    firm = omega > 0.0
    elastic = linear.elastic[:, list(others)]
    flexibility = (shapes[:, firm] / omega[firm] ** 2) @ shapes[:, firm].T
    basis[list(others)] = -flexibility @ (elastic.T @ linear.elastic[:, list(masters)])
    loose = np.zeros((size, int(np.count_nonzero(~firm))))
    loose[list(others)] = shapes[:, ~firm]
    return np.hstack([basis, loose])
