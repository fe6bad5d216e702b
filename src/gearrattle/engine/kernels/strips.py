"""Rows written in strips of four, and the tables and series of a region: arrays of ``march_arrays.Regions``."""

from __future__ import annotations

from math import ceil, log2

from gearrattle.engine.kernels._jit import inlined, strict
from gearrattle.engine.kernels.dense import TOP, copy_rows, norm_of_chained_columns, times_chained
from gearrattle.engine.kernels.march_arrays import DEEPEST, LONGEST, ORDER, level_within, step_of, window_norm
from gearrattle.engine.kernels.memory_addresses import bounds_at, common_at, free_at, region_at, scratch_at
from gearrattle.engine.kernels.workspace import POWERS

step = inlined(step_of)
_level_within = inlined(level_within)
_WINDOW = window_norm(ORDER + 1)
NOTHING = 1e-19  # share of the largest term of a forced deflection below which a term is omitted


@strict
def fill(stack, index, strip, rows, first, count, columns):
    """Write ``count`` rows of an array from a strip on, filled up with zeros; return the index of the next strip."""
    for i in range(0, count, 4):
        for r in range(4):
            for j in range(columns):
                stack[index, strip, j, r] = rows[first + i + r, j] if i + r < count else 0.0
        strip += 1
    return strip


@strict
def fill_in_turn(stack, index, rows, count, columns):
    """Write four groups of ``count`` rows: strip k holds row k of every group."""
    for k in range(count):
        for r in range(4):
            for j in range(columns):
                stack[index, k, j, r] = rows[r * count + k, j]


