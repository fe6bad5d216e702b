"""The rates of a region over z and over y, and what the inputs split off do; stages of ``system.building``.

What stands where is on the page ``bench``.
"""

from __future__ import annotations

from gearrattle.engine.kernels._jit import strict, strict_entry
from gearrattle.engine.kernels.bench import (
    ACCELERATION,
    AMPLITUDE,
    BALANCE,
    BY_DEFLECTION,
    BY_ITSELF,
    BY_MEMORY,
    BY_RATE,
    CHAIN,
    CHAIN_PACE,
    CLEARANCE_COUNT,
    CLEARANCES,
    COLUMN,
    CORNER_SCALE,
    CURVATURE,
    DAMPING,
    DEFLECTION,
    DEFLECTIONS,
    ELEMENT_COUNT,
    ELEMENTS,
    FIRST_PIECE,
    FLOWING,
    FORCED,
    FORCES,
    FOUND,
    FREQUENCY,
    GENERATOR,
    HARMONICS,
    INERTIA,
    INERTIA_COUNT,
    INTEGRAL,
    KEPT,
    KEPT_AMPLITUDE,
    LIMITS,
    LINKS,
    MATRIX,
    MEMORY,
    MEMORY_SCALE,
    MOTION,
    MOVES,
    OFFSET,
    PACE,
    PARENT,
    PARTICULAR,
    PASSED,
    PERIOD,
    PIECES,
    RATE,
    RATES,
    REFERENCE_COUNT,
    REFERENCES,
    SCHUR,
    SEEN,
    SIZES,
    STATES,
    STIFFNESS,
    TOP,
    VECTORS,
    WATCHED,
    WATCHED_ALL,
    WATCHED_COUNT,
    WIDTH,
)  # fmt: skip
from gearrattle.engine.kernels.dense import copy_rows, times
from gearrattle.engine.kernels.strips import differentiate


@strict
def _width(marks):
    """Z."""
    return marks[SIZES, STATES] + 1 + 2 * marks[SIZES, HARMONICS] + marks[SIZES, CHAIN]


@strict
def _accompany(work, laws, marks, c, width):
    """Add a companion's force to its element's, and write the rate of its memory."""
    at = marks[SIZES, ELEMENT_COUNT] + c
    k, piece, memory = marks[PARENT, c], marks[FIRST_PIECE, at] + marks[PIECES, at], marks[MEMORY, c]
    stiffness, damping, scale = laws[STIFFNESS, piece], laws[DAMPING, piece], work[VECTORS, MEMORY_SCALE, c]
    for j in range(width):
        work[FORCES, k, j] += stiffness * work[DEFLECTION, k, j] + damping * work[RATE, k, j]
    work[FORCES, k, marks[SIZES, STATES]] += laws[OFFSET, piece]
    if memory >= 0:
        work[FORCES, k, memory] += laws[BY_MEMORY, piece] / scale
        pace = laws[MOVES, piece] * work[VECTORS, LIMITS, PERIOD] * scale
        for j in range(width):
            work[MATRIX, memory, j] = pace * work[RATE, k, j]


@strict_entry
def accelerate(work, laws, marks):
    """Forces and accelerations, and from them the rates of the states: rows over z. False if one is not finite."""
    m, n, states = marks[SIZES, ELEMENT_COUNT], marks[SIZES, INERTIA_COUNT], marks[SIZES, STATES]
    width, r, finite = _width(marks), marks[SIZES, DEFLECTIONS], True
    for k in range(m):
        piece = marks[FIRST_PIECE, k] + marks[PIECES, k]
        stiffness, damping = laws[STIFFNESS, piece], laws[DAMPING, piece]
        for j in range(width):
            work[FORCES, k, j] = stiffness * work[DEFLECTION, k, j] + damping * work[RATE, k, j]
        work[FORCES, k, states] += laws[OFFSET, piece]
    for c in range(marks[SIZES, WATCHED_COUNT] - marks[SIZES, CLEARANCE_COUNT]):
        _accompany(work, laws, marks, c, width)
    for j in range(width):
        for i in range(r):
            work[MATRIX, i, j] = work[MOTION, i, j]
        for i in range(n):
            total = work[BALANCE, i, j]
            for k in range(m):
                total -= work[ELEMENTS, k, i] * work[FORCES, k, j]
            work[ACCELERATION, i, j] = total / work[VECTORS, INERTIA, i]
            work[MATRIX, r + i, j] = work[VECTORS, PACE, i] * work[ACCELERATION, i, j]
            finite = finite and abs(work[MATRIX, r + i, j]) < 1e300
    return finite


@strict_entry
def look(work, laws, marks):
    """Rates of the carried quantities, and what is watched: rows over z."""
    n, clearances, watched = marks[SIZES, INERTIA_COUNT], marks[SIZES, CLEARANCE_COUNT], marks[SIZES, WATCHED_COUNT]
    references, period = marks[SIZES, REFERENCE_COUNT], work[VECTORS, LIMITS, PERIOD]
    width = _width(marks)
    copy_rows(work, REFERENCES, TOP, references, width, PASSED)
    for k in range(clearances):
        element, unit = marks[CLEARANCES, k], period * period / work[VECTORS, CORNER_SCALE, k]
        for j in range(width):
            work[PASSED, references + k, j] = period * work[FORCES, element, j]
            work[WATCHED_ALL, k, j] = work[SEEN, k, j]
            work[WATCHED_ALL, watched + k, j] = work[SEEN, clearances + k, j]
            second = -work[CURVATURE, k, j]
            for i in range(n):
                second += work[ELEMENTS, element, i] * work[ACCELERATION, i, j]
            work[WATCHED_ALL, 2 * watched + k, j] = second * unit
    for c in range(watched - clearances):
        _watch(work, laws, marks, c, clearances + c, width)


