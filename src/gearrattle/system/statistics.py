"""Extremes and moments of a motion between its samples: from the exact motion, not from the samples.

The window is cut at samples, crossings and knots of signals. Through every part rows times the state are power series
(``series``): forwards from the sample a part begins with, or backwards from the one it ends with; only parts between
two cuts, and those of very stiff contacts, need states that are carried on.

Extremes: values at Chebyshev points of an interval bound what lies between them (Ehlich, Zeller 1964, Math. Z. 86,
41-44: a polynomial of degree d exceeds its values at 2 d + 1 such points by the factor 2^(1/2) at most). Only parts
whose bound passes the extremes seen so far are searched for turning points. Moments are Gauss-Legendre sums, with as
many nodes as the fourth power of the fastest oscillation needs.

Takes a Flow, sampled states and a log; gives extremes and central moments over a window.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearrattle.system.energy import _visited
from gearrattle.system.flow import Flow, Pieces
from gearrattle.system.series import Rows, Series, blocks_of, phase_of

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_MOST = 4096  # parts at once
_UNCUT = 1e-9  # of an interval between two samples: shorter remainders are rounding
_EXCESS = 1.5  # by which values pass the middle of those at Chebyshev points: 2^(1/2), and a reserve
_MOST_WORK = 1e10  # floating-point operations, some seconds: beyond, samples must do


@dataclass(frozen=True)
class Statistics:
    """Of q rows over a window.

    Attributes:
        low, high: (q,) extremes.
        mean: (q,).
        second, third, fourth: (q,) central moments <(x - <x>)^p>; these and the mean are NaN where not asked for.
    """

    low: Array
    high: Array
    mean: Array
    second: Array
    third: Array
    fourth: Array


@dataclass(frozen=True)
class Path:
    """A motion by the samples of the window and its log, times in periods from the first sample of the motion.

    Attributes:
        initial: piece of every element and companion at the first sample.
        samples: (t, Z) states z of the window; sample i lies at (first + i) / per_cycle.
        per_cycle: samples a period.
        first: samples before the window.
        time, watch, upward: (E,) crossings, of clearances and companions, ascending.
        first_cycle: whole periods before the first sample.
    """

    initial: Pieces
    samples: Array
    per_cycle: int
    first: int
    time: Array
    watch: IntArray
    upward: IntArray
    first_cycle: int


@dataclass(frozen=True)
class _Parts:
    """Parts of the window (K,): length in periods, region, the sample and the knot it begins with (-1: none)."""

    duration: Array
    region: IntArray
    sample: IntArray
    knot: IntArray

    @cached_property
    def is_last(self) -> BoolArray:
        """Whether a part ends at a sample."""
        return np.append(self.sample[1:] >= 0, True)

    def backward(self, shortest: float, whole: BoolArray) -> BoolArray:
        """Which parts may start from the sample they end with: regions of one block, and no cut at that sample."""
        goes_on = np.append(self.duration[1:] > shortest, False)
        return np.asarray((self.sample < 0) & self.is_last & goes_on & whole[self.region])


class _Sums:
    """Extremes and powers about a reference, gathered part by part."""

    def __init__(self, about: Array, moments: BoolArray) -> None:
        self.about, self.moments = about, moments
        self.low, self.high = np.full(about.size, np.inf), np.full(about.size, -np.inf)
        self.powers = np.zeros((4, about.size))

    def reach(self, low: Array, high: Array) -> None:
        """Take smallest and largest values (q, N) into the extremes."""
        if low.size:
            self.low, self.high = np.minimum(self.low, low.min(axis=1)), np.maximum(self.high, high.max(axis=1))

    def weigh(self, channels: BoolArray, values: Array, weights: Array) -> None:
        """Add the powers of values (c, ...) of the channels marked, with weights of the shape (...)."""
        away = values.reshape(len(values), -1) - self.about[channels, None]
        power, flat = away, weights.ravel()
        for p in range(4):
            self.powers[p, channels] += power @ flat
            power = power * away

    def rest(self, channels: BoolArray, duration: float) -> None:
        """Add the powers of channels that are 0 for so long."""
        self.powers[:, channels] += duration * (-self.about[channels]) ** np.arange(1, 5)[:, None]

    def result(self, duration: float) -> Statistics:
        """Return what was gathered over a window of this length."""
        m1, m2, m3, m4 = self.powers / duration
        third, fourth = m3 - 3 * m1 * m2 + 2 * m1**3, m4 - 4 * m1 * m3 + 6 * m1**2 * m2 - 3 * m1**4
        known = (np.where(self.moments, each, np.nan) for each in (self.about + m1, m2 - m1**2, third, fourth))
        return Statistics(self.low, self.high, *known)


def statistics_of(flow: Flow, path: Path, rows: Rows, *, with_moments: BoolArray | bool = True) -> Statistics | None:
    """Return extremes and moments of rows over the window of a motion.

    Args:
        flow: the system.
        path: the motion.
        rows: gives (q, Z) rows for the pieces of a region [SI].
        with_moments: whether moments are wanted, of all rows or of each (q,).

    Returns:
        The statistics; None where they would take longer than some seconds (many regions of many bodies, or a contact
        that is stiff beyond all proportion to the window).
    """
    regions, visited = _visited(flow, path.initial, path.watch, path.upward)
    parts, length = _parts_of(flow, path, visited), 1.0 / path.per_cycle
    counts = np.bincount(parts.region, minlength=len(regions))
    present = np.flatnonzero(counts).tolist()
    if 100.0 * flow.width**3 * len(present) > _MOST_WORK:
        return None
    phases = {r: phase_of(flow, regions[r], length) for r in present}
    blocks = np.array([blocks_of(phases.get(r, 0.0)) for r in range(len(regions))])
    if float(counts @ blocks) * 40.0 * rows(regions[0]).size > _MOST_WORK:
        return None
    series = {r: Series.of(flow, regions[r], rows, length, phases[r]) for r in present}
    moments = np.broadcast_to(np.asarray(with_moments), len(rows(regions[0])))
    backward = parts.backward(_UNCUT * length, blocks == 1)
    search = _Search(path, parts, series, _Sums(_reference(path, parts, series), moments), backward)
    search.bound()
    search.carry(flow)
    search.finish()
    return search.sums.result((len(path.samples) - 1) / path.per_cycle)


def _reference(path: Path, parts: _Parts, series: dict[int, Series]) -> Array:
    """(q,) roughly the mean of every row: that of some samples."""
    begins = np.flatnonzero(parts.sample >= 0)[::16]
    at = {r: parts.sample[begins[parts.region[begins] == r]] for r in series}
    sums = [each.rows[0, 0] @ path.samples[at[r]].sum(axis=0) for r, each in series.items()]
    return np.asarray(np.sum(sums, axis=0) / begins.size)


class _Search:
    """Extremes and moments of the rows through all parts."""

    def __init__(self, path: Path, parts: _Parts, series: dict[int, Series], sums: _Sums, backward: BoolArray) -> None:
        self.samples, self.parts, self.series, self.sums, self.backward = path.samples, parts, series, sums, backward
        self.forward = parts.sample >= 0
        self.cut = ~self.forward | (np.abs(parts.duration * path.per_cycle - 1.0) >= _UNCUT)
        self.lower, self.upper = (np.full((sums.about.size, parts.sample.size), side) for side in (-np.inf, np.inf))
        self.carried = np.flatnonzero(~self.forward & ~backward)
        self.states = np.zeros((self.carried.size, path.samples.shape[1]))

    def groups(self, of: BoolArray) -> Iterator[tuple[Series, IntArray]]:
        """Yield the parts marked, of one region and some thousands at a time."""
        which = np.flatnonzero(of)
        which = which[np.argsort(self.parts.region[which], kind="stable")]
        for some in np.split(which, np.flatnonzero(np.diff(self.parts.region[which])) + 1):
            for first in range(0, some.size, _MOST):
                yield self.series[int(self.parts.region[some[0]])], some[first : first + _MOST]

    def bound(self) -> None:
        """Bound the rows in every part that has a sample by its whole interval; take in the parts without a cut."""
        kinds = ((self.forward & ~self.cut, 1.0), (self.forward & self.cut, 1.0), (self.backward, -1.0))
        for k, (of, sign) in enumerate(kinds):
            for series, some in self.groups(of):
                states = self._begin(series, some, sign)
                low, high, rise = self._bounds(series, states, sign)
                self.lower[:, some], self.upper[:, some] = low - rise, high + rise
                if k == 0:
                    self.sums.reach(low, high)
                    if self.sums.moments.any():
                        self._whole_moments(series, states)

    def carry(self, flow: Flow) -> None:
        """Carry states on to the parts that begin with none and end with none that serves."""
        where = np.full(self.parts.sample.size, -1)
        where[self.carried] = np.arange(self.carried.size)
        now = self.carried[self.forward[self.carried - 1]] - 1
        states = self.samples[self.parts.sample[now]]
        while now.size:
            for r in np.unique(self.parts.region[now]).tolist():
                on, series = self.parts.region[now] == r, self.series[r]
                states[on] = series.moved(series.begun(states[on]), self.parts.duration[now[on]])
            now = now + 1
            knot = self.parts.knot[now]
            states[knot >= 0, states.shape[1] - flow.chain.size :] = flow.chains[knot[knot >= 0]]
            self.states[where[now]] = states
            goes_on = ~self.parts.is_last[now]
            now, states = now[goes_on], states[goes_on]
            follows = where[now + 1] >= 0
            now, states = now[follows], states[follows]

    def finish(self) -> None:
        """Take in the moments of cut parts, and the extremes of parts whose bounds pass those seen so far."""
        sums, carried = self.sums, ~self.forward & ~self.backward
        high, low = sums.high[:, None], sums.low[:, None]
        passing = carried | np.any((self.upper > high) | (self.lower < low), axis=0)
        for sign, of in ((1.0, ~self.backward), (-1.0, self.backward)):
            for series, some in self.groups(of & passing):
                for terms, _ in self._terms(series, some, sign, slice(None)):
                    self._turning_points(series, terms)
            for series, some in self.groups(of & self.cut) if sums.moments.any() else ():
                self._moments(series, some, sign)

    def _begin(self, series: Series, some: IntArray, sign: float) -> Array:
        """(N, Z) the states that the series of some parts start from."""
        if sign < 0.0:
            return series.begun(self.samples[self.parts.sample[some + 1]])
        states = self.samples[self.parts.sample[some]]
        held = ~self.forward[some]
        states[held] = self.states[np.searchsorted(self.carried, some[held])]
        return series.begun(states)

    def _bounds(self, series: Series, states: Array, sign: float) -> tuple[Array, Array, Array]:
        """(q, N) smallest and largest value at the Chebyshev points, and by how much values between may pass them."""
        low, high, rise = np.inf, -np.inf, 0.0
        for block in range(len(series.rows)):
            rows = series.at(block, series.points, sign)
            values = (rows.reshape(-1, rows.shape[2]) @ states.T).reshape(*rows.shape[:2], -1)
            least, most = values.min(axis=0), values.max(axis=0)
            low, high = np.minimum(low, least), np.maximum(high, most)
            rise = np.maximum(rise, 0.5 * (_EXCESS - 1.0) * (most - least))
        return np.asarray(low), np.asarray(high), np.asarray(rise)

    def _terms(
        self, series: Series, some: IntArray, sign: float, channels: BoolArray | slice
    ) -> Iterator[tuple[Array, Array]]:
        """Terms (N, P + 1, c) of powers 0 ... 1 of the time through each part, and its length (N,), block by block."""
        states, left = self._begin(series, some, sign), self.parts.duration[some]
        for block, rows in enumerate(series.rows):
            here = rows[:, channels]
            on = left > 0.0 if block else slice(None)
            length = np.minimum(left[on], series.block)
            terms = (states[on] @ here.reshape(-1, here.shape[2]).T).reshape(-1, *here.shape[:2])
            share = np.repeat((sign * length / series.block)[:, None], len(rows), axis=1)
            share[:, 0] = 1.0
            yield terms * np.multiply.accumulate(share, axis=1)[:, :, None], length
            left = left - series.block

    def _turning_points(self, series: Series, terms: Array) -> None:
        """Take in the extremes of parts: their values at the ends and where their rates vanish."""
        sums, p = self.sums, series.powers
        grid, step = series.grid, series.grid[1]
        values = np.matmul(grid[:, None] ** p, terms)
        rates = np.matmul(grid[:, None] ** p[:-1], terms[:, 1:] * p[1:, None])
        sums.reach(values.min(axis=1).T, values.max(axis=1).T)
        turns = rates[:, :-1] * rates[:, 1:] < 0.0
        beyond = step * np.maximum(np.abs(rates[:, :-1]), np.abs(rates[:, 1:]))
        turns &= (np.maximum(values[:, :-1], values[:, 1:]) + beyond > sums.high) | (
            np.minimum(values[:, :-1], values[:, 1:]) - beyond < sums.low
        )
        part, place, channel = np.nonzero(turns)
        if not part.size:
            return
        before, after = rates[part, place, channel], rates[part, place + 1, channel]
        begin, x = grid[place], grid[place] + step * before / (before - after)
        own = np.ascontiguousarray(terms[part, :, channel].T)
        rate = own[1:] * p[1:, None]
        bend = rate[1:] * p[1:-1, None]
        for _ in range(4):
            slope = _at(bend, x)
            x = np.clip(x - _at(rate, x) / np.where(slope == 0.0, np.inf, slope), begin, begin + step)
        found = _at(own, x)
        np.minimum.at(sums.low, channel, found)
        np.maximum.at(sums.high, channel, found)

    def _whole_moments(self, series: Series, states: Array) -> None:
        """Add the moments of parts that go through an interval between two samples."""
        changing = self._changing(series, len(states) * len(series.rows) * series.block)
        nodes, weights = series.gauss
        for block in range(len(series.rows) if changing.any() else 0):
            rows = series.at(block, nodes)[:, changing].transpose(1, 0, 2)
            values = (rows.reshape(-1, rows.shape[2]) @ states.T).reshape(*rows.shape[:2], -1)
            self.sums.weigh(changing, values, np.repeat(weights[:, None] * series.block, len(states), axis=1))

    def _moments(self, series: Series, some: IntArray, sign: float) -> None:
        """Add the moments of parts of any length."""
        changing = self._changing(series, float(self.parts.duration[some].sum()))
        if not changing.any():
            return
        nodes, weights = series.gauss
        for terms, length in self._terms(series, some, sign, changing):
            values = np.matmul(nodes[:, None] ** series.powers, terms)
            self.sums.weigh(changing, values.transpose(2, 1, 0), np.multiply.outer(weights, length))

    def _changing(self, series: Series, duration: float) -> BoolArray:
        """(q,) the channels whose moments are wanted and that are not 0 in a region; add the moments of the others."""
        moving = np.any(series.rows[0] != 0.0, axis=(0, 2))
        self.sums.rest(self.sums.moments & ~moving, duration)
        return np.asarray(self.sums.moments & moving)


def _at(terms: Array, x: Array) -> Array:
    """(N,) values of polynomials with coefficients (P, N), lowest first, at x (N,)."""
    value = terms[-1].copy()
    for term in terms[-2::-1]:
        value *= x
        value += term
    return np.asarray(value)


def _parts_of(flow: Flow, path: Path, visited: IntArray) -> _Parts:
    """Cut the window at samples, crossings and knots."""
    samples = path.first + np.arange(len(path.samples) - 1)
    begin, end = path.first / path.per_cycle, (path.first + samples.size) / path.per_cycle
    knots = flow.knots[1:-1] - path.first_cycle
    first_knot = int(np.searchsorted(knots, begin, side="right"))
    knots = knots[first_knot : np.searchsorted(knots, end)]
    gone = int(np.searchsorted(path.time, begin, side="right"))
    crossings = path.time[gone : np.searchsorted(path.time, end)]
    at = np.concatenate([samples / path.per_cycle, crossings, knots])
    order = np.argsort(at, kind="stable")
    durations = np.maximum(np.diff(np.append(at[order], end)), 0.0)
    is_sample, which_knot = order < samples.size, order - samples.size - crossings.size
    crossed = ~is_sample & (which_knot < 0)
    return _Parts(
        durations,
        visited[gone + np.cumsum(crossed)],
        np.where(is_sample, order, -1),
        np.where(which_knot >= 0, which_knot + first_knot + 1, -1),
    )
