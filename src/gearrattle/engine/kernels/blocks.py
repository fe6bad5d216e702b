"""Block diagonalisation of a triangular matrix with well-conditioned transformations (Bavely and Stewart, SIAM J.
Numer. Anal. 16 (1979) 359).

Eigenvectors of a driveline are useless where eigenvalues meet: rigid and free-flying parts (0 and -drag/J, a Jordan
block without drag), critical damping, an order on an undamped mode. Here invariant subspaces are split only as long
as the splitting transformation stays small; what cannot be split stays together in one upper-triangular block.
Swaps are LAPACK's ztrexc, Sylvester equations its ztrsyl.
"""

from __future__ import annotations

from math import sqrt

from gearrattle.engine.kernels._jit import strict, strict_entry
from gearrattle.engine.kernels.bench import BOUNDS, CHAIN, LEFT, PIVOTS, RIGHT, SIZES, TOP, TRIANGLE, WIDTH

_ROUNDING = 2.0**-52
_SMALLEST = 1e-290


@strict
def eliminate(waves, begin, end, size, largest):
    """Solve T11 X - X T22 = -T12 for what splits rows [begin, end) from those behind; False where an X_ij is large."""
    most = _SMALLEST
    for i in range(begin, size):
        for j in range(i, end if i < end else size):
            most = max(most, abs(waves[TRIANGLE, i, j].real), abs(waves[TRIANGLE, i, j].imag))
    least = _ROUNDING * most
    for column in range(end, size):
        for i in range(end - 1, begin - 1, -1):
            total = -waves[TRIANGLE, i, column]
            for j in range(i + 1, end):
                total -= waves[TRIANGLE, i, j] * waves[BOUNDS, j, column]
            for j in range(end, column):
                total += waves[BOUNDS, i, j] * waves[TRIANGLE, j, column]
            apart = waves[TRIANGLE, i, i] - waves[TRIANGLE, column, column]
            if abs(apart.real) + abs(apart.imag) <= least:
                apart = complex(least, 0.0)
            x = total / apart
            if not x.real * x.real + x.imag * x.imag <= largest * largest:
                return False
            waves[BOUNDS, i, column] = x
    return True


@strict
def swap(waves, k, begin, size):
    """Exchange the eigenvalues k and k + 1 by a rotation; rows from ``begin`` on take part."""
    f, g = waves[TRIANGLE, k, k + 1], waves[TRIANGLE, k + 1, k + 1] - waves[TRIANGLE, k, k]
    f2, g2 = f.real * f.real + f.imag * f.imag, g.real * g.real + g.imag * g.imag
    if g2 == 0.0:
        c, s = 1.0, complex(0.0, 0.0)
    elif f2 == 0.0:
        c, s = 0.0, g.conjugate() / sqrt(g2)
    else:
        length = sqrt(f2 + g2)
        c = sqrt(f2) / length
        s = (f / sqrt(f2)) * (g.conjugate() / length)
    bar = s.conjugate()
    for j in range(k + 2, size):
        x, y = waves[TRIANGLE, k, j], waves[TRIANGLE, k + 1, j]
        waves[TRIANGLE, k, j], waves[TRIANGLE, k + 1, j] = c * x + s * y, c * y - bar * x
    for i in range(begin, k):
        x, y = waves[TRIANGLE, i, k], waves[TRIANGLE, i, k + 1]
        waves[TRIANGLE, i, k], waves[TRIANGLE, i, k + 1] = c * x + bar * y, c * y - s * x
    waves[TRIANGLE, k, k], waves[TRIANGLE, k + 1, k + 1] = waves[TRIANGLE, k + 1, k + 1], waves[TRIANGLE, k, k]
    for i in range(size):
        x, y = waves[RIGHT, i, k], waves[RIGHT, i, k + 1]
        waves[RIGHT, i, k], waves[RIGHT, i, k + 1] = c * x + bar * y, c * y - s * x
        x, y = waves[LEFT, k, i], waves[LEFT, k + 1, i]
        waves[LEFT, k, i], waves[LEFT, k + 1, i] = c * x + s * y, c * y - bar * x


@strict
def _split(waves, begin, end, size):
    """Carry an elimination out."""
    for i in range(begin, end):
        for j in range(end, size):
            x = waves[BOUNDS, i, j]
            waves[TRIANGLE, i, j] = 0.0
            if x != 0.0:
                for k in range(size):
                    waves[RIGHT, k, j] += waves[RIGHT, k, i] * x
                    waves[LEFT, i, k] -= x * waves[LEFT, j, k]


@strict
def _is_coupled(waves, begin, end, size):
    for i in range(begin, end):
        for j in range(end, size):
            if waves[TRIANGLE, i, j] != 0.0:
                return True
    return False


@strict_entry
def block_diagonalise(waves, marks, largest):
    """Split M = right T left, T upper triangular, into blocks, in place.

    Args:
        waves: its pages ``TRIANGLE``, ``LEFT`` and ``RIGHT`` are T, V^-1 and V; ``BOUNDS`` is scratch.
        marks: where every block begins, and the end of the last, is written into ``PIVOTS``; T is as large as y without
            chains.
        largest: bound on the entries of every elimination; larger means more, but worse conditioned, blocks.

    Returns:
        the number of blocks.
    """
    size, count, begin, end = marks[SIZES, WIDTH] - marks[SIZES, CHAIN], TOP, TOP, TOP
    marks[PIVOTS, 0] = 0
    while begin < size:
        end = begin + 1
        while end < size and _is_coupled(waves, begin, end, size):
            if eliminate(waves, begin, end, size, largest):
                _split(waves, begin, end, size)
                break
            centre = complex(0.0, 0.0)
            for i in range(begin, end):
                centre += waves[TRIANGLE, i, i] / (end - begin)
            nearest, least = end, -1.0
            for i in range(end, size):
                apart = waves[TRIANGLE, i, i] - centre
                square = apart.real * apart.real + apart.imag * apart.imag
                if least < 0.0 or square < least:
                    nearest, least = TOP + i, square
            for k in range(nearest - 1, end - 1, -1):
                swap(waves, k, begin, size)
            end += 1
        count += 1
        marks[PIVOTS, count] = end
        begin = end
    return count