@strict
def _watch(work, laws, marks, c, row, width):
    """What a companion watches; its derivatives follow from the rates of y."""
    at, k, memory = marks[SIZES, ELEMENT_COUNT] + c, marks[PARENT, c], marks[MEMORY, c]
    piece, unit = marks[FIRST_PIECE, at] + marks[PIECES, at], 1.0 / work[VECTORS, CORNER_SCALE, row]
    of_deflection, of_rate = laws[BY_DEFLECTION, piece] * unit, laws[BY_RATE, piece] * unit
    for j in range(width):
        work[WATCHED_ALL, row, j] = of_deflection * work[DEFLECTION, k, j] + of_rate * work[RATE, k, j]
    if memory >= 0:
        work[WATCHED_ALL, row, memory] += laws[BY_ITSELF, piece] * unit / work[VECTORS, MEMORY_SCALE, c]


@strict
def _keep(work, marks):
    """Which of z stand in y, chains last, and the amplitudes of the oscillators among them; answers Y."""
    states, count = marks[SIZES, STATES], marks[SIZES, HARMONICS]
    width = states
    for i in range(states):
        marks[COLUMN, i] = i
    for j in range(1 + 2 * count):
        if marks[KEPT, j]:
            if j <= count:
                work[FOUND, KEPT_AMPLITUDE, width - states] = work[VECTORS, AMPLITUDE, j]
            marks[COLUMN, width] = states + j
            width += 1
    for j in range(marks[SIZES, CHAIN]):
        marks[COLUMN, width] = states + 1 + 2 * count + j
        width += 1
    return width


@strict
def _take(work, marks, page, count, width, out, first):
    """Columns of some rows."""
    for i in range(count):
        for j in range(width):
            work[out, first + i, j] = work[page, i, marks[COLUMN, j]]


@strict
def _force(work, marks, page, count, out):
    """What rows over z make of the inputs split off: (count, U)."""
    states = marks[SIZES, STATES]
    for i in range(count):
        for j in range(1 + 2 * marks[SIZES, HARMONICS]):
            total = 0.0 if marks[KEPT, j] else work[page, i, states + j]
            for q in range(states):
                total += work[page, i, q] * work[PARTICULAR, q, j]
            work[out, i, j] = total


@strict_entry
def generate(work, marks):
    """Rates over y: carried quantities, states, kept inputs; and what is watched over y."""
    states, count, watched = marks[SIZES, STATES], marks[SIZES, HARMONICS], marks[SIZES, WATCHED_COUNT]
    clearances, one = marks[SIZES, CLEARANCE_COUNT], TOP + 1
    carried, width = marks[SIZES, REFERENCE_COUNT] + clearances, _keep(work, marks)
    marks[SIZES, WIDTH] = width
    _take(work, marks, PASSED, carried, width, RATES, TOP)
    _take(work, marks, MATRIX, states, width, RATES, carried)
    for i in range(states, width):
        mine = marks[COLUMN, i] - states
        for j in range(width):
            other, rate = marks[COLUMN, j] - states, 0.0
            if mine > 2 * count:
                last = (mine - 2 * count) % marks[SIZES, LINKS] == 0
                rate = work[VECTORS, LIMITS, CHAIN_PACE] if other == mine + 1 and not last else 0.0
            elif 0 < mine <= count and other == mine + count:
                rate = -work[VECTORS, FREQUENCY, mine - 1]
            elif mine > count and other == mine - count:
                rate = work[VECTORS, FREQUENCY, other - 1]
            work[RATES, carried + i, j] = rate
    copy_rows(work, RATES, carried, width, width, GENERATOR)
    _take(work, marks, WATCHED_ALL, 3 * watched, width, WATCHED, TOP)
    for i in range(clearances, watched):
        times(work, 1.0, WATCHED, i, GENERATOR, one, width, WATCHED, watched + i)
        times(work, 1.0, WATCHED, watched + i, GENERATOR, one, width, WATCHED, 2 * watched + i)
    times(work, 1.0, WATCHED, 2 * watched, GENERATOR, watched, width, WATCHED, 3 * watched)


@strict_entry
def split_off(work, marks):
    """What the inputs split off make of the deflections and of the carried quantities."""
    count, watched = marks[SIZES, HARMONICS], marks[SIZES, WATCHED_COUNT]
    carried = marks[SIZES, REFERENCE_COUNT] + marks[SIZES, CLEARANCE_COUNT]
    _force(work, marks, WATCHED_ALL, watched, FORCED)
    for i in range(3 * watched):
        differentiate(work, FORCED, i, count, 1.0, i + watched)
    _force(work, marks, PASSED, carried, FLOWING)
    for i in range(carried):
        work[INTEGRAL, i, 0] = 0.0
        for h in range(count):
            w = work[VECTORS, FREQUENCY, h]
            work[INTEGRAL, i, 1 + h] = -work[FLOWING, i, 1 + count + h] / w
            work[INTEGRAL, i, 1 + count + h] = work[FLOWING, i, 1 + h] / w


@strict_entry
def transpose_states(work, waves, marks):
    """A as LAPACK reads it."""
    for i in range(marks[SIZES, STATES]):
        for j in range(marks[SIZES, STATES]):
            waves[SCHUR, j, i] = work[MATRIX, i, j]
