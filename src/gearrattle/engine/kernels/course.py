"""A motion from crossing to crossing with one perturbation, and the turning points of its deflections.

Time is counted in periods. Inside a region z' = Z z, z = (x, u): states and inputs. A perturbation v of the states that
begins with a change of the state at the start and of the parameter p, by dp, obeys

    v' = Z v + (dZ/dp) z dp.

A bound b, crossed by a row r of z at the rate g = r Z z, is met later by

    dt = -(r v + (dr/dp z - db/dp) dp) / g,        v -> v + (Z z - Z+ z+) dt,

Z+ and z+ behind the bound. Where a law alone changes there, Z z - Z+ z+ is in proportion to g, which is divided out:
valid at a grazing too. Memories that are known behind it change with what is known.

Over a step of at most ``_STEP`` radians of the fastest mode z and v are Taylor series, so a deflection and its
perturbation are polynomials. A *turning point* lies where the rate of a deflection changes its sign. Its *depth* is how
far it lies beyond a corner, in the direction in which the deflection moves before it: negative where the corner is not
reached. The depth changes by w v less what the corner does, its instant by -w v' over the second derivative of w z.
Where a rate comes nearest to zero and keeps its sign, within a step or at a crossing, two turning points may appear:
such a *dip* is kept, by the distance of the rate beyond zero.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, strict, strict_entry
from gearrattle.engine.kernels.arrays import Array3, IntMatrix, IntVector, Matrix, UInt64Vector, Vector
from gearrattle.engine.kernels.dense import factorise, substitute
from gearrattle.engine.kernels.motion_levels import bend_of, slope_of, turn_between, value_of

_ORDER = 26  # terms of the series over a step: the first one left out is below 1e-17
_STEP = 2.0  # radians of the fastest mode in a step
_ROUNDING = 1e-18  # terms below this share of the first are left out
_LOOKS = 8  # at a rate, over a step
_IDLE = 1e-9  # a memory that nothing depends on, and that depends on nothing, to so much
CLEARANCE, UPWARD, TIME, DEPTH, SLOPE, TIME_SLOPE, LEVEL, LEVEL_SLOPE, COLUMNS = range(9)
"""Columns of turning points, and how many: instants in periods, slopes along the perturbation.

The last two are of dips: how far the deflection is from the corner nearest to it.
"""
FALLING = 2
RISING = 3
"""In the column UPWARD: no turning point, but a dip, where a negative or a positive rate comes nearest to zero."""
MOST_TURNS = 4096
"""Rows for turning points; where there are more they are not known."""
NEAR = 1.0 / 64.0
FARTHEST = 1.0 / 16.0
"""Periods that an extremum may move in one step of Newton's method, and from the instant that is asked for."""
# of Newton's method in time; a step after which the depth is exact, in periods
_ITERATIONS = 30
_SETTLED = 1e-11


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


class _Series(NamedTuple):
    """Deflections and their perturbations over a step: coefficients of powers of its share."""

    value: Matrix  # (K, _ORDER)
    change: Matrix
    rate: Vector  # (_ORDER - 1,) derivatives, of one of them
    rate_change: Vector
    looks: Matrix  # (3, _LOOKS + 1) shares of a step, the rate and its derivative there


class _Part(NamedTuple):
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


class _Extremum(NamedTuple):
    """An extremum so long after the beginning of an interval."""

    interval: int
    since: float  # [periods]
    sign: float  # of the way to the corner
    corner_shift: float
    row: Vector  # (Z,) deflection over z
    row_shift: Vector
    rate_row: Vector


@kernel
def _copy(source, out):
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
def _room_region(states, size):
    return _Region(_room_sparse(size, size), _room_sparse(states, states), _room_sparse(states, size), np.zeros(1))


@kernel
def _room_rows(count, states, size):
    """Room for rows over z, over v, and how they change with p."""
    return _Region(_room_sparse(count, size), _room_sparse(count, states), _room_sparse(count, size), np.zeros(1))


@kernel
def _room_now(states, size):
    z = np.zeros((3, size))
    v = np.zeros((3, states))
    return _Now(z[0], v[0], z[1], v[1], z[2], v[2])


