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

Takes a periodic motion of a model; gives a table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from math import inf, nan
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble, free_names
from gearrattle.engine.periodic.motion import Pass, multipliers_of
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.table import did_you_mean, shown
from gearrattle.orbits.destinations import (
    BACK,
    ELSEWHERE,
    MOST_PERIODS,
    NEAR,
    UNDECIDED,
    Destination,
    Destinations,
    smallest_corner,
)
from gearrattle.orbits.progress import Progress
from gearrattle.wording import counted, listed, measured

if TYPE_CHECKING:
    import pandas as pd

Array = NDArray[np.float64]

_GROWTH = 1.1  # of pulses, from one to the next
_FIRST, _LARGEST = 1e-3, 1e2  # changes of speed; 1 is as much as the largest corner, in balanced coordinates
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


def check_pulses(model: Model, on: str) -> None:
    """Refuse pulses on what is no free inertia of a model, and on a model for which they are not known.

    Raises
    ------
    ModelError
        no such inertia, or stiffness that alternates by the clock.
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
    """Return the smallest pulses that tip a stable, isolated motion over; see ``Orbit.tipping``.

    Parameters
    ----------
    period_map
        that the motion is a fixed point of.
    motion
        the motion.
    inertia
        on which the pulses act, by its number among the free ones.
    instants, best
        see ``Orbit.tipping``.
    unit
        of pulses; empty for none.
    progress
        called with the finished share; an exception from it ends the work.
    """
    import pandas as pd

    levels = max(0, int(np.ceil(np.log2(_SAMPLES / instants))))
    finer = max(0, int(np.ceil(np.log2(_FEWEST / instants)))) if best else 0
    borders = len(_SIGNS) * ((instants << finer) + (2 * (levels - finer) * _VALLEYS if best else 0))
    basin = _Basin(period_map, motion, inertia, instants << levels, _Count(borders, progress))
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
    if progress is not None:
        progress(1.0)
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
    verb, total = "is" if missing == 1 else "are", sizes.size
    known = sizes[~np.isnan(sizes)]
    shown = measured(largest, unit, 3, float(known.max()) if known.size else None)
    return [
        f"{missing} of {counted(total, 'smallest pulse')} {verb} not known (NaN): no pulse up to {shown} is "
        "known to tip the motion over there."
    ]


def _passes_until_back(motion: Pass, largest: float) -> int:
    """After how many passes the largest pulse, over the smallest corner, has died out where the motion is about linear.

    Raises
    ------
    ModelError
        too many: what has not come back by then could not be told from what never does.
    """
    modulus = float(np.abs(multipliers_of(motion.gradient)[0]))
    passes = 2.0 * np.log(largest / NEAR) / -np.log(min(modulus, 1.0 - 1e-12)) if modulus > 0.0 else 1.0
    if passes > _MOST_PASSES:
        rule = f"dies out too slowly for pulses: its largest multiplier has the modulus {modulus:.6g}"
        raise ModelError(Problem("orbit", f"{motion.cycles} T", rule, "give the driveline more damping"))
    return int(passes)


class _Count:
    """Counts borders, of about so many, and says what share of them is known."""

    def __init__(self, most: int, progress: Progress | None) -> None:
        self._most, self._known, self._progress = most, 0, progress

    def one_more(self) -> None:
        """Take note of one more."""
        self._known += 1
        if self._progress is not None:
            self._progress(min(1.0, self._known / self._most))


class _Border(NamedTuple):
    """The smallest pulse that is known to tip a motion over [N m s]; NaN: none is."""

    size: float
    error: float  # by which it exceeds the largest one below that is known to come back


class _Basin:
    """The border of a motion's basin along pulses on one inertia, at every sample of the motion."""

    def __init__(self, period_map: PeriodMap, motion: Pass, inertia: int, samples: int, count: _Count) -> None:
        self.samples, self._count = samples, count
        self._map, self._motion = period_map, motion
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
        longest, known = self._destinations.longest * self._map.cycles, []
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
        cycles, system = self._map.cycles, self._map.system
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
        self._count.one_more()
        factor = self._unit * self._moment
        return _Border(float(border.size * factor), float(border.error * factor))


class _Tried(NamedTuple):
    """A pulse, by its change of speed, and where it leads."""

    speed: float
    to: Destination


class _Pulses:
    """Pulses of one sign at one instant, by the change of speed, and where they lead.

    Parameters
    ----------
    destination
        where a pulse leads, by the change of speed.
    smallest
        corner, over the largest one.
    """

    def __init__(self, destination: Callable[[float], Destination], smallest: float = 1.0) -> None:
        self._destination, self._smallest = destination, smallest
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
        speed, small = _FIRST, _FIRST * self._smallest
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
        back, doubtful = self._back[-1].speed, [speed for speed in self._doubtful if speed < tips]
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
