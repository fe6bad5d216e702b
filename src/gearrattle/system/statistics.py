"""Extremes and moments of a motion between its samples: from the exact motion, not from the samples.

Inside a region dz/ds = M z (``flow``), so any row of numbers R has the values R z, the rates R M z and the curvatures
R M^2 z at every instant whose z is known. Between two neighbouring instants of one region it is taken as the quintic
that has all six of them at both ends. Instants are the samples, the crossings (both limits), the knots of signals, and
as many between as it takes to stay within half the finest step of the exponential tables, a = |(h M)^20|^(1/20) <= 0.6:
the error of the quintic, (a^6 / 46080) of the fastest oscillation, is below 1e-6. Moments are Gauss-Legendre sums over
it with six nodes an interval.

Takes a Flow, sampled states and a log; gives extremes and central moments over a window.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.kernels.packed import step_of
from gearrattle.system.energy import _increments, _visited
from gearrattle.system.flow import Flow, Pieces
from gearrattle.system.region import finest_level

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Rows = Callable[[Pieces], Array]

_SHARE = 0.5  # of the finest step
_ORDER = 14  # of the Taylor series over one such step: 0.6^15 / 15! is rounding
_MOST = 4096  # intervals at once
_UNCUT = 1e-9  # of an interval between two samples: shorter remainders are rounding
_GAUSS = np.polynomial.legendre.leggauss(6)
_NODES, _WEIGHTS = 0.5 * (_GAUSS[0] + 1.0), 0.5 * _GAUSS[1]
_MOST_WORK = 1e10  # floating-point operations, some seconds: beyond, samples must do
_QUINTIC = np.linalg.inv(
    np.array(
        [
            [1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 0, 2, 0, 0, 0],
            [1, 1, 1, 1, 1, 1], [0, 1, 2, 3, 4, 5], [0, 0, 2, 6, 12, 20],
        ],
        dtype=float,
    )
)  # fmt: skip
"""Coefficients of the quintic on 0 ... 1 from value, rate and curvature at its begin and at its end."""


@dataclass(frozen=True)
class Statistics:
    """Of q rows over a window.

    Attributes:
        low, high: (q,) extremes.
        mean: (q,).
        second, third, fourth: (q,) central moments <(x - <x>)^p>.
    """

    low: Array
    high: Array
    mean: Array
    second: Array
    third: Array
    fourth: Array


@dataclass(frozen=True)
class Path:
    """A motion by its samples and its log, times in periods from the first sample.

    Attributes:
        initial: piece of every element and companion at the first sample.
        samples: (t, Z) states z; sample i lies at i / per_cycle.
        per_cycle: samples a period.
        first: the sample with which the window begins; it ends with the last one.
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


class _Sums:
    """Extremes and powers about a reference, gathered interval by interval."""

    def __init__(self, about: Array, *, with_moments: bool) -> None:
        self.about, self.with_moments = about, with_moments
        self.low, self.high = np.full(about.size, np.inf), np.full(about.size, -np.inf)
        self.powers = np.zeros((4, about.size))

    def add(self, begin: Array, end: Array, length: Array) -> None:
        """Add intervals: (N, 3, q) values, rates and curvatures by s at their begins and ends, (N,) lengths."""
        scale = length[:, None, None] ** np.arange(3.0)[None, :, None]
        ends = np.concatenate([begin * scale, end * scale], axis=1)
        for values in (ends[:, 0], ends[:, 3]):
            self.low, self.high = np.minimum(self.low, values.min(0)), np.maximum(self.high, values.max(0))
        row, channel = np.nonzero(ends[:, 1] * ends[:, 4] < 0.0)
        if row.size:
            values = _turning_values(ends[row, :, channel] @ _QUINTIC.T)
            np.minimum.at(self.low, channel, values)
            np.maximum.at(self.high, channel, values)
        if self.with_moments:
            shape = _NODES[:, None] ** np.arange(6.0) @ _QUINTIC
            away = np.einsum("ps,nsq->pnq", shape, ends) - self.about
            weight = _WEIGHTS[:, None] * length
            power = np.ones_like(away)
            for p in range(4):
                power *= away
                self.powers[p] += np.einsum("pn,pnq->q", weight, power)

    def result(self, duration: float) -> Statistics:
        """Return what was gathered over a window of this length."""
        m1, m2, m3, m4 = self.powers / duration
        return Statistics(
            self.low, self.high, self.about + m1, m2 - m1**2, m3 - 3 * m1 * m2 + 2 * m1**3,
            m4 - 4 * m1 * m3 + 6 * m1**2 * m2 - 3 * m1**4,
        )  # fmt: skip


def _turning_values(coefficients: Array) -> Array:
    """Values of quintics (N, 6) on 0 ... 1 where their rate, of different signs at the ends, vanishes: by bisection."""
    rate = coefficients[:, 1:] * np.arange(1.0, 6.0)
    low, high = np.zeros(len(rate)), np.ones(len(rate))
    falling = rate[:, 0] > 0.0
    for _ in range(26):  # the value at the turning point hangs on the square of what is left
        middle = 0.5 * (low + high)
        before = (_at(rate, middle) > 0.0) == falling
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return _at(coefficients, 0.5 * (low + high))


def _at(coefficients: Array, x: Array) -> Array:
    value = np.zeros(len(x))
    for column in coefficients.T[::-1]:
        value = value * x + column
    return value


