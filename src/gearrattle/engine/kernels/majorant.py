"""Bounds on every clearance's deflection for as long as a region lasts (the derivation is in ``system.majorant``).

Takes the generator of a region over y = (states, kept inputs) and the Schur form of its states' part; writes rows,
weights and constants of the bounds.
"""

from __future__ import annotations

from math import ceil, exp, log2, sqrt

from gearrattle.engine.kernels._jit import strict, strict_entry
from gearrattle.engine.kernels.bench import (
    AMPLITUDE,
    BASIS,
    BOUNDS,
    CALM,
    CHAIN,
    FAST,
    FAST_ROUNDING,
    FORCED,
    FOUND,
    FOUR,
    FREQUENCY,
    GENERATOR,
    HARMONICS,
    HORIZON,
    KEPT,
    KEPT_AMPLITUDE,
    LEFT,
    LIMITS,
    MODES,
    OFFSETS,
    ONE,
    PART,
    RIGHT,
    SCHUR,
    SIMPLE,
    SIZES,
    SLACK,
    STATES,
    THREE,
    TOP,
    TRIANGLE,
    TWO,
    VECTORS,
    WATCHED,
    WATCHED_COUNT,
    WEIGHTS,
    WIDTH,
)  # fmt: skip
from gearrattle.engine.kernels.dense import copy_rows, norm_of_columns, times
from gearrattle.engine.kernels.pushes import add_push, begin_pushes, finish_pushes, push, shape
from gearrattle.engine.kernels.responses import modulus

_HALF = sqrt(0.5)
_SAME = 1e-9  # of their size: eigenvalues this near count as one


@strict_entry
def triangular_form(work, waves, marks):
    """Complex Schur form of M = [A G; 0 S] with its vectors: Schur of A, known eigenvectors of S; chains stay outside.

    M = ``GENERATOR`` = V T V^-1: T is written on the page ``TRIANGLE``, V on ``RIGHT``, V^-1 on ``LEFT``.
    """
    n, constant = marks[SIZES, STATES], marks[KEPT, 0]
    width = chained = marks[SIZES, WIDTH] - marks[SIZES, CHAIN]
    for i in range(width):
        for j in range(width):
            waves[TRIANGLE, i, j] = waves[RIGHT, i, j] = 0.0
    for i in range(n):
        for j in range(n):
            waves[RIGHT, i, j] = waves[BASIS, j, i]
            if j >= i:
                waves[TRIANGLE, i, j] = waves[SCHUR, j, i]
    harmonics = (chained - n - constant) // 2
    if constant:
        waves[RIGHT, n, n] = 1.0
    for h in range(harmonics):
        c, s = n + constant + h, n + constant + harmonics + h
        w = work[GENERATOR, s, c]
        waves[RIGHT, c, c] = _HALF
        waves[RIGHT, c, s] = _HALF
        waves[RIGHT, s, c] = complex(0.0, -_HALF)
        waves[RIGHT, s, s] = complex(0.0, _HALF)
        waves[TRIANGLE, c, c] = complex(0.0, w)
        waves[TRIANGLE, s, s] = complex(0.0, -w)
    for i in range(width):
        for j in range(width):
            waves[LEFT, i, j] = waves[RIGHT, j, i].conjugate()
    for k in range(n):
        for j in range(n, width):
            pushed = complex(0.0, 0.0)
            for q in range(n, width):
                pushed += work[GENERATOR, k, q] * waves[RIGHT, q, j]
            for i in range(n):
                waves[TRIANGLE, i, j] += waves[LEFT, i, k] * pushed
    begin_pushes(work, marks)


