"""Lowest, highest and mean values of rows along a motion, from its state at the start and its regions.

Every interval between crossings is cut into steps, over which rows times z are short Taylor series,

    w z(t) = w z + w Z z t + w Z^2 z t^2 / 2 + ...

The rows w Z^m / m! are computed once per region; so is the exponential over a step, if the motion takes many steps in
the region. The integral of a polynomial is known; its turning points lie where its derivative changes its sign.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel
from gearrattle.engine.kernels.arrays import Array3, Matrix, Vector

_NORM = 0.5  # |Z h| of a step
_ORDER = 16  # terms of a series
_ITERATIONS = 60  # of the search for a turning point
_SETTLED = 1e-15  # share of the interval that counts as zero


class Region(NamedTuple):
    """Series and exponential of one region over its step."""

    step: Vector  # (2,) length in periods, 0: not computed yet; 1 if the increment is computed
    series: Array3  # (K, _ORDER + 1, Z) rows of the Taylor series of every row
    increment: Matrix  # (Z, Z) exp(Z step) - 1


@kernel
def norm_of_square(generator, states):
    """Root of the largest row sum of |Z^2| over the first ``states`` rows: about the largest rate of a mode.

    Unlike the norm of Z it hardly depends on the scales of the states.
    """
    size = generator.shape[0]
    largest = 0.0
    row = np.empty(size)
    for i in range(states):
        for p in range(size):
            row[p] = 0.0
        for j in range(size):
            for p in range(size):
                row[p] += generator[i, j] * generator[j, p]
        total = 0.0
        for p in range(size):
            total += abs(row[p])
        largest = max(largest, total)
    return np.sqrt(largest)


@kernel
def value_of(series, s):
    """A polynomial in s from its coefficients."""
    total = 0.0
    for j in range(series.size - 1, -1, -1):
        total = total * s + series[j]
    return total


@kernel
def slope_of(series, s):
    """Derivative of a polynomial."""
    total = 0.0
    for j in range(series.size - 1, 0, -1):
        total = total * s + j * series[j]
    return total


@kernel
def bend_of(series, s):
    """Second derivative of a polynomial."""
    total = 0.0
    for j in range(series.size - 1, 1, -1):
        total = total * s + j * (j - 1.0) * series[j]
    return total


@kernel
def turn_between(series, begin, end):
    """The turning point of a polynomial between two values of s at which its derivative has opposite signs.

    Newton's method; bisection if a step would leave the interval.
    """
    rises = slope_of(series, begin) > 0.0
    s = 0.5 * (begin + end)
    width = end - begin
    for _ in range(_ITERATIONS):
        slope = slope_of(series, s)
        bend = bend_of(series, s)
        if (slope > 0.0) == rises:
            begin = s
        else:
            end = s
        last = s
        s = s - slope / bend
        if not begin <= s <= end:
            s = 0.5 * (begin + end)
        if abs(s - last) <= _SETTLED * width:
            break
    return s


@kernel
def add_levels(series, h, out):
    """Update lowest value, highest value and integral of one row by a step."""
    first = series[0]
    last = value_of(series, h)
    out[0] = min(out[0], first, last)
    out[1] = max(out[1], first, last)
    integral = 0.0
    for j in range(series.size - 1, -1, -1):
        integral = integral * h + series[j] / (j + 1.0)
    out[2] += integral * h
    begin = 0.0
    for part in range(1, 5):  # in a quarter of a step a mode turns by 1/8 rad at most
        end = 0.25 * part * h
        if (slope_of(series, begin) > 0.0) != (slope_of(series, end) > 0.0):
            turn = value_of(series, turn_between(series, begin, end))
            out[0] = min(out[0], turn)
            out[1] = max(out[1], turn)
        begin = end


@kernel
def _add_product(generator, factor, source, out):
    """Add a factor times the product of the generator and a vector."""
    for a in range(source.size):
        total = 0.0
        for b in range(source.size):
            total += generator[a, b] * source[b]
        out[a] += factor * total


@kernel
def _write_region(generator, rows, duration, region):
    """Write the series of all rows and, if there are more steps than columns, the exponential by its series."""
    size = generator.shape[0]
    # the step over which the Taylor series represents every row to rounding
    h = _NORM / max(norm_of_square(generator, size), _NORM)
    region.step[0] = h
    # series of all rows: r Z^m / m!
    for k in range(rows.shape[0]):
        for b in range(size):
            region.series[k, 0, b] = rows[k, b]
        for m in range(1, _ORDER + 1):
            for b in range(size):
                total = 0.0
                for a in range(size):
                    total += region.series[k, m - 1, a] * generator[a, b]
                region.series[k, m, b] = total / m
    # few steps: the state is carried by the series of z
    if duration < size * h:
        return
    # many steps: exp(Z h) - 1, column by column
    region.step[1] = 1.0
    term = np.empty(size)
    product = np.empty(size)
    for b in range(size):
        for a in range(size):
            term[a] = 1.0 if a == b else 0.0
            region.increment[a, b] = 0.0
        for m in range(1, _ORDER + 1):
            for a in range(size):
                product[a] = 0.0
            _add_product(generator, h / m, term, product)
            for a in range(size):
                term[a] = product[a]
                region.increment[a, b] += term[a]


@kernel
def _carry(generator, h, z, term, product):
    """Carry z over less than a step, by its Taylor series."""
    for a in range(z.size):
        term[a] = z[a]
    for m in range(1, _ORDER + 1):
        for a in range(z.size):
            product[a] = 0.0
        _add_product(generator, h / m, term, product)
        for a in range(z.size):
            term[a] = product[a]
            z[a] += term[a]


@kernel
def _add_steps(generator, region, duration, z, series, room, out):
    """Update the levels of all rows by an interval in a region, and carry z to its end."""
    left = duration
    h = region.step[0]
    term = room[0]
    product = room[1]
    while left > 0.0:
        span = min(left, h)
        for k in range(out.shape[0]):
            for m in range(series.size):
                total = 0.0
                for b in range(z.size):
                    total += region.series[k, m, b] * z[b]
                series[m] = total
            add_levels(series, span, out[k])
        if span == h and region.step[1] != 0.0:
            for a in range(z.size):
                product[a] = 0.0
            _add_product(region.increment, 1.0, z, product)
            for a in range(z.size):
                z[a] += product[a]
        else:
            _carry(generator, span, z, term, product)
        left -= span


@kernel
def levels(generators, region, duration, known, z, rows, out):
    """Write lowest value, highest value and time integral of every row times z.

    generators: (regions, Z, Z) rates of z per period.
    region: (I,) region of every interval between crossings.
    duration: (I,) length of every interval, in periods.
    known: (I, Z) entries of z that are set at the start of an interval; NaN: the entry keeps its value.
    z: (Z,) at the start; overwritten.
    rows: (K, Z) over z.
    out: (K, 3).
    """
    size = z.size
    count = rows.shape[0]
    steps = np.zeros((len(generators), 2))
    increments = np.empty(generators.shape)
    spent = np.zeros(len(generators))
    tables = np.empty((len(generators), count, _ORDER + 1, size))
    series = np.empty(_ORDER + 1)
    room = np.empty((2, size))
    for k in range(count):
        out[k, 0] = np.inf
        out[k, 1] = -np.inf
        out[k, 2] = 0.0
    for i in range(duration.size):
        spent[region[i]] += duration[i]
    for i in range(duration.size):
        r = region[i]
        made = Region(steps[r], tables[r], increments[r])
        for j in range(size):
            if known[i, j] == known[i, j]:
                z[j] = known[i, j]
        if made.step[0] == 0.0:
            _write_region(generators[r], rows, spent[r], made)
        _add_steps(generators[r], made, duration[i], z, series, room, out)
