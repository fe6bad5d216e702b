"""Rows written in strips of four (see ``packed``), and the tables and series that ``packed.Regions`` holds.

Takes pages of ``bench``; writes one slot's part of an array.
"""

from __future__ import annotations

from math import ceil, log2

from gearrattle.engine.kernels._jit import inlined, strict, strict_entry
from gearrattle.engine.kernels.bench import (
    BOUNDS,
    DEEPEST,
    FORCED,
    FOUND,
    FOUR,
    FREQUENCY,
    GENERATOR,
    HARMONICS,
    INPUT_SIZE,
    LEAST,
    ONE,
    RATES,
    SIZES,
    THREE,
    TOP,
    TURNING,
    TWO,
    VECTORS,
    WATCHED,
    WATCHED_COUNT,
    WIDTH,
)  # fmt: skip
from gearrattle.engine.kernels.dense import copy_rows, norm_of_columns, times
from gearrattle.engine.kernels.packed import LONGEST, ORDER, level_within, step_of, window_norm

step = inlined(step_of)
_level_within = inlined(level_within)
_WINDOW = window_norm(ORDER + 1)
NOTHING = 1e-19  # of the largest: terms of a forced deflection below this are left out


@strict_entry
def fill(stack, index, strip, work, page, first, count, columns):
    """Write rows first ... of a page from a strip on, and zeros behind them; the strip behind those written."""
    for i in range(0, count, 4):
        for r in range(4):
            for j in range(columns):
                stack[index, strip, j, r] = work[page, first + i + r, j] if i + r < count else 0.0
        strip += 1
    return strip


@strict_entry
def fill_in_turn(stack, index, work, page, count, columns):
    """Write four groups of ``count`` rows of a page, a strip for the first rows of all, a strip for the second ..."""
    for k in range(count):
        for r in range(4):
            for j in range(columns):
                stack[index, k, j, r] = work[page, r * count + k, j]


