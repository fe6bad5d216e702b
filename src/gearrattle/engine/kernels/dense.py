"""Small dense matrices in plain loops: products, norms, and linear systems with partial pivoting.

Matrices are pages of a stack (see ``bench``), larger than what is meant: the sizes say how much of them counts. Every
operation is rounded by itself (``strict``), so results do not depend on what a loop was compiled into.
"""

from __future__ import annotations

from gearrattle.engine.kernels._jit import strict
from gearrattle.engine.kernels.bench import COLUMNS, PIVOTS, SYSTEM


@strict
def times(work, factor, a, a0, b, rows, columns, out, out0):
    """Page out, from row out0 on = factor times rows a0 ... of page a, times page b (columns, columns).

    What is written is none of what is read.
    """
    for i in range(rows):
        for j in range(columns):
            work[out, out0 + i, j] = 0.0
        for k in range(columns):
            weight = factor * work[a, a0 + i, k]
            if weight != 0.0:
                for j in range(columns):
                    work[out, out0 + i, j] += weight * work[b, k, j]


@strict
def copy_rows(work, source, first, rows, columns, out):
    """Page out = rows first ... of another."""
    for i in range(rows):
        for j in range(columns):
            work[out, i, j] = work[source, first + i, j]


@strict
def norm_of_columns(work, page, size):
    """Largest sum of moduli of a column; nan if there is one."""
    largest = 0.0
    for j in range(size):
        total = 0.0
        for i in range(size):
            total += abs(work[page, i, j])
        if not total <= largest:
            largest = total
    return largest


@strict
def factorise(waves, marks, size):
    """P a = L U in place, on the page ``SYSTEM``; False where a pivot is zero."""
    for j in range(size):
        best, largest = j, -1.0
        for i in range(j, size):
            modulus = abs(waves[SYSTEM, i, j].real) + abs(waves[SYSTEM, i, j].imag)
            if modulus > largest:
                best, largest = i, modulus
        marks[PIVOTS, j] = best
        if not largest > 0.0:
            return False
        if best != j:
            for k in range(size):
                kept = waves[SYSTEM, j, k]
                waves[SYSTEM, j, k] = waves[SYSTEM, best, k]
                waves[SYSTEM, best, k] = kept
        inverse = 1.0 / waves[SYSTEM, j, j]
        for i in range(j + 1, size):
            if waves[SYSTEM, i, j] != 0.0:
                weight = waves[SYSTEM, i, j] * inverse
                waves[SYSTEM, i, j] = weight
                for k in range(j + 1, size):
                    waves[SYSTEM, i, k] -= weight * waves[SYSTEM, j, k]
    return True


@strict
def substitute(waves, marks, size, x):
    """Solve with the factors, in place: row x of the page ``COLUMNS``."""
    for j in range(size):
        best, kept = marks[PIVOTS, j], waves[COLUMNS, x, j]
        waves[COLUMNS, x, j] = waves[COLUMNS, x, best]
        waves[COLUMNS, x, best] = kept
    for i in range(size):
        for j in range(i):
            waves[COLUMNS, x, i] -= waves[SYSTEM, i, j] * waves[COLUMNS, x, j]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            waves[COLUMNS, x, i] -= waves[SYSTEM, i, j] * waves[COLUMNS, x, j]
        waves[COLUMNS, x, i] = waves[COLUMNS, x, i] / waves[SYSTEM, i, i]
