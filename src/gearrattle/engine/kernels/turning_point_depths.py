"""Turning points of deflections within a step of a motion (``course``), and their depths.

Over a step a deflection and its perturbation are polynomials of the share of the step. A *turning point* lies where the
rate of a deflection changes its sign. Its *depth* is how far it lies beyond a corner, in the direction in which the
deflection moves before it: negative where the corner is not reached. With w the row of the deflection the depth changes
by w v less what the corner does, its instant by -w v' over the second derivative of w z. Where a rate comes nearest to
zero and keeps its sign, within a step or at a crossing, two turning points may appear: such a *dip* is kept, by the
distance of the rate beyond zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, strict, strict_entry
from gearrattle.engine.kernels.arrays import Matrix, Vector
from gearrattle.engine.kernels.motion_levels import bend_of, slope_of, turn_between, value_of

ORDER = 26
"""Terms of the series over a step: the first one left out is below 1e-17."""
_LOOKS = 8  # at a rate, over a step
CLEARANCE, UPWARD, TIME, DEPTH, SLOPE, TIME_SLOPE, LEVEL, LEVEL_SLOPE, COLUMNS = range(9)
"""Columns of turning points, and how many: instants in periods, slopes along the perturbation.

The last two are of dips: how far the deflection is from the corner nearest to it.
"""
FALLING = 2
RISING = 3
"""In the column UPWARD: no turning point, but a dip, where a negative or a positive rate comes nearest to zero."""
MOST_TURNS = 4096
"""Rows for turning points; where there are more they are not known."""


class Series(NamedTuple):
    """Deflections and their perturbations over a step: coefficients of powers of its share."""

    value: Matrix  # (K, ORDER)
    change: Matrix
    rate: Vector  # (ORDER - 1,) derivatives, of one of them
    rate_change: Vector
    looks: Matrix  # (3, _LOOKS + 1) shares of a step, the rate and its derivative there


class Part(NamedTuple):
    """The step in which turning points of a clearance are sought."""

    interval: int
    clearance: int
    begin: float  # of a step [periods]
    length: float
    by: float  # change of p


class _Least(NamedTuple):
    """A rate that comes nearest to zero [SI, per period], and slopes along the perturbation."""

    time: float
    value: float  # of the deflection
    rate: float
    value_slope: float
    rate_slope: float
    time_slope: float


@kernel
def room_series(count):
    """Room for the series of so many deflections."""
    coefficients = np.empty((2, count, ORDER))
    looks = np.empty((3, _LOOKS + 1))
    for n in range(_LOOKS + 1):
        looks[0, n] = n / _LOOKS
    return Series(coefficients[0], coefficients[1], np.empty(ORDER - 1), np.empty(ORDER - 1), looks)


@kernel
def _way_across(path, i, k, step):
    """Direction of a clearance's next crossing, from crossing i on, forwards or backwards; -1: it crosses nothing."""
    while 0 <= i < path.clearance.size:
        if path.clearance[i] == k:
            return path.upward[i]
        i += step
    return path.outside[1 if step > 0 else 0, k]


@strict
def _write_turn(path, part, s, upward, series, trace):
    """Write a turning point by the corner ahead, and by the one behind that it has passed, where it lies near them."""
    i = part.interval
    k = part.clearance
    # the deflection there, its change and the change of the instant
    value = value_of(series.value[k], s)
    slope = value_of(series.change[k], s)
    time_slope = -part.length * slope_of(series.change[k], s) / bend_of(series.value[k], s)
    # a visit: the motion came over the same corner and leaves over it
    is_visit = _way_across(path, i - 1, k, -1) == upward != _way_across(path, i, k, 1)
    sign = 1.0 if upward == 1 else -1.0
    for is_behind in range(2):
        is_upper = (upward == 1) != (is_behind == 1)
        # the corner, how it moves, and the depth of the motion beyond it
        corner = path.upper[i, k] if is_upper else path.lower[i, k]
        moved = part.by * (path.upper_shift[i, k] if is_upper else path.lower_shift[i, k])
        depth = sign * (value - corner)
        if abs(depth) < trace.reach[k] and (is_behind == 0 or is_visit):
            if trace.number[0] < trace.turns.shape[0]:
                row = trace.turns[trace.number[0]]
                row[CLEARANCE] = k
                row[UPWARD] = upward
                row[TIME] = part.begin + s * part.length
                row[DEPTH] = depth
                row[SLOPE] = sign * (slope - moved)
                row[TIME_SLOPE] = time_slope
            trace.number[0] += 1


