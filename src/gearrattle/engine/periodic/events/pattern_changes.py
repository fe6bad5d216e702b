"""The patterns of two motions of a branch: which touch only one of them has, which crossings exchange their order.

*Hidden exchanges.* Two crossings may exchange their order twice between two motions, which then have the same pattern.
The time between two successive crossings is positive at both motions. Whether it was zero in between is judged as for a
depth (``turning_points``): from its values at both motions and its slopes along the branch. Two crossings of one
clearance are a touch, and no exchange.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from gearrattle.engine.periodic import patterns
from gearrattle.engine.periodic.motion import Touch
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.periodic.turning_points import beyond_zero, length_between, times_between
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

_SHIFTS = 2  # most crossings that move over the begin of the period from one motion to the other


@dataclass(frozen=True)
class View:
    """The crossings that motions are compared by: those of the first ``watches`` watched quantities; None: of all."""

    watches: int | None = None

    def __call__(self, point: Point) -> str:
        """Return the pattern of a motion, as a word."""
        return point.word if self.watches is None else patterns.rotated(patterns.word_of(self.crossings(point)))

    def crossings(self, point: Point) -> Passages:
        """Return the crossings of a motion, those at one instant in the order of watches, as in its pattern."""
        crossings = point.motion.crossings.in_order()
        return crossings if self.watches is None else crossings.where(crossings.watch < self.watches)


def touch_between(apart: Point, touching: Point, view: View) -> tuple[float, Touch]:
    """Return the two crossings which, if removed from ``touching``, give the pattern of ``apart``: duration [s], Touch.

    If several pairs do so, as in a series of impacts, the pair is chosen without which the instants of both motions
    agree best. If several corners are touched at once, as in both halves of a symmetric motion, the pair of the
    shortest duration is chosen among the crossings that ``apart`` lacks.

    ConvergenceError: no pair of crossings does so.
    """
    crossings = view.crossings(touching)
    motion = touching.motion
    word = patterns.word_of(crossings)
    length = motion.cycles * motion.period
    pairs = [(i, (i + 1) % len(word)) for i in patterns.touches(view(apart), word)]
    if len(pairs) > 1:
        others = view.crossings(apart)
        pairs = [min(pairs, key=lambda pair: _difference(crossings, pair, others, length))]
    if not pairs:  # several corners are touched at once
        following = [_next_of_same(word, i) for i in range(len(word))]
        pairs = [(i, j) for i, j in enumerate(following) if ord(word[j]) == ord(word[i]) ^ 1]
        is_new = _lacking(touching, apart, view)
        pairs = [(i, j) for i, j in pairs if is_new[i] and is_new[j]] or pairs
    touches = []
    for i, j in pairs:
        duration = (crossings.time[j] - crossings.time[i]) % length
        middle = float((crossings.time[i] + 0.5 * duration) / motion.period)
        touches.append((float(duration), Touch(patterns.watch_of(word[i]), patterns.is_upward(word[i]), middle)))
    if not touches:
        raise ConvergenceError("the pattern of crossings changes more than once")
    return min(touches, key=lambda touch: touch[0])


def time_between(point: Point, other: str, view: View) -> float:
    """Return the shortest time [s] between two crossings whose exchange gives the pattern ``other``; 0 if none does."""
    crossings = view.crossings(point)
    motion = point.motion
    word = patterns.word_of(crossings)
    length = motion.cycles * motion.period
    times = crossings.time
    return float(
        min(((times[(i + 1) % len(word)] - times[i]) % length for i in patterns.swaps(word, other)), default=0)
    )


def exchanged_at(point: Point, view: View) -> int:
    """Return the lower index of the two watched quantities that cross at nearly one time; -1: only one crosses."""
    crossings = view.crossings(point)
    motion = point.motion
    following = np.roll(crossings.watch, -1)
    intervals = (np.roll(crossings.time, -1) - crossings.time) % (motion.cycles * motion.period)
    chosen = np.flatnonzero(crossings.watch != following)
    if not chosen.size:
        return -1
    nearest = chosen[np.argmin(np.minimum(intervals, motion.cycles * motion.period - intervals)[chosen])]
    return int(min(crossings.watch[nearest], following[nearest]))


def _difference(touching: Passages, pair: tuple[int, int], apart: Passages, length: float) -> float:
    """Sum of the differences [s] between the instants of ``apart`` and of ``touching`` without a pair of crossings."""
    kept = np.ones(touching.time.size, np.bool_)
    kept[list(pair)] = False
    times = touching.time[kept]
    word = patterns.word_of(touching.where(kept))
    fewer = patterns.word_of(apart)
    differences = [
        float(np.abs((np.roll(times, shift) - apart.time + 0.5 * length) % length - 0.5 * length).sum())
        for shift in range(-_SHIFTS, _SHIFTS + 1)
        if word[-shift:] + word[:-shift] == fewer
    ]
    return min(differences, default=np.inf)


def _lacking(touching: Point, apart: Point, view: View) -> NDArray[np.bool_]:
    """Which crossings of ``touching`` have no counterpart in ``apart``, equal crossings matched by their times."""
    ours = view.crossings(touching)
    theirs = view.crossings(apart)
    times = ours.time / touching.motion.period
    away = times_between(times, theirs.time / apart.motion.period, touching.motion.cycles)
    is_other = (ours.watch[:, None] != theirs.watch) | (ours.upward[:, None] != theirs.upward)
    away[is_other] = touching.motion.cycles  # no two are farther apart
    rows, columns = linear_sum_assignment(away)
    is_new = np.ones(len(times), np.bool_)
    is_new[rows[~is_other[rows, columns]]] = False
    return is_new


def _next_of_same(word: str, i: int) -> int:
    """Index of the next crossing of the same watched quantity as crossing i."""
    count = len(word)
    watch = patterns.watch_of(word[i])
    return next((i + k) % count for k in range(1, count + 1) if patterns.watch_of(word[(i + k) % count]) == watch)


class _Order(NamedTuple):
    """The C crossings of a motion in order of time."""

    word: str
    time: Array  # (C,) in periods from the start
    delay: Array  # (C,) slope of the time along the branch
    cycles: int

    def rolled(self, shift: int) -> _Order:
        """Return the crossings from index ``shift`` on, then the earlier ones, shifted by the motion's length."""
        time = np.append(self.time[shift:], self.time[:shift] + self.cycles)
        return _Order(self.word[shift:] + self.word[:shift], time, np.roll(self.delay, -shift), self.cycles)

    def intervals(self) -> tuple[Array, Array]:
        """Return (C,) times from every crossing to the next [periods], and their slopes along the branch."""
        return np.diff(self.time, append=self.time[0] + self.cycles), np.roll(self.delay, -1) - self.delay


