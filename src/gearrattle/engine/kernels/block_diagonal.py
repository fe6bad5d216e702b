"""Block diagonalisation of a triangular matrix with well-conditioned transformations (Bavely and Stewart, SIAM J.
Numer. Anal. 16 (1979) 359).

Eigenvectors are ill-conditioned where eigenvalues are close: rigid and free-flying parts (0 and -drag/J, a Jordan block
without drag), critical damping, an order on an undamped mode. Therefore invariant subspaces are split only while the
entries of the transformation stay small; the others stay together in an upper-triangular block. Exchanges of
eigenvalues follow LAPACK's ztrexc, Sylvester equations its ztrsyl.
"""

from __future__ import annotations

from math import sqrt

from gearrattle.engine.kernels._jit import strict
from gearrattle.engine.kernels.dense import TOP
from gearrattle.engine.kernels.memory_addresses import bounds_at, free_at, modes_at
from gearrattle.engine.kernels.workspace import ELIMINATION

_ROUNDING = 2.0**-52  # share of the largest entry
_SMALLEST = 1e-290  # least value of the largest entry


@strict
def eliminate(modes, x, begin, end, size):
    """Solve T11 X - X T22 = -T12, which splits rows [begin, end) from later ones; return False if an X_ij is large."""
    # least difference of two eigenvalues: rounding of the largest entry
    most = _SMALLEST
    for i in range(begin, size):
        for j in range(i, end if i < end else size):
            most = max(most, abs(modes.triangle[i, j].real), abs(modes.triangle[i, j].imag))
    least = _ROUNDING * most
    for column in range(end, size):
        for i in range(end - 1, begin - 1, -1):
            # every column from its last row upwards
            total = -modes.triangle[i, column]
            for j in range(i + 1, end):
                total -= modes.triangle[i, j] * x[j, column]
            for j in range(end, column):
                total += x[i, j] * modes.triangle[j, column]
            apart = modes.triangle[i, i] - modes.triangle[column, column]
            if abs(apart.real) + abs(apart.imag) <= least:
                apart = complex(least, 0.0)
            # a large entry: the splitting would be ill-conditioned
            entry = total / apart
            if not entry.real * entry.real + entry.imag * entry.imag <= ELIMINATION * ELIMINATION:
                return False
            x[i, column] = entry
    return True


@strict
def swap(modes, k, begin, size):
    """Exchange the eigenvalues k and k + 1 by a rotation of the rows from ``begin`` on."""
    # the rotation that exchanges them
    f = modes.triangle[k, k + 1]
    g = modes.triangle[k + 1, k + 1] - modes.triangle[k, k]
    f2 = f.real * f.real + f.imag * f.imag
    g2 = g.real * g.real + g.imag * g.imag
    if g2 == 0.0:
        c = 1.0
        s = complex(0.0, 0.0)
    elif f2 == 0.0:
        c = 0.0
        s = g.conjugate() / sqrt(g2)
    else:
        length = sqrt(f2 + g2)
        c = sqrt(f2) / length
        s = (f / sqrt(f2)) * (g.conjugate() / length)
    bar = s.conjugate()
    # rows and columns of T
    for j in range(k + 2, size):
        x, y = modes.triangle[k, j], modes.triangle[k + 1, j]
        modes.triangle[k, j] = c * x + s * y
        modes.triangle[k + 1, j] = c * y - bar * x
    for i in range(begin, k):
        x, y = modes.triangle[i, k], modes.triangle[i, k + 1]
        modes.triangle[i, k] = c * x + bar * y
        modes.triangle[i, k + 1] = c * y - s * x
    modes.triangle[k, k], modes.triangle[k + 1, k + 1] = modes.triangle[k + 1, k + 1], modes.triangle[k, k]
    # columns of V and rows of V^-1
    for i in range(size):
        x, y = modes.right[i, k], modes.right[i, k + 1]
        modes.right[i, k] = c * x + bar * y
        modes.right[i, k + 1] = c * y - s * x
        x, y = modes.left[k, i], modes.left[k + 1, i]
        modes.left[k, i] = c * x + s * y
        modes.left[k + 1, i] = c * y - bar * x


@strict
def _split(modes, x, begin, end, size):
    """Apply the transformation X."""
    for i in range(begin, end):
        for j in range(end, size):
            entry = x[i, j]
            modes.triangle[i, j] = 0.0
            if entry != 0.0:
                for k in range(size):
                    modes.right[k, j] += modes.right[k, i] * entry
                    modes.left[i, k] -= entry * modes.left[j, k]


@strict
def _is_coupled(triangle, begin, end, size):
    for i in range(begin, end):
        for j in range(end, size):
            if triangle[i, j] != 0.0:
                return True
    return False


@strict
def block_diagonalise(workspace):
    """Split M = right T left, T upper triangular, into blocks, in place.

    workspace: see ``memory_addresses``; T, V^-1 and V are changed, the begins of blocks are written, the rows of the
    bounds are scratch. Return the number of blocks.
    """
    free = free_at(workspace)
    modes = modes_at(workspace)
    bounds = bounds_at(workspace)
    size = free.chained[0]
    count = TOP
    begin = TOP
    end = TOP
    modes.begins[0] = 0
    while begin < size:
        # a block begins with one eigenvalue and grows until it can be split off
        end = begin + 1
        while end < size and _is_coupled(modes.triangle, begin, end, size):
            if eliminate(modes, bounds.rows, begin, end, size):
                _split(modes, bounds.rows, begin, end, size)
                break
            # ill-conditioned: the eigenvalue nearest to the mean of the block is added to it
            centre = complex(0.0, 0.0)
            for i in range(begin, end):
                centre += modes.triangle[i, i] / (end - begin)
            nearest = end
            least = -1.0
            for i in range(end, size):
                apart = modes.triangle[i, i] - centre
                square = apart.real * apart.real + apart.imag * apart.imag
                if least < 0.0 or square < least:
                    nearest = TOP + i
                    least = square
            for k in range(nearest - 1, end - 1, -1):
                swap(modes, k, begin, size)
            end += 1
        count += 1
        modes.begins[count] = end
        begin = end
    return count
