"""Extremes, moments and exceeded levels of a motion between its samples: from the exact motion, not from the samples.

The window is cut at samples, crossings and knots of signals. Intervals between samples are joined where the motion is
slow, and cut further where it is so fast that the series of a region over one interval would be long. In every part a
quantity (a row times the state) is a power series (``row_series``) from the sample at its begin, or backwards from the
sample at its end. Only parts without a sample at an end, and parts of very stiff contacts, need states that are carried
from part to part.

Extremes: four terms and a bound on the others exclude most parts; the remaining ones are searched for turning points
(``kernels.extremes``). Moments are Gauss-Legendre sums, with enough nodes for the fourth power of the fastest
oscillation. The level exceeded for a share of the time is a root of the time above a level, which follows from roots of
the power series. Curves are values of the power series at points of every part.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels import extremes as compiled
from gearrattle.engine.system.energy_audit import _visited
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.row_series import Rows, Series

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_UNCUT = 1e-9  # share of an interval between two samples: shorter remainders are rounding
_LEVEL = 1e-12  # rounding of a level, over the level
_NEWTON = 1e-8  # last step of Newton's method for a level, over the level: the error after it is rounding
_TURN = 0.05  # rad: phase of the fastest oscillation between two points of a curve; chords miss 0.03 % of its amplitude
_MOST_POINTS = 200_000  # most points of a curve
_FEWEST = 8  # least points of a block of a longer curve
_PIECE = 2_000_000  # values of curves in memory at one time
_MOST_BLOCKS = 16
_MOST_CUTS = 4096
"""Most blocks of a region's series in an interval between samples, and most parts of an interval that needs more."""
_MOST_WORK = 1e10  # floating-point operations, some seconds: with more, statistics are taken from the samples


@dataclass(frozen=True)
class Statistics:
    """Extremes and moments of q rows over a window."""

    # low, high: (q,) extremes
    low: Array
    high: Array
    mean: Array  # (q,)
    # second, third, fourth: (q,) central moments <(x - <x>)^p>; these and the mean are NaN where not asked for
    second: Array
    third: Array
    fourth: Array


@dataclass(frozen=True)
class SampledMotion:
    """A motion by the samples of the window and its log, times in periods from the first sample of the motion."""

    initial: Pieces  # piece of every element and auxiliary at the first sample
    samples: Array  # (t, Z) states z of the window; sample i lies at (first + i) / per_cycle
    per_cycle: int  # samples per period
    first: int  # samples before the window
    # time, watch, upward: (E,) crossings, of clearances and auxiliaries, ascending
    time: Array
    watch: IntArray
    upward: IntArray
    first_cycle: int  # whole periods before the first sample


@dataclass(frozen=True)
class _Parts:
    """Parts of the window (K,): length in periods, region, the sample and the knot it begins with (-1: none).

    Samples count from the start of the window.
    """

    duration: Array
    region: IntArray
    sample: IntArray
    knot: IntArray

    @cached_property
    def is_last(self) -> BoolArray:
        """Whether a part ends at a sample."""
        return np.append(self.sample[1:] >= 0, True)

    def joined(self, together: IntArray, path: SampledMotion, rounding: float) -> _Parts:
        """Join parts that are whole intervals between samples, in each region so many, within a cycle.

        rounding: by which a length may differ from that between two samples.
        """
        whole = (self.sample >= 0) & (np.abs(self.duration - 1.0 / path.per_cycle) < rounding)
        cycle, sample = np.divmod(self.sample, path.per_cycle)
        key = cycle * path.per_cycle + sample // together[self.region]
        goes_on = whole[1:] & whole[:-1] & (self.region[1:] == self.region[:-1]) & (key[1:] == key[:-1])
        begins = np.flatnonzero(np.append(True, ~goes_on))
        duration = np.add.reduceat(self.duration, begins)
        return _Parts(duration, self.region[begins], self.sample[begins], self.knot[begins])

    def backward(self, shortest: float, whole: BoolArray) -> BoolArray:
        """Mask of parts that may start from their last sample: regions of one block, and no cut at that sample."""
        goes_on = np.append(self.duration[1:] > shortest, False)
        return np.asarray((self.sample < 0) & self.is_last & goes_on & whole[self.region])


