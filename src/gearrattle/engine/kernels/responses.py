"""Particular solutions: (i w - A) p = g for every input, and which inputs are kept (see ``system.forced``).

A solution is refined once with a residual in twice the working precision (Ogita, Rump and Oishi, SIAM J. Sci. Comput.
26 (2005) 1955, algorithm 5.3; products split after Veltkamp and Dekker). Arrays: see ``bench``.
"""

from __future__ import annotations

from math import sqrt

from gearrattle.engine.kernels._jit import strict, strict_entry
from gearrattle.engine.kernels.bench import (
    AMPLITUDE,
    CLEARANCE_COUNT,
    CLEARANCES,
    COLUMNS,
    CORNER_SCALE,
    CORNERED,
    DEFLECTION,
    ELEMENT_COUNT,
    FIRST_PIECE,
    FORCE,
    FREQUENCY,
    HARMONICS,
    KEPT,
    LEFT_OVER,
    LIMITS,
    MATRIX,
    MOST,
    MOST_SEEN,
    PARTICULAR,
    PIECES,
    SIZES,
    SOLUTION,
    STATES,
    STIFFNESS,
    SYSTEM,
    VECTORS,
    WATCHED_ALL,
    WATCHED_COUNT,
)
from gearrattle.engine.kernels.dense import factorise, substitute

_SPLITTER = 134217729.0  # 2^27 + 1
SOLVED = 1e-9
"""Largest residual of a solution, of its force; a singular matrix may pass for a regular one."""


@strict
def add_product(total, rest, a, b):
    """(total, rest) + a b, exact but for the rounding of ``rest``."""
    p = a * b
    t = _SPLITTER * a
    a1 = t - (t - a)
    a2 = a - a1
    t = _SPLITTER * b
    b1 = t - (t - b)
    b2 = b - b1
    e = a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2)
    s = total + p
    z = s - total
    return s, rest + (((total - (s - z)) + (p - z)) + e)


@strict
def modulus(z):
    """|z| of numbers whose squares neither overflow nor vanish."""
    return sqrt(z.real * z.real + z.imag * z.imag)


@strict
def residual(work, waves, size, w):
    """Row ``LEFT_OVER`` = g - (i w - A) x; its largest modulus."""
    largest = 0.0
    for i in range(size):
        g, x = waves[COLUMNS, FORCE, i], waves[COLUMNS, SOLUTION, i]
        re, im, re_rest, im_rest = g.real, g.imag, 0.0, 0.0
        re, re_rest = add_product(re, re_rest, w, x.imag)
        im, im_rest = add_product(im, im_rest, -w, x.real)
        for j in range(size):
            a, x = work[MATRIX, i, j], waves[COLUMNS, SOLUTION, j]
            if a != 0.0:
                re, re_rest = add_product(re, re_rest, a, x.real)
                im, im_rest = add_product(im, im_rest, a, x.imag)
        left = complex(re + re_rest, im + im_rest)
        waves[COLUMNS, LEFT_OVER, i] = left
        if not modulus(left) <= largest:
            largest = modulus(left)
    return largest


@strict
def respond(work, waves, marks, size, w):
    """Write the solution for the force at w; False where there is none."""
    pushed = 0.0
    for i in range(size):
        for j in range(size):
            waves[SYSTEM, i, j] = complex(-work[MATRIX, i, j], w if i == j else 0.0)
        waves[COLUMNS, SOLUTION, i] = waves[COLUMNS, FORCE, i]
        pushed = max(pushed, modulus(waves[COLUMNS, FORCE, i]))
    if not factorise(waves, marks, size):
        return False
    substitute(waves, marks, size, SOLUTION)
    residual(work, waves, size, w)
    substitute(waves, marks, size, LEFT_OVER)
    for i in range(size):
        waves[COLUMNS, SOLUTION, i] += waves[COLUMNS, LEFT_OVER, i]
    return residual(work, waves, size, w) <= SOLVED * pushed


