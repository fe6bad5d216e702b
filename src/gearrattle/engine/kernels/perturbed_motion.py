"""A motion from crossing to crossing, with one perturbation of it.

Time is counted in periods. Inside a region z' = Z z, z = (x, u): states and inputs. A perturbation v of the states that
begins with a change of the state at the start and of the parameter p, by dp, obeys

    v' = Z v + (dZ/dp) z dp.

A bound b, crossed by a row r of z at the rate g = r Z z, is met later by

    dt = -(r v + (dr/dp z - db/dp) dp) / g,        v -> v + (Z z - Z+ z+) dt,

Z+ and z+ behind the bound. Where a law alone changes there, Z z - Z+ z+ is in proportion to g, which is divided out:
valid at a grazing too. Memories that are known behind it change with what is known.

Over a step of at most ``_STEP`` radians of the fastest mode z and v are Taylor series: so is every deflection, whose
turning points are sought there (``depths``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, strict, strict_entry
from gearrattle.engine.kernels.arrays import Array3, IntMatrix, IntVector, Matrix, UInt64Vector, Vector
from gearrattle.engine.kernels.motion_levels import bend_of
from gearrattle.engine.kernels.turning_point_depths import ORDER, Part, is_far, room_series, search, write_kinks

_STEP = 2.0  # radians of the fastest mode in a step
_ROUNDING = 1e-18  # terms below this share of the first are left out


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
    known: Matrix  # (E + 1, M) memories that are known where an interval begins; NaN: they go on
    known_shift: Matrix
    clearance: IntVector  # (E,) what crosses; from K on no clearance
    upward: IntVector
    row: Matrix  # (E, Z) r
    row_shift: Matrix  # (E, Z)
    bound_shift: Vector  # (E,)
    tick: Vector  # (E,) d/dp of the instant of a change by the clock; NaN: no such change
    is_law: IntVector  # (E,) 1: a law alone changes
    outside: IntMatrix  # (2, K) 1 upwards, 0 downwards: before the start of the motion, after its end; -1: no crossing


class Trace(NamedTuple):
    """A motion and its perturbation where intervals begin and at the end, and its turning points."""

    z: Matrix  # (E + 2, Z)
    v: Matrix  # (E + 2, N)
    delay: Vector  # (E,) dt of every crossing
    jump: Matrix  # (E, N) (Z z - Z+ z+) / g of every crossing, without g where the clock decides
    reach: Vector  # (K,) of a corner: turning points farther away are left out
    turns: Matrix  # (., COLUMNS); without rows none are sought
    number: IntVector  # (1,) of turning points; -1: there are more than rows


class _Sparse(NamedTuple):
    """A matrix by rows: entries ``start[i]`` to ``start[i + 1]`` of the others are those of row i."""

    start: IntVector
    column: UInt64Vector
    value: Vector


class _Region(NamedTuple):
    """Rates of a motion and of its perturbation in one region."""

    rates: _Sparse  # (Z, Z)
    own: _Sparse  # (N, N) of the states alone
    shift: _Sparse  # (N, Z)
    speed: Vector  # (1,) about the fastest mode [1/period]


class _Now(NamedTuple):
    """A motion and its perturbation, and their terms."""

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
    """Room for the rates of a region."""
    return _Region(_room_sparse(size, size), _room_sparse(states, states), _room_sparse(states, size), np.zeros(1))


@kernel
def room_rows(count, states, size):
    """Room for rows over z, over v, and how they change with p."""
    return _Region(_room_sparse(count, size), _room_sparse(count, states), _room_sparse(count, size), np.zeros(1))


@kernel
def room_now(states, size):
    """Room for a motion, its perturbation and their terms."""
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
    """Product of two vectors, as far as both go."""
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
    # terms of order m of the motion z and of its perturbation v, by turns
    share = 1.0
    copy(now.z, now.z_term)
    copy(now.v, now.v_term)
    for m in range(ORDER):
        # coefficients of all rows: C z of the motion, C v + (dC/dp) z of the perturbation
        for k in range(series.value.shape[0]):
            series.value[k, m] = product(rows.rates, k, now.z_term)
            series.change[k, m] = product(rows.own, k, now.v_term) + by * product(rows.shift, k, now.z_term)
        # the next terms are below rounding: the coefficients that are left are zero
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
    """Set the memories that are known where interval i begins."""
    first = now.v.size - path.known.shape[1]
    for m in range(path.known.shape[1]):
        if path.known[i, m] == path.known[i, m]:
            now.z[first + m] = path.known[i, m]
            now.v[first + m] = by * path.known_shift[i, m]


@kernel
def _write_jump(driven, path, i, z, z_after, region, room, jump):
    """Write Z z - Z+ z+ of crossing i over its rate, which is returned; that over 1 where the clock decides."""
    before = driven.generator[path.slot[i]]
    after = driven.generator[path.slot[i + 1]]
    size = z.size
    times_rates(path.row[i], region, room)
    # the rate at which the row passes its corner
    rate = dot(room, z)
    square = dot(room[: jump.size], room)
    # the jump of the rates over that rate
    for j in range(jump.size):
        total = 0.0
        if path.is_law[i] == 1:  # the rate alone is seen: what depends on the deflection vanishes at the corner
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
    """Carry a motion and its perturbation over crossing i; its delay is returned."""
    # the state behind the crossing: memories that are known there
    copy(now.z, now.z_term)
    first = now.v.size - path.known.shape[1]
    for m in range(path.known.shape[1]):
        if path.known[i + 1, m] == path.known[i + 1, m]:
            now.z_term[first + m] = path.known[i + 1, m]
    rate = _write_jump(driven, path, i, now.z, now.z_term, region, room, jump)
    # how the crossing moves: with the clock, or with its corner and with what is watched
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
    """Follow a motion and its perturbation, and write the turning points that lie near a corner.

    z: (Z,) at the start, balanced.
    change: (N + 1,) of the state at the start, balanced, and of p.
    """
    # room for the motion, its perturbation and the series of the deflections
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
        for n in range(count):  # within the interval: step by step
            h = length / count
            begin = path.time[i] + n * h
            advance(region, rows, by, h, now, series)
            if n == 0 and i > 0:  # dips at the crossing before
                write_kinks(path, i, by, h, series, last, trace)
            for k in range(sought):  # turning points and dips of every clearance
                last[k] = bend_of(series.value[k], 1.0) / (h * h)
                if is_far(path, i, k, series, trace):
                    sign[k] = -1
                    continue
                rises = series.value[k, 1] > 0.0 if sign[k] < 0 else sign[k] == 1
                sign[k] = 1 if search(path, Part(i, k, begin, h, by), rises, series, trace) else 0
        if i + 1 < path.slot.size:  # over the crossing behind it
            trace.delay[i] = _leap(driven, path, i, by, region, room, trace.jump[i], now)
    end = path.slot.size
    copy(now.z, trace.z[end])
    copy(now.v, trace.v[end])
    if trace.number[0] > trace.turns.shape[0]:
        trace.number[0] = -1