@strict
def _write_dip(path, part, least, trace):
    """Write where a rate comes nearest to zero and does not reach it: its distance beyond zero, as a depth."""
    i = part.interval
    k = part.clearance
    # its distance from the nearer corner
    below = least.value - path.lower[i, k]
    above = path.upper[i, k] - least.value
    if min(below, above) >= trace.reach[k]:
        return
    if trace.number[0] < trace.turns.shape[0]:
        row = trace.turns[trace.number[0]]
        # depth: the distance of the rate from zero, and how it changes
        sign = -1.0 if least.rate > 0.0 else 1.0
        row[CLEARANCE] = k
        row[UPWARD] = RISING if least.rate > 0.0 else FALLING
        row[TIME] = least.time
        row[TIME_SLOPE] = least.time_slope
        row[DEPTH] = sign * least.rate
        row[SLOPE] = sign * least.rate_slope
        row[LEVEL] = min(below, above)
        # the level at which it happens, and how that changes
        if below < above:
            row[LEVEL_SLOPE] = least.value_slope - part.by * path.lower_shift[i, k]
        else:
            row[LEVEL_SLOPE] = part.by * path.upper_shift[i, k] - least.value_slope
    trace.number[0] += 1


@kernel
def is_far(path, i, k, series, trace):
    """Whether a deflection stays farther than its reach from both corners over a step."""
    value = series.value[k, 0]
    way = trace.reach[k]
    for m in range(1, ORDER):
        way += abs(series.value[k, m])
    return value - path.lower[i, k] > way and path.upper[i, k] - value > way


@kernel
def _least_at(part, s, series):
    """A rate at the instant within a step at which it comes nearest to zero."""
    k = part.clearance
    h = part.length
    rate = value_of(series.rate, s)
    time_slope = -slope_of(series.rate_change, s) / bend_of(series.rate, s)
    value_slope = value_of(series.change[k], s) + rate * time_slope
    rate_slope = value_of(series.rate_change, s) / h
    time = part.begin + s * h
    return _Least(time, value_of(series.value[k], s), rate / h, value_slope, rate_slope, h * time_slope)


@kernel
def _look(series):
    """Write a rate and its derivative at every look: all at once, which vectors do."""
    looks = series.looks
    for n in range(_LOOKS + 1):
        looks[1, n] = 0.0
        looks[2, n] = 0.0
    for m in range(series.rate.size - 1, -1, -1):
        for n in range(_LOOKS + 1):
            looks[2, n] = looks[2, n] * looks[0, n] + looks[1, n]
            looks[1, n] = looks[1, n] * looks[0, n] + series.rate[m]


@strict
def search(path, part, rises, series, trace):
    """Write the turning points and dips of a clearance within a step; gives whether its rate is positive at the end."""
    k = part.clearance
    # the rate within the step, its change, and its values at the looks
    for m in range(1, ORDER):
        series.rate[m - 1] = m * series.value[k, m]
        series.rate_change[m - 1] = m * series.change[k, m]
    _look(series)
    share = series.looks[0]
    rate = series.looks[1]
    bend = series.looks[2]
    for n in range(_LOOKS):
        # between two looks: a change of sign is a turning point
        low = share[n]
        high = share[n + 1]
        ends = (high, high)
        is_turn = (rate[n + 1] > 0.0) != rises
        if not is_turn and rate[n] * bend[n] < 0.0 < rate[n + 1] * bend[n + 1]:  # it comes nearer to zero and goes away
            # the rate comes nearest to zero: either two turning points or a dip
            s = turn_between(series.rate, low, high)
            ends = (s, high)
            is_turn = (value_of(series.rate, s) > 0.0) != rises
            if not is_turn:
                _write_dip(path, part, _least_at(part, s, series), trace)
        # locate the turning points between the looks
        if is_turn:
            for end in ends:
                if low < end:
                    s = turn_between(series.value[k], low, end)
                    _write_turn(path, part, s, 1 if rises else 0, series, trace)
                    rises = not rises
                low = end
    return rises


@strict
def write_kinks(path, i, by, h, series, last, trace):
    """Write the rates that come nearest to zero at crossing i - 1, where their derivatives jump from ``last``."""
    delay = trace.delay[i - 1]
    time = path.time[i]
    for k in range(last.size):
        value = series.value[k, 0]
        rate = series.value[k, 1] / h
        after = 2.0 * series.value[k, 2] / (h * h)
        if rate * last[k] < 0.0 < rate * after:
            value_slope = series.change[k, 0] + rate * delay
            rate_slope = series.change[k, 1] / h + after * delay
            least = _Least(time, value, rate, value_slope, rate_slope, delay)
            _write_dip(path, Part(i, k, time, h, by), least, trace)


@strict_entry
def write_outside(watch, upward, begins, outside):
    """Write which way clearances cross last before a part of a motion that repeats, and first after it.

    watch: (E,) what crosses; numbers that are none of the K clearances are passed over.
    upward: (E,) 1 upwards, 0 downwards.
    begins: (2,) crossings before the start and before the end of the part; 0 and 0 for the whole motion.
    outside: (2, K) written; -1: it crosses nothing.
    """
    count = watch.size
    clearances = outside.shape[1]
    for k in range(clearances):
        outside[0, k] = -1
        outside[1, k] = -1
    for i in range(count):
        before = (begins[0] + i) % count
        after = (begins[1] - 1 - i) % count
        if watch[before] < clearances:
            outside[0, watch[before]] = upward[before]
        if watch[after] < clearances:
            outside[1, watch[after]] = upward[after]