@strict
def exponential(work, size):
    """Page ``ONE`` = exp of the matrix without negative entries there: Taylor at norm one half, squared up."""
    norm = norm_of_columns(work, ONE, size)
    squarings = max(0, int(ceil(log2(max(min(norm, 1e300), 1e-300)))) + 1)
    for i in range(size):
        for j in range(size):
            work[TWO, i, j] = 1.0 if i == j else 0.0
            work[THREE, i, j] = work[TWO, i, j]
    for order in range(1, 16):
        times(work, 1.0 / (order * 2.0**squarings), TWO, TOP, ONE, size, size, FOUR, TOP)
        copy_rows(work, FOUR, TOP, size, size, TWO)
        for i in range(size):
            for j in range(size):
                work[THREE, i, j] += work[TWO, i, j]
    for _ in range(squarings):
        times(work, 1.0, THREE, TOP, THREE, size, size, FOUR, TOP)
        copy_rows(work, FOUR, TOP, size, size, THREE)
    copy_rows(work, THREE, TOP, size, size, ONE)


@strict
def _multiplicity(waves, marks, i, width):
    """2 for a simple mode above the real axis whose conjugate is there too, 0 for that conjugate, else 1.

    A mode within rounding of the real axis is real: it is its own conjugate and counts once.
    """
    value = waves[TRIANGLE, i, i]
    near = _SAME * modulus(value)
    if not marks[SIMPLE, i] or not abs(value.imag) > near:
        return 1.0
    for j in range(width):
        if marks[SIMPLE, j] and modulus(value - waves[TRIANGLE, j, j].conjugate()) <= near:
            return 2.0 if value.imag > 0.0 else 0.0
    return 1.0


@strict
def _largest_of_inputs(work, waves, i, n, constant, chained):
    """Largest |row i . u| over all phases, summed over harmonics.

    max over phi of |p cos phi + q sin phi|^2 = (|p|^2 + |q|^2 + |p^2 + q^2|) / 2.
    """
    total = 0.0
    if constant:
        total = modulus(waves[BOUNDS, i, n]) * work[FOUND, KEPT_AMPLITUDE, 0]
    harmonics = (chained - n - constant) // 2
    for h in range(harmonics):
        p, q = waves[BOUNDS, i, n + constant + h], waves[BOUNDS, i, n + constant + harmonics + h]
        squares = p.real * p.real + p.imag * p.imag + q.real * q.real + q.imag * q.imag
        total += sqrt(0.5 * (squares + modulus(p * p + q * q))) * work[FOUND, KEPT_AMPLITUDE, constant + h]
    return total


@strict_entry
def weigh(work, waves, marks, a, b):
    """One block, [a, b): |delta_k V| exp(G horizon) in row k of ``WEIGHTS``, fourth derivatives in rows of ``BOUNDS``.

    G are the moduli of the entries above the diagonal and what grows on it. The rows are T^4 V^-1, and what chains add.
    """
    clearances, width = marks[SIZES, WATCHED_COUNT], marks[SIZES, WIDTH]
    chained = width - marks[SIZES, CHAIN]
    for i in range(a, b):
        marks[SIMPLE, i] = b - a == 1
        for j in range(a, b):
            size = modulus(waves[TRIANGLE, i, j]) if j > i else 0.0
            if j == i:
                size = max(waves[TRIANGLE, i, i].real, 0.0)
            work[ONE, i - a, j - a] = work[VECTORS, LIMITS, HORIZON] * size
    if b - a == 1:
        work[ONE, 0, 0] = exp(work[ONE, 0, 0])
    else:
        exponential(work, b - a)
    for k in range(clearances):
        for j in range(a, b):
            work[WEIGHTS, k, j] = 0.0
        for i in range(a, b):
            size = SLACK * modulus(shape(work, waves, k, i, chained))
            if size > 0.0:
                for j in range(a, b):
                    work[WEIGHTS, k, j] += size * work[ONE, i - a, j - a]
    if width > chained:
        push(work, waves, marks, a, b)
    for i in range(a, b):
        for j in range(width):
            waves[BOUNDS, i, j] = waves[LEFT, i, j]
    for passed in range(4):
        for i in range(a, b):
            for j in range(width):
                made = complex(0.0, 0.0)
                for q in range(i, b):
                    made += waves[TRIANGLE, i, q] * waves[BOUNDS, q, j]
                waves[BOUNDS, i, j] = made
            add_push(work, waves, marks, i, passed)


