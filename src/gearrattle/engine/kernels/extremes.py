"""Extremes, moments and time above a level of quantities (rows times the state) over the parts of a motion.

Over a part every quantity is a power series of time (``system.row_series``). Its first four terms and a bound on all
others bound its values; a part whose bounds lie within the extremes so far is skipped. A closer bound follows from the
values at Chebyshev points (Ehlich, Zeller 1964, Math. Z. 86, 41-44: a polynomial of degree d exceeds its values at
2 d + 1 such points by the factor 2^(1/2) at most). The few parts that remain are searched for turning points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import loose
from gearrattle.engine.kernels.arrays import BoolMatrix, BoolVector, IntVector, Matrix, Vector

FEW = 4
"""Terms of a series in the first bound."""
_EXCESS = 1.5  # factor on the half-range of the values at Chebyshev points: 2^(1/2) with a margin


class Parts(NamedTuple):
    """Parts of a motion, each within one region and one interval between two samples."""

    duration: Vector  # (K,) in periods
    region: IntVector  # (K,)
    start: IntVector  # (K,) index of the sampled state from which the series starts; -1 - i: carried state i
    backward: BoolVector  # (K,) whether that state is at the end of the part
    whole: BoolVector  # (K,) whether the part is the whole interval
    samples: Matrix  # (t, Z) sampled states z
    carried: Matrix  # (C, Z) states at the start of parts without a sample, carried there from the part before


class Rows(NamedTuple):
    """Power series of q rows in every region. An interval between samples is divided into equal blocks.

    Flat arrays are ordered by block, then row; ``first...`` is the begin of a region in a flat array.
    """

    blocks: IntVector  # (R,) number of blocks of an interval
    block: Vector  # (R,) length of a block, in periods
    terms: IntVector  # (R,) highest power P
    cells: IntVector  # (R,) equal cells of a block: within a cell the rate changes its sign at most once
    first: IntVector  # (R,) where the coefficients of a region begin
    coefficients: Vector  # (P + 1, Z) for every block and row
    first_rest: IntVector  # (R,)
    rest: Vector  # (Z,) for every block and row: sums of the moduli of the coefficients from the power ``FEW`` on
    points: IntVector  # (R,) Chebyshev points of a block
    first_look: IntVector  # (R,)
    looks: Vector  # (2, points, Z) for every block and row: the row at the points after the state, and before it
    moving: BoolMatrix  # (R, q) whether a row is not 0 in a region
    nodes: IntVector  # (R,) of Gauss's rule for moments
    abscissas: Matrix  # (R, J) in 0 ... 1
    weights: Matrix  # (R, J)
    first_seen: IntVector  # (R,)
    seen: Vector  # (J, Z) for every block and row: the row at the nodes
    known: Matrix  # (R, S) memories at the entry, scaled; NaN: a memory keeps its value
    first_memory: int  # index of the first memory in z


@loose
def _begin(parts, rows, i, z):
    """Write the state from which the series of a part start."""
    start = parts.start[i]
    if start >= 0:
        for k in range(z.size):
            z[k] = parts.samples[start, k]
    else:
        for k in range(z.size):
            z[k] = parts.carried[-1 - start, k]
    for k in range(rows.known.shape[1]):
        if rows.known[parts.region[i], k] == rows.known[parts.region[i], k]:  # not NaN
            z[rows.first_memory + k] = rows.known[parts.region[i], k]


@loose
def _dot(flat, at, z):
    """The row that begins at ``at``, times the state."""
    row = flat[at : at + z.size]
    total = 0.0
    for k in range(z.size):
        total += row[k] * z[k]
    return total


@loose
def _reach(rows, region, row, x, z):
    """Bounds on a row from its state to x, in blocks, by few terms and a bound on the others."""
    width = z.size
    flat = rows.coefficients
    at = rows.first[region] + row * (rows.terms[region] + 1) * width
    a0 = _dot(flat, at, z)
    a1 = _dot(flat, at + width, z)
    a2 = _dot(flat, at + 2 * width, z)
    a3 = _dot(flat, at + 3 * width, z)
    beyond = rows.first_rest[region] + row * width
    left = 0.0
    rest = rows.rest[beyond : beyond + width]
    for k in range(width):
        left += rest[k] * abs(z[k])
    a1 = a1 * x
    a2 = a2 * x * x
    a3 = a3 * x * x * x
    left = left * x * x * x * x
    low = a0 + min(a1, 0.0) + min(a2, 0.0) + min(a3, 0.0) - left
    return low, a0 + max(a1, 0.0) + max(a2, 0.0) + max(a3, 0.0) + left


@loose
def _look(rows, region, row, is_backward, z):
    """Bounds on a row in the whole block, by values at Chebyshev points."""
    count = rows.points[region]
    width = z.size
    at = rows.first_look[region] + (2 * row + is_backward) * count * width
    low = _dot(rows.looks, at, z)
    high = low
    for g in range(1, count):
        value = _dot(rows.looks, at + g * width, z)
        low = min(low, value)
        high = max(high, value)
    rise = 0.5 * (_EXCESS - 1.0) * (high - low)
    return low - rise, high + rise


@loose
def _expand(rows, region, row, x, z, terms):
    """Write the series of a row in powers of the share, 0 ... 1, of an interval from its state to x blocks from it."""
    width = z.size
    top = rows.terms[region]
    at = rows.first[region] + row * (top + 1) * width
    power = 1.0
    for p in range(top + 1):
        terms[p] = _dot(rows.coefficients, at + p * width, z) * power
        power *= x
    return top


@loose
def _value(terms, top, x):
    """A polynomial at x."""
    value = terms[top]
    for p in range(top - 1, -1, -1):
        value = value * x + terms[p]
    return value


@loose
def _rate(terms, top, x):
    """First derivative of a polynomial at x."""
    value = top * terms[top]
    for p in range(top - 1, 0, -1):
        value = value * x + p * terms[p]
    return value


@loose
def _bend(terms, top, x):
    """Second derivative of a polynomial at x."""
    value = top * (top - 1) * terms[top]
    for p in range(top - 1, 1, -1):
        value = value * x + p * (p - 1) * terms[p]
    return value


@loose
def _turn(terms, top, begin, end, before, after):
    """The zero of the rate between two points at which the rates have opposite signs."""
    x = begin + (end - begin) * before / (before - after)
    for _ in range(5):
        bend = _bend(terms, top, x)
        if bend != 0.0:
            x = min(max(x - _rate(terms, top, x) / bend, begin), end)
    return x


@loose
def extremes(parts, rows, first, last, scratch, low, high):
    """Widen low and high to the extremes of every row over the parts ``first`` to ``last`` - 1.

    scratch: (2, size) for the state and for the terms.
    low, high: (q,) extremes so far.
    """
    z = scratch[0, : parts.samples.shape[1]]
    terms = scratch[1]
    count = low.size
    for i in range(first, last):
        # the state from which the series of this part start
        region = parts.region[i]
        _begin(parts, rows, i, z)
        sign = -1.0 if parts.backward[i] else 1.0
        for c in range(count):
            # a row that is zero in this region
            if not rows.moving[region, c]:
                low[c] = min(low[c], 0.0)
                high[c] = max(high[c], 0.0)
                continue
            left = parts.duration[i]
            for j in range(rows.blocks[region]):
                # can this block widen the extremes? first by a coarse bound, then by a closer one
                x = sign * min(left, rows.block[region]) / rows.block[region]
                least, most = _reach(rows, region, j * count + c, x, z)
                if most > high[c] or least < low[c]:
                    least, most = _look(rows, region, j * count + c, parts.backward[i], z)
                if most > high[c] or least < low[c]:
                    # if so: the polynomial of the row over the block, and its values at both ends
                    top = _expand(rows, region, j * count + c, x, z, terms)
                    cells = max(1, int(np.ceil(rows.cells[region] * abs(x))))
                    before = terms[1]
                    low[c] = min(low[c], terms[0])
                    high[c] = max(high[c], terms[0])
                    # cell by cell: the value at the end, and the extremum where the rate changes its sign
                    for g in range(1, cells + 1):
                        end = g / cells
                        value = _value(terms, top, end)
                        after = _rate(terms, top, end)
                        low[c] = min(low[c], value)
                        high[c] = max(high[c], value)
                        if before * after < 0.0:
                            value = _value(terms, top, _turn(terms, top, (g - 1) / cells, end, before, after))
                            low[c] = min(low[c], value)
                            high[c] = max(high[c], value)
                        before = after
                left -= rows.block[region]
                if left <= 0.0:
                    break


@loose
def _weigh(weight, value, about, c, sums):
    """Add the powers 1 ... 4 of a value minus a reference."""
    away = value - about[c]
    square = away * away
    sums[0, c] += weight * away
    sums[1, c] += weight * square
    sums[2, c] += weight * square * away
    sums[3, c] += weight * square * square


@loose
def moments(parts, rows, first, last, wanted, about, scratch, sums, powers):
    """Add the integrals of the powers 1 ... 4 of rows about a reference; a row that is 0 in a region adds nothing.

    parts, rows, first, last, scratch: as in ``extremes``.
    wanted: (m,) rows whose moments are wanted.
    about: (q,) references.
    sums: (4, q) scratch.
    powers: (4, q) added to.
    """
    z = scratch[0, : parts.samples.shape[1]]
    terms = scratch[1]
    count = about.size
    for i in range(first, last):
        # the state from which the series of this part start
        region = parts.region[i]
        width = z.size
        _begin(parts, rows, i, z)
        sign = -1.0 if parts.backward[i] else 1.0
        for m in range(wanted.size):
            c = wanted[m]
            left = parts.duration[i]
            for j in range(rows.blocks[region] if rows.moving[region, c] else 0):
                # every block of the row
                row = j * count + c
                length = min(left, rows.block[region])
                # a whole interval: values at the nodes by stored rows
                if parts.whole[i]:
                    at = rows.first_seen[region] + row * rows.nodes[region] * width
                    for g in range(rows.nodes[region]):
                        value = _dot(rows.seen, at + g * width, z)
                        _weigh(rows.block[region] * rows.weights[region, g], value, about, c, sums)
                elif length > 0.0:
                    # a part of an interval: values at the nodes by the polynomial of the row
                    top = _expand(rows, region, row, sign * length / rows.block[region], z, terms)
                    for g in range(rows.nodes[region]):
                        value = _value(terms, top, rows.abscissas[region, g])
                        _weigh(length * rows.weights[region, g], value, about, c, sums)
                left -= rows.block[region]
        if i % 256 == 255 or i == last - 1:  # partial sums reduce rounding
            for p in range(4):
                for c in range(count):
                    powers[p, c] += sums[p, c]
                    sums[p, c] = 0.0


@loose
def reaches(parts, rows, first, last, c, scratch, low, high):
    """Write bounds (K,) on row c in every part."""
    z = scratch[0, : parts.samples.shape[1]]
    count = rows.moving.shape[1]
    for i in range(first, last):
        region = parts.region[i]
        left = parts.duration[i]
        low[i] = 0.0
        high[i] = 0.0
        if not rows.moving[region, c]:
            continue
        _begin(parts, rows, i, z)
        low[i] = np.inf
        high[i] = -np.inf
        for j in range(rows.blocks[region]):
            x = min(left, rows.block[region]) / rows.block[region]
            # the narrower of two bounds, block by block
            least, most = _reach(rows, region, j * count + c, -x if parts.backward[i] else x, z)
            lowest, highest = _look(rows, region, j * count + c, parts.backward[i], z)
            low[i] = min(low[i], max(least, lowest))
            high[i] = max(high[i], min(most, highest))
            left -= rows.block[region]
            if left <= 0.0:
                break


@loose
def _above(terms, top, sign, level, begin, end):
    """Share of begin ... end, where a polynomial is monotonic, in which sign times polynomial is above a level.

    Also its loss per increase of the level.
    """
    # all below or all above
    at_begin = sign * _value(terms, top, begin) - level
    at_end = sign * _value(terms, top, end) - level
    if at_begin <= 0.0 and at_end <= 0.0:
        return 0.0, 0.0
    if at_begin > 0.0 and at_end > 0.0:
        return end - begin, 0.0
    # the instant at which the polynomial crosses the level: bracketed Newton steps
    low = begin
    high = end
    rate = 0.0
    x = begin + (end - begin) * at_begin / (at_begin - at_end)
    for _ in range(60):
        value = sign * _value(terms, top, x) - level
        rate = sign * _rate(terms, top, x)
        if (value > 0.0) == (at_begin > 0.0):
            low = x
        else:
            high = x
        moved = x - value / rate if rate != 0.0 else low
        if not low < moved < high:
            moved = 0.5 * (low + high)
        step = abs(moved - x)
        x = moved
        if step <= 1e-9 * (end - begin):  # the error is of second order in this step
            break
    # the share above the level, and its derivative by the level
    loss = 1.0 / abs(rate) if rate != 0.0 else np.inf
    return (x - begin if at_begin > 0.0 else end - x), loss


@loose
def time_above(parts, rows, which, c, level, scratch):
    """Return the time [periods] in which the modulus of a row is above a level, and its loss per rise of the level."""
    z = scratch[0, : parts.samples.shape[1]]
    terms = scratch[1]
    count = rows.moving.shape[1]
    time = 0.0
    loss = 0.0
    for n in range(which.size):
        i = which[n]
        # the state from which the series of this part start
        region = parts.region[i]
        left = parts.duration[i]
        _begin(parts, rows, i, z)
        for j in range(rows.blocks[region]):
            # the row's polynomial over a block
            length = min(left, rows.block[region])
            x = (-length if parts.backward[i] else length) / rows.block[region]
            top = _expand(rows, region, j * count + c, x, z, terms)
            cells = max(1, int(np.ceil(rows.cells[region] * abs(x))))
            before = terms[1]
            for g in range(1, cells + 1):
                # every cell, cut where the rate changes its sign: monotonic on both sides
                begin = (g - 1) / cells
                end = g / cells
                after = _rate(terms, top, end)
                middle = _turn(terms, top, begin, end, before, after) if before * after < 0.0 else end
                # time above the level, and below minus the level
                for sign in (1.0, -1.0):
                    share, lost = _above(terms, top, sign, level, begin, middle)
                    time = time + length * share
                    loss = loss + length * lost
                    if middle < end:
                        share, lost = _above(terms, top, sign, level, middle, end)
                        time = time + length * share
                        loss = loss + length * lost
                before = after
            left -= rows.block[region]
            if left <= 0.0:
                break
    return time, loss