def exchange_between(before: Point, after: Point) -> float | None:
    """Return the share of the step at which two crossings may be exchanged, if they are exchanged twice; else None."""
    if before.word != after.word or len(set(map(patterns.watch_of, before.word))) < 2:
        return None
    one = _order_of(before)
    other = _order_of(after)
    if one is None or other is None:
        return None
    length = length_between(before, after)
    other = _aligned(one, other, length)
    low, slope = one.intervals()
    high, slope_after = other.intervals()
    watches = np.array([patterns.watch_of(letter) for letter in one.word])
    differ = watches != np.roll(watches, -1)
    share, excess = beyond_zero(low[differ], high[differ], length * slope[differ], length * slope_after[differ])
    return share if excess > 0.0 else None


def _order_of(point: Point) -> _Order | None:
    """The crossings of a motion in order of time; None where their slopes are not known."""
    turns = point.motion.turns
    crossings = point.motion.crossings
    if turns is None or len(turns.delay) != len(crossings.time):
        return None
    ordered = crossings.in_order()
    delay = turns.delay[crossings.order()]
    return _Order(patterns.word_of(ordered), ordered.time / point.motion.period, delay, point.motion.cycles)


def _aligned(one: _Order, other: _Order, length: float) -> _Order:
    """The crossings of ``other``, of the same pattern, rotated so that their times agree best with those of ``one``."""
    twice = other.word + other.word
    shift = -1
    rolled = list[_Order]()
    while (shift := twice.find(one.word, shift + 1)) >= 0 and shift < len(one.word):
        rolled.append(other.rolled(shift))
    return min(rolled, key=lambda order: _distance(one, order, length))


def _distance(one: _Order, other: _Order, length: float) -> float:
    """Sum of the differences [periods] between instants of two motions and their prediction from both slopes."""
    error = other.time - one.time - 0.5 * length * (one.delay + other.delay)
    return float(np.abs(error - one.cycles * np.rint(error / one.cycles)).sum())