@strict
def _has_some(waves, page, i, begin, end):
    for j in range(begin, end):
        if waves[page, i, j] != 0.0:
            return True
    return False


@strict_entry
def gather(work, waves, marks):
    """Write the bounds of one region, whose blocks have been weighed.

    Written: ``WEIGHTS`` (3 K, J) on fourth derivatives, on the same without fast modes, on the fast modes; ``BOUNDS``
    (J, Y) their rows; ``OFFSETS`` (3 K,); ``PART`` (K, Y) the fast modes' part of every deflection; J.
    """
    n, width, constant, clearances = (
        marks[SIZES, STATES],
        marks[SIZES, WIDTH],
        marks[KEPT, 0],
        marks[SIZES, WATCHED_COUNT],
    )
    fast, chained = work[VECTORS, LIMITS, FAST], width - marks[SIZES, CHAIN]
    finish_pushes(work, marks)
    for k in range(clearances):
        for part in range(3):
            work[FOUND, OFFSETS, part * clearances + k] = 0.0
        for j in range(width):
            work[PART, k, j] = 0.0
    count = 0
    for i in range(chained):
        how_often, speed, swift = _multiplicity(waves, marks, i, chained), modulus(waves[TRIANGLE, i, i]), 0.0
        is_free = not _has_some(waves, TRIANGLE, i, chained, width)
        if marks[SIMPLE, i] and speed > fast and is_free and _has_some(waves, LEFT, i, 0, n):
            swift = 1.0 / (speed * speed * speed * speed)
            for k in range(clearances):
                form = shape(work, waves, k, i, chained)
                for j in range(width):
                    work[PART, k, j] += (form * waves[LEFT, i, j]).real
        if not _has_some(waves, BOUNDS, i, 0, n) and not _has_some(waves, BOUNDS, i, chained, width):
            largest = _largest_of_inputs(work, waves, i, n, constant, chained)
            for k in range(clearances):
                more = how_often * work[WEIGHTS, k, i] * largest
                work[FOUND, OFFSETS, k] += more
                work[FOUND, OFFSETS, clearances + k] += more
            continue
        felt = False
        for k in range(clearances):
            w = how_often * work[WEIGHTS, k, i]
            felt = felt or w > 0.0
            work[WEIGHTS, k, count] = w
            work[WEIGHTS, clearances + k, count] = 0.0 if swift > 0.0 else w
            work[WEIGHTS, 2 * clearances + k, count] = w * swift
        if felt:
            for j in range(width):
                waves[BOUNDS, count, j] = waves[BOUNDS, i, j]
            count += 1
    marks[SIZES, MODES] = count


@strict_entry
def finish_bounds(work, marks):
    """Add the inputs split off and rounding to the constants; write what is watched without the fast modes."""
    count, clearances, width = marks[SIZES, HARMONICS], marks[SIZES, WATCHED_COUNT], marks[SIZES, WIDTH]
    for k in range(clearances):
        fourth = 0.0
        for h in range(count):
            c, s, w = work[FORCED, k, 1 + h], work[FORCED, k, 1 + count + h], work[VECTORS, FREQUENCY, h]
            fourth += w * w * w * w * sqrt(c * c + s * s) * work[VECTORS, AMPLITUDE, 1 + h]
        work[FOUND, OFFSETS, k] += SLACK * fourth
        work[FOUND, OFFSETS, clearances + k] += SLACK * fourth
        work[FOUND, OFFSETS, 2 * clearances + k] += SLACK * work[VECTORS, LIMITS, FAST_ROUNDING]
        for j in range(width):
            work[CALM, k, j] = work[WATCHED, k, j] - work[PART, k, j]
    for d in range(3):
        times(work, 1.0, CALM, d * clearances, GENERATOR, clearances, width, CALM, (d + 1) * clearances)
