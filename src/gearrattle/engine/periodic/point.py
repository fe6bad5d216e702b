"""A motion of a branch: a point of the curve in w = (u, p / unit), with the direction of the branch there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.motion import Pass, Touch
from gearrattle.engine.periodic.multipliers import multipliers_of
from gearrattle.engine.periodic.patterns import Pattern, pairs_of, rotated, word_of
from gearrattle.engine.system.crossings_in_order import Passages

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_SMALL = 1e3  # growth of a disturbance below which motions are followed as a whole again


class Guess(NamedTuple):
    """What a motion is followed from.

    The unknowns of Newton's method are w, and behind it the states of ``later``.
    """

    w: Array  # (N + 1,) state at the start and parameter in the branch's units
    pieces: IntArray | None  # (C,) of the auxiliaries at the start; None: the state decides them
    later: Array | None = None  # (m - 1, N) states at the start of its later parts; None: it is followed as a whole

    def moved(self, change: Array) -> Guess:
        """Return it after a change of all unknowns."""
        own = self.w.size
        later = None if self.later is None else self.later + change[own:].reshape(self.later.shape)
        return self._replace(w=self.w + change[:own], later=later)

    def halfway(self, other: Guess) -> Guess:
        """Return it half of the way to another one."""
        later = None if self.later is None or other.later is None else 0.5 * (self.later + other.later)
        return self._replace(w=0.5 * (self.w + other.w), later=later)


class Later(NamedTuple):
    """The states at the start of the later parts of a motion that was followed in m parts, in the branch's units."""

    state: Array  # (m - 1, N)
    tangent: Array  # (m - 1, N) their change along the branch


@dataclass(frozen=True)
class Point:
    """A periodic motion of a branch.

    touch: the corner that the motion grazes, and the instant; None: it was not sought as one that grazes.
    """

    parameter: float  # p
    motion: Pass  # over n periods
    slope: Array  # (N,) d end / d p for a fixed start [SI]
    scale: Array  # (N,) factors: balanced = scale * SI.
    size: float  # norm of balanced coordinates that counts as one
    w: Array  # (N + 1,) state and parameter in the branch's units
    tangent: Array  # (N + 1,) direction of the branch, of length one
    free: int  # number of directions in which neighbouring motions repeat as well, at the same parameter
    orientation: float  # det [dF/du, dF/dp; t]; 0 where there are free directions.
    error: float = 0.0  # estimated error of the state, over its size
    iterations: int = 0  # motions that Newton's method followed
    length: float = 0.0  # arclength from the start of the branch
    touch: Touch | None = None
    later: Later | None = None  # of a motion that was followed in parts; None: it was followed as a whole.

    @property
    def state(self) -> Array:
        """(N,) deflections of the basis, velocities, memories at the start of the period [SI]."""
        return self.motion.start.y

    @cached_property
    def gradient(self) -> Array:
        """(N, N) M in balanced coordinates."""
        return np.asarray(self.scale[:, None] * self.motion.gradient / self.scale)

    @cached_property
    def multipliers(self) -> NDArray[np.complex128]:
        """(N,) Floquet multipliers, the largest first."""
        return multipliers_of(self.gradient)

    @cached_property
    def word(self) -> str:
        """Its pattern, as a word of ``patterns``."""
        return rotated(word_of(self.motion.crossings))

    def guess(self, w: Array) -> Guess:
        """Return what a motion nearby (N + 1,) is followed from."""
        later = self.later
        pieces = self.motion.end.auxiliary_pieces
        if later is None or np.linalg.norm(self.gradient) < _SMALL:
            return Guess(w, pieces)
        return Guess(w, pieces, later.state + float(self.tangent @ (w - self.w)) * later.tangent)

    def change_of(self, part: int) -> Array:
        """Return (N + 1,) the change of the state at the start of a part and of the parameter along the branch."""
        if part == 0 or self.later is None:
            return self.tangent
        return np.append(self.later.tangent[part - 1], self.tangent[-1])

    @property
    def pattern(self) -> Pattern:
        """What crosses its bounds, and which bound (1: the upper one), in order of time."""
        return pairs_of(self.word)


def pattern_of(motion: Pass) -> Pattern:
    """Return the crossings of a motion in order of time, wherever it begins."""
    return pattern_along(motion.crossings)


def pattern_along(crossings: Passages) -> Pattern:
    """Return crossings in order of time, wherever the motion begins."""
    return pairs_of(rotated(word_of(crossings)))


def halves_apart(motion: Pass) -> float:
    """Return by how much instants of the same crossings in both halves of a motion differ, over its length.

    Infinite where the halves do not cross the same bounds in the same order, or cross none.
    """
    crossings = motion.crossings.in_order()
    half, odd = divmod(len(crossings.time), 2)
    first = slice(None, half)
    second = slice(half, None)
    if odd or not half or not all(np.array_equal(p[first], p[second]) for p in (crossings.watch, crossings.upward)):
        return np.inf
    whole = motion.period * motion.cycles
    return float(np.abs(crossings.time[second] - crossings.time[first] - 0.5 * whole).max()) / whole


def turned_around(point: Point) -> Point:
    """Return the point of the same branch passed in the other direction."""
    turns = point.motion.turns
    motion = point.motion if turns is None else replace(point.motion, turns=turns.scaled(-1.0))
    later = None if point.later is None else point.later._replace(tangent=-point.later.tangent)
    return replace(point, motion=motion, tangent=-point.tangent, orientation=-point.orientation, later=later)


def appended(point: Point, following: Point) -> Point:
    """Return a point that follows another one, with its length along the branch."""
    return replace(following, length=point.length + float(np.linalg.norm(following.w - point.w)))


def interpolated(before: Point, after: Point, share: float) -> Array:
    """Return the value (N + 1,) at a share of the cubic through two points that has their tangents."""
    chord = after.w - before.w
    length = np.linalg.norm(chord)
    s = share
    rest = 1.0 - share
    bend = rest * (length * before.tangent - chord) - s * (length * after.tangent - chord)
    return np.asarray(before.w + s * chord + s * rest * bend)
