"""Where the kernel that builds regions works: stacks of pages, and what stands on which.

A compiled function that is handed dozens of arrays takes seconds to compile, so there are four: ``work`` (pages, rows,
columns) of floats, ``waves`` the same of complex numbers, ``laws`` and ``marks``. The pages up to ``VECTORS`` hold what
a driveline's regions have in common (written by ``system.building``); those behind it are written anew by every region.

m elements, n inertias, r deflections that are states, S memories, N = r + n + S states, U = 1 + 2 H inputs, Q entries
of chains, Z = N + U + Q, K clearances, W = K + companions watched, R reference angles, C = R + K carried quantities, Y
the length of y, J rows of bounds.
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
INERTIA, PACE, CORNER_SCALE, FREQUENCY, AMPLITUDE, INPUT_SIZE, LIMITS, MEMORY_SCALE = _numbers(8)
"""Rows of the page ``VECTORS``: (n,); (n,) T times the scale of every velocity; (W,); (H,) radians a period; (1 + H,);
(U,) the amplitude of every input; the limits below; of every companion's memory."""
PERIOD, MOST, MOST_SEEN, FAST, FAST_ROUNDING, CHAIN_PACE, HORIZON = _numbers(7)
"""Limits: T [s]; the largest state and the largest deflection up to which a particular solution is used; modes beyond
so many radians a period are fast; what the bound on them gets for rounding, in corner scales; the pace of chains; how
long bounds must hold, in periods."""

FORCES, ACCELERATION, MATRIX, PASSED, WATCHED_ALL = _numbers(9, 14)
"""(m, Z); (n, Z); (N, Z) A and G; (C, Z) rates of the carried quantities; (3 W, Z) what is watched, its first and
second derivatives."""
RATES, GENERATOR, WATCHED, CALM = _numbers(14, 18)
"""(C + Y, Y) rates of the carried quantities and of y; (Y, Y) of y alone; (4 W, Y) what is watched and three
derivatives; the same without the fast modes."""
PARTICULAR, FORCED, FLOWING, INTEGRAL = _numbers(18, 22)
"""(N, U) P; (4 W, U) what the inputs split off make of what is watched, and three derivatives; (C, U) of the carried
quantities, and their integral."""
WEIGHTS, PART, FOUND, PUSHED, FOLLOWED = _numbers(22, 27)
"""(3 W, J) of the bounds; (W, Y) the fast modes' part of what is watched; the rows below; (3 W, Q) of the bounds, on
what chains drive; (W, Q) what the deflections follow of chains."""
OFFSETS, KEPT_AMPLITUDE, TURNING = _numbers(3)
"""Rows of the page ``FOUND``: (3 W,) constants of the bounds; of the kept constant and harmonics; (ORDER + 1,) the
largest Taylor coefficient of every order."""
ONE, TWO, THREE, FOUR, PAGES = _numbers(27, 32)
"""Scratch."""

TRIANGLE, LEFT, RIGHT, BOUNDS, SCHUR, BASIS, SYSTEM, COLUMNS, WAVES = _numbers(9)
"""Pages of ``waves``: T, V^-1, V; (J, Y) rows of the bounds; (N, N) Schur form of A and its vectors, transposed; a
linear system; the vectors below."""
FORCE, SOLUTION, LEFT_OVER = _numbers(3)
"""Rows of the page ``COLUMNS``."""

STIFFNESS, DAMPING, OFFSET, LOWER, UPPER, BY_MEMORY, MOVES, BY_DEFLECTION, BY_RATE, BY_ITSELF, LAWS = _numbers(11)
"""Rows of ``laws``, over all pieces of all elements, then of all companions: the offset over the constant input's
scale; the bounds around; of companions alone: the force for a unit of memory, whether that moves, and what of the
deflection, its rate and the memory is watched."""

SIZES, PIECES, FIRST_PIECE, CLEARANCES, CORNERED, COLUMN, KEPT, PIVOTS, SIMPLE, PARENT, MEMORY, MARKS = _numbers(12)
"""Rows of ``marks``: the sizes below; (m + companions,) pieces of the region to build; where an element's or
companion's begin in ``laws``, and where the last end; (K,) elements; (K,) whether one has a corner off zero; (Y,) which
of z stand in y; (U,) whether one is kept; where blocks begin, or pivots; simple modes; of every companion its element,
and its memory's place among the states, -1 without."""
ELEMENT_COUNT, INERTIA_COUNT, STATES, WATCHED_COUNT, REFERENCE_COUNT, HARMONICS = _numbers(6)
LEAST, DEEPEST, CLEARANCE_COUNT, DEFLECTIONS, CHAIN, LINKS, WIDTH, MODES, FINE = _numbers(6, 15)
"""Sizes: m, n, N, W, R, H; the finest step's least and largest level; K, r, Q, D + 1; then found: Y, J, its level."""

SLACK = 1.0 + 1e-6
"""Covers the rounding of a region's decomposition."""
TOP = np.int64(0)
"""The first row of a page."""
POWERS = 4  # of the generator, for the Taylor window