@kernel
def _enter(driven, slot, sums, region):
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
def _dot(row, z):
    total = 0.0
    for j in range(min(row.size, z.size)):
        total += row[j] * z[j]
    return total


@kernel
def _times_rates(row, region, out):
    """Write a row times the rates of a region."""
    for j in range(row.size):
        out[j] = 0.0
    for q in range(row.size):
        if row[q] != 0.0:
            for entry in range(region.rates.start[q], region.rates.start[q + 1]):
                out[region.rates.column[entry]] += row[q] * region.rates.value[entry]


@strict
def _step(region, rows, by, h, now, series):
    """Carry a motion and its perturbation over a step, and write the series of all rows."""
    reach = region.speed[0] * h
    # terms of order m of the motion z and of its perturbation v, by turns
    share = 1.0
    _copy(now.z, now.z_term)
    _copy(now.v, now.v_term)
    for m in range(_ORDER):
        # coefficients of all rows: C z of the motion, C v + (dC/dp) z of the perturbation
        for k in range(series.value.shape[0]):
            series.value[k, m] = product(rows.rates, k, now.z_term)
            series.change[k, m] = product(rows.own, k, now.v_term) + by * product(rows.shift, k, now.z_term)
        # the next terms are below rounding: the coefficients that are left are zero
        share *= reach / (m + 1.0)
        if m + 1 == _ORDER or (m > reach and share < _ROUNDING):
            for k in range(series.value.shape[0]):
                for n in range(m + 1, _ORDER):
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
    _times_rates(path.row[i], region, room)
    # the rate at which the row passes its corner
    rate = _dot(room, z)
    square = _dot(room[: jump.size], room)
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
    _copy(now.z, now.z_term)
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
def _is_far(path, i, k, series, trace):
    """Whether a deflection stays farther than its reach from both corners over a step."""
    value = series.value[k, 0]
    way = trace.reach[k]
    for m in range(1, _ORDER):
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
def _search(path, part, rises, series, trace):
    """Write the turning points and dips of a clearance within a step; gives whether its rate is positive at the end."""
    k = part.clearance
    # the rate within the step, its change, and its values at the looks
    for m in range(1, _ORDER):
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
def _write_kinks(path, i, by, h, series, last, trace):
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
            _write_dip(path, _Part(i, k, time, h, by), least, trace)


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
    now = _room_now(states, size)
    region = _room_region(states, size)
    sought = driven.deflection.shape[0] if trace.turns.shape[0] > 0 else 0
    rows = _room_rows(sought, states, size)
    _write_sparse(driven.deflection[:sought], rows.rates)
    _write_sparse(driven.deflection[:sought, :states], rows.own)
    _write_sparse(driven.deflection_shift[:sought], rows.shift)
    coefficients = np.empty((2, sought, _ORDER))
    room = np.empty((2, size))
    looks = np.empty((3, _LOOKS + 1))
    for n in range(_LOOKS + 1):
        looks[0, n] = n / _LOOKS
    series = _Series(coefficients[0], coefficients[1], np.empty(_ORDER - 1), np.empty(_ORDER - 1), looks)
    last = np.zeros(sought)
    sign = np.full(sought, -1)
    # the start
    _copy(z, now.z)
    _copy(change, now.v)
    _set_known(path, 0, by, now)
    trace.number[0] = 0
    for i in range(path.slot.size):
        # each interval between crossings: its region and its steps
        _copy(now.z, trace.z[i])
        _copy(now.v, trace.v[i])
        length = path.time[i + 1] - path.time[i]
        _enter(driven, path.slot[i], room[0], region)
        count = steps_of(region, length) if length > 0.0 else 0
        for n in range(count):  # within the interval: step by step
            h = length / count
            begin = path.time[i] + n * h
            _step(region, rows, by, h, now, series)
            if n == 0 and i > 0:  # dips at the crossing before
                _write_kinks(path, i, by, h, series, last, trace)
            for k in range(sought):  # turning points and dips of every clearance
                last[k] = bend_of(series.value[k], 1.0) / (h * h)
                if _is_far(path, i, k, series, trace):
                    sign[k] = -1
                    continue
                rises = series.value[k, 1] > 0.0 if sign[k] < 0 else sign[k] == 1
                sign[k] = 1 if _search(path, _Part(i, k, begin, h, by), rises, series, trace) else 0
        if i + 1 < path.slot.size:  # over the crossing behind it
            trace.delay[i] = _leap(driven, path, i, by, region, room[0], trace.jump[i], now)
    end = path.slot.size
    _copy(now.z, trace.z[end])
    _copy(now.v, trace.v[end])
    if trace.number[0] > trace.turns.shape[0]:
        trace.number[0] = -1


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


