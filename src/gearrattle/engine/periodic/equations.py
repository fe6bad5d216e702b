"""Linear equations that may be singular: the shortest solution, and the free directions (the null space)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgecon, dgetrf, dgetrs

Array = NDArray[np.float64]

_REGULAR = 1e-7
"""Reciprocal condition above which equations are surely regular."""
_FREE = 1e-9
_FREE_OF_LARGEST = 1e-13
"""A singular value counts as zero if it is below _FREE and below _FREE_OF_LARGEST times the largest."""
_ORTHOGONAL = 1e-12
"""Cosine between a direction and the null space below which they are orthogonal."""


class Factored:
    """Equations A x = b, factored once.

    matrix: (P, P) A.
    is_regular: whether A is surely not singular.
    """

    def __init__(self, matrix: Array) -> None:
        self._matrix = matrix
        self._factors, self._pivots, _ = dgetrf(matrix)
        norm = float(np.abs(matrix).sum(axis=0).max())
        self.is_regular = bool(dgecon(self._factors, norm)[0] > _REGULAR * min(1.0, norm))

    def solution(self, right: Array) -> Array:
        """Return the shortest x (P,) with A x = b (P,), without any part along singular directions."""
        if not self.is_regular:
            return shortest_solution(self._matrix, right)[0]
        return np.asarray(dgetrs(self._factors, self._pivots, right)[0])

    def determinant(self) -> float:
        """Return det A."""
        exchanges = int(np.count_nonzero(self._pivots != np.arange(len(self._pivots))))
        return float(self._factors.diagonal().prod()) * (-1.0 if exchanges % 2 else 1.0)


class Bordered(Factored):
    """Equations A x = b with one unknown more than equations, bordered by a row: [A; row] x = (b, c), factored once.

    matrix: (P, P + 1) A.
    row: (W,) over the first W unknowns; norms are norms of these.
    """

    def __init__(self, matrix: Array, row: Array) -> None:
        self._width = len(row)
        unknowns = matrix.shape[1]
        whole = np.zeros((unknowns, unknowns))
        whole[:-1] = matrix
        whole[-1, : self._width] = row
        super().__init__(whole)
        self._row = row

    def null_vector(self, direction: Array) -> tuple[Array, int, float]:
        """Return the t (P + 1,) with A t = 0 nearest to a direction (W,), the number of further solutions, and det [A;
        t].

        The first W entries of t have norm one and form the last row of the determinant; it is 0 if there are further
        solutions.
        """
        width = self._width
        if self.is_regular:
            null = self.solution(np.eye(1, len(self._matrix), len(self._matrix) - 1)[0])
            own = null[:width]
            tangent = null / np.copysign(np.sqrt(own @ own), direction @ own)
            return tangent, 0, self.determinant() / float(self._row @ tangent[:width])
        matrix = self._matrix[:-1]
        _, nulls = shortest_solution(matrix, np.zeros(len(matrix)))
        tangent = nulls @ (direction @ nulls[:width])
        norm = float(np.linalg.norm(tangent[:width]))
        if norm < _ORTHOGONAL:  # the direction is orthogonal to the null space: any vector of it
            tangent = nulls[:, 0]
            norm = float(np.linalg.norm(nulls[:width, 0]))
        others = nulls.shape[1] - 1
        tangent = np.asarray(tangent / norm)
        if others:
            return tangent, others, 0.0
        last = np.append(tangent[:width], np.zeros(len(tangent) - width))
        return tangent, others, float(np.linalg.det(np.vstack([matrix, last])))


def shortest_solution(matrix: Array, right: Array) -> tuple[Array, Array]:
    """Return the shortest x with A x = b, without any part along singular directions, and these directions.

    matrix: (N, P) A.
    right: (N,) b.
    Returns (P,) x, and (P, F) orthonormal directions with A d = 0.
    """
    left, values, rows = np.linalg.svd(matrix)
    regular = values > _FREE + _FREE_OF_LARGEST * values[0]
    rank = int(np.count_nonzero(regular))
    weights = (left.T @ right)[:rank] / values[:rank]
    return np.asarray(rows[:rank].T @ weights), np.asarray(rows[rank:].T)
