"""Eigenvalues of small symmetric matrices, by Jacobi's rotations.

C. G. J. Jacobi, J. reine angew. Math. 30 (1846) 51; the rotation as in Golub and Van Loan, Matrix Computations, sec.
8.5. Every operation is rounded by itself, so all machines give the same bits, whatever linear algebra library they
have.
"""

from __future__ import annotations

from math import sqrt

from gearrattle.engine.kernels._jit import strict

_SWEEPS = 60  # most sweeps
_NEGLIGIBLE = 1e-18  # share of the largest entry below which an entry counts as zero


@strict
def _rotate(a, vectors, p, q, size):
    """Make a[p, q] zero by a rotation in the plane (p, q)."""
    theta = (a[q, q] - a[p, p]) / (2.0 * a[p, q])
    t = 1.0 / (abs(theta) + sqrt(theta * theta + 1.0))
    if theta < 0.0:
        t = -t
    c = 1.0 / sqrt(t * t + 1.0)
    s = t * c
    for k in range(size):
        x, y = a[k, p], a[k, q]
        a[k, p] = c * x - s * y
        a[k, q] = s * x + c * y
    for k in range(size):
        x, y = a[p, k], a[q, k]
        a[p, k] = c * x - s * y
        a[q, k] = s * x + c * y
        x, y = vectors[k, p], vectors[k, q]
        vectors[k, p] = c * x - s * y
        vectors[k, q] = s * x + c * y
    a[p, q] = 0.0
    a[q, p] = 0.0


@strict
def diagonalise(a, vectors, size):
    """Write the eigenvectors of a as columns; the diagonal of a becomes its eigenvalues."""
    largest = 0.0
    for i in range(size):
        for j in range(size):
            vectors[i, j] = 1.0 if i == j else 0.0
            largest = max(largest, abs(a[i, j]))
    for _ in range(_SWEEPS):
        is_done = True
        for p in range(size):
            for q in range(p + 1, size):
                if abs(a[p, q]) > _NEGLIGIBLE * largest:
                    _rotate(a, vectors, p, q, size)
                    is_done = False
        if is_done:
            return