class Direction(NamedTuple):
    """A direction in the space of motions, and its equations; n = N + 1."""

    matrix: Matrix  # (n, n) [[M - I, s], row], overwritten by its factors
    pivots: IntVector  # (n,)
    change: Vector  # (n,) of the state at the start, balanced, and of p


@strict_entry
def write_direction(columns, scale, row, memories, direction):
    """Write the change that keeps the way from the start to the end of a motion, and of which a row's product is 1.

        (M - I) du + s dp = 0,      row . (du, dp) = 1

    A memory that may be anything, because it is let go all along, stays as it is. Returns whether there is a change.

    columns: (N, N + 1) M and s, balanced.
    scale: (N,) balanced = scale * SI.
    row: (N + 1,) over the state at the start [SI], and p.
    memories: how many of the last entries of the state are some.
    """
    states = scale.size
    matrix = direction.matrix
    change = direction.change
    # the equations: M - I and s, and below them the row
    for i in range(states):
        for j in range(states + 1):
            matrix[i, j] = columns[i, j]
        matrix[i, i] -= 1.0
        matrix[states, i] = row[i] / scale[i]
        change[i] = 0.0
    matrix[states, states] = row[states]
    change[states] = 1.0
    # a memory that nothing depends on stays as it is
    for i in range(states - memories, states):
        largest = 0.0
        for j in range(states):
            largest = max(largest, abs(matrix[i, j]), abs(matrix[j, i]))
        if largest < _IDLE:
            for j in range(states + 1):
                matrix[i, j] = 0.0
                matrix[j, i] = 0.0
            matrix[i, i] = 1.0
    # solve them
    if not factorise(direction, states + 1):
        return False
    substitute(direction, states + 1, change)
    return True


class Touched(NamedTuple):
    """An extremum of a deflection near a corner."""

    number: Vector  # (3,) instant asked for, then that of the extremum [periods]; depth, NaN: none; second derivative
    slope: Vector  # (N + 1,) of the depth, by the state at the start [SI] and by p
    time_slope: Vector  # (N + 1,) of the instant


@strict
def _carry_row(driven, path, trace, last, since, row, region):
    """Carry a row over v backwards to the start, from so long after the beginning of interval ``last``."""
    states = row.size
    memories = path.known.shape[1]
    room = np.empty(driven.generator.shape[1])
    terms = np.empty((3, states))
    term = terms[0]
    following = terms[1]
    total = terms[2]
    for i in range(last, -1, -1):
        # each interval backwards, in steps
        _enter(driven, path.slot[i], room, region)
        length = since if i == last else path.time[i + 1] - path.time[i]
        count = steps_of(region, length) if length > 0.0 else 0
        for _ in range(count):
            # Taylor series of row exp(A h)
            for j in range(states):
                term[j] = row[j]
                total[j] = term[j]
            for m in range(1, _ORDER):
                for j in range(states):
                    following[j] = 0.0
                for q in range(states):
                    weight = length / count / m * term[q]
                    for entry in range(region.own.start[q], region.own.start[q + 1]):
                        following[region.own.column[entry]] += weight * region.own.value[entry]
                for j in range(states):
                    term[j] = following[j]
                    total[j] += term[j]
            _copy(total, row)
        # memories that are known at the beginning depend on nothing before
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
    """The last interval that has begun at an instant of the motion."""
    i = 0
    while i < path.slot.size - 1 and path.time[i + 1] <= time:
        i += 1
    return i


