"""Turning points of deflections within a step of a motion (``course``), and their depths.

Over a step a deflection and its perturbation are polynomials of the share of the step. A *turning point* lies where the
rate of a deflection changes its sign. Its *depth* is the distance of the turning point beyond a corner, in the
direction of the motion before it: negative where the corner is not reached. With w the row of the deflection and v the
perturbation of the state z, the depth changes by w v minus the change of the corner, and the instant by -w v' over the
second derivative of w z. Where a rate has an extremum near zero and keeps its sign, within a step or at a crossing, two
turning points may appear. Such an extremum is a *dip*; its depth is the distance of the rate beyond zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, strict, strict_entry
from gearrattle.engine.kernels.arrays import Matrix, Vector
from gearrattle.engine.kernels.motion_levels import bend_of, slope_of, turn_between, value_of

ORDER = 26
"""Terms of the series over a step: the first omitted term is below 1e-17."""
_LOOKS = 8  # equal parts of a step, at whose ends a rate is evaluated
CLEARANCE, UPWARD, TIME, DEPTH, SLOPE, TIME_SLOPE, LEVEL, LEVEL_SLOPE, COLUMNS = range(9)
"""Columns of turning points, and their number. Instants are in periods, slopes are along the perturbation.

LEVEL and its slope exist for dips alone: the distance of the deflection from the nearer corner.
"""
FALLING = 2
RISING = 3
"""Values in the column UPWARD for a dip of a negative and of a positive rate."""
MOST_TURNS = 4096
"""Rows for turning points; if a motion has more, its turning points count as unknown."""


class Series(NamedTuple):
    """Deflections and their perturbations over a step: coefficients of powers of its share."""

    value: Matrix  # (K, ORDER)
    change: Matrix
    rate: Vector  # (ORDER - 1,) derivatives, of one of them
    rate_change: Vector
    looks: Matrix  # (3, _LOOKS + 1) shares of the step; the rate and its derivative at these shares


class Part(NamedTuple):
    """The step in which turning points of a clearance are sought."""

    interval: int
    clearance: int
    begin: float  # of the step [periods]
    length: float  # of the step [periods]
    by: float  # change of the parameter p


class _Least(NamedTuple):
    """An extremum of a rate near zero [SI, per period], and slopes along the perturbation."""

    time: float
    value: float  # of the deflection
    rate: float
    value_slope: float
    rate_slope: float
    time_slope: float


@kernel
def room_series(count):
    """Arrays for the series of ``count`` deflections."""
    coefficients = np.empty((2, count, ORDER))
    looks = np.empty((3, _LOOKS + 1))
    for n in range(_LOOKS + 1):
        looks[0, n] = n / _LOOKS
    return Series(coefficients[0], coefficients[1], np.empty(ORDER - 1), np.empty(ORDER - 1), looks)


@kernel
def _way_across(path, i, k, step):
    """Direction of the next crossing of clearance k from crossing i on, forwards or backwards; -1: none."""
    while 0 <= i < path.clearance.size:
        if path.clearance[i] == k:
            return path.upward[i]
        i += step
    return path.outside[1 if step > 0 else 0, k]


@strict
def _write_turn(path, part, s, upward, series, trace):
    """Write a turning point near the corner ahead, and near a corner passed before, with its depth there."""
    i = part.interval
    k = part.clearance
    # the deflection at the turning point, its change and the change of the instant
    value = value_of(series.value[k], s)
    slope = value_of(series.change[k], s)
    time_slope = -part.length * slope_of(series.change[k], s) / bend_of(series.value[k], s)
    # a visit: the motion crosses the same corner before and after the turning point
    is_visit = _way_across(path, i - 1, k, -1) == upward != _way_across(path, i, k, 1)
    sign = 1.0 if upward == 1 else -1.0
    for is_behind in range(2):
        is_upper = (upward == 1) != (is_behind == 1)
        # the corner, its change with the parameter, and the depth of the motion beyond it
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
    """Write a dip: an extremum of a rate that does not reach zero."""
    i = part.interval
    k = part.clearance
    # the distance of the deflection from the nearer corner
    below = least.value - path.lower[i, k]
    above = path.upper[i, k] - least.value
    if min(below, above) >= trace.reach[k]:
        return
    if trace.number[0] < trace.turns.shape[0]:
        row = trace.turns[trace.number[0]]
        # depth: the distance of the rate from zero, and its slope
        sign = -1.0 if least.rate > 0.0 else 1.0
        row[CLEARANCE] = k
        row[UPWARD] = RISING if least.rate > 0.0 else FALLING
        row[TIME] = least.time
        row[TIME_SLOPE] = least.time_slope
        row[DEPTH] = sign * least.rate
        row[SLOPE] = sign * least.rate_slope
        row[LEVEL] = min(below, above)
        # slope of the level
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
    """The extremum of a rate at the share s of a step."""
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
    """Write a rate and its derivative at all shares of ``looks``, in loops that the compiler vectorises."""
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
    """Write the turning points and dips of a clearance within a step; return whether the last rate is positive."""
    k = part.clearance
    # the series of the rate and of its change, and the values of the rate at the ends of all parts
    for m in range(1, ORDER):
        series.rate[m - 1] = m * series.value[k, m]
        series.rate_change[m - 1] = m * series.change[k, m]
    _look(series)
    share = series.looks[0]
    rate = series.looks[1]
    bend = series.looks[2]
    for n in range(_LOOKS):
        # within one part: a change of sign is a turning point
        low = share[n]
        high = share[n + 1]
        ends = (high, high)
        is_turn = (rate[n + 1] > 0.0) != rises
        if not is_turn and rate[n] * bend[n] < 0.0 < rate[n + 1] * bend[n + 1]:
            # the modulus of the rate has a minimum: either two turning points or a dip
            s = turn_between(series.rate, low, high)
            ends = (s, high)
            is_turn = (value_of(series.rate, s) > 0.0) != rises
            if not is_turn:
                _write_dip(path, part, _least_at(part, s, series), trace)
        # locate the turning points of this part
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
    """Write the dips at crossing i - 1, where the derivatives of the rates jump from ``last``."""
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
    """Write the directions of the last crossings before a part of a periodic motion, and of the first ones after it.

    watch: (E,) index of what crosses; crossings of other quantities than the K clearances are ignored.
    upward: (E,) 1 upwards, 0 downwards.
    begins: (2,) number of crossings before the start and before the end of the part; 0 and 0 for the whole motion.
    outside: (2, K) written; -1: the clearance does not cross.
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