@strict
def fill_bounds(workspace, stack, index):
    """Write the rows of the bounds: strips of four real parts and of four imaginary parts alternate."""
    free = free_at(workspace)
    bounds = bounds_at(workspace)
    modes = bounds.used[0]
    width = free.width[0]
    for i in range(4 * ((modes + 3) // 4)):
        strip = 2 * (i // 4)
        for j in range(width):
            value = bounds.rows[i, j] if i < modes else complex(0.0, 0.0)
            stack[index, strip, j, i % 4] = value.real
            stack[index, strip + 1, j, i % 4] = value.imag


@inlined
def _shape_of(common, free):
    """Return (columns of y, first column of the chains, entries of a chain), and the number of rows to compute.

    All chains have the same rows except for a shift, so only the rows of the first chain are computed.
    """
    width = free.width[0]
    chained = free.chained[0]
    links = common.links[0]
    return (width, chained, links), min(width, chained + links)


@strict
def finest_level(workspace):
    """Smallest allowed level at which a Taylor series of order ORDER has a negligible remainder."""
    common = common_at(workspace)
    free = free_at(workspace)
    scratch = scratch_at(workspace)
    coarsest = common.coarsest[0]
    shape, rows = _shape_of(common, free)
    norm = norm_of_chained_columns(free.generator, shape)
    if norm == 0.0:
        return coarsest
    one = scratch.one
    two = scratch.two
    three = scratch.three
    times_chained(1.0 / (norm * norm), free.generator, TOP, free.generator, rows, shape, one, TOP)
    times_chained(1.0, one, TOP, one, rows, shape, two, TOP)  # the fourth power
    times_chained(1.0, two, TOP, two, rows, shape, one, TOP)
    times_chained(1.0, one, TOP, one, rows, shape, three, TOP)
    times_chained(1.0, three, TOP, two, rows, shape, one, TOP)  # the twentieth
    power = norm_of_chained_columns(one, shape) ** (1.0 / (ORDER + 1)) * norm
    return min(DEEPEST, max(coarsest, _level_within(_WINDOW / max(power, 1e-300))))


@strict
def _append(more, increment, scratch, carried, rows, shape):
    """Overwrite E(a) with E(a + b) = E(a) + E(b) + E(b) E(a); ``more`` is E(b)."""
    every = carried + rows
    width = shape[0]
    copy_rows(increment, carried, rows, width, scratch.two)
    times_chained(1.0, more, TOP, scratch.two, every, shape, scratch.three, TOP)
    for i in range(every):
        for j in range(width):
            increment[i, j] += more[i, j] + scratch.three[i, j]


@strict
def _fill_table(tables, index, increment, carried, shape):
    """Write the increments of the carried quantities, then of y without its chains."""
    width, chained, _ = shape
    behind = fill(tables, index, TOP, increment, TOP, carried, width)
    fill(tables, index, behind, increment, carried, chained, width)


@strict
def fill_tables(workspace, tables, first, carried):
    """Write the increments E(h) = exp(A h) - I over the step of every level, the carried quantities first.

    The first table is a Taylor series at a step at which a dozen terms suffice. Tables of longer steps follow by
    doubling; those of three quarters of a step are the sum of a half and a quarter.
    """
    # sizes, and the step at which a dozen terms of the Taylor series suffice
    common = common_at(workspace)
    free = free_at(workspace)
    scratch = scratch_at(workspace)
    fine = free.fine[0]
    shape, rows = _shape_of(common, free)
    width = shape[0]
    every = carried + rows
    octaves = (fine + 1) // 2
    one = scratch.one
    four = scratch.four
    h = LONGEST / 2.0**octaves
    norm = norm_of_chained_columns(free.generator, shape)
    below = max(1, int(ceil(log2(max(norm * h, 1e-300) / 0.25))))
    h /= 2.0**below
    # Taylor series of E at that step
    for i in range(every):
        for j in range(width):
            one[i, j] = h * free.rates[i, j]
    copy_rows(one, carried, rows, width, scratch.two)
    for order in range(2, 17):
        times_chained(h / order, free.rates, TOP, scratch.two, every, shape, scratch.three, TOP)
        for i in range(every):
            for j in range(width):
                one[i, j] += scratch.three[i, j]
        copy_rows(scratch.three, carried, rows, width, scratch.two)
    # double it: E(a + b) = E(a) + E(b) + E(b) E(a)
    for octave in range(below + octaves - 1, -1, -1):
        copy_rows(one, TOP, every, width, four)
        _append(four, one, scratch, carried, rows, shape)
        level = 2 * octave
        # tables of the steps 1/8, 1/16 ... of a period, and of 3/4 of these
        if level <= fine:
            _fill_table(tables, first + level, one, carried, shape)
        if 0 < level <= fine + 1:
            _append(one, four, scratch, carried, rows, shape)
            _fill_table(tables, first + level - 1, four, carried, shape)


@strict
def fill_powers(workspace, powers, first, carried, h):
    """Write (h A)^1 ... (h A)^POWERS without the chains; in rows of carried quantities A has one power less."""
    common = common_at(workspace)
    free = free_at(workspace)
    scratch = scratch_at(workspace)
    one = scratch.one
    two = scratch.two
    shape, rows = _shape_of(common, free)
    width = shape[0]
    for i in range(rows):
        for j in range(width):
            one[i, j] = 1.0 if i == j else 0.0
    for p in range(POWERS):
        times_chained(h, free.rates, TOP, one, carried + rows, shape, two, TOP)
        _fill_table(powers, first + p, two, carried, shape)
        copy_rows(two, carried, rows, width, one)


@strict
def fill_series(workspace, series, slot, h):
    """Write the Taylor coefficients over h of every watched quantity: one row for every order."""
    common = common_at(workspace)
    free = free_at(workspace)
    scratch = scratch_at(workspace)
    watched = free.fast.shape[0]
    row = TOP + 1
    shape, _ = _shape_of(common, free)
    width = shape[0]
    for k in range(watched):
        copy_rows(free.watched, k, row, width, scratch.one)
        for order in range(1, ORDER + 1):
            times_chained(h / order, scratch.one, order - 1, free.generator, row, shape, scratch.one, order)
        fill(series, slot * watched + k, TOP, scratch.one, TOP, TOP + ORDER + 1, width)


@strict
def differentiate(rows, i, frequency, factor, o):
    """Row o = factor d/ds (row i . u)."""
    count = frequency.size
    rows[o, 0] = 0.0
    for h in range(count):
        w = factor * frequency[h]
        rows[o, 1 + h] = w * rows[i, 1 + count + h]
        rows[o, 1 + count + h] = -w * rows[i, 1 + h]


@strict
def fill_forced(workspace, series, slot, h):
    """Write the Taylor coefficients of the inputs split off; return the number of strips that are not negligible."""
    common = common_at(workspace)
    region = region_at(workspace)
    scratch = scratch_at(workspace)
    watched = common.corner_scale.size
    inputs = common.input_size.size
    one = scratch.one
    row = TOP + 1
    largest = 0.0
    last = 0
    for order in range(ORDER + 1):
        scratch.largest[order] = 0.0
    for k in range(watched):
        copy_rows(region.forced, k, row, inputs, one)
        for order in range(ORDER + 1):
            if order > 0:
                differentiate(one, order - 1, common.frequency, h / order, order)
            for j in range(inputs):
                size = abs(one[order, j]) * common.input_size[j]
                scratch.largest[order] = max(scratch.largest[order], size)
                largest = max(largest, size)
        fill(series, slot * watched + k, TOP, one, TOP, TOP + ORDER + 1, inputs)
    for order in range(ORDER + 1):
        if scratch.largest[order] > NOTHING * largest:
            last = order
    return last // 4 + 1
