"""All turning points of deflections along a motion, and where their rates come nearest to zero, along one direction.

The direction is that in which the motion goes on to repeat, or to end as far from its start as it does,

    (M - I) du + s dp = 0,      row . (du, dp) = 1.

The perturbation v that begins with it obeys v' = A v + B z dp and is carried along with z. So the depth of a turning
point (``approaches``) changes by w v, and its instant by -w v' over the second derivative of w z.

Rates are looked at in steps of about half a radian of the fastest mode; between two looks a deflection is a Taylor
series. Where a rate keeps its sign but comes nearest to zero, its series tells whether there are two turning points or
none. There two of them may appear: such a *dip* is kept, by the distance of the rate beyond zero. A rate may also come
nearest to zero at a crossing, where its derivative jumps.

Arrays: ``packed`` (regions, log), ``approaches`` (rates, steps, course, crossings).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, strict, strict_entry
from gearrattle.engine.kernels.approaches import add_turned, dot, write_products
from gearrattle.engine.kernels.arrays import Array3, IntVector, Matrix, Vector
from gearrattle.engine.kernels.dense import factorise, substitute
from gearrattle.engine.kernels.levels import bend_of, slope_of, turn_between, value_of

_COARSER, _ORDER = 5, 15  # levels from the finest step to that between two looks; terms of its series, to below 1e-16
_BLOCK = 4  # levels: 16 looks are taken from one state
CLEARANCE, UPWARD, TURN_TIME, TURN_DEPTH, TURN_SLOPE, TURN_TIME_SLOPE, LEVEL, LEVEL_SLOPE, TURN_COLUMNS = range(9)
"""Columns of ``Map.turns``, and how many: instants and their slopes in periods, slopes along the direction.