def statistics_of(flow: Flow, path: Path, rows: Rows, *, with_moments: bool = True) -> Statistics | None:
    """Return extremes and moments of rows over the window of a motion.

    Args:
        flow: the system.
        path: the motion.
        rows: gives (q, Z) rows for the pieces of a region [SI].
        with_moments: whether moments are wanted; without, they are 0.

    Returns:
        The statistics; None where they would take longer than some seconds (many regions of many bodies, or a contact
        that is stiff beyond all proportion to the window).
    """
    regions, visited = _visited(flow, path.initial, path.watch, path.upward)
    durations, region, sample, knot = _intervals(flow, path, visited)
    if 100.0 * flow.width**3 * np.unique(region).size > _MOST_WORK:
        return None
    seen = {int(r): _Region.of(flow, regions[int(r)], rows) for r in np.unique(region)}
    some = next(iter(seen.values()))
    steps = sum(float(np.sum(durations[region == r] / each.step + 1.0)) for r, each in seen.items())
    if steps * (2.0 * some.matrix.size + 40.0 * some.seen.size) > _MOST_WORK:
        return None
    begins = [(seen[int(r)], sample[(region == r) & (sample >= 0)]) for r in np.unique(region)]
    about = sum(each.seen[0] @ path.samples[at].sum(axis=0) for each, at in begins) / np.count_nonzero(sample >= 0)
    sums = _Sums(about, with_moments=with_moments)
    waiting, z = np.flatnonzero(sample >= 0), path.samples[sample[sample >= 0]]
    while waiting.size:  # the intervals that begin at samples, then those that follow them, and so on
        chained = knot[waiting] >= 0
        z[chained, z.shape[1] - flow.chain.size :] = flow.chains[knot[waiting[chained]]]
        ends = np.empty_like(z)
        uncut = np.abs(durations[waiting] * path.per_cycle - 1.0) < _UNCUT
        for chosen in _batches(2 * region[waiting] + uncut):
            here, whole = seen[int(region[waiting[chosen[0]]])], bool(uncut[chosen[0]])
            ends[chosen] = here.run(z[chosen], durations[waiting[chosen]], sums, alike=whole)
        after = waiting + 1
        goes_on = (after < len(sample)) & (sample[np.minimum(after, len(sample) - 1)] < 0)
        waiting, z = after[goes_on], ends[goes_on]
    return sums.result((len(path.samples) - 1 - path.first) / path.per_cycle)


def _batches(kind: IntArray) -> Iterator[IntArray]:
    """Positions of the intervals of one kind, a few thousand at a time."""
    order = np.argsort(kind, kind="stable")
    for part in np.split(order, np.flatnonzero(np.diff(kind[order])) + 1):
        for first in range(0, len(part), _MOST):
            yield part[first : first + _MOST]


def _intervals(flow: Flow, path: Path, visited: IntArray) -> tuple[Array, IntArray, IntArray, IntArray]:
    """Length of every interval of the window, its region, the sample and the knot it begins with (-1: none)."""
    count, first = len(path.samples) - 1, path.first
    begin, end = first / path.per_cycle, count / path.per_cycle
    samples = np.arange(first, count)
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
    return (
        durations,
        visited[gone + np.cumsum(crossed)],
        np.where(is_sample, first + order, -1),
        np.where(which_knot >= 0, which_knot + first_knot + 1, -1),
    )


@dataclass(frozen=True)
class _Region:
    """One region: M, the rows R, R M and R M^2 (3, q, Z), the longest interval in periods, and known memories."""

    matrix: Array
    seen: Array
    step: float
    known: Array
    first_memory: int

    @classmethod
    def of(cls, flow: Flow, pieces: Pieces, rows: Rows) -> _Region:
        matrix, chosen = flow.generator(pieces), rows(pieces)
        rate = chosen @ matrix
        step = _SHARE * step_of(finest_level(matrix))
        first_memory = flow.states - flow.memory.size
        return cls(matrix, np.stack([chosen, rate, rate @ matrix]), step, flow.known(pieces), first_memory)

    def run(self, z: Array, durations: Array, sums: _Sums, *, alike: bool) -> Array:
        """Add intervals that begin at z (N, Z), of one length or of any; return the states at their ends."""
        z = z.copy()
        for s, value in enumerate(self.known.tolist()):
            if not np.isnan(value):
                z[:, self.first_memory + s] = value
        parts = np.maximum(np.ceil(durations / self.step), 1.0)
        length = durations / parts
        move = _increments(self.matrix, length[:1])[0] if alike else None
        begin = self._look(z)
        for k in range(int(parts.max())):
            on = np.flatnonzero(parts > k)
            moved = z[on] + (z[on] @ move.T if move is not None else self._travel(z[on], length[on]))
            end = self._look(moved)
            sums.add(begin[on], end, length[on])
            z[on], begin[on] = moved, end
        return z

    def _look(self, z: Array) -> Array:
        """(N, 3, q) values, rates and curvatures."""
        count = self.seen.shape[1]
        return (z @ self.seen.reshape(3 * count, -1).T).reshape(len(z), 3, count)

    def _travel(self, z: Array, length: Array) -> Array:
        """(N, Z) what z gains over lengths (N,), by its Taylor series."""
        term, gained = z, np.zeros_like(z)
        for p in range(1, _ORDER + 1):
            term = (term @ self.matrix.T) * (length / p)[:, None]
            gained += term
        return gained
