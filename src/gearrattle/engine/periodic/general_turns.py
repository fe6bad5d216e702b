"""All turning points of deflections along a motion of a driveline of any kind, and where rates come nearest to zero.

They are what ``kernels.turning_points`` finds for drivelines of laws and harmonics alone, along the same direction

    (M - I) du + s dp = 0,      row . (du, dp) = 1.

On every step of a ``course`` a deflection and its perturbation are polynomials. Their rates are looked at a few times a
step; a turning point lies where one changes its sign, and a *dip* where one comes nearest to zero and keeps its sign,
between its turning points or at a crossing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels.turning_points import FALLING, RISING, write_outside
from gearrattle.engine.periodic.course import ORDER, Course, Setting, course_of
from gearrattle.engine.periodic.grazing_depth import crossings_before, reaches
from gearrattle.engine.periodic.motion import Along, Approach, Dips, Pass, Touch, Turns, idle_memories
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.system.passages import Passages

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_LOOKS = 8  # a step, of two radians of the fastest mode at most
_ITERATIONS, _SETTLED = 60, 1e-15  # of the search for a turning point; share of a step that counts as zero
_POWERS = np.arange(ORDER)


class _Part(NamedTuple):
    """Where turning points or dips are sought: E parts of steps, or instants at the start of steps."""

    step: IntArray  # (E,)
    watch: IntArray  # (E,) clearance
    begin: Array  # (E,) share of the step
    end: Array


class _Seen(NamedTuple):
    """Deflections at E instants [SI], over powers of a period, and their changes along the direction."""

    value: Array
    rate: Array
    bend: Array
    third: Array
    change: Array
    rate_change: Array
    bend_change: Array


class _Corners(NamedTuple):
    """Of the pieces in which clearances are (E,), and their changes along the direction."""

    lower: Array
    upper: Array
    lower_change: Array
    upper_change: Array


def direction_of(
    motion: Pass, slope: Array, row: Array, units: tuple[Array, float], counts: tuple[int, int]
) -> Along | None:
    """Return the change that keeps the gap of a motion, and of which a row's product is 1; None if there is no one.

    Where memories may be anything, because they are let go all along, they stay as they are.

    slope: (N,) d end / d p [SI].
    row: (N + 1,) over the state at the start and p [1/SI].
    units: (N,) balanced = scale * SI, and the unit of p.
    """
    scale, unit = units
    states = scale.size
    matrix, right = np.zeros((states + 1, states + 1)), np.zeros(states + 1)
    matrix[:states, :states] = scale[:, None] * motion.gradient / scale - np.eye(states)
    matrix[:states, states] = scale * slope * unit
    matrix[states] = row * np.append(1.0 / scale, unit)
    right[states] = 1.0
    change, moving = np.zeros(states + 1), np.ones(states + 1, np.bool_)
    moving[idle_memories(motion, scale, counts[1])] = False
    try:
        change[moving] = np.linalg.solve(matrix[np.ix_(moving, moving)], right[moving])
    except np.linalg.LinAlgError:
        return None
    if not np.all(np.isfinite(change)):
        return None
    outside = outside_of(motion.crossings, (0, 0), counts[0])
    return Along(change[:-1] / scale, float(change[-1] * unit), outside)


def outside_of(crossings: Passages, begins: tuple[int, int], clearances: int) -> IntArray:
    """Return (2, K) which way clearances cross before and after a part of a motion that repeats, as in Along.

    begins: how many of them lie before the start and before the end of the part; 0 and 0 for the whole motion.
    """
    outside = np.empty((2, clearances), np.int64)
    write_outside(crossings.watch.astype(np.int64), crossings.upward.astype(np.int64), np.array(begins), outside)
    return outside


def turns_of(period_map: PeriodMap, setting: Setting, motion: Pass, along: Along) -> Turns:
    """Return the turning points of a motion by a corner, with slopes along a change."""
    pieces, y, path, _ = period_map.along(motion)
    change = along.state * period_map.scale, along.parameter
    course = course_of(setting, (pieces, y), path, float(period_map.cycles), change)
    return _Search(course, path, along, reaches(setting.flow.system)).turns()


def exact_slope(period_map: PeriodMap, setting: Setting, motion: Pass) -> Array:
    """Return (N,) d end / d p [SI] of a motion with the crossings that it has.

    Near a touch, a difference is that of a motion with the touch and one without it. Parameters are those of
    ``turns_of``.
    """
    pieces, y, path, _ = period_map.along(motion)
    states = setting.flow.states
    course = course_of(setting, (pieces, y), path, float(period_map.cycles), (np.zeros(states), 1.0))
    return np.asarray(course.v[:states] / setting.sizes[:states])


def with_slopes(period_map: PeriodMap, setting: Setting, motion: Pass, touch: Touch, beyond: float) -> Approach:
    """Return the approach of a touch with the slopes of its depth and of its instant by the state and by p.

    beyond: its depth [SI].
    """
    flow, states = setting.flow, setting.flow.states
    pieces, y, path, _ = period_map.along(motion)
    path = crossings_before(path, motion.period, touch, pieces[flow.system.clearances[touch.watch]])
    course = course_of(setting, (pieces, y), path, touch.time, (np.zeros(states), 1.0))
    rates = setting.region(course.pieces[-1])
    row, row_shift, _, bound_shift = setting.bound(course.pieces[-1], touch.watch, touch.upward)
    rate_row = row @ rates.rates
    bend, sign = float(rate_row @ rates.rates @ course.z), 1.0 if touch.upward else -1.0
    by_p = float(row @ course.v + row_shift @ course.z) - bound_shift
    rate_by_p = float(rate_row @ course.v + row_shift @ rates.rates @ course.z + row @ rates.shift @ course.z)
    by_state, rate_by_state = (course.backwards(one) * setting.sizes[:states] for one in (row, rate_row))
    slope = sign * np.append(by_state, by_p)
    time_slope = -np.append(rate_by_state, rate_by_p) / bend
    return Approach(beyond, touch.time, bend / flow.system.inputs.period**2, slope, time_slope)


class _Search:
    """The search for the turning points of a course."""

    def __init__(self, course: Course, path: Passages, along: Along, reach: Array) -> None:
        self._course, self._path, self._reach = course, path, reach
        self._outside, by = along.outside, along.parameter
        self._delays = np.array([leap.delay for leap in course.leaps])
        pieces = np.array(course.pieces, np.int64)[:, list(course.setting.flow.system.clearances)]
        corners, changes = np.empty((2, *pieces.shape)), np.empty((2, *pieces.shape))
        for k, (own, shift) in enumerate(course.setting.corners):
            corners[:, :, k], changes[:, :, k] = own[:, pieces[:, k]], by * shift[:, pieces[:, k]]
        self._corners = _Corners(*corners, *changes)

    def turns(self) -> Turns:
        """Return all turning points near corners, in order of time."""
        crossing, dipping = self._parts()
        s = _turning(_rates(self._coefficients(dipping)), dipping.begin, dipping.end)
        sought, at_begin = self._seen(dipping, s), self._seen(dipping, dipping.begin)
        is_pair = (sought.rate > 0.0) != (at_begin.rate > 0.0)
        pair, dip = _chosen(dipping, is_pair), _chosen(dipping, ~is_pair)
        middle = s[is_pair]
        parts = _joined([crossing, pair._replace(end=middle), pair._replace(begin=middle)])
        dips = _joined_dips([self._dips(dip, s[~is_pair]), self._kinks()])
        return self._turns(parts, dips)

    def _parts(self) -> tuple[_Part, _Part]:
        """Parts of steps on which a rate changes its sign, and on which it comes nearer to zero and goes away."""
        looks = np.arange(_LOOKS + 1) / _LOOKS
        value, course = self._course.value, self._course
        powers = looks[:, None] ** _POWERS
        rates = _rates(value) @ powers[:, :-1].T  # (J, K, looks)
        bends = _rates(_rates(value)) @ powers[:, :-2].T
        is_positive = rates > 0.0
        is_positive[:-1, :, -1] = np.where(
            course.length[1:, None] > 0.0, is_positive[1:, :, 0], is_positive[:-1, :, -1]
        )
        crosses = is_positive[..., :-1] != is_positive[..., 1:]
        dips = ~crosses & (rates[..., :-1] * bends[..., :-1] < 0.0) & (rates[..., 1:] * bends[..., 1:] > 0.0)
        near = self._is_near()[..., None]
        parts = []
        for chosen in (crosses & near, dips & near):
            step, watch, look = np.nonzero(chosen)
            parts.append(_Part(step, watch, looks[look], looks[look + 1]))
        return parts[0], parts[1]

    def _is_near(self) -> NDArray[np.bool_]:
        """(J, K) whether a deflection may come within its reach of a corner over a step."""
        value, reach, course = self._course.value, self._reach, self._course
        way = reach + np.abs(value[..., 1:]).sum(axis=2)
        lower, upper = (part[course.interval] for part in self._corners[:2])
        return np.asarray((value[..., 0] - lower <= way) | (upper - value[..., 0] <= way))

    def _coefficients(self, part: _Part) -> Array:
        return np.asarray(self._course.value[part.step, part.watch])

    def _seen(self, part: _Part, s: Array) -> _Seen:
        """Deflections and changes at shares of steps."""
        h, powers = self._course.length[part.step], s[:, None] ** _POWERS
        at = []
        for coefficients, orders in ((self._coefficients(part), 4), (self._course.change[part.step, part.watch], 3)):
            now = coefficients
            for order in range(orders):
                at.append((now * powers[:, : ORDER - order]).sum(axis=1) / h**order)
                now = _rates(now)
        return _Seen(*at)

    def _corners_of(self, part: _Part) -> _Corners:
        interval = self._course.interval[part.step]
        return _Corners(*(corner[interval, part.watch] for corner in self._corners))

    def _turns(self, part: _Part, dips: Dips) -> Turns:
        """The turning points on parts of steps, by the corner ahead, and by the one behind that they have passed."""
        course = self._course
        s = _turning(self._coefficients(part), part.begin, part.end)
        seen, corners = self._seen(part, s), self._corners_of(part)
        upward = (self._seen(part, part.begin).rate > 0.0).astype(np.int64)
        sign, time = np.where(upward == 1, 1.0, -1.0), course.begin[part.step] + s * course.length[part.step]
        rows = []
        for is_upper in (upward == 1, upward == 0):
            corner = np.where(is_upper, corners.upper, corners.lower)
            moved = np.where(is_upper, corners.upper_change, corners.lower_change)
            rows.append((sign * (seen.value - corner), sign * (seen.change - moved)))
        (ahead, slope), (behind, slope_behind) = rows
        reach, is_visit = self._reach[part.watch], self._is_visit(part, upward)
        chosen = np.concatenate([np.abs(ahead) < reach, (np.abs(behind) < reach) & is_visit])
        twice = [np.concatenate([one, one])[chosen] for one in (part.watch, upward, time)]
        depth, slopes = (np.concatenate(pair)[chosen] for pair in ((ahead, behind), (slope, slope_behind)))
        time_slope = np.tile(-seen.rate_change / seen.bend, 2)[chosen]
        order = np.argsort(twice[2], kind="stable")
        watch, way, time = (one[order] for one in twice)
        return Turns(watch, way, time, depth[order], slopes[order], time_slope[order], dips, self._delays)

    def _is_visit(self, part: _Part, upward: IntArray) -> NDArray[np.bool_]:
        """Whether turning points lie beyond a corner that is crossed there before and back after them."""
        path, interval = self._path, self._course.interval[part.step]
        is_visit = np.zeros(upward.size, np.bool_)
        for e, (i, k) in enumerate(zip(interval.tolist(), part.watch.tolist(), strict=True)):
            own = np.flatnonzero(path.watch == k)
            following = int(np.searchsorted(own, i))
            entered = path.upward[own[following - 1]] if following > 0 else self._outside[0, k]
            left = path.upward[own[following]] if following < own.size else self._outside[1, k]
            is_visit[e] = entered == upward[e] != left
        return is_visit

    def _dips(self, part: _Part, s: Array) -> Dips:
        """Where rates come nearest to zero within steps."""
        seen, course = self._seen(part, s), self._course
        time_slope = -seen.bend_change / seen.third
        time = course.begin[part.step] + s * course.length[part.step]
        return self._dips_at(part, seen, time, seen.rate_change, time_slope)

    def _kinks(self) -> Dips:
        """Where rates come nearest to zero at crossings, at which their derivatives jump."""
        course, count = self._course, self._course.value.shape[1]
        behind = np.flatnonzero(np.diff(course.interval)) + 1  # steps that begin at crossings
        behind = behind[course.length[behind] > 0.0]
        step, watch = np.repeat(behind, count), np.tile(np.arange(count), len(behind))
        part = _Part(step, watch, np.zeros(step.size), np.zeros(step.size))
        seen = self._seen(part, part.begin)
        before = self._seen(part._replace(step=step - 1), np.ones(step.size)).bend
        is_kink = (seen.rate * before < 0.0) & (seen.rate * seen.bend > 0.0)
        part, seen = _chosen(part, is_kink), _Seen(*(one[is_kink] for one in seen))
        time_slope = self._delays[course.interval[part.step] - 1] if self._delays.size else np.zeros(0)
        change = seen.rate_change + seen.bend * time_slope
        return self._dips_at(part, seen, course.begin[part.step], change, time_slope)

    def _dips_at(self, part: _Part, seen: _Seen, time: Array, rate_change: Array, time_slope: Array) -> Dips:
        """Dips whose deflections are near a corner."""
        corners = self._corners_of(part)
        below, above = seen.value - corners.lower, corners.upper - seen.value
        moved = seen.change + seen.rate * time_slope
        level, level_slope = np.minimum(below, above), moved - corners.lower_change
        level_slope = np.where(below < above, level_slope, corners.upper_change - moved)
        is_rising = seen.rate > 0.0
        sign = np.where(is_rising, -1.0, 1.0)
        upward = np.where(is_rising, RISING, FALLING).astype(np.int64)
        every = part.watch, upward, time, sign * seen.rate, sign * rate_change, time_slope, level, level_slope
        is_near = level < self._reach[part.watch]
        return Dips._make(one[is_near] for one in every)


def _chosen(part: _Part, chosen: NDArray[np.bool_]) -> _Part:
    return _Part._make(one[chosen] for one in part)


def _joined(parts: list[_Part]) -> _Part:
    return _Part._make(np.concatenate(same) for same in zip(*parts, strict=True))


def _joined_dips(parts: list[Dips]) -> Dips:
    """All dips, in order of time."""
    every = Dips._make(np.concatenate(same) for same in zip(*parts, strict=True))
    order = np.argsort(every.time, kind="stable")
    return Dips._make(one[order] for one in every)


def _rates(coefficients: Array) -> Array:
    """(..., m - 1) coefficients of the derivatives of polynomials (..., m)."""
    return np.asarray(coefficients[..., 1:] * np.arange(1, coefficients.shape[-1]))


def _turning(coefficients: Array, begin: Array, end: Array) -> Array:
    """(E,) the turning points of polynomials (E, m) between two values at which their derivatives have other signs.

    Newton's method, and a bisection where that would leave the interval.
    """
    rates = _rates(coefficients)
    bends = _rates(rates)
    begin, end, s = begin.copy(), end.copy(), 0.5 * (begin + end)
    powers = np.arange(rates.shape[1])
    rises = (rates * begin[:, None] ** powers).sum(axis=1) > 0.0
    least = _SETTLED * (end - begin)
    for _ in range(_ITERATIONS):
        at = s[:, None] ** powers
        rate, bend = (rates * at).sum(axis=1), (bends * at[:, :-1]).sum(axis=1)
        is_before = (rate > 0.0) == rises
        begin, end = np.where(is_before, s, begin), np.where(is_before, end, s)
        with np.errstate(divide="ignore", invalid="ignore"):
            following = s - rate / bend
        inside = (following >= begin) & (following <= end)
        last, s = s, np.where(inside, following, 0.5 * (begin + end))
        if np.all(np.abs(s - last) <= least):
            break
    return s