The last two are of dips: how far the deflection is from the corner nearest to it.
"""
FALLING, RISING = 2, 3
"""In the column UPWARD: no turning point, but a *dip*, where a negative or a positive rate comes nearest to zero."""
MOST_TURNS = 4096
"""Rows of ``Map.turns``; where there are more turning points they are not known."""


class Direction(NamedTuple):
    """A direction in the space of motions, and its equations; n = N + 1."""

    matrix: Matrix  # (n, n) [[M - I, s], row], overwritten by its factors
    pivots: IntVector  # (n,)
    change: Vector  # (n,) of the state at the start, balanced, and of p


class Perturbed(NamedTuple):
    """A motion after a crossing with its perturbation, and room for their products."""

    z: Vector  # (P,)
    v: Vector  # (N,)
    product: Vector
    v_product: Vector


class Series(NamedTuple):
    """A deflection and its perturbation from an instant on, over powers of the time; and room."""

    term: Perturbed
    value: Vector  # (_ORDER,)
    v_value: Vector
    rate: Vector  # (_ORDER - 1,)
    v_rate: Vector


class Looks(NamedTuple):
    """Columns over z, in a row for every look of a block: deflections of the K clearances, their first two derivatives.

    The first look is at the state itself, the n-th n steps later.
    """

    columns: Array3  # (S, P, looks * 3 * K)
    is_written: Vector  # (S,)


class Seen(NamedTuple):
    """The deflections of the K clearances and their first two derivatives at both ends of a step."""

    begin: Matrix  # (3, K)
    end: Matrix


@kernel
def _way_across(crossings, i, k, step):
    """Which way a clearance crosses next, from crossing i on, forwards or backwards; -1: it crosses nothing."""
    while 0 <= i < crossings.clearance.size:
        if crossings.clearance[i] == k:
            return crossings.upward[i]
        i += step
    return crossings.outside[1 if step > 0 else 0, k]


@strict_entry
def write_outside(watch, upward, begins, outside):
    """Write which way clearances cross last before a part of a motion that repeats, and first after it.

    watch: (E,) what crosses; numbers that are none of the K clearances are passed over.
    upward: (E,) 1 upwards, 0 downwards.
    begins: (2,) crossings before the start and before the end of the part; 0 and 0 for the whole motion.
    outside: (2, K) written; -1: it crosses nothing.
    """
    count, clearances = watch.size, outside.shape[1]
    for k in range(clearances):
        outside[0, k] = outside[1, k] = -1
    for i in range(count):
        before, after = (begins[0] + i) % count, (begins[1] - 1 - i) % count
        if watch[before] < clearances:
            outside[0, watch[before]] = upward[before]
        if watch[after] < clearances:
            outside[1, watch[after]] = upward[after]


@strict
def write_direction(columns, scale, row, direction):
    """Write the change that keeps the way from the start to the end of a motion, and of which a row's product is 1.

    columns: (N, N + 1) perturbations at the end, and s.
    scale: (N,) balanced = scale * SI.
    row: (N + 1,) over the state at the start [SI], and p.
    """
    states, matrix, change = scale.size, direction.matrix, direction.change
    for i in range(states):
        for j in range(states + 1):
            matrix[i, j] = columns[i, j]
        matrix[i, i] -= 1.0
        matrix[states, i] = row[i] / scale[i]
        change[i] = 0.0
    matrix[states, states] = row[states]
    change[states] = 1.0
    if not factorise(direction, states + 1):
        return False
    substitute(direction, states + 1, change)
    return True


@kernel
def _perturbed(states, size):
    """Room for a motion and its perturbation."""
    z, v = np.empty((2, size)), np.empty((2, states))
    return Perturbed(z[0], v[0], z[1], v[1])


@kernel
def _copy(source, out):
    for j in range(out.z.size):
        out.z[j] = source.z[j]
    for j in range(out.v.size):
        out.v[j] = source.v[j]


@kernel
def _write_both(matrix, moved, by, now):
    """Write the products of rates, or of increments, with a motion and its perturbation; p changes by ``by``."""
    states = now.v.size
    write_products(matrix, states, now.z, now.product)
    for i in range(states):
        now.v_product[i] = by * dot(moved, i, now.z) + dot(matrix, i, now.v)


@kernel
def _add_products(now):
    for j in range(now.z.size):
        now.z[j] += now.product[j]
    for j in range(now.v.size):
        now.v[j] += now.v_product[j]


@kernel
def _begin_interval(course, i, change, now):
    """Put a motion and its perturbation after crossing i."""
    states = now.v.size
    for j in range(now.z.size):
        now.z[j] = course.z[i, j]
    for j in range(states):
        now.v[j] = 0.0
        for p in range(states + 1):
            now.v[j] += course.columns[i, j, p] * change[p]


@strict
def _carry_both(steps, slot, level, left, by, now):
    """Carry a motion and its perturbation over a number of the steps of a level."""
    length = 0.5 ** steps.first[slot]
    for n in range(steps.first[slot], level + 1):
        while left >= length:
            _write_both(steps.increment[slot, n], steps.moved[slot, n], by, now)
            _add_products(now)
            left -= length
        length *= 0.5


@strict
def _write_series(rates, slot, k, h, by, begin, series):
    """Write the coefficients of a deflection, its perturbation and both rates, over powers of the time over h."""
    term = series.term
    _copy(begin, term)
    for m in range(_ORDER):
        series.value[m] = dot(rates.deflection, k, term.z)
        series.v_value[m] = by * dot(rates.deflection_shift, k, term.z) + dot(rates.deflection, k, term.v)
        if m > 0:
            series.rate[m - 1], series.v_rate[m - 1] = m * series.value[m], m * series.v_value[m]
        _write_both(rates.generator[slot], rates.shift[slot], by, term)
        for j in range(term.z.size):
            term.z[j] = h / (m + 1.0) * term.product[j]
        for j in range(term.v.size):
            term.v[j] = h / (m + 1.0) * term.v_product[j]


@kernel
def _write_product(row, states, increment, out):
    """Write a row plus its product with an increment."""
    size = row.size
    for j in range(size):
        out[j] = row[j]
    for i in range(states):
        for j in range(size):
            out[j] += row[i] * increment[i, j]
    add_turned(row, states, increment, out)


@strict
def _write_looks(rates, steps, slot, level, looks):
    """Write the looks of a slot: each the one before times the exponential over a step."""
    generator, increment, states = rates.generator[slot], steps.increment[slot, level], steps.moved.shape[2]
    columns, clearances, size = looks.columns[slot], rates.deflection.shape[0], generator.shape[0]
    row, product = np.empty(size), np.empty(size)
    for k in range(clearances):
        for p in range(3):
            for j in range(size):
                product[j] = rates.deflection[k, j]
            for _ in range(p):
                for j in range(size):
                    row[j], product[j] = product[j], 0.0
                for q in range(size):
                    for j in range(size):
                        product[j] += row[q] * generator[q, j]
            for c in range(p * clearances + k, columns.shape[1], 3 * clearances):
                for j in range(size):
                    row[j] = columns[j, c] = product[j]
                _write_product(row, states, increment, product)
    looks.is_written[slot] = 1.0


@kernel
def _see(columns, first, z, values):
    """Write the products of z with as many columns as there are values, from one on."""
    for c in range(values.size):
        values[c] = 0.0
    for j in range(z.size):
        weight, row = z[j], columns[j]
        for c in range(values.size):
            values[c] += weight * row[first + c]


@kernel
def _copy_look(look, out):
    for p in range(look.shape[0]):
        for k in range(look.shape[1]):
            out[p, k] = look[p, k]


@kernel
def _crosses(seen, k):
    """Whether a rate has another sign at the end of a step."""
    return (seen.begin[1, k] > 0.0) != (seen.end[1, k] > 0.0)


@kernel
def _dips(seen, k):
    """Whether a rate comes nearer to zero where a step begins, and goes away from it where the step ends."""
    return seen.begin[1, k] * seen.begin[2, k] < 0.0 and seen.end[1, k] * seen.end[2, k] > 0.0


@kernel
def _is_visit(crossings, i, k, upward):
    """Whether a turning point after crossing i lies beyond a corner that is crossed before and after it."""
    entered, left = _way_across(crossings, i - 1, k, -1), _way_across(crossings, i, k, 1)
    return entered == upward and left != upward


@strict
def _write_turn(piece, rates, crossings, turn, by, reach, turns, count):
    """Write a turning point by the corner ahead, and by the one behind that it has passed, where it lies near them."""
    i, k, upward, time, value, slope, time_slope, lower, upper = turn
    sign = 1.0 if upward == 1 else -1.0
    for is_behind in range(2):
        is_upper = (upward == 1) != (is_behind == 1)
        corner, shift = (upper, rates.upper_shift[piece]) if is_upper else (lower, rates.lower_shift[piece])
        depth = sign * (value - corner)
        is_near = abs(depth) < reach and (is_behind == 0 or _is_visit(crossings, i, k, upward))
        if is_near and count[0] < turns.shape[0]:
            row = turns[count[0]]
            row[CLEARANCE], row[UPWARD], row[TURN_TIME], row[TURN_DEPTH] = k, upward, time, depth
            row[TURN_SLOPE], row[TURN_TIME_SLOPE] = sign * (slope - by * shift), time_slope
            count[0] += 1


@strict
def _write_level(laws, rates, piece, value, slope, by, row):
    """Write how far a deflection is from the nearest corner of its piece."""
    below, above = value - laws.lower[piece], laws.upper[piece] - value
    row[LEVEL] = min(below, above)
    if below < above:
        row[LEVEL_SLOPE] = slope - by * rates.lower_shift[piece]
    else:
        row[LEVEL_SLOPE] = by * rates.upper_shift[piece] - slope


@strict
def _write_dip(laws, rates, k, piece, time, h, s, by, series, turns, count):
    """Write where a rate comes nearest to zero and does not reach it: its distance beyond zero, as a depth."""
    rate, v_rate = value_of(series.rate, s) / h, value_of(series.v_rate, s) / h
    bend, v_bend = bend_of(series.rate, s) / (h * h * h), slope_of(series.v_rate, s) / (h * h)
    if count[0] < turns.shape[0]:
        row, sign = turns[count[0]], -1.0 if rate > 0.0 else 1.0
        row[CLEARANCE], row[UPWARD], row[TURN_TIME] = k, RISING if rate > 0.0 else FALLING, time + s * h
        row[TURN_DEPTH], row[TURN_SLOPE], row[TURN_TIME_SLOPE] = sign * rate, sign * v_rate, -v_bend / bend
        slope = value_of(series.v_value, s) - rate * v_bend / bend
        _write_level(laws, rates, piece, value_of(series.value, s), slope, by, row)
        count[0] += 1


@strict
def _write_part(laws, rates, crossings, part, by, series, seen, reach, turns, count):
    """Write the turning points of clearance k within a step, of which ``series`` is the series, or where it dips."""
    i, k, piece, time, h = part
    lower, upper = laws.lower[piece], laws.upper[piece]
    begin, ends = 0.0, (1.0, 1.0)
    if not _crosses(seen, k):
        s = turn_between(series.rate, 0.0, 1.0)
        if (value_of(series.rate, s) > 0.0) == (series.rate[0] > 0.0):
            value = value_of(series.value, s)
            if min(abs(value - lower), abs(value - upper)) < reach:
                _write_dip(laws, rates, k, piece, time, h, s, by, series, turns, count)
            return
        ends = (s, 1.0)
    for end in ends:
        if begin < end:
            upward = int(value_of(series.rate, begin) > 0.0)
            s = turn_between(series.value, begin, end)
            bend = bend_of(series.value, s) / (h * h)
            time_slope = -slope_of(series.v_value, s) / (h * bend)
            value, slope = value_of(series.value, s), value_of(series.v_value, s)
            turn = i, k, upward, time + s * h, value, slope, time_slope, lower, upper
            _write_turn(piece, rates, crossings, turn, by, reach, turns, count)
        begin = end


@kernel
def _is_far(laws, piece, seen, k, h, reach):
    """Whether a deflection stays farther than a reach from both corners of its piece, over a step."""
    value = seen.begin[0, k]
    way = reach + 2.0 * (
        h * max(abs(seen.begin[1, k]), abs(seen.end[1, k])) + h * h * max(abs(seen.begin[2, k]), abs(seen.end[2, k]))
    )
    return value - laws.lower[piece] > way and laws.upper[piece] - value > way


@strict
def _delay(rates, crossings, i, by, now, seen):
    """By how much crossing i - 1 comes later along the direction; ``seen`` is a look just behind it."""
    crossed = crossings.clearance[i - 1]
    moved = by * (dot(rates.deflection_shift, crossed, now.z) - crossings.shift[i - 1])
    return -(moved + dot(rates.deflection, crossed, now.v)) / seen[1, crossed]


@strict
def _write_kinks(laws, clearances, regions, rates, course, crossings, i, by, now, last, seen, reach, turns, count):
    """Write the rates that come nearest to zero at crossing i - 1, where their derivatives jump from ``last``."""
    slot, time_slope, is_known = course.slot[i], crossings.delay[i - 1], False
    for k in range(clearances.size):
        rate, before, after = seen[1, k], last[2, k], seen[2, k]
        piece = laws.first[clearances[k]] + regions.piece[slot, k]
        distance = min(seen[0, k] - laws.lower[piece], laws.upper[piece] - seen[0, k])
        if rate * before < 0.0 < rate * after and distance < reach[k] and count[0] < turns.shape[0]:
            if not is_known:
                _write_both(rates.generator[slot], rates.shift[slot], by, now)
                is_known = True
            moved = by * dot(rates.deflection_shift, k, now.z) + dot(rates.deflection, k, now.v)
            v_rate = by * dot(rates.deflection_shift, k, now.product) + dot(rates.deflection, k, now.v_product)
            row, sign = turns[count[0]], -1.0 if rate > 0.0 else 1.0
            row[CLEARANCE], row[UPWARD], row[TURN_TIME] = k, RISING if rate > 0.0 else FALLING, course.time[i]
            row[TURN_DEPTH], row[TURN_SLOPE] = sign * rate, sign * (v_rate + after * time_slope)
            row[TURN_TIME_SLOPE] = time_slope
            _write_level(laws, rates, piece, seen[0, k], moved + rate * time_slope, by, row)
            count[0] += 1


@strict
def write_turns(laws, clearances, regions, rates, steps, course, crossings, change, reach, turns, count):
    """Write the turning points that lie nearer than a reach to a corner ahead, or to one that they have passed.

    The delays of the crossings are written as well.

    ``change`` is the direction along which their slopes are. Rates are looked at in blocks: of every block one state is
    made. The motion and its perturbation are carried to where a rate changes its sign, or may do so twice. Where there
    is no room for all of them the count is -1.
    """
    slots, states, size = rates.shift.shape
    width, by, block = clearances.size, change[states], np.empty((2, size))
    one_look, most = 3 * width, 2**_BLOCK
    looks = Looks(np.empty((slots, size, (1 + most) * one_look)), np.zeros(slots))
    values, seen, last = np.empty((4, _ORDER)), np.zeros((1 + most) * one_look), np.empty((3, width))
    table = seen.reshape((1 + most, 3, width))
    series = Series(_perturbed(states, size), values[0], values[1], values[2, 1:], values[3, 1:])
    now = _perturbed(states, size)
    count[0] = 0
    for i in range(course.slot.size):
        slot, length = course.slot[i], course.time[i + 1] - course.time[i]
        level = max(steps.first[slot], steps.levels[slot] - 1 - _COARSER)
        block_level = max(steps.first[slot], level - _BLOCK)
        h, begin, carried = 0.5**level, 0.0, 0.0
        if looks.is_written[slot] == 0.0:
            _write_looks(rates, steps, slot, level, looks)
        _begin_interval(course, i, change, now)
        for j in range(size):
            block[0, j] = now.z[j]
        _copy_look(table[0], last)
        columns = looks.columns[slot]
        _see(columns, 0, now.z, seen[:one_look])
        if i > 0:
            crossings.delay[i - 1] = _delay(rates, crossings, i, by, now, table[0])
            _write_kinks(
                laws, clearances, regions, rates, course, crossings, i, by, now, last, table[0], reach, turns, count
            )
        while begin < length:
            _see(columns, one_look, block[0], seen[one_look:])
            for n in range(2 ** (level - block_level)):
                at, end = begin + n * h, min(begin + (n + 1) * h, length)
                if end == length:
                    _see(columns, 0, course.z[i + 1], seen[(n + 1) * one_look : (n + 2) * one_look])
                step = Seen(table[n], table[n + 1])
                for k in range(width):
                    if not (_crosses(step, k) or _dips(step, k)):
                        continue
                    piece = laws.first[clearances[k]] + regions.piece[slot, k]
                    if not _is_far(laws, piece, step, k, h, reach[k]):
                        _carry_both(steps, slot, level, at - carried, by, now)
                        carried = at
                        _write_series(rates, slot, k, end - at, by, now, series)
                        part = i, k, piece, course.time[i] + at, end - at
                        _write_part(laws, rates, crossings, part, by, series, step, reach[k], turns, count)
                if end == length or n + 1 == 2 ** (level - block_level):
                    _copy_look(table[n + 1], table[0])
                    break
            begin += 0.5**block_level
            if begin < length:
                write_products(steps.increment[slot, block_level], states, block[0], block[1])
                for j in range(size):
                    block[0, j] += block[1, j]
    if count[0] == turns.shape[0]:
        count[0] = -1