@strict_entry
def fill_bounds(stack, index, waves, modes, width):
    """Four real and four imaginary parts in turn."""
    for i in range(4 * ((modes + 3) // 4)):
        strip = 2 * (i // 4)
        for j in range(width):
            value = waves[BOUNDS, i, j] if i < modes else complex(0.0, 0.0)
            stack[index, strip, j, i % 4] = value.real
            stack[index, strip + 1, j, i % 4] = value.imag


@strict_entry
def finest_level(work, marks):
    """Smallest level, of those allowed, at which ORDER Taylor terms leave a negligible remainder."""
    size, least, deepest = marks[SIZES, WIDTH], marks[SIZES, LEAST], marks[SIZES, DEEPEST]
    norm = norm_of_columns(work, GENERATOR, size)
    if norm == 0.0:
        return least
    times(work, 1.0 / (norm * norm), GENERATOR, TOP, GENERATOR, size, size, ONE, TOP)
    times(work, 1.0, ONE, TOP, ONE, size, size, TWO, TOP)  # the fourth power
    times(work, 1.0, TWO, TOP, TWO, size, size, ONE, TOP)
    times(work, 1.0, ONE, TOP, ONE, size, size, THREE, TOP)
    times(work, 1.0, THREE, TOP, TWO, size, size, ONE, TOP)  # the twentieth
    power = norm_of_columns(work, ONE, size) ** (1.0 / (ORDER + 1)) * norm
    return min(deepest, max(least, _level_within(_WINDOW / max(power, 1e-300))))


@strict
def _append(work, page, to, carried, width):
    """E(a + b) = E(a) + E(b) + E(b) E(a), in place of E(a); E(b) stands on another page."""
    rows = carried + width
    copy_rows(work, to, carried, width, width, TWO)
    times(work, 1.0, page, TOP, TWO, rows, width, THREE, TOP)
    for i in range(rows):
        for j in range(width):
            work[to, i, j] += work[page, i, j] + work[THREE, i, j]


@strict
def _fill_table(tables, index, work, page, carried, width):
    """Write the carried quantities' increments, and those of y."""
    behind = fill(tables, index, TOP, work, page, TOP, carried, width)
    fill(tables, index, behind, work, page, carried, width, width)


@strict_entry
def fill_tables(tables, first, work, carried, width, fine):
    """Increments E(h) = exp(A h) - I over every level's step, those of the carried quantities first.

    Built where the Taylor series converges in a dozen terms, and doubled; steps of three quarters are made of two.
    """
    rows, octaves = carried + width, (fine + 1) // 2
    h = LONGEST / 2.0**octaves
    below = max(1, int(ceil(log2(max(norm_of_columns(work, GENERATOR, width) * h, 1e-300) / 0.25))))
    h /= 2.0**below
    for i in range(rows):
        for j in range(width):
            work[ONE, i, j] = h * work[RATES, i, j]
    copy_rows(work, ONE, carried, width, width, TWO)
    for order in range(2, 17):
        times(work, h / order, RATES, TOP, TWO, rows, width, THREE, TOP)
        for i in range(rows):
            for j in range(width):
                work[ONE, i, j] += work[THREE, i, j]
        copy_rows(work, THREE, carried, width, width, TWO)
    for octave in range(below + octaves - 1, -1, -1):
        copy_rows(work, ONE, TOP, rows, width, FOUR)
        _append(work, FOUR, ONE, carried, width)
        level = 2 * octave
        if level <= fine:
            _fill_table(tables, first + level, work, ONE, carried, width)
        if 0 < level <= fine + 1:  # half as long again
            _append(work, ONE, FOUR, carried, width)
            _fill_table(tables, first + level - 1, work, FOUR, carried, width)


@strict_entry
def fill_powers(powers, first, count, work, carried, width, h):
    """(h A)^1 ... (h A)^count, the carried rows with one power less of A."""
    for i in range(width):
        for j in range(width):
            work[ONE, i, j] = 1.0 if i == j else 0.0
    for p in range(count):
        times(work, h, RATES, TOP, ONE, carried + width, width, TWO, TOP)
        strip = fill(powers, first + p, TOP, work, TWO, TOP, carried, width)
        fill(powers, first + p, strip, work, TWO, carried, width, width)
        copy_rows(work, TWO, carried, width, width, ONE)


@strict_entry
def fill_series(series, slot, work, marks, h):
    """Taylor coefficients over h of every deflection, a row of its own for every order."""
    clearances, width, one = marks[SIZES, WATCHED_COUNT], marks[SIZES, WIDTH], TOP + 1
    for k in range(clearances):
        copy_rows(work, WATCHED, k, one, width, ONE)
        for order in range(1, ORDER + 1):
            times(work, h / order, ONE, order - 1, GENERATOR, one, width, ONE, order)
        fill(series, slot * clearances + k, TOP, work, ONE, TOP, TOP + ORDER + 1, width)


@strict
def differentiate(work, page, i, count, factor, o):
    """Row o of a page = factor d/ds (row i . u); ``count`` harmonics."""
    work[page, o, 0] = 0.0
    for h in range(count):
        w = factor * work[VECTORS, FREQUENCY, h]
        work[page, o, 1 + h] = w * work[page, i, 1 + count + h]
        work[page, o, 1 + count + h] = -w * work[page, i, 1 + h]


@strict_entry
def fill_forced(series, slot, work, marks, h):
    """The same of the inputs split off; how many strips of it hold more than nothing."""
    clearances, count = marks[SIZES, WATCHED_COUNT], marks[SIZES, HARMONICS]
    inputs, one, largest, last = 1 + 2 * count, TOP + 1, 0.0, 0
    for order in range(ORDER + 1):
        work[FOUND, TURNING, order] = 0.0
    for k in range(clearances):
        copy_rows(work, FORCED, k, one, inputs, ONE)
        for order in range(ORDER + 1):
            if order > 0:
                differentiate(work, ONE, order - 1, count, h / order, order)
            for j in range(inputs):
                size = abs(work[ONE, order, j]) * work[VECTORS, INPUT_SIZE, j]
                work[FOUND, TURNING, order] = max(work[FOUND, TURNING, order], size)
                largest = max(largest, size)
        fill(series, slot * clearances + k, TOP, work, ONE, TOP, TOP + ORDER + 1, inputs)
    for order in range(ORDER + 1):
        if work[FOUND, TURNING, order] > NOTHING * largest:
            last = order
    return last // 4 + 1
