"""Lowest, highest and mean values of rows along a motion, from its state at the start and its regions.

Every interval between crossings is cut into steps of a small norm, over which the states are Taylor series. A row is a
polynomial there: its integral is known, and its turning points are found where its derivative changes sign.
"""

from __future__ import annotations

import numpy as np

from gearrattle.engine.kernels._jit import kernel

_NORM = 0.5  # of the rates times a step
_ORDER = 16  # terms of a series
_HALVINGS = 60


@kernel
def norm_of_rows(matrix, size):
    """Largest sum of moduli of a row, of the first rows and columns."""
    largest = 0.0
    for i in range(size):
        total = 0.0
        for j in range(size):
            total += abs(matrix[i, j])
        largest = max(largest, total)
    return largest


@kernel
def value_of(series, s):
    """A polynomial in s from its coefficients."""
    total = 0.0
    for j in range(series.size - 1, -1, -1):
        total = total * s + series[j]
    return total


@kernel
def slope_of(series, s):
    """Its derivative."""
    total = 0.0
    for j in range(series.size - 1, 0, -1):
        total = total * s + j * series[j]
    return total


@kernel
def turn_between(series, begin, end):
    """The turning point of a polynomial between two values of s at which its derivative has other signs."""
    rises = slope_of(series, begin) > 0.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (begin + end)
        if middle in (begin, end):
            break
        if (slope_of(series, middle) > 0.0) == rises:
            begin = middle
        else:
            end = middle
    return 0.5 * (begin + end)


@kernel
def add_levels(series, h, out):
    """Add the step of one row to its lowest and highest value and its integral."""
    first, last = series[0], value_of(series, h)
    out[0], out[1] = min(out[0], first, last), max(out[1], first, last)
    integral = 0.0
    for j in range(series.size - 1, -1, -1):
        integral = integral * h + series[j] / (j + 1.0)
    out[2] += integral * h
    begin = 0.0
    for part in range(1, 5):  # a quarter of a step turns by an eighth of a radian at most
        end = 0.25 * part * h
        if (slope_of(series, begin) > 0.0) != (slope_of(series, end) > 0.0):
            turn = value_of(series, turn_between(series, begin, end))
            out[0], out[1] = min(out[0], turn), max(out[1], turn)
        begin = end


@kernel
def levels(generators, region, duration, known, z, rows, out):
    """Write lowest value, highest value and integral over the phase of every row.

    Parameters
    ----------
    generators
        (regions, Z, Z) rates of z, a period.
    region
        (I,) of every interval between crossings.
    duration
        (I,) of every interval, in periods.
    known
        (I, Z) entries of z that are set where an interval starts; NaN for those that go on.
    z
        (Z,) at the start; overwritten.
    rows
        (K, Z) over z.
    out
        (K, 3).
    """
    size, count = z.size, rows.shape[0]
    terms, series = np.empty((_ORDER + 1, size)), np.empty(_ORDER + 1)
    for k in range(count):
        out[k, 0], out[k, 1], out[k, 2] = np.inf, -np.inf, 0.0
    for i in range(duration.size):
        generator = generators[region[i]]
        for j in range(size):
            if known[i, j] == known[i, j]:
                z[j] = known[i, j]
        steps = int(duration[i] * norm_of_rows(generator, size) / _NORM) + 1
        h = duration[i] / steps
        for _ in range(steps if duration[i] > 0.0 else 0):
            for a in range(size):
                terms[0, a] = z[a]
            for m in range(1, _ORDER + 1):
                for a in range(size):
                    total = 0.0
                    for b in range(size):
                        total += generator[a, b] * terms[m - 1, b]
                    terms[m, a] = total / m
            for k in range(count):
                for m in range(_ORDER + 1):
                    total = 0.0
                    for b in range(size):
                        total += rows[k, b] * terms[m, b]
                    series[m] = total
                add_levels(series, h, out[k])
            for a in range(size):
                total = 0.0
                for m in range(_ORDER, -1, -1):
                    total = total * h + terms[m, a]
                z[a] = total
