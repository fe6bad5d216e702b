"""Whether two crossings exchange their order between two motions of a branch, and do so back again.

Both motions then have the same pattern. The time between two crossings that follow one another is positive at both, as
a depth that stays on one side of its corner (``turning``); with the slopes of the instants along the branch it is
looked at in the same way. Two crossings of one clearance are a touch, and no exchange.

Takes Points that follow one another; gives a share of the way.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic import patterns
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.periodic.turning import beyond_zero, length_between

Array = NDArray[np.float64]


class _Order(NamedTuple):
    """The C crossings of a motion in order of time."""

    word: str
    time: Array  # (C,) in periods from the start
    delay: Array  # (C,) slope of the time along the branch
    cycles: int

    def rolled(self, shift: int) -> _Order:
        """Return the crossings from one of them on, those before it a motion later."""
        time = np.append(self.time[shift:], self.time[:shift] + self.cycles)
        return _Order(self.word[shift:] + self.word[:shift], time, np.roll(self.delay, -shift), self.cycles)

    def intervals(self) -> tuple[Array, Array]:
        """Return (C,) times from every crossing to the next [periods], and their slopes."""
        return np.diff(self.time, append=self.time[0] + self.cycles), np.roll(self.delay, -1) - self.delay


def exchange_between(before: Point, after: Point) -> float | None:
    """Return the share of the way at which crossings may have exchanged their order and will do so again, or None.

    Parameters
    ----------
    before, after
        two points that follow one another.
    """
    if before.word != after.word or len(set(map(patterns.watch_of, before.word))) < 2:
        return None
    one, other = _order_of(before), _order_of(after)
    if one is None or other is None:
        return None
    length = length_between(before, after)
    other = _alike(one, other, length)
    (low, slope), (high, slope_after) = one.intervals(), other.intervals()
    watches = np.array([patterns.watch_of(letter) for letter in one.word])
    differ = watches != np.roll(watches, -1)
    share, excess = beyond_zero(low[differ], high[differ], length * slope[differ], length * slope_after[differ])
    return share if excess > 0.0 else None


def _order_of(point: Point) -> _Order | None:
    """The crossings of a motion in order of time; None where their slopes are not known."""
    turns, crossings = point.motion.turns, point.motion.crossings
    if turns is None or len(turns.delay) != len(crossings.time):
        return None
    ordered, delay = crossings.in_order(), turns.delay[crossings.order()]
    return _Order(patterns.word_of(ordered), ordered.time / point.motion.period, delay, point.motion.cycles)


def _alike(one: _Order, other: _Order, length: float) -> _Order:
    """The crossings of another motion with the same pattern, from the one on that agrees best with the first."""
    twice, shift, rolled = other.word + other.word, -1, list[_Order]()
    while (shift := twice.find(one.word, shift + 1)) >= 0 and shift < len(one.word):
        rolled.append(other.rolled(shift))
    return min(rolled, key=lambda order: _apart(one, order, length))


def _apart(one: _Order, other: _Order, length: float) -> float:
    """By how much instants of two motions differ over what their slopes say, whichever way round the periods."""
    apart = other.time - one.time - 0.5 * length * (one.delay + other.delay)
    return float(np.abs(apart - one.cycles * np.rint(apart / one.cycles)).sum())
