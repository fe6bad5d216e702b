"""The smallest pulse of torque that tips a stable motion over into another one, over the instants of the period.

An impulse I on an inertia J changes its speed by I / J at once. The effect of a small one dies out. The smallest one
that does not die out leads to the border of the basin; along the border the motion goes to an unstable one, the saddle.

Pulses are made larger step by step, from one that comes back, until one takes the motion elsewhere (``destinations``).
Along the way the passes until the motion is back grow towards every border. Where they have a maximum, that is sought
as well: smaller pulses than some that come back may tip the motion over. Between the largest pulse below that comes
back and the smallest one that tips the motion over the border is sought by bisection. What is undecided in between
stays so: it is the error.

The instant at which the smallest pulse is smallest is sought from every instant, of eight at least, at which it is no
larger than at both its neighbours: half the distance to either side is tried, a quarter from the best of these, and so
on. The first step tries what twice as many instants begin with, so these never give a larger pulse.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from functools import cache, reduce
from math import inf, nan
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble, free_names
from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.equations import shortest_solution
from gearrattle.engine.periodic.motion import Pass, State, multipliers_of
from gearrattle.engine.periodic.period_map import Marched, PeriodMap
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import did_you_mean, shown
from gearrattle.orbits.motion_families import without_free
from gearrattle.orbits.progress import Progress, never_falling
from gearrattle.wording import counted, listed, measured

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]
BACK = "back"
ELSEWHERE = "elsewhere"
UNDECIDED = "undecided"
NEAR = 1e-4
"""Of the smallest corner: a motion that is nearer than this to a stable one, and still comes nearer, settles in it."""
LONGEST = 6000
"""Periods for which a motion is followed, at least."""
MOST_PERIODS = 64
"""After so many periods at most another motion is seen to repeat."""

_CHUNK = 8  # passes between two looks, and periods after which a motion about repeats that stays near a saddle
_REPEATS = 1e-2  # of the smallest corner: what repeats as well as this is searched for
_LOOKS = 8  # the time between two looks is at most this part of the time so far
_FALLS = 0.5  # what comes nearer to a known motion by this factor between two looks is not searched for
_PATIENT = 512  # passes during which nothing is searched for where a motion is near a saddle that is known
_LINEAR = 0.5  # of the radius of stability: by so much a difference may depart from what the gradient makes of it
_ANGLES = 64  # at which the radius of stability is sought
_ROUNDED = 1e-12  # of a state: its rounding
_MET = 1e-2  # of the smallest corner: what comes so near to the states of an irregular motion goes on like it
_STEADY = 0.9  # at least: how well it repeats in two parts of the time, the smaller over the larger
_MOVES = 1e-6  # of the smallest corner: what repeats no better than this moves
_GROWTH = 1.1  # of pulses, from one to the next
_FIRST = 1e-3  # change of speed; 1 is as much as the largest corner, in balanced coordinates
_LARGEST = 1e2  # the same
_DOWN = _GROWTH**-24  # about a tenth, from one try of a first pulse to the next
_LEAST = 1e-6  # of a first pulse that is small for the smallest corner: beside a fold it may be smaller by this
_EXACT = 1e-6  # of a pulse: to so much its border is sought
_NARROWEST = 1e-3  # of a pulse: a maximum of the passes until the motion is back is sought to this
_GOLDEN = 0.381966
_MOST_UNDECIDED = 6  # of pulses at one instant
_MOST_PASSES = 5000
_SAMPLES = 1024  # at least, of a motion: instants between which the best one is sought
_VALLEYS = 3  # that are expected
_FEWEST = 8  # instants from which the best one is sought
_SIGNS = (1.0, -1.0)


class Destination(NamedTuple):
    """Where a motion goes."""

    where: str  # BACK, ELSEWHERE or UNDECIDED
    passes: float  # until it is back; infinite where it does not come back


class _Gradients(NamedTuple):
    """By what small differences from M states of a stable motion are multiplied every n periods.

    What departs from that by less of the difference than the margin cannot keep it from dying out (small gain).
    """

    periods: int  # n
    gradients: Array  # (M, N, N)
    margins: Array  # (M,)
    rounding: float  # of a difference

    def part(self, which: slice) -> _Gradients:
        """Return the same of some of the states."""
        return self._replace(gradients=self.gradients[which], margins=self.margins[which])

    def dies_out(self, past: Array, states: Array) -> bool:
        """Whether the difference of states at the starts of periods so far (R, N) from the nearest of (M, N) does."""
        if len(past) <= 2 * self.periods:
            return False
        nearest = int(np.argmin(np.linalg.norm(states - past[-1], axis=1)))
        off = past[-1 - 2 * self.periods :: self.periods] - states[nearest]
        departures = np.linalg.norm(off[1:] - off[:-1] @ self.gradients[nearest].T, axis=1)
        allowed = _LINEAR * self.margins[nearest] * np.linalg.norm(off[:-1], axis=1)
        return bool(np.all(departures <= np.maximum(allowed, self.rounding)))


class _Known(NamedTuple):
    """A motion by its states at the starts of periods (M, N), balanced, and how near others are that go on like it."""

    states: Array
    radius: float
    near: _Gradients | None = None  # of a motion that attracts

    def distances(self, y: Array) -> Array:
        """Distances (R,) of states (R, N) from the nearest one of the motion."""
        return np.asarray(np.linalg.norm(self.states[:, None] - y, axis=2).min(axis=0))

    def attracts(self, past: Array, distance: float) -> bool:
        """Whether a motion goes on like this one, by its states at the starts of periods so far, and the last distance.

        Near to a stable motion the difference must die out.
        """
        return distance < self.radius and (self.near is None or self.near.dies_out(past, self.states))


class Destinations:
    """Where motions go, by their states at the start of a period."""

    def __init__(self, period_map: PeriodMap, motion: Pass, passes: int) -> None:
        self._map = period_map
        self._size = smallest_corner(period_map)
        states, gradients = self._followed(motion.start, period_map.cycles)
        first = slice(1)
        later = slice(1, None)
        near = NEAR * self._size
        self._own = _Known(states[first], near, gradients.part(first))
        self._known = [_Known(states[later], near, gradients.part(later))] if period_map.cycles > 1 else []
        self._decay = -float(np.log(np.clip(np.abs(multipliers_of(motion.gradient)[0]), 1e-3, 1.0 - 1e-12)))
        self.longest = max(4 * passes, -(-LONGEST // period_map.cycles))
        self._chunk = int(np.clip(passes // (4 * _CHUNK), 1, 4)) * _CHUNK
        self._saddles = list[_Known]()
        self.irregular = 0
        self.undecided = 0

    def of(self, state: State) -> Destination:
        """Return where the motion from a state at the start of a period goes."""
        destination = self._of(state)
        return self.lost() if destination.where == UNDECIDED else destination

    def lost(self) -> Destination:
        """Take note of a motion that could not be followed so far that it is decided, and return that."""
        self.undecided += 1
        return Destination(UNDECIDED, np.inf)

    def _of(self, state: State) -> Destination:
        visited = list[Array]()
        done = 0
        search = 2 * self._chunk
        past = np.zeros((0, self._own.states.shape[1]))
        while done < self.longest:
            passes = max(self._chunk, done // (_LOOKS * _CHUNK) * _CHUNK)
            try:
                march = self._map.marched(state, passes)
            except ConvergenceError:
                return Destination(UNDECIDED, np.inf)
            # back, or as near to another motion that is known
            rows = self._rows(march)
            state = self._map.sampled(march, -1)
            past = np.concatenate([past[-1 - 2 * MOST_PERIODS : -1], rows])
            own = self._own.distances(rows[:: self._map.cycles])
            if self._own.attracts(past, own[-1]):
                return Destination(BACK, max(0.0, done + self._passes_until_near(own / self._size)))
            others = [known.distances(rows[[0, -1]]) for known in self._known]
            if any(known.attracts(past, off[-1]) for known, off in zip(self._known, others, strict=True)):
                return Destination(ELSEWHERE, np.inf)
            done += passes
            visited.append(rows[1:])
            # a search for a motion that is not known, unless it comes nearer to one that is
            is_settling = any(distance[-1] < _FALLS * distance[0] for distance in (own, *others))
            is_at_saddle = done < _PATIENT and any(
                saddle.distances(rows[-1:])[0] < saddle.radius for saddle in self._saddles
            )
            if done >= search and not is_settling and not is_at_saddle:
                search = 2 * done
                if self._settles_in_another(state, past):
                    return Destination(ELSEWHERE, np.inf)
        # neither back nor settled: near a saddle, or irregular
        later = np.concatenate(visited)[self.longest // 2 * self._map.cycles :]
        if _may_go_either_way(later / self._size):
            return Destination(UNDECIDED, np.inf)
        self.irregular += 1
        self._known.append(_Known(later, _MET * self._size))
        return Destination(ELSEWHERE, np.inf)

    def _passes_until_near(self, distances: Array) -> float:
        """After how many passes the distance falls below NEAR for good, between passes as if it fell exponentially.

        A motion that was nearer all the time may have stayed near a saddle that is nearer, too: the last distance says
        how long.
        """
        over = np.flatnonzero(distances >= NEAR)
        if not over.size:
            return len(distances) - 1 + float(np.log(max(distances[-1], 1e-300) / NEAR)) / self._decay
        before = np.log(distances[over[-1]])
        after = np.log(max(distances[over[-1] + 1], 1e-300))
        return float(over[-1] + (before - np.log(NEAR)) / (before - after))

    def _settles_in_another(self, state: State, past: Array) -> bool:
        """Whether a motion is settled in one that was not known, from its states so far.

        A motion of many periods may about repeat earlier, near a saddle: it repeats better after all of them.
        """
        distances = np.linalg.norm(past[-2 : -MOST_PERIODS - 2 : -1] - past[-1], axis=1)
        least = _REPEATS * self._size
        for i, distance in enumerate(distances):
            if distance < least:
                another = self._another(state, i + 1)
                least = _FALLS * distance
                if another is not None and another.attracts(past, another.distances(past[-1:])[0]):
                    return True
        return False

    def _rows(self, march: Marched) -> Array:
        """Balanced states (R, N) at the starts of the periods T of a march, and at its end."""
        return np.array(march.samples.states[:, : self._map.flow.states])

    def _another(self, state: State, cycles: int) -> _Known | None:
        """The stable motion, not the own one, that Newton's method leads to from a state; None: it does not.

        It is known from then on, and so is a saddle.
        """
        period_map = PeriodMap(self._map.system, cycles)
        try:
            orbit = shooting.shoot(period_map, state)
            rows = self._rows(period_map.marched(orbit.motion.start))[:-1]
            same = NEAR * self._size
            if self._own.distances(rows).min() < same:
                return None
            others = without_free(orbit.multipliers, orbit.free.shape[1])
            is_stable = float(np.abs(others).max(initial=0.0)) < 1.0
            motions = self._known if is_stable else self._saddles
            motion = next((known for known in motions if known.distances(rows[:1])[0] < same), None)
            if motion is None:
                motion = _Known(rows, _REPEATS * self._size)
                if is_stable:
                    motion = _Known(rows, same, self._followed(orbit.motion.start, cycles)[1])
                motions.append(motion)
        except (ConvergenceError, np.linalg.LinAlgError):
            return None
        return motion if is_stable else None

    def _followed(self, start: State, cycles: int) -> tuple[Array, _Gradients]:
        """States (M, N) of a motion of M periods at their starts, and what differences from them are multiplied by."""
        period_map = PeriodMap(self._map.system)
        scale = self._map.scale
        states = list[Array]()
        steps = list[Array]()
        for _ in range(cycles):
            period = period_map(start)
            states.append(period.start.y * scale)
            steps.append(scale[:, None] * period.gradient / scale)
            start = period.end
        gradients = np.array(
            [reduce(lambda first, second: second @ first, steps[k:] + steps[:k]) for k in range(cycles)]
        )
        margins = np.array([_radius_of_stability(gradient) for gradient in gradients])
        gap = float(np.linalg.norm(start.y * scale - states[0]))
        rounding = 10.0 * gap + _ROUNDED * max(self._map.size, float(np.linalg.norm(states[0])))
        return np.array(states), _Gradients(cycles, gradients, margins, rounding)


def smallest_corner(period_map: PeriodMap) -> float:
    """Return by how much a balanced state changes at least between the middle and the end of a gap; 1: no gap."""
    rows = np.linalg.norm(period_map.flow.deflection[:, : period_map.flow.states], axis=1)
    laws = zip(period_map.system.laws, rows, strict=True)
    corners = [float(corner) / row for law, row in laws for corner in np.abs(law.corners) if corner > 0.0]
    return float(min(corners, default=1.0))


def _radius_of_stability(gradient: Array) -> float:
    """How large a change of a gradient (N, N) is at least that makes it unstable, but for free directions.

    It is the least singular value of z - M over |z| = 1.
    """
    one = np.eye(len(gradient))
    free = shortest_solution(one - gradient, np.zeros(len(gradient)))[1]
    kept = gradient @ (one - free @ free.T)
    turns = np.exp(1j * np.linspace(0.0, np.pi, _ANGLES))
    return float(np.linalg.svd(turns[:, None, None] * one - kept, compute_uv=False).min())


def _may_go_either_way(y: Array) -> bool:
    """Whether a motion is near a saddle for as long as it was followed, by its states (R, N) in units of a corner.

    There it about repeats, better and better, or less and less well.
    """
    distances = _repeating(y)
    if np.mean(distances < _REPEATS) <= 0.5:
        return False
    before, last = (float(half.mean()) for half in np.array_split(distances, 2))
    return min(before, last) < max(_MOVES, _STEADY * max(before, last))


def _repeating(y: Array) -> Array:
    """How well (R - 8,) states repeat after one to 8 periods, the best of these."""
    distances = [np.linalg.norm(y[k : len(y) - _CHUNK + k] - y[:-_CHUNK], axis=1) for k in range(1, _CHUNK + 1)]
    return np.asarray(np.min(distances, axis=0))


def check_pulses(model: Model, on: str) -> None:
    """Refuse pulses on what is no free inertia of a model, and on a model for which they are not known.

    Raises ModelError: no such inertia, or stiffness that alternates by the clock.
    """
    names = free_names(model)
    if on not in names:
        rule = f"must be a free inertia: {listed(names, 'or')}"
        raise ModelError(Problem("on", shown(on), rule, did_you_mean(on, names)))
    if assemble(model).system.clock is not None:
        rule = "pulses are not known where the stiffness of a mesh alternates"
        raise ModelError(Problem("model", model.name, rule))


def tipping_table(
    period_map: PeriodMap,
    motion: Pass,
    inertia: int,
    *,
    instants: int,
    best: bool,
    unit: str,
    progress: Progress | None,
) -> pd.DataFrame:
    """Return the smallest pulses that tip a stable, isolated motion over; see ``Orbit.tipping``."""
    import pandas as pd

    levels = max(0, int(np.ceil(np.log2(_SAMPLES / instants))))
    finer = max(0, int(np.ceil(np.log2(_FEWEST / instants)))) if best else 0
    borders = len(_SIGNS) * ((instants << finer) + (2 * (levels - finer) * _VALLEYS if best else 0))
    work = never_falling(progress)
    known = itertools.count(1)
    basin = _Basin(period_map, motion, inertia, instants << levels, lambda: work(next(known) / borders))
    samples = range(0, basin.samples, 1 << levels)
    tried = range(0, basin.samples, samples.step >> finer)
    ways = [basin.sizes(sign, tried, best=best) for sign in _SIGNS]
    shown_samples = {*samples, *(min(sizes, key=lambda sample: sizes[sample]) for sizes in ways if best)}
    rows = []
    for sample in sorted(shown_samples):
        share = sample / basin.samples
        borders_there = [basin.border(sample, sign) for sign in _SIGNS]
        sizes = (sign * border.size for sign, border in zip(_SIGNS, borders_there, strict=True))
        rows.append((share, share * period_map.length, *sizes, *(border.error for border in borders_there)))
    work(1.0)
    columns = ["share", "time", "forward", "backward", "forward_error", "backward_error"]
    table = pd.DataFrame(rows, columns=columns)
    table.attrs["notes"] = [*basin.notes, *_missing(table, basin.largest, unit)]
    return table


def _missing(table: pd.DataFrame, largest: float, unit: str) -> list[str]:
    """What to say of smallest pulses that are not known."""
    sizes = np.abs(table[["forward", "backward"]].to_numpy())
    missing = int(np.isnan(sizes).sum())
    if not missing:
        return []
    verb = "is" if missing == 1 else "are"
    total = sizes.size
    known = sizes[~np.isnan(sizes)]
    shown = measured(largest, unit, 3, float(known.max()) if known.size else None)
    return [
        f"{missing} of {counted(total, 'smallest pulse')} {verb} not known (NaN): no pulse up to {shown} is "
        "known to tip the motion over there."
    ]


def _passes_until_back(motion: Pass, largest: float) -> int:
    """After how many passes the largest pulse, over the smallest corner, has died out as in a linear motion."""
    modulus = float(np.abs(multipliers_of(motion.gradient)[0]))
    passes = 2.0 * np.log(largest / NEAR) / -np.log(min(modulus, 1.0 - 1e-12)) if modulus > 0.0 else 1.0
    if passes > _MOST_PASSES:
        rule = f"dies out too slowly for pulses: its largest multiplier has the modulus {modulus:.6g}"
        raise ModelError(Problem("orbit", f"{motion.cycles} T", rule, "give the driveline more damping"))
    return int(passes)


class _Border(NamedTuple):
    """The smallest pulse that is known to tip a motion over [N m s]; NaN: none is."""

    size: float
    error: float  # by which it exceeds the largest one below that is known to come back


class _Basin:
    """The border of a motion's basin along pulses on one inertia, at every sample of the motion."""

    def __init__(
        self, period_map: PeriodMap, motion: Pass, inertia: int, samples: int, one_more: Callable[[], None]
    ) -> None:
        self.samples = samples
        self._one_more = one_more  # border is known
        self._map = period_map
        self._motion = motion
        self._march = period_map.marched(motion.start, samples_per_cycle=samples)
        self._smallest = min(1.0, smallest_corner(period_map) / period_map.size)
        passes = _passes_until_back(motion, _LARGEST / self._smallest)
        self._destinations = Destinations(period_map, motion, passes)
        self._at = len(period_map.flow.coordinates.elements) + inertia
        self._unit = period_map.size / period_map.scale[self._at]
        self._moment = float(period_map.system.inertia[inertia])
        self.border = cache(self._border)

    @property
    def largest(self) -> float:
        """The largest pulse that is tried [N m s]."""
        return float(_LARGEST * self._unit * self._moment)

    @property
    def notes(self) -> list[str]:
        """What is not certain about where pulses lead."""
        longest = self._destinations.longest * self._map.cycles
        known = []
        if self._destinations.irregular:
            known.append(
                f"Some pulses lead to a motion that did not come back within {longest} T, and does not repeat within "
                f"{MOST_PERIODS} T: it counts as another motion."
            )
        if self._destinations.undecided:
            pulses = counted(self._destinations.undecided, "pulse")
            known.append(
                f"After {pulses} the motion was neither back nor settled elsewhere within {longest} T: such pulses do "
                "not count as tipping it over."
            )
        return known

    def sizes(self, sign: float, samples: range, *, best: bool) -> dict[int, float]:
        """Return the smallest pulses of a sign at samples, infinite where none is known; and, for the best, between."""
        sizes = {sample: self._size(sample, sign) for sample in samples}
        if best:
            for sample in samples:
                sides = sizes[(sample - samples.step) % self.samples], sizes[(sample + samples.step) % self.samples]
                if sizes[sample] < inf and sizes[sample] <= min(sides):
                    lowest = self._lowest(sample, samples.step, sign)
                    sizes[lowest] = self._size(lowest, sign)
        return sizes

    def _lowest(self, sample: int, step: int, sign: float) -> int:
        """The sample in the valley of one at which the smallest pulse is smallest."""
        while step > 1:
            step //= 2
            tried = (sample, (sample - step) % self.samples, (sample + step) % self.samples)
            sample = min(tried, key=lambda other: self._size(other, sign))
        return sample

    def _size(self, sample: int, sign: float) -> float:
        """The smallest pulse of a sign; infinite where none is known."""
        size = self.border(sample, sign).size
        return size if np.isfinite(size) else inf

    def _border(self, sample: int, sign: float) -> _Border:
        """The smallest pulse of a sign (1 or -1) that tips the motion over."""
        cycles = self._map.cycles
        system = self._map.system
        start = self._map.sampled(self._march, sample * cycles) if sample else self._motion.start
        share = sample / self.samples
        ahead = PeriodMap(
            replace(system, inputs=system.inputs.part(share * cycles, (1.0 - share) * cycles)), repeats=False
        )

        def destination(speed: float) -> Destination:
            impulse = np.zeros_like(start.y)
            impulse[self._at] = sign * speed * self._unit
            state = ahead.struck(start, impulse)
            try:  # to the start of the next period, from which all motions are followed
                state = ahead.later(state)
            except ConvergenceError:
                return self._destinations.lost()
            return self._destinations.of(state)

        border = _Pulses(destination, self._smallest).border()
        self._one_more()
        factor = self._unit * self._moment
        return _Border(float(border.size * factor), float(border.error * factor))


