"""The approach of a deflection to a corner: its extremum near an instant, and the slopes of depth and instant.

The extremum is located by Newton's method, t -> t - (w Z z) / (w Z Z z), with w the row of the deflection and z the
motion (``perturbed_motion``). A perturbation v changes its depth by w v and its instant by -(w Z v) / (w Z Z z). These
rows over v are carried backwards to the start, over a region by exp(Z h) and over a crossing by the transposed jump.
So the slopes of depth and instant by the whole state at the start are known.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, strict, strict_entry
from gearrattle.engine.kernels.arrays import Vector
from gearrattle.engine.kernels.perturbed_motion import (
    advance,
    copy,
    dot,
    enter,
    product,
    room_now,
    room_region,
    room_rows,
    steps_of,
    times_rates,
    write_course,
)
from gearrattle.engine.kernels.turning_point_depths import ORDER, room_series

_NEAR = 1.0 / 64.0  # periods: largest step of Newton's method
_FARTHEST = 1.0 / 16.0  # periods: largest distance of the extremum from the requested instant
_ITERATIONS = 30  # most steps of Newton's method
_SETTLED = 1e-11  # periods: last step of Newton's method


class Touched(NamedTuple):
    """An extremum near a corner, written."""

    number: Vector  # (3,) instant: requested, then of the extremum [periods]; depth, NaN: none; second derivative
    slope: Vector  # (N + 1,) of the depth, by the state at the start [SI] and by p
    time_slope: Vector  # (N + 1,) of the instant


class _Extremum(NamedTuple):
    """An extremum in an interval of the motion."""

    interval: int
    since: float  # time since the beginning of the interval [periods]
    sign: float  # 1: at an upper corner, -1: at a lower one
    corner_shift: float  # derivative of the corner by the parameter
    row: Vector  # (Z,) deflection over z
    row_shift: Vector
    rate_row: Vector


@strict
def _carry_row(driven, path, trace, extremum, row, region):
    """Carry a row over v backwards to the start, from an extremum."""
    states = driven.shift.shape[1]
    memories = path.known.shape[1]
    room = np.empty(driven.generator.shape[1])
    terms = np.empty((3, states))
    term = terms[0]
    following = terms[1]
    total = terms[2]
    for i in range(extremum.interval, -1, -1):
        # each interval backwards, in steps
        enter(driven, path.slot[i], room, region)
        length = extremum.since if i == extremum.interval else path.time[i + 1] - path.time[i]
        count = steps_of(region, length) if length > 0.0 else 0
        for _ in range(count):
            # Taylor series of row exp(A h)
            for j in range(states):
                term[j] = row[j]
                total[j] = row[j]
            for m in range(1, ORDER):
                for j in range(states):
                    following[j] = 0.0
                for q in range(states):
                    weight = length / count / m * term[q]
                    for entry in range(region.own.start[q], region.own.start[q + 1]):
                        following[region.own.column[entry]] += weight * region.own.value[entry]
                for j in range(states):
                    term[j] = following[j]
                    total[j] += term[j]
            for j in range(states):
                row[j] = total[j]
        # memories with a known value at the beginning do not depend on the state before
        for m in range(memories):
            if path.known[i, m] == path.known[i, m]:
                row[states - memories + m] = 0.0
        # backwards over the crossing: the transposed jump
        if i > 0 and path.tick[i - 1] != path.tick[i - 1]:
            weight = 0.0
            for j in range(states):
                weight += row[j] * trace.jump[i - 1, j]
            for j in range(states):
                row[j] -= weight * path.row[i - 1, j]


@kernel
def _interval_at(path, time):
    """The interval that contains an instant of the motion."""
    i = 0
    while i < path.slot.size - 1 and path.time[i + 1] <= time:
        i += 1
    return i


@strict
def _write_slopes(driven, path, trace, extremum, now, scale, region, touched):
    """Write the slopes of the depth and of the instant of an extremum."""
    states = now.v.size
    row = extremum.row
    row_shift = extremum.row_shift
    rate_row = extremum.rate_row
    # derivatives by the parameter, for a fixed start
    depth_by_p = dot(row, now.v) + dot(row_shift, now.z) - extremum.corner_shift
    rate_by_p = dot(rate_row, now.v)
    for q in range(now.z.size):
        rate_by_p += row_shift[q] * product(region.rates, q, now.z)
    for q in range(states):
        rate_by_p += row[q] * product(region.shift, q, now.z)
    # derivatives by the state at the start: the rows of depth and instant, carried backwards
    for j in range(states):
        touched.slope[j] = row[j]
        touched.time_slope[j] = rate_row[j]
    _carry_row(driven, path, trace, extremum, touched.slope, region)
    _carry_row(driven, path, trace, extremum, touched.time_slope, region)
    # signs and factors: depth grows towards the corner, the instant moves by -rate / second derivative
    sign = extremum.sign
    factor = -1.0 / touched.number[2]
    for j in range(states):
        touched.slope[j] = sign * touched.slope[j] * scale[j]
        touched.time_slope[j] = factor * touched.time_slope[j] * scale[j]
    touched.slope[states] = sign * depth_by_p
    touched.time_slope[states] = factor * rate_by_p


@strict_entry
def write_touch(driven, path, z, corner, scale, trace, touched):
    """Write the instant and the depth of an extremum of a deflection near an instant, and the slopes of both.

    z: (Z,) states and inputs at the start, scaled.
    corner: (2,) index of the clearance; 1: its upper corner, 0: the lower one.
    scale: (N,) scaled states over states in SI units.
    """
    # the motion and its change with the parameter, at the beginning of every interval
    k = corner[0]
    upward = corner[1]
    states = scale.size
    size = z.size
    change = np.zeros(states + 1)
    change[states] = 1.0
    write_course(driven, path, z, change, trace)
    # the extremum, by Newton's method in time; the state is computed from the beginning of its interval
    asked = touched.number[0]
    end = path.time[path.time.size - 1]
    time = asked
    touched.number[1] = np.nan
    now = room_now(states, size)
    region = room_region(states, size)
    rows = np.empty((4, size))
    none = room_rows(0, states, size)
    series = room_series(0)
    copy(driven.deflection[k], rows[0])
    copy(driven.deflection_shift[k], rows[1])
    for _ in range(_ITERATIONS):
        at = time - end * np.floor(time / end)
        i = _interval_at(path, at)
        since = at - path.time[i]
        enter(driven, path.slot[i], rows[3], region)
        copy(trace.z[i], now.z)
        copy(trace.v[i], now.v)
        count = steps_of(region, since) if since > 0.0 else 0
        for _ in range(count):
            advance(region, none, 1.0, since / count, now, series)
        times_rates(rows[0], region, rows[2])
        times_rates(rows[2], region, rows[3])
        # a minimum near an upper corner, or a maximum near a lower one: no touch
        rate = dot(rows[2], now.z)
        bend = dot(rows[3], now.z)
        if (bend >= 0.0) == (upward == 1):
            return
        # Newton's step in time, at most _NEAR
        change_of_time = min(max(-rate / bend, -_NEAR), _NEAR)
        time += change_of_time
        if abs(time - asked) > _FARTHEST:
            return
        if abs(change_of_time) < _SETTLED:  # converged: depth and slopes
            sign = 1.0 if upward == 1 else -1.0
            bound = path.upper[i, k] if upward == 1 else path.lower[i, k]
            touched.number[0] = time
            touched.number[2] = bend
            touched.number[1] = sign * (dot(rows[0], now.z) - bound)
            shift = path.upper_shift[i, k] if upward == 1 else path.lower_shift[i, k]
            if np.isfinite(bound):
                extremum = _Extremum(i, since, sign, shift, rows[0], rows[1], rows[2])
                _write_slopes(driven, path, trace, extremum, now, scale, region, touched)
            return
