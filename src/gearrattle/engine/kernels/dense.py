"""Small dense matrices in plain loops: products, norms, and linear systems with partial pivoting.

Arrays are larger than the matrices in them; the sizes are arguments. Every operation is rounded by itself (``strict``),
so results do not depend on the compiled form of a loop.
"""

from __future__ import annotations

import numpy as np

from gearrattle.engine.kernels._jit import strict

TOP = np.int64(0)
"""The first row of an array as an integer of 64 bits: a literal 0 is another type, compiled once more."""


@strict
def times(factor, a, first, b, rows, columns, out, out_first):
    """Rows out_first ... of out = factor times rows first ... of a, times b (columns, columns).

    ``out`` is neither ``a`` nor ``b``.
    """
    for i in range(rows):
        for j in range(columns):
            out[out_first + i, j] = 0.0
        for k in range(columns):
            weight = factor * a[first + i, k]
            if weight != 0.0:
                for j in range(columns):
                    out[out_first + i, j] += weight * b[k, j]


@strict
def times_chained(factor, a, first, b, rows, shape, out, out_first):
    """The product of ``times`` for a matrix b whose last columns are chains.

    factor, a, first, rows, out, out_first: as in ``times``.
    b: rows before the chains, then rows of the first chain; rows of the other chains are the same except for a shift.
    shape: number of columns, first column of the chains, links of a chain.
    """
    width, chained, links = shape
    for i in range(rows):
        for j in range(width):
            out[out_first + i, j] = 0.0
        for k in range(chained):
            weight = factor * a[first + i, k]
            if weight != 0.0:
                for j in range(width):
                    out[out_first + i, j] += weight * b[k, j]
        for begin in range(chained, width, links):
            for k in range(links):
                weight = factor * a[first + i, begin + k]
                if weight != 0.0:
                    for j in range(links):
                        out[out_first + i, begin + j] += weight * b[chained + k, chained + j]


@strict
def norm_of_chained_columns(matrix, shape):
    """Largest column sum of moduli of a matrix b of ``times_chained``; NaN if an entry is NaN."""
    width, chained, links = shape
    largest = 0.0
    for j in range(width):
        total = 0.0
        for i in range(chained):
            total += abs(matrix[i, j])
        if j >= chained:
            for i in range(links):
                total += abs(matrix[chained + i, chained + (j - chained) % links])
        if not total <= largest:
            largest = total
    return largest


@strict
def copy_rows(source, first, rows, columns, out):
    """out = rows first ... of ``source``."""
    for i in range(rows):
        for j in range(columns):
            out[i, j] = source[first + i, j]


@strict
def norm_of_columns(matrix, size):
    """Largest column sum of moduli; NaN if an entry is NaN."""
    largest = 0.0
    for j in range(size):
        total = 0.0
        for i in range(size):
            total += abs(matrix[i, j])
        if not total <= largest:
            largest = total
    return largest


@strict
def factorise(solver, size):
    """Factor ``solver.matrix`` in place, P a = L U; return False if a pivot is zero."""
    matrix = solver.matrix
    for j in range(size):
        # the pivot of the column; exchange of rows
        best = j
        largest = -1.0
        for i in range(j, size):
            modulus = abs(matrix[i, j].real) + abs(matrix[i, j].imag)
            if modulus > largest:
                best = i
                largest = modulus
        solver.pivots[j] = best
        if not largest > 0.0:
            return False
        if best != j:
            for k in range(size):
                kept = matrix[j, k]
                matrix[j, k] = matrix[best, k]
                matrix[best, k] = kept
        # elimination below the pivot
        inverse = 1.0 / matrix[j, j]
        for i in range(j + 1, size):
            if matrix[i, j] != 0.0:
                weight = matrix[i, j] * inverse
                matrix[i, j] = weight
                for k in range(j + 1, size):
                    matrix[i, k] -= weight * matrix[j, k]
    return True


@strict
def substitute(solver, size, x):
    """Solve with the factors, in place: x is the right side, then the solution."""
    matrix = solver.matrix
    for j in range(size):
        best = solver.pivots[j]
        kept = x[j]
        x[j] = x[best]
        x[best] = kept
    for i in range(size):
        for j in range(i):
            x[i] -= matrix[i, j] * x[j]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            x[i] -= matrix[i, j] * x[j]
        x[i] = x[i] / matrix[i, i]