def walk_of(flow: Flow, path: SampledMotion, series_of: Callable[[Pieces, float], Series]) -> Walk | None:
    """Return a motion cut into parts; None where its regions would take some seconds to expand.

    series_of: gives the series of a region over a length in periods.
    """
    # parts by region and sample interval, and whether they take too long
    regions, visited = _visited(flow, path.initial, path.watch, path.upward)
    parts = _parts_of(flow, path, visited)
    length = 1.0 / path.per_cycle
    counts = np.bincount(parts.region, minlength=len(regions))
    present = np.flatnonzero(counts).tolist()
    if 100.0 * flow.width**3 * len(present) > _MOST_WORK:
        return None
    # series of every region present
    series = {r: series_of(regions[r], length) for r in present}
    # samples far apart: a state carried on costs less than a series of so many blocks in every region
    longest = max(region_series.count for region_series in series.values())
    if longest > _MOST_BLOCKS:
        cuts = min(_MOST_CUTS, -(-longest // _MOST_BLOCKS))
        parts = _parts_of(flow, path, visited, cuts)
        length /= cuts
        series = {r: series_of(regions[r], length) for r in present}
    # neighbouring parts in one region become one
    together, blocks = np.ones((2, len(regions)), dtype=np.int64)
    for r, region_series in series.items():
        together[r] = region_series.intervals
        blocks[r] = region_series.count
    parts = parts.joined(together, path, _UNCUT * length)
    # where the series of a part start: its own sample, the next one, or a state carried on
    backward = parts.backward(_UNCUT * length, blocks == 1)
    forward = parts.sample >= 0
    carried = np.flatnonzero(~forward & ~backward)
    start = np.where(forward, parts.sample, np.append(parts.sample[1:], 0))
    start[carried] = -1 - np.arange(carried.size)
    states = _carried(flow, path, parts, series, carried)
    # whole parts, whose moments are made beforehand
    full = together[parts.region] * length
    whole = forward & (np.abs(parts.duration - full) < _UNCUT * length)
    return Walk(
        path=path,
        regions=regions,
        parts=parts,
        series=series,
        blocks=float(blocks[parts.region].sum()),
        start=start,
        backward=backward,
        whole=whole,
        carried=states,
    )


@dataclass(frozen=True)
class Walk:
    """A motion cut into K parts, from which statistics are computed."""

    path: SampledMotion
    regions: list[Pieces]  # all that it is in
    parts: _Parts  # of the window
    series: dict[int, Series]  # by region, of those in the window
    blocks: float  # through which all parts go
    start: IntArray  # (K,) the sample that a part's series start from, or -1 - the carried state
    backward: BoolArray  # (K,) whether that is where the part ends
    whole: BoolArray  # (K,) whether the part is as long as the series of its region
    carried: Array  # (C, Z) states

    def statistics(
        self, rows: Rows, *, with_moments: BoolArray | bool = True, cycles: tuple[int, ...] | None = None
    ) -> Statistics | None:
        """Return extremes and moments of rows.

        rows: gives (q, Z) rows for the pieces of a region [SI].
        with_moments: whether moments are wanted, of all rows or of each (q,).
        cycles: ends of some windows that follow each other, in cycles of the path's; None: all of it.
        Returns the statistics, with a leading axis where there are several windows; None where they would take longer
            than some seconds (a contact that is stiff beyond all proportion to the window).
        """

        # rows of every region
        chosen = {r: rows(self.regions[r]) for r in self.series}
        count = len(next(iter(chosen.values())))
        if self._takes_too_long(count):
            return None
        # which moments are wanted, and about what
        marked = np.broadcast_to(np.asarray(with_moments), count)
        packed, scratch = self._packed(chosen, with_nodes=bool(marked.any()))
        about = self._reference(chosen)
        wanted = np.flatnonzero(marked)
        # window by window: extremes, then moments
        ends = self._ends(cycles)
        shape = (len(ends) - 1, count)
        low = np.full(shape, np.inf)
        high = np.full(shape, -np.inf)
        powers = np.zeros((4, *shape))
        for i, (first, last) in enumerate(pairwise(ends)):
            compiled.extremes(self._compiled, packed, first, last, scratch, low[i], high[i])
            if wanted.size:
                room, own = np.zeros((2, 4, count))
                compiled.moments(self._compiled, packed, first, last, wanted, about, scratch, room, own)
                some = slice(first, last)
                spent = np.bincount(self.parts.region[some], self.parts.duration[some], minlength=len(self.regions))
                own += (spent @ ~packed.moving) * (-about) ** np.arange(1.0, 5.0)[:, None]
                powers[:, i] = own / float(self.parts.duration[some].sum())
        # central moments
        m1, m2, m3, m4 = powers
        third = m3 - 3 * m1 * m2 + 2 * m1**3
        fourth = m4 - 4 * m1 * m3 + 6 * m1**2 * m2 - 3 * m1**4
        known = (np.where(marked, moment, np.nan) for moment in (about + m1, m2 - m1**2, third, fourth))
        all_moments = (low, high, *known)
        return Statistics(*(all_moments if cycles is not None else (moment[0] for moment in all_moments)))

    def exceeded(self, rows: Rows, share: float) -> Array | None:
        """Return (q,) what the modulus of each row exceeds for a share of the time; None as in ``statistics``.

        share: of the window, between 0 and 1.
        """
        chosen = {r: rows(self.regions[r]) for r in self.series}
        count = len(next(iter(chosen.values())))
        if self._takes_too_long(count):
            return None
        packed, scratch = self._packed(chosen, with_nodes=False)
        return np.array([self._level(packed, scratch, c, share) for c in range(count)])

    def curves(self, rows: Rows) -> Iterator[Array] | None:
        """Return values of rows at points so near each other that chords between them are the motion.

        The ends of all parts, where a motion bends, are among the points. They come in pieces (N, q), one after the
        other in time and made when asked for: of a stiff contact there are millions. None as in ``statistics``.
        """
        chosen = {r: rows(self.regions[r]) for r in self.series}
        count = len(next(iter(chosen.values())))
        if self._takes_too_long(count):
            return None
        most = max(_FEWEST, int(_MOST_POINTS / self.blocks))
        shares = {}
        values = np.zeros(len(self.regions))
        for r, series in self.series.items():
            shares[r] = np.linspace(0.0, 1.0, 1 + min(most, int(np.ceil(series.phase / _TURN))))
            values[r] = series.count * shares[r].size * count
        pieces = np.cumsum(values[self.parts.region]) // _PIECE
        ends = [0, *(np.flatnonzero(np.diff(pieces)) + 1).tolist(), pieces.size]
        expanded = {r: series.expanded(chosen[r]) for r, series in self.series.items()}
        return (self._piece(expanded, shares, first, last) for first, last in pairwise(ends))

    def values(self, rows: Rows, time: Array) -> Array | None:
        """Return (N, q) values of rows at some times (N,), in periods from the begin of the window, within it.

        At a crossing the value just after it. None as in ``statistics``.
        """
        chosen = {r: rows(self.regions[r]) for r in self.series}
        count = len(next(iter(chosen.values())))
        if self._takes_too_long(count):
            return None
        # the part that every time lies in, and the time from the state that its series start from
        ends = np.cumsum(self.parts.duration)
        part = np.minimum(np.searchsorted(ends, time, side="right"), ends.size - 1)
        backward = self.backward[part]
        since = time - np.where(backward, ends[part], ends[part] - self.parts.duration[part])
        values = np.empty((time.size, count))
        for r in np.unique(self.parts.region[part]).tolist():
            # states of the parts of a region, and the block of every time
            series = self.series[r]
            own = np.flatnonzero(self.parts.region[part] == r)
            used, which = np.unique(part[own], return_inverse=True)
            states = series.begun(self._states_at(used))
            block = np.clip(np.floor(since[own] / series.block), 0, series.count - 1).astype(np.int64)
            expanded = series.expanded(chosen[r])
            for j in np.unique(block).tolist():
                # power series of the rows, by Horner's rule
                on = block == j
                terms = np.einsum("qpz,nz->pnq", expanded[j], states)
                share = (since[own[on]] / series.block - j)[:, None]
                value = np.zeros((share.size, count))
                for term in terms[::-1]:
                    value = value * share + term[which[on]]
                values[own[on]] = value
        return values

    def _piece(self, expanded: dict[int, Array], shares: dict[int, Array], first: int, last: int) -> Array:
        """(N, q) values of rows in some parts, at these shares of the blocks of their regions."""
        duration = self.parts.duration[first:last]
        region = self.parts.region[first:last]
        begins = np.cumsum(duration) - duration
        times = []
        values = []
        for r in np.unique(region).tolist():
            series = self.series[r]
            part = np.flatnonzero((region == r) & (duration > 0.0))
            states = series.begun(self._states_at(first + part))
            for j in range(series.count):
                on = duration[part] > j * series.block
                some = part[on]
                length = np.minimum(duration[part[on]] - j * series.block, series.block)
                is_backward = self.backward[first + some]
                powers = np.where(is_backward, -length, length)[:, None] / series.block
                terms = np.einsum("qpz,nz->nqp", expanded[r][j], states[on]) * (powers**series.powers)[:, None]
                values.append((terms @ (shares[r][:, None] ** series.powers).T).transpose(0, 2, 1))
                at = begins[some] + np.where(is_backward, length, j * series.block)
                times.append(at[:, None] + np.where(is_backward, -length, length)[:, None] * shares[r])
        order = np.argsort(np.concatenate([time.ravel() for time in times]), kind="stable")
        return np.asarray(np.concatenate([value.reshape(-1, value.shape[2]) for value in values])[order])

    def _states_at(self, parts: IntArray) -> Array:
        """(N, Z) states that the series of some parts start from."""
        start = self.start[parts]
        states = self.path.samples[np.maximum(start, 0)]
        states[start < 0] = self.carried[-1 - start[start < 0]]
        return states

    def _level(self, packed: compiled.Rows, scratch: Array, channel: int, share: float) -> float:
        """Level that the modulus of one row exceeds for a share of the time, between bounds by those of all parts."""

        # bounds on the modulus in every part, and on the level
        duration = self.parts.duration
        lower = np.empty(duration.size)
        upper = np.empty(duration.size)
        compiled.reaches(self._compiled, packed, 0, duration.size, channel, scratch, lower, upper)
        wanted = share * float(duration.sum())
        most = np.maximum(upper, -lower)
        least = np.maximum(np.maximum(lower, -upper), 0.0)
        low = _exceeded_for(least, duration, wanted)
        high = _exceeded_for(most, duration, wanted)

        def excess(level: float) -> tuple[float, float]:
            which = np.flatnonzero((least <= level) & (most > level))
            time, loss = compiled.time_above(self._compiled, packed, which, channel, level, scratch)
            return float(duration[least > level].sum()) + time - wanted, loss

        # the root of the time above the level
        if low == 0.0 and excess(0.0)[0] <= 0.0:
            return 0.0
        level = min(max(_exceeded_for(0.5 * (least + most), duration, wanted), low), high)
        while high - low > _LEVEL * high:  # Newton's steps, and halves where these lead out
            beyond, loss = excess(level)
            low, high = (level, high) if beyond > 0.0 else (low, level)
            before = level
            level = level + beyond / loss if loss > 0.0 else -1.0
            if not low <= level <= high:
                level = 0.5 * (low + high)
            elif abs(level - before) <= _NEWTON * high:
                break
        return level

    def _takes_too_long(self, rows: int) -> bool:
        """Whether this many rows would take longer than some seconds."""
        return bool(self.blocks * 40.0 * rows * self.path.samples.shape[1] > _MOST_WORK)

    def _ends(self, cycles: tuple[int, ...] | None) -> list[int]:
        """Parts with which windows begin, and the one after the last."""
        begins = np.flatnonzero(self.parts.sample >= 0)
        count = self.parts.sample.size
        if cycles is None:
            return [0, count]
        at = np.searchsorted(self.parts.sample[begins], np.array(cycles) * self.path.per_cycle)
        ends: list[int] = np.append(begins, count)[at].tolist()
        return ends

    @cached_property
    def _compiled(self) -> compiled.Parts:
        """The parts of the walk for compiled code."""

        return compiled.Parts(
            self.parts.duration,
            self.parts.region,
            self.start,
            self.backward,
            self.whole,
            self.path.samples,
            self.carried,
        )

    def _packed(self, chosen: dict[int, Array], *, with_nodes: bool) -> tuple[compiled.Rows, Array]:
        """Rows of every region for compiled code, and room to work in."""

        # room: sizes, memories, nodes of the quadrature
        count = len(next(iter(chosen.values())))
        regions = len(self.regions)
        sizes = np.zeros((9, regions), dtype=np.int64)
        most = max(region_series.terms for region_series in self.series.values())
        block = np.ones(regions)
        known = np.full((regions, next(iter(self.series.values())).known.size), np.nan)
        moving = np.zeros((regions, count), dtype=np.bool_)
        # Gauss's rule in every region
        rules = {r: region_series.gauss for r, region_series in self.series.items()}
        abscissas, weights = np.zeros((2, regions, max(x.size for x, _ in rules.values())))
        flat: tuple[list[Array], ...] = ([], [], [], [])
        begun = [0, 0, 0, 0]
        for r, series in self.series.items():
            # series of the rows, a bound on their rest, their values at Chebyshev points and at nodes
            coefficients = series.expanded(chosen[r])
            (x, weight) = rules[r]
            rest = np.abs(coefficients[:, :, compiled.FEW :]).sum(axis=2)
            both = np.concatenate([series.points, -series.points])
            looks = (both[:, None] ** series.powers) @ coefficients
            seen = (x[:, None] ** series.powers) @ coefficients if with_nodes else np.zeros(0)
            # sizes of the region, and where its numbers begin
            sizes[:, r] = series.count, series.terms, series.cells, x.size, series.points.size, *begun
            block[r] = series.block
            known[r] = series.known
            moving[r] = np.any(chosen[r] != 0.0, axis=1)
            abscissas[r, : x.size] = x
            weights[r, : x.size] = weight
            for k, array in enumerate((coefficients, rest, seen, looks)):
                flat[k].append(array.ravel())
                begun[k] += array.size
        # all regions end to end
        numbers, rests, seens, looked = (np.concatenate(arrays) for arrays in flat)
        blocks, terms, cells, nodes, points, *first = sizes
        room = np.zeros((2, max(self.path.samples.shape[1], most + 1)))
        return compiled.Rows(
            blocks=blocks,
            block=block,
            terms=terms,
            cells=cells,
            first=first[0],
            coefficients=numbers,
            first_rest=first[1],
            rest=rests,
            points=points,
            first_look=first[3],
            looks=looked,
            moving=moving,
            nodes=nodes,
            abscissas=abscissas,
            weights=weights,
            first_seen=first[2],
            seen=seens,
            known=known,
            first_memory=next(iter(self.series.values())).first_memory,
        ), room

    def _reference(self, chosen: dict[int, Array]) -> Array:
        """(q,) roughly the mean of every row: that of some samples."""
        begins = np.flatnonzero(self.parts.sample >= 0)[::4]
        at = {r: self.parts.sample[begins[self.parts.region[begins] == r]] for r in chosen}
        sums = [weights @ self.path.samples[at[r]].sum(axis=0) for r, weights in chosen.items()]
        return np.asarray(np.sum(sums, axis=0) / begins.size)


def _exceeded_for(values: Array, duration: Array, time: float) -> float:
    """The value that those of some parts exceed for so long at most."""
    order = np.argsort(values)[::-1]
    passed = int(np.searchsorted(np.cumsum(duration[order]), time))
    return float(values[order[min(passed, order.size - 1)]])


def _carried(flow: Flow, path: SampledMotion, parts: _Parts, series: dict[int, Series], carried: IntArray) -> Array:
    """(C, Z) states carried on to the parts that begin with none and end with none that serves."""
    where = np.full(parts.sample.size, -1)
    where[carried] = np.arange(carried.size)
    carried_states = np.zeros((carried.size, path.samples.shape[1]))
    now = carried[parts.sample[carried - 1] >= 0] - 1
    states = path.samples[parts.sample[now]]
    while now.size:
        for r in np.unique(parts.region[now]).tolist():
            on = parts.region[now] == r
            states[on] = series[r].moved(series[r].begun(states[on]), parts.duration[now[on]])
        now = now + 1
        knot = parts.knot[now]
        states[knot >= 0, states.shape[1] - flow.chain.size :] = flow.chains[knot[knot >= 0]]
        carried_states[where[now]] = states
        goes_on = ~parts.is_last[now]
        now = now[goes_on]
        states = states[goes_on]
        follows = where[now + 1] >= 0
        now = now[follows]
        states = states[follows]
    return carried_states


def _parts_of(flow: Flow, path: SampledMotion, visited: IntArray, cuts: int = 1) -> _Parts:
    """Cut the window at samples, crossings and knots, and intervals between samples into so many."""
    # samples, knots and crossings of the window
    samples = path.first + np.arange(len(path.samples) - 1)
    begin = path.first / path.per_cycle
    end = (path.first + samples.size) / path.per_cycle
    knots = flow.knots[1:-1] - path.first_cycle
    first_knot = int(np.searchsorted(knots, begin, side="right"))
    knots = knots[first_knot : np.searchsorted(knots, end)]
    gone = int(np.searchsorted(path.time, begin, side="right"))
    crossings = path.time[gone : np.searchsorted(path.time, end)]
    # all cuts in order
    between = (samples[:, None] + np.arange(1, cuts) / cuts).ravel() / path.per_cycle
    at = np.concatenate([samples / path.per_cycle, crossings, knots, between])
    order = np.argsort(at, kind="stable")
    durations = np.maximum(np.diff(np.append(at[order], end)), 0.0)
    # what each part begins with
    is_sample = order < samples.size
    which_knot = order - samples.size - crossings.size
    crossed = ~is_sample & (which_knot < 0)
    which_knot = np.where(which_knot < knots.size, which_knot, -1)
    return _Parts(
        durations,
        visited[gone + np.cumsum(crossed)],
        np.where(is_sample, order, -1),
        np.where(which_knot >= 0, which_knot + first_knot + 1, -1),
    )
