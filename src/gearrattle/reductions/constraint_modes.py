"""Constraint modes: static displacements of the other bodies when one master after the other is moved.

With the masters held, the other bodies may still have rigid motions (a train without a master). These rigid motions are
part of the basis as well.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.analysis.linear.matrices import LinearSystem

Array = NDArray[np.float64]


def held(linear: LinearSystem, masters: tuple[int, ...]) -> tuple[Array, Array, tuple[int, ...]]:
    """Frequencies and shapes of the other coordinates with the masters held, and the indices of these coordinates."""
    others = tuple(i for i in range(len(linear.mass)) if i not in masters)
    if not others:
        return np.zeros(0), np.zeros((0, 0)), ()
    omega, shapes = linear.within(np.eye(len(linear.mass))[:, list(others)]).natural()
    return omega, shapes, others


def constraint_modes(linear: LinearSystem, masters: tuple[int, ...]) -> Array:
    """(n, r) a static shape for every master, of unit angle there; then rigid motions that no master holds."""
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