@strict
def _write_slopes(driven, path, trace, extremum, now, scale, region, touched):
    """Write the slopes of the depth and of the instant of an extremum."""
    states = now.v.size
    sign = extremum.sign
    own = np.empty(scale.size)
    row = extremum.row
    row_shift = extremum.row_shift
    rate_row = extremum.rate_row
    # the derivatives by the parameter with a fixed start
    depth_by_p = _dot(row, now.v) + _dot(row_shift, now.z) - extremum.corner_shift
    rate_by_p = _dot(rate_row, now.v)
    for q in range(now.z.size):
        rate_by_p += row_shift[q] * product(region.rates, q, now.z)
    for q in range(states):
        rate_by_p += row[q] * product(region.shift, q, now.z)
    # by the state at the start: rows carried backwards, first of the depth, then of the instant
    for part in range(2):
        out, factor = (touched.slope, sign) if part == 0 else (touched.time_slope, -1.0 / touched.number[2])
        for j in range(states):
            own[j] = row[j] if part == 0 else rate_row[j]
        _carry_row(driven, path, trace, extremum.interval, extremum.since, own, region)
        for j in range(states):
            out[j] = factor * own[j] * scale[j]
        out[states] = factor * (depth_by_p if part == 0 else rate_by_p)


@strict_entry
def write_touch(driven, path, z, corner, scale, trace, touched):
    """Write when the deflection of a clearance has an extremum near an instant, its depth, and the slopes of both.

    z: (Z,) at the start, balanced.
    corner: (2,) the clearance, and 1 for its upper corner.
    scale: (N,) balanced = scale * SI.
    """
    # the motion and its change with the parameter, at the beginning of every interval
    k = corner[0]
    upward = corner[1]
    states = scale.size
    size = z.size
    change = np.zeros(states + 1)
    change[states] = 1.0
    write_course(driven, path, z, change, trace)
    # the extremum, by Newton's method in time from the beginning of the interval that it lies in
    asked = touched.number[0]
    end = path.time[path.time.size - 1]
    time = touched.number[0]
    touched.number[1] = np.nan
    now = _room_now(states, size)
    region = _room_region(states, size)
    rows = np.empty((4, size))
    none = _room_rows(0, states, size)
    series = _Series(np.empty((0, _ORDER)), np.empty((0, _ORDER)), z, z, rows)
    _copy(driven.deflection[k], rows[0])
    _copy(driven.deflection_shift[k], rows[1])
    for _ in range(_ITERATIONS):
        at = time - end * np.floor(time / end)
        i = _interval_at(path, at)
        since = at - path.time[i]
        _enter(driven, path.slot[i], rows[3], region)
        _copy(trace.z[i], now.z)
        _copy(trace.v[i], now.v)
        count = steps_of(region, since) if since > 0.0 else 0
        for _ in range(count):
            _step(region, none, 1.0, since / count, now, series)
        _times_rates(rows[0], region, rows[2])
        _times_rates(rows[2], region, rows[3])
        # a minimum where a maximum is sought, or the reverse: no touch
        rate = _dot(rows[2], now.z)
        bend = _dot(rows[3], now.z)
        if (bend >= 0.0) == (upward == 1):
            return
        # Newton's step in time, within the neighbourhood
        step = min(max(-rate / bend, -NEAR), NEAR)
        time += step
        if abs(time - asked) > FARTHEST:
            return
        if abs(step) < _SETTLED:  # its depth, and how both move
            sign = 1.0 if upward == 1 else -1.0
            bound = path.upper[i, k] if upward == 1 else path.lower[i, k]
            touched.number[0] = time
            touched.number[2] = bend
            touched.number[1] = sign * (_dot(rows[0], now.z) - bound)
            shift = path.upper_shift[i, k] if upward == 1 else path.lower_shift[i, k]
            if np.isfinite(bound):
                extremum = _Extremum(i, since, sign, shift, rows[0], rows[1], rows[2])
                _write_slopes(driven, path, trace, extremum, now, scale, region, touched)
            return