@strict
def push(work, waves, marks, j):
    """Write the force of input j, constant or harmonic, on the states; whether there is one. No solution yet."""
    size, count, is_pushed = marks[SIZES, STATES], marks[SIZES, HARMONICS], False
    for i in range(size):
        sine = work[MATRIX, i, size + j + count] if j > 0 else 0.0
        force = complex(work[MATRIX, i, size + j], -sine)
        waves[COLUMNS, FORCE, i] = force
        waves[COLUMNS, SOLUTION, i] = 0.0
        is_pushed = is_pushed or force != 0.0
    return is_pushed


@strict_entry
def stiffest(laws, marks):
    """Put every element into its stiffest piece, the lowest of several."""
    for k in range(marks[SIZES, ELEMENT_COUNT]):
        begin, most = marks[FIRST_PIECE, k], 0
        for p in range(marks[FIRST_PIECE, k + 1] - begin):
            if laws[STIFFNESS, begin + p] > laws[STIFFNESS, begin + most]:
                most = p
        marks[PIECES, k] = most


@strict_entry
def typical(work, waves, marks):
    """Size of the scaled states in an ordinary motion, of the rates on the page ``MATRIX``.

    What fills a clearance, and what the inputs make of the stiffest combination of pieces, in a period at most.
    """
    size, largest, width = marks[SIZES, STATES], 0.0, marks[SIZES, STATES] + 1 + 2 * marks[SIZES, HARMONICS]
    for j in range(1 + marks[SIZES, HARMONICS]):
        w, reached = 0.0, 0.0
        if j > 0:
            w = work[VECTORS, FREQUENCY, j - 1]
        for i in range(size):
            reached = max(reached, abs(work[MATRIX, i, size + j]))
        if not push(work, waves, marks, j):
            reached = 0.0
        elif respond(work, waves, marks, size, w):
            made = 0.0
            for i in range(size):
                made = max(made, modulus(waves[COLUMNS, SOLUTION, i]))
            reached = min(reached, made)
        largest = max(largest, reached * work[VECTORS, AMPLITUDE, j])
    for k in range(marks[SIZES, CLEARANCE_COUNT]):
        moved = 0.0
        for j in range(width):
            moved = max(moved, abs(work[DEFLECTION, marks[CLEARANCES, k], j]))
        if marks[CORNERED, k]:
            largest = max(largest, work[VECTORS, CORNER_SCALE, k] / moved)
    return largest if largest > 0.0 else 1.0


@strict_entry
def split_inputs(work, waves, marks):
    """Solve for P, input by input, and mark those whose particular solution is too large: they are kept."""
    size, count = marks[SIZES, STATES], marks[SIZES, HARMONICS]
    most, most_seen = work[VECTORS, LIMITS, MOST], work[VECTORS, LIMITS, MOST_SEEN]
    for j in range(1 + count):
        w, amplitude = 0.0, work[VECTORS, AMPLITUDE, j]
        if j > 0:
            w = work[VECTORS, FREQUENCY, j - 1]
        keep = push(work, waves, marks, j) and not respond(work, waves, marks, size, w)
        for i in range(size):
            keep = keep or not modulus(waves[COLUMNS, SOLUTION, i]) * amplitude <= most
        for k in range(marks[SIZES, WATCHED_COUNT]):
            seen = complex(0.0, 0.0)
            for i in range(size):
                seen += work[WATCHED_ALL, k, i] * waves[COLUMNS, SOLUTION, i]
            keep = keep or not modulus(seen) * amplitude <= most_seen
        marks[KEPT, j] = keep
        for i in range(size):
            work[PARTICULAR, i, j] = 0.0 if keep else waves[COLUMNS, SOLUTION, i].real
        if j > 0:
            marks[KEPT, j + count] = keep
            for i in range(size):
                work[PARTICULAR, i, j + count] = 0.0 if keep else -waves[COLUMNS, SOLUTION, i].imag
