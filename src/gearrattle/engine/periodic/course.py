"""A motion from crossing to crossing, with one perturbation, for drivelines of any kind: z' = Z z between crossings.

The perturbation v begins with a change of the state at the start and of the parameter p, and obeys

    v' = Z v + (dZ/dp) z dp.

A bound b, crossed by a row r of z at the rate g = r Z z, is met later by

    dt = -(r v + (dr/dp z - db/dp) dp) / g,        v -> v + (Z z - Z+ z+) dt,

Z+ and z+ behind the bound. Memories that are known there change with what is known. Derivatives with respect to p are
central differences of coefficients: no motion is differenced.

Every interval is cut into steps, over each of which z and v are Taylor series. So a row over the whole motion is a
polynomial on every step. Rows over v at an instant are carried backwards to the start: then they tell of every
perturbation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.passages import Passages

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

ORDER = 26
"""Terms of the series over a step."""
_STEP = 2.0  # radians of the fastest mode in a step: the first term left out is below 1e-17
_ROUNDING = 1e-18  # terms below this share of the first are left out
_DENSE = 48  # entries of z and v up to which matrices are dense
_SAME_TICK = 1e-9  # periods


class Neighbours(NamedTuple):
    """The drivelines with a smaller and with a larger parameter, and how far they are apart."""

    low: Flow
    high: Flow
    distance: float


class Bound(NamedTuple):
    """What crosses a bound, and the bound."""

    row: Array  # (Z,) over z
    row_shift: Array  # (Z,) its derivative with respect to p
    value: float  # infinite where the clock decides
    shift: float


class _Crossing(NamedTuple):
    """A crossing, in periods."""

    watch: int
    upward: int
    time: float


class Setting:
    """A driveline and how it changes with its parameter, in the scales of its own flow."""

    def __init__(self, flow: Flow, neighbours: Neighbours) -> None:
        self.flow, self.neighbours = flow, neighbours
        self.sizes = sizes_of(flow)
        self._regions: dict[Pieces, Region] = {}

    @property
    def memories(self) -> slice:
        """Where memories stand in z."""
        return slice(self.flow.states - self.flow.memory.size, self.flow.states)

    def region(self, pieces: Pieces) -> Region:
        """Return what drives motions in a region."""
        if pieces not in self._regions:
            rates = self.flow.generator(pieces)
            shift = self._difference([self._rates_of(flow, pieces) for flow in self._flows])
            self._regions[pieces] = Region(rates, shift)
        return self._regions[pieces]

    @cached_property
    def deflections(self) -> tuple[Array, Array]:
        """(K, Z) rows of the deflections of the clearances, and how they change with p."""
        chosen = list(self.flow.system.clearances)
        shift = self._difference([flow.deflection[chosen] * self._ratio(flow) for flow in self._flows])
        return self.flow.deflection[chosen], shift

    @cached_property
    def corners(self) -> list[tuple[Array, Array]]:
        """Lower and upper corners (2, pieces) of every clearance, and how these change with p."""
        both = []
        for k in self.flow.system.clearances:
            own, *others = (np.stack([f.system.laws[k].lower, f.system.laws[k].upper]) for f in self._all)
            both.append((own, self._difference([np.where(np.isfinite(own), other, 0.0) for other in others])))
        return both

    def bound(self, pieces: Pieces, watch: int, upward: int) -> Bound:
        """Return what crosses a bound in a region."""
        rows = [_row_of(flow, pieces, watch) for flow in self._all]
        bounds = np.array([_bound_of(flow, pieces, watch, upward) for flow in self._all])
        shift = self._difference([row * self._ratio(f) for row, f in zip(rows[1:], self._flows, strict=True)])
        moved = float(self._difference(bounds[1:])) if np.isfinite(bounds[0]) else 0.0
        return Bound(rows[0], shift, float(bounds[0]), moved)

    def known_shift(self, pieces: Pieces) -> Array:
        """Return (S,) how memories that are known change with p, in scales of z."""
        return self._difference([flow.known(pieces) / flow.memory * self.flow.memory for flow in self._flows])

    def tick_shift(self, auxiliary: int, time: float) -> float:
        """Return how the instant of a change by the clock moves with p [periods]."""
        ticks = []
        for flow in self._all:
            clock, period = flow.system.clock, flow.system.inputs.period
            if clock is None:
                return 0.0
            ticks.append(clock.time[clock.auxiliary == auxiliary] / period)
        apart = np.abs(np.remainder(time - ticks[0] + 0.5, 1.0) - 0.5)
        if not apart.size or apart.min() > _SAME_TICK:
            return 0.0
        low, high = (tick[int(np.argmin(apart))] for tick in ticks[1:])
        moved = np.remainder(high - low + 0.5, 1.0) - 0.5  # one at the end of the period may pass it
        return float(moved / self.neighbours.distance)

    @property
    def _flows(self) -> tuple[Flow, ...]:
        return self.neighbours[:2]

    @property
    def _all(self) -> tuple[Flow, ...]:
        return (self.flow, *self._flows)

    def _ratio(self, flow: Flow) -> Array:
        """(Z,) entries of z in the scales of another flow over those in the scales of this one."""
        return sizes_of(flow) / self.sizes

    def _rates_of(self, flow: Flow, pieces: Pieces) -> Array:
        ratio = self._ratio(flow)
        return np.asarray(flow.generator(pieces) * ratio / ratio[:, None])

    def _difference(self, both: Sequence[Array] | Array) -> Array:
        return np.asarray((both[1] - both[0]) / self.neighbours.distance)


def is_alike(flow: Flow, other: Flow) -> bool:
    """Return whether two drivelines differ in numbers alone."""
    return _shape(flow) == _shape(other)


def _shape(flow: Flow) -> tuple[object, ...]:
    """What drivelines that differ in numbers alone have in common."""
    system = flow.system
    pieces = tuple(law.pieces for law in system.laws)
    others = tuple((own.kind, own.element, len(own.lower)) for own in system.auxiliaries)
    ticks = None if system.clock is None else tuple(system.clock.auxiliary.tolist())
    return pieces, others, ticks, sizes_of(flow).size, system.clearances


def sizes_of(flow: Flow) -> Array:
    """Return (Z,) scales of the entries of z: z = scale * SI, inputs of size one."""
    parts = flow.scaling.deflection, flow.scaling.velocity, flow.memory, flow.input_size, flow.chain
    return np.concatenate(parts)


def _row_of(flow: Flow, pieces: Pieces, watch: int) -> Array:
    """(Z,) what crosses a bound [its own unit]."""
    clearances, auxiliary = flow.system.clearances, watch - len(flow.system.clearances)
    if auxiliary < 0:
        return np.asarray(flow.deflection[clearances[watch]])
    own, piece, memory = list(flow.beside(pieces))[auxiliary]
    of_deflection, of_rate, of_memory = own.watched[piece]
    row = of_deflection * flow.deflection[own.element] + of_rate * flow.rate[own.element] + of_memory * memory
    return np.asarray(row)


def _bound_of(flow: Flow, pieces: Pieces, watch: int, upward: int) -> float:
    """The bound; infinite where the clock decides."""
    system, auxiliary = flow.system, watch - len(flow.system.clearances)
    if auxiliary < 0:
        element = system.clearances[watch]
        return system.laws[element].bounds(pieces[element])[1 if upward else 0]
    own, piece = system.auxiliaries[auxiliary], pieces[len(system.laws) + auxiliary]
    return float(own.upper[piece] if upward else own.lower[piece])


class Region:
    """What drives a motion and its perturbation in one region.

    rates: (Z, Z) of z' = Z z.
    shift: (Z, Z) its derivative with respect to p.
    """

    def __init__(self, rates: Array, shift: Array) -> None:
        self.rates, self.shift = rates, shift
        size = np.abs(rates)
        self.speed = float(np.sqrt((size @ size.sum(axis=1)).max(initial=0.0)))  # about the fastest mode [1/period]
        self._operators: dict[float, Any] = {}

    @cached_property
    def backwards(self) -> Any:
        """(Z, Z) what rows over v are carried backwards by."""
        return _stored(self.rates.T)

    def operator(self, by: float) -> Any:
        """Return (2 Z, 2 Z) rates of z and v, while p changes by an amount."""
        if by not in self._operators:
            zero = np.zeros_like(self.rates)
            self._operators[by] = _stored(np.block([[self.rates, zero], [by * self.shift, self.rates]]))
        return self._operators[by]

    def series(self, operator: Any, start: Array, h: float) -> Array:
        """Return (ORDER, .) terms of the series from a state over a step; zero where they are rounding."""
        terms = np.zeros((ORDER, start.size))
        terms[0], reach, share = start, self.speed * abs(h), 1.0
        for m in range(1, ORDER):
            share *= reach / m
            np.multiply(operator @ terms[m - 1], h / m, out=terms[m])
            if m > reach and share < _ROUNDING:
                break
        return terms

    def steps(self, length: float) -> int:
        """Return into how many steps an interval is cut."""
        return max(1, int(np.ceil(self.speed * abs(length) / _STEP)))


def _stored(matrix: Array) -> Any:
    """A matrix for products with vectors."""
    return np.ascontiguousarray(matrix) if len(matrix) <= _DENSE else csr_array(matrix)


@dataclass(frozen=True)
class Leap:
    """What a crossing does to perturbations."""

    row: Array  # (Z,) over v, what crosses the bound
    rate: float  # of that, per period; infinite where the clock decides.
    jump: Array  # (Z,) Z z before the crossing less that after it
    known: NDArray[np.bool_]  # (S,) memories that are known behind it
    delay: float  # dt along the perturbation of the Course [periods]

    def backwards(self, row: Array, memories: slice) -> Array:
        """Return a row over v before the crossing, for one after it."""
        after = row.copy()
        after[memories][self.known] = 0.0
        return after - float(after @ self.jump) / self.rate * self.row


@dataclass(frozen=True)
class Course:
    """A motion and its perturbation on its steps, J of them in I intervals.

    begin, length: (J,) of every step, in periods.
    value, change: (J, K, ORDER) deflections of the clearances and their perturbations: coefficients of the powers of
    the time in a step over its length [SI].
    z, v: (Z,) at the end.
    """

    setting: Setting  # of the driveline
    pieces: tuple[Pieces, ...]  # (I,) regions of the intervals
    leaps: tuple[Leap, ...]  # (I - 1,) at the crossings between them
    interval: IntArray  # (J,) of every step
    begin: Array
    length: Array
    value: Array
    change: Array
    z: Array
    v: Array

    def backwards(self, row: Array) -> Array:
        """Return (N,) a row (Z,) over v at the end as one over v at the start, p left as it is."""
        states, now = self.setting.flow.states, row.copy()
        for j in range(len(self.begin) - 1, -1, -1):
            i, earlier = int(self.interval[j]), int(self.interval[j - 1]) if j > 0 else 0
            region = self.setting.region(self.pieces[i])
            now = region.series(region.backwards, now, float(self.length[j])).sum(axis=0)
            for leap in reversed(self.leaps[earlier:i]):
                now = leap.backwards(now, self.setting.memories)
        now[self.setting.memories][~np.isnan(self.setting.flow.known(self.pieces[0]))] = 0.0
        return now[:states]


def course_of(
    setting: Setting, begin: tuple[Pieces, Array], path: Passages, end: float, change: tuple[Array, float]
) -> Course:
    """Follow a motion and its perturbation through crossings that are known.

    change: (N,) of the state at the start, balanced, and of p.
    """
    flow, (pieces, y), (u, by) = setting.flow, begin, change
    z = np.concatenate([y, flow.inputs_at(np.zeros(1), np.zeros(1))[0]])
    v = np.concatenate([u, np.zeros(z.size - u.size)])
    is_known = ~np.isnan(flow.known(pieces))
    if is_known.any():
        v[setting.memories][is_known] = by * setting.known_shift(pieces)[is_known]
    times = np.concatenate([[0.0], path.time / flow.system.inputs.period, [end]])
    rows, shift = setting.deflections
    both = np.block([[rows, np.zeros_like(rows)], [by * shift, rows]])
    regions, leaps, steps, seen = [pieces], list[Leap](), list[tuple[int, float, float]](), list[Array]()
    now = np.concatenate([z, v])
    for i in range(len(times) - 1):
        region, length = setting.region(pieces), float(times[i + 1] - times[i])
        count, operator = region.steps(length), region.operator(by)
        h = length / count
        for n in range(count if length > 0.0 or i == len(path.time) else 0):
            terms = region.series(operator, now, h)
            steps.append((i, float(times[i]) + n * h, h))
            seen.append(terms @ both.T)
            now = terms.sum(axis=0)
        if i < len(path.time):
            crossing = _Crossing(int(path.watch[i]), int(path.upward[i]), float(times[i + 1]))
            following = flow.system.beyond(pieces, crossing.watch, crossing.upward)
            leap, now = _leap(setting, (pieces, following), crossing, now, by)
            pieces = following
            leaps.append(leap)
            regions.append(pieces)
    interval, first, length_of_step = (np.array(part) for part in zip(*steps, strict=True))
    value, moved = np.split(np.array(seen).transpose(0, 2, 1), 2, axis=1)
    z, v = np.split(now, 2)
    return Course(setting, tuple(regions), tuple(leaps), interval, first, length_of_step, value, moved, z, v)


def _leap(
    setting: Setting, sides: tuple[Pieces, Pieces], crossing: _Crossing, now: Array, by: float
) -> tuple[Leap, Array]:
    """What a crossing does, and the motion and its perturbation behind it."""
    before, after = sides
    (z, v), memories = np.split(now, 2), setting.memories
    z_after, known = z.copy(), setting.flow.known(after)
    is_known = ~np.isnan(known)
    z_after[memories][is_known] = known[is_known]
    rates = setting.region(before).rates @ z
    jump = rates - setting.region(after).rates @ z_after
    bound = setting.bound(before, crossing.watch, crossing.upward)
    if np.isfinite(bound.value):
        rate = float(bound.row @ rates)
        delay = -(float(bound.row @ v) + by * (float(bound.row_shift @ z) - bound.shift)) / rate
    else:
        auxiliary = crossing.watch - len(setting.flow.system.clearances)
        rate, delay = np.inf, by * setting.tick_shift(auxiliary, crossing.time)
    v = v + jump * delay
    v[memories][is_known] = by * setting.known_shift(after)[is_known]
    return Leap(bound.row, rate, jump, is_known, delay), np.concatenate([z_after, v])