class _Tried(NamedTuple):
    """A pulse, by its change of speed, and where it leads."""

    speed: float
    to: Destination


class _Pulses:
    """Pulses of one sign at one instant, by the change of speed, and where they lead."""

    def __init__(self, destination: Callable[[float], Destination], smallest: float = 1.0) -> None:
        self._destination = destination
        self._smallest = smallest
        self._back = [_Tried(0.0, Destination(BACK, 0.0))]  # below all others that do not lead back
        self._doubtful: list[float] = []

    def border(self) -> _Border:
        """Return the smallest pulse that tips the motion over, and how far the border may lie below."""
        speed = self._first()
        while speed <= _LARGEST and len(self._doubtful) < _MOST_UNDECIDED:
            tried = self._tried(speed)
            if tried.to.where == BACK and not self._doubtful:
                self._back.append(tried)
                tried = self._at_a_maximum() or tried
            if tried.to.where == ELSEWHERE:
                return self._bisected(tried.speed)
            if tried.to.where == UNDECIDED:
                self._doubtful.append(tried.speed)
            speed *= _GROWTH
        return _Border(nan, nan)

    def _first(self) -> float:
        """A pulse that is small for the smallest corner and does not tip the motion over: beside a fold far smaller."""
        speed = _FIRST
        small = _FIRST * self._smallest
        while speed > small or (speed > _LEAST * small and self._tried(speed).to.where == ELSEWHERE):
            speed *= _DOWN
        return speed

    def _tried(self, speed: float) -> _Tried:
        return _Tried(speed, self._destination(speed))

    def _at_a_maximum(self) -> _Tried | None:
        """A pulse that does not lead back, where the passes until it is back have a maximum; None: they all do."""
        if len(self._back) < 3:
            return None
        low, top, high = self._back[-3:]
        below = self._back[:-2]
        if top.to.passes < max(low.to.passes, high.to.passes):
            return None
        while high.speed - low.speed > _NARROWEST * top.speed:
            farther = high if high.speed - top.speed > top.speed - low.speed else low
            tried = self._tried(top.speed + _GOLDEN * (farther.speed - top.speed))
            if tried.to.where != BACK:
                self._back = [*below, low] if farther is low else [*below, low, top]
                return tried
            if tried.to.passes > top.to.passes:
                low, top, high = (top, tried, high) if farther is high else (low, tried, top)
            elif farther is high:
                high = tried
            else:
                low = tried
        return None

    def _bisected(self, tips: float) -> _Border:
        """The border below a pulse that tips the motion over; what is undecided lies in between."""
        back = self._back[-1].speed
        doubtful = [speed for speed in self._doubtful if speed < tips]
        tries = _MOST_UNDECIDED + len(doubtful)
        while len(doubtful) < tries:
            edges = [back, min(doubtful), max(doubtful), tips] if doubtful else [back, tips]
            gaps = [(edges[k], edges[k + 1]) for k in range(0, len(edges), 2)]
            low, high = max(gaps, key=lambda gap: gap[1] - gap[0])
            if high - low <= _EXACT * tips:
                break
            middle = 0.5 * (low + high)
            where = self._tried(middle).to.where
            if where == UNDECIDED:
                doubtful.append(middle)
            elif where == BACK:
                back = middle
                doubtful = [speed for speed in doubtful if speed > back]
            else:
                tips = middle
                doubtful = [speed for speed in doubtful if speed < tips]
        return _Border(tips, tips - back)
