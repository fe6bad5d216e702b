"""Linear equations that may be singular: the shortest solution, and the directions that are free.

Takes matrices; gives vectors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgecon, dgetrf, dgetrs

Array = NDArray[np.float64]

_REGULAR = 1e-7
"""Reciprocal condition of equations that are surely not singular."""
_FREE, _FREE_OF_LARGEST = 1e-9, 1e-13
"""A singular value below the first, and this share of the largest, is zero."""


def solution(matrix: Array, right: Array) -> Array:
    """Return the shortest x (P,) with A x = b, A (P, P), nothing done along singular directions."""
    factors, pivots, _ = dgetrf(matrix)
    norm = float(np.abs(matrix).sum(axis=0).max())
    if not dgecon(factors, norm)[0] > _REGULAR * min(1.0, norm):
        return shortest_solution(matrix, right)[0]
    return np.asarray(dgetrs(factors, pivots, right)[0])


def shortest_solution(matrix: Array, right: Array) -> tuple[Array, Array]:
    """Return the shortest x with A x = b, nothing done along singular directions, and these directions.

    Parameters
    ----------
    matrix
        (N, P) A.
    right
        (N,) b.

    Returns
    -------
    tuple[Array, Array]
        (P,) x, and (P, F) orthonormal directions with A d = 0.
    """
    left, values, rows = np.linalg.svd(matrix)
    regular = values > _FREE + _FREE_OF_LARGEST * values[0]
    rank = int(np.count_nonzero(regular))
    weights = (left.T @ right)[:rank] / values[:rank]
    return np.asarray(rows[:rank].T @ weights), np.asarray(rows[rank:].T)
