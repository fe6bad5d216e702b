"""A motion from crossing to crossing, with one perturbation.

Time is counted in periods. Inside a region z' = Z z, z = (x, u): states and inputs. A perturbation v of the states that
begins with a change of the state at the start and of the parameter p, by dp, obeys

    v' = Z v + (dZ/dp) z dp.

A bound b is crossed by r z, with a row r, at the rate g = r Z z. The perturbation delays the crossing by

    dt = -(r v + (dr/dp z - db/dp) dp) / g,        v -> v + (Z z - Z+ z+) dt,

with Z+ and z+ behind the bound. If only a law changes, Z z - Z+ z+ is in proportion to g, and g is cancelled: the jump
of v is then valid at a grazing too. A memory whose value is known behind the bound gets the derivative of that value.

Over a step of at most ``_STEP`` radians of the fastest mode, z and v are Taylor series, and so is every deflection. The
turning points of the deflections are searched in these steps (``turning_point_depths``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, strict, strict_entry
from gearrattle.engine.kernels.arrays import Array3, IntMatrix, IntVector, Matrix, UInt64Vector, Vector
from gearrattle.engine.kernels.motion_levels import bend_of
from gearrattle.engine.kernels.turning_point_depths import ORDER, Part, is_far, room_series, search, write_kinks

_STEP = 2.0  # rad: phase of the fastest mode in a step
_ROUNDING = 1e-18  # share of the first term below which terms are omitted


class Driven(NamedTuple):
    """Rates of a motion in S regions: Z entries of z, the first N of them states; K clearances."""

    generator: Array3  # (S, Z, Z)
    shift: Array3  # (S, N, Z) d/dp of the rows of states
    deflection: Matrix  # (K, Z) of the clearances
    deflection_shift: Matrix  # (K, Z)


class Path(NamedTuple):
    """The E crossings of a motion, the E + 1 intervals between them; M memories are the last states."""

    time: Vector  # (E + 2,) in periods: start, crossings, end
    slot: IntVector  # (E + 1,) region of every interval
    lower: Matrix  # (E + 1, K) corners of the pieces
    upper: Matrix
    lower_shift: Matrix
    upper_shift: Matrix
    known: Matrix  # (E + 1, M) memories with a known value at the start of an interval; NaN: a memory keeps its value
    known_shift: Matrix
    clearance: IntVector  # (E,) index of the watched quantity that crosses; from K on: auxiliaries
    upward: IntVector
    row: Matrix  # (E, Z) r
    row_shift: Matrix  # (E, Z)
    bound_shift: Vector  # (E,)
    tick: Vector  # (E,) d/dp of the instant of a change by the clock; NaN: no such change
    is_law: IntVector  # (E,) 1: a law alone changes
    outside: IntMatrix  # (2, K) last crossing before the start, first after the end: 1 upwards, 0 downwards, -1 none


class Trace(NamedTuple):
    """A motion and its perturbation at the starts of intervals and at the end, and the turning points."""

    z: Matrix  # (E + 2, Z)
    v: Matrix  # (E + 2, N)
    delay: Vector  # (E,) dt of every crossing
    jump: Matrix  # (E, N) (Z z - Z+ z+) / g of every crossing; without 1 / g for a change by the clock
    reach: Vector  # (K,) distance from a corner up to which turning points are written
    turns: Matrix  # (., COLUMNS); no rows: turning points are not searched
    number: IntVector  # (1,) number of turning points; -1: more than rows


class _Sparse(NamedTuple):
    """A matrix by rows: entries ``start[i]`` to ``start[i + 1]`` of ``column`` and ``value`` belong to row i."""

    start: IntVector
    column: UInt64Vector
    value: Vector


class _Region(NamedTuple):
    """Rates of a motion and of its perturbation in one region."""

    rates: _Sparse  # (Z, Z)
    own: _Sparse  # (N, N) of the states alone
    shift: _Sparse  # (N, Z)
    speed: Vector  # (1,) estimate of the rate of the fastest mode [1/period]


class _Now(NamedTuple):
    """The present motion and perturbation, and the present and next terms of their series."""

    z: Vector
    v: Vector
    z_term: Vector
    v_term: Vector
    z_next: Vector
    v_next: Vector


@kernel
def copy(source, out):
    """Write one vector into another."""
    for j in range(out.size):
        out[j] = source[j]


@kernel
def _write_sparse(matrix, out):
    """Write the entries that are not zero."""
    count = 0
    out.start[0] = 0
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            if matrix[i, j] != 0.0:
                out.column[count] = j
                out.value[count] = matrix[i, j]
                count += 1
        out.start[i + 1] = count


@kernel
def _room_sparse(rows, columns):
    return _Sparse(np.empty(rows + 1, np.int64), np.empty(rows * columns, np.uint64), np.empty(rows * columns))


@kernel
def room_region(states, size):
    """Arrays for the rates of a region."""
    return _Region(_room_sparse(size, size), _room_sparse(states, states), _room_sparse(states, size), np.zeros(1))


@kernel
def room_rows(count, states, size):
    """Arrays for rows over z, over v, and for their derivatives by p."""
    return _Region(_room_sparse(count, size), _room_sparse(count, states), _room_sparse(count, size), np.zeros(1))


@kernel
def room_now(states, size):
    """Arrays for a motion, its perturbation and the terms of their series."""
    z = np.zeros((3, size))
    v = np.zeros((3, states))
    return _Now(z[0], v[0], z[1], v[1], z[2], v[2])


@kernel
def enter(driven, slot, sums, region):
    """Write the rates of a region; ``sums`` is scratch (Z,)."""
    generator = driven.generator[slot]
    largest = 0.0
    states = driven.shift.shape[1]
    _write_sparse(generator, region.rates)
    _write_sparse(generator[:states, :states], region.own)
    _write_sparse(driven.shift[slot], region.shift)
    for i in range(sums.size):
        sums[i] = 0.0
        for entry in range(region.rates.start[i], region.rates.start[i + 1]):
            sums[i] += abs(region.rates.value[entry])
    for i in range(sums.size):
        total = 0.0
        for entry in range(region.rates.start[i], region.rates.start[i + 1]):
            total += abs(region.rates.value[entry]) * sums[region.rates.column[entry]]
        largest = max(largest, total)
    region.speed[0] = np.sqrt(largest)


@kernel
def steps_of(region, length):
    """Number of steps into which an interval is cut."""
    return max(1, int(np.ceil(region.speed[0] * length / _STEP)))


@kernel
def product(sparse, i, x):
    """Row i of a sparse matrix times a vector."""
    total = 0.0
    for entry in range(sparse.start[i], sparse.start[i + 1]):
        total += sparse.value[entry] * x[sparse.column[entry]]
    return total


@kernel
def dot(row, z):
    """Product of two vectors up to the length of the shorter one."""
    total = 0.0
    for j in range(min(row.size, z.size)):
        total += row[j] * z[j]
    return total


@kernel
def times_rates(row, region, out):
    """Write a row times the rates of a region."""
    for j in range(row.size):
        out[j] = 0.0
    for q in range(row.size):
        if row[q] != 0.0:
            for entry in range(region.rates.start[q], region.rates.start[q + 1]):
                out[region.rates.column[entry]] += row[q] * region.rates.value[entry]


@strict
def advance(region, rows, by, h, now, series):
    """Carry a motion and its perturbation over a step, and write the series of all rows."""
    reach = region.speed[0] * h
    # for every order m: the terms of z and v
    share = 1.0
    copy(now.z, now.z_term)
    copy(now.v, now.v_term)
    for m in range(ORDER):
        # coefficients of all rows: C z of the motion, C v + (dC/dp) z of the perturbation
        for k in range(series.value.shape[0]):
            series.value[k, m] = product(rows.rates, k, now.z_term)
            series.change[k, m] = product(rows.own, k, now.v_term) + by * product(rows.shift, k, now.z_term)
        # the next terms are below rounding: the remaining coefficients are zero
        share *= reach / (m + 1.0)
        if m + 1 == ORDER or (m > reach and share < _ROUNDING):
            for k in range(series.value.shape[0]):
                for n in range(m + 1, ORDER):
                    series.value[k, n] = 0.0
                    series.change[k, n] = 0.0
            break
        # next terms: z' = Z z, v' = A v + B z
        factor = h / (m + 1.0)
        for i in range(now.z.size):
            now.z_next[i] = factor * product(region.rates, i, now.z_term)
        for i in range(now.v.size):
            now.v_next[i] = factor * (product(region.own, i, now.v_term) + by * product(region.shift, i, now.z_term))
        # add them to the state at the end of the step
        for i in range(now.z.size):
            now.z_term[i] = now.z_next[i]
            now.z[i] += now.z_term[i]
        for i in range(now.v.size):
            now.v_term[i] = now.v_next[i]
            now.v[i] += now.v_term[i]


@kernel
def _set_known(path, i, by, now):
    """Set the memories with a known value at the start of interval i."""
    first = now.v.size - path.known.shape[1]
    for m in range(path.known.shape[1]):
        if path.known[i, m] == path.known[i, m]:
            now.z[first + m] = path.known[i, m]
            now.v[first + m] = by * path.known_shift[i, m]


@kernel
def _write_jump(driven, path, i, z, z_after, region, room, jump):
    """Write (Z z - Z+ z+) / g of crossing i, without 1 / g for a change by the clock; return the rate g."""
    before = driven.generator[path.slot[i]]
    after = driven.generator[path.slot[i + 1]]
    size = z.size
    times_rates(path.row[i], region, room)
    # the rate g at the bound
    rate = dot(room, z)
    square = dot(room[: jump.size], room)
    # the jump of the rates over that rate
    for j in range(jump.size):
        total = 0.0
        if path.is_law[i] == 1:  # only the rate enters: terms of the deflection vanish at the corner
            for q in range(jump.size):
                total += (before[j, q] - after[j, q]) * room[q]
            jump[j] = total / square
        else:
            for q in range(size):
                total += before[j, q] * z[q] - after[j, q] * z_after[q]
            jump[j] = total / rate if path.tick[i] != path.tick[i] else total
    return rate


@strict
def _leap(driven, path, i, by, region, room, jump, now):
    """Carry a motion and its perturbation over crossing i; return the delay of the crossing."""
    # the state behind the crossing: memories with a known value are set
    copy(now.z, now.z_term)
    first = now.v.size - path.known.shape[1]
    for m in range(path.known.shape[1]):
        if path.known[i + 1, m] == path.known[i + 1, m]:
            now.z_term[first + m] = path.known[i + 1, m]
    rate = _write_jump(driven, path, i, now.z, now.z_term, region, room, jump)
    # the delay: of the clock, or from the changes of the bound and of the watched quantity
    if path.tick[i] == path.tick[i]:
        delay = by * path.tick[i]
        moved = -delay
    else:
        moved = -by * path.bound_shift[i]
        for j in range(now.z.size):
            moved += by * path.row_shift[i, j] * now.z[j]
        for j in range(now.v.size):
            moved += path.row[i, j] * now.v[j]
        delay = -moved / rate
    # the perturbation behind the crossing, by the jump of the rates
    for j in range(now.v.size):
        now.v[j] -= moved * jump[j]
    _set_known(path, i + 1, by, now)
    return delay


@strict_entry
def write_course(driven, path, z, change, trace):
    """Compute a motion and its perturbation, and write the turning points near a corner.

    z: (Z,) states and inputs at the start, scaled.
    change: (N + 1,) of the state at the start, scaled, and of p.
    """
    # arrays for the motion, its perturbation and the series of the deflections
    states = driven.shift.shape[1]
    size = z.size
    by = change[states]
    now = room_now(states, size)
    region = room_region(states, size)
    sought = driven.deflection.shape[0] if trace.turns.shape[0] > 0 else 0
    rows = room_rows(sought, states, size)
    _write_sparse(driven.deflection[:sought], rows.rates)
    _write_sparse(driven.deflection[:sought, :states], rows.own)
    _write_sparse(driven.deflection_shift[:sought], rows.shift)
    series = room_series(sought)
    room = np.empty(size)
    last = np.zeros(sought)
    sign = np.full(sought, -1)
    # the start
    copy(z, now.z)
    copy(change, now.v)
    _set_known(path, 0, by, now)
    trace.number[0] = 0
    for i in range(path.slot.size):
        # each interval between crossings: its region and its steps
        copy(now.z, trace.z[i])
        copy(now.v, trace.v[i])
        length = path.time[i + 1] - path.time[i]
        enter(driven, path.slot[i], room, region)
        count = steps_of(region, length) if length > 0.0 else 0
        for n in range(count):
            h = length / count
            begin = path.time[i] + n * h
            advance(region, rows, by, h, now, series)
            if n == 0 and i > 0:  # dips at the last crossing
                write_kinks(path, i, by, h, series, last, trace)
            for k in range(sought):  # turning points and dips of every clearance
                last[k] = bend_of(series.value[k], 1.0) / (h * h)
                if is_far(path, i, k, series, trace):
                    sign[k] = -1
                    continue
                rises = series.value[k, 1] > 0.0 if sign[k] < 0 else sign[k] == 1
                sign[k] = 1 if search(path, Part(i, k, begin, h, by), rises, series, trace) else 0
        if i + 1 < path.slot.size:  # over the crossing at the end of the interval
            trace.delay[i] = _leap(driven, path, i, by, region, room, trace.jump[i], now)
    end = path.slot.size
    copy(now.z, trace.z[end])
    copy(now.v, trace.v[end])
    if trace.number[0] > trace.turns.shape[0]:
        trace.number[0] = -1
