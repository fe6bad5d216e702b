"""Where the kernel that builds regions works: stacks of pages, and what stands on which.

A compiled function that is handed dozens of arrays takes seconds to compile, so there are four: ``work`` (pages, rows,
columns) of floats, ``waves`` the same of complex numbers, ``laws`` and ``marks``. The pages up to ``VECTORS`` hold what
a driveline's regions have in common (written by ``system.building``); those behind it are written anew by every region.

m elements, n inertias, r deflections that are states, N = r + n states, U = 1 + 2 H inputs, Z = N + U, K clearances,
R reference angles, C = R + K carried quantities, Y the length of y, J rows of bounds.
"""

from __future__ import annotations

import numpy as np


def _numbers(*bounds: int) -> map[np.int64]:
    """A range of numbers that a compiled function takes as they come: one made for each would compile for ever."""
    return map(np.int64, range(*bounds))


MOTION, BALANCE, ELEMENTS, DEFLECTION, RATE, REFERENCES, SEEN, CURVATURE, VECTORS = _numbers(9)
"""Pages of ``work``: (r, Z) rates of the deflections that are states; (n, Z) torques less drag; (m, n) W; (m, Z)
deflections and rates; (R, Z) rates of the reference angles; (2 K, Z) deflections and rates of the clearances in corner
scales; (K, Z) their e'' [SI]; the vectors below."""
INERTIA, PACE, CORNER_SCALE, FREQUENCY, AMPLITUDE, INPUT_SIZE, LIMITS = _numbers(7)
"""Rows of the page ``VECTORS``: (n,); (n,) T times the scale of every velocity; (K,); (H,) radians a period; (1 + H,);
(U,) the amplitude of every input; the limits below."""
PERIOD, MOST, MOST_SEEN, FAST, FAST_ROUNDING = _numbers(5)
"""Limits: T [s]; the largest state and the largest deflection up to which a particular solution is used; modes beyond
so many radians a period are fast; what the bound on them gets for rounding, in corner scales."""

FORCES, ACCELERATION, MATRIX, PASSED, WATCHED_ALL = _numbers(9, 14)
"""(m, Z); (n, Z); (N, Z) A and G; (C, Z) rates of the carried quantities; (3 K, Z) deflections, rates, curvatures."""
RATES, GENERATOR, WATCHED, CALM = _numbers(14, 18)
"""(C + Y, Y) rates of the carried quantities and of y; (Y, Y) of y alone; (4 K, Y) deflections and three derivatives;
the same without the fast modes."""
PARTICULAR, FORCED, FLOWING, INTEGRAL = _numbers(18, 22)
"""(N, U) P; (4 K, U) what the inputs split off make of the deflections, and three derivatives; (C, U) of the carried
quantities, and their integral."""
WEIGHTS, PART, FOUND = _numbers(22, 25)
"""(3 K, J) of the bounds; (K, Y) the fast modes' part of the deflections; the rows below."""
OFFSETS, KEPT_AMPLITUDE, TURNING = _numbers(3)
"""Rows of the page ``FOUND``: (3 K,) constants of the bounds; of the kept constant and harmonics; (ORDER + 1,) the
largest Taylor coefficient of every order."""
ONE, TWO, THREE, FOUR, PAGES = _numbers(25, 30)
"""Scratch."""

TRIANGLE, LEFT, RIGHT, BOUNDS, SCHUR, BASIS, SYSTEM, COLUMNS, WAVES = _numbers(9)
"""Pages of ``waves``: T, V^-1, V; (J, Y) rows of the bounds; (N, N) Schur form of A and its vectors, transposed; a
linear system; the vectors below."""
FORCE, SOLUTION, LEFT_OVER = _numbers(3)
"""Rows of the page ``COLUMNS``."""

STIFFNESS, DAMPING, OFFSET, LOWER, UPPER = _numbers(5)
"""Rows of ``laws``, over all pieces of all elements: the offset over the constant input's scale, the corners around."""

SIZES, PIECES, FIRST_PIECE, CLEARANCES, CORNERED, COLUMN, KEPT, PIVOTS, SIMPLE, MARKS = _numbers(10)
"""Rows of ``marks``: the sizes below; (m,) pieces of the region to build; (m + 1,) where an element's
begin in ``laws``; (K,) elements; (K,) whether one has a corner off zero; (Y,) which of z stand in y; (U,) whether one
is kept; where blocks begin, or pivots; simple modes."""
ELEMENT_COUNT, INERTIA_COUNT, STATES, WATCHED_COUNT, REFERENCE_COUNT, HARMONICS = _numbers(6)
LEAST, DEEPEST, WIDTH, MODES, FINE = _numbers(6, 11)
"""Sizes: m, n, N, K, R, H; the finest step's least and largest level; then found: Y, J, its level."""

TOP = np.int64(0)
"""The first row of a page."""
POWERS = 4  # of the generator, for the Taylor window
