"""Where a motion goes: back to a stable motion, to another one, or it is not known.

A motion is back where it is so near to its own one that the difference dies out as small ones do. It has gone elsewhere
where it is as near to another stable motion, which Newton's method finds from where the motion about repeats. Near an
unstable motion it may stay for thousands of periods and still go either way: there it is neither. What neither comes
back nor repeats for as long as it is followed, a chaotic motion, counts as elsewhere; others that meet its states go
there too. What about repeats at the end of that, and is near to no stable motion, is undecided.

Takes a PeriodMap, a motion and states; gives Destinations.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.period_map import Marched, Pass, PeriodMap, State
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

BACK, ELSEWHERE, UNDECIDED = "back", "elsewhere", "undecided"
NEAR = 1e-4
"""Of the largest corner: a motion nearer than this to a stable one settles in it."""
LONGEST = 6000
"""Periods for which a motion is followed, at least."""

_CHUNK = 8  # passes between two looks, and the most periods after which another motion is seen to repeat
_REPEATS = 1e-2  # of the largest corner: what repeats as well as this is searched for
_LOOKS = 8  # the time between two looks is at most this part of the time so far
_FALLS = 0.5  # what comes nearer to a known motion by this factor between two looks is not searched for
_PATIENT = 512  # passes during which nothing is searched for where a motion is near a saddle that is known
_CONTRACTED = 0.1  # of 1 - |multiplier|, per largest corner: nearer to a motion that attracts slowly, it is linear
_MET = 1e-2  # of the largest corner: what comes so near to the states of an irregular motion goes on like it


class Destination(NamedTuple):
    """Where a motion goes."""

    where: str  # BACK, ELSEWHERE or UNDECIDED
    passes: float  # until it is back; infinite where it does not come back


class _Known(NamedTuple):
    """States of another motion at the starts of its periods (M, N), balanced, and how near is settled."""

    states: Array
    radius: float


class Destinations:
    """Where motions go, by their states at the start of a period.

    Parameters
    ----------
    period_map
        that the motion is a fixed point of.
    motion
        stable and isolated: where motions come back to.
    passes
        after which small disturbances of it have died out.
    """

    def __init__(self, period_map: PeriodMap, motion: Pass, passes: int) -> None:
        self._map, self._scale, self._size = period_map, period_map.scale, period_map.size
        self._states = period_map.flow.states
        rows = self._rows(period_map.marched(motion.start))
        self._own = rows[0]
        self._known = [_Known(rows[1:-1], NEAR * self._size)] if period_map.cycles > 1 else []
        self.longest = max(4 * passes, -(-LONGEST // period_map.cycles))
        self._chunk = int(np.clip(passes // (4 * _CHUNK), 1, 4)) * _CHUNK
        self._saddles = list[_Known]()
        self.irregular, self.undecided = 0, 0

    def of(self, state: State) -> Destination:
        """Return where the motion from a state at the start of a period goes."""
        destination = self._of(state)
        return self.lost() if destination.where == UNDECIDED else destination

    def lost(self) -> Destination:
        """Take note of a motion that could not be followed so far that it is decided, and return that."""
        self.undecided += 1
        return Destination(UNDECIDED, np.inf)

    def _of(self, state: State) -> Destination:
        visited, done, search = list[Array](), 0, 2 * self._chunk
        while done < self.longest:
            passes = max(self._chunk, done // (_LOOKS * _CHUNK) * _CHUNK)
            try:
                march = self._map.marched(state, passes)
            except ConvergenceError:
                return Destination(UNDECIDED, np.inf)
            rows, state = self._rows(march), self._map.sampled(march, -1)
            own = np.linalg.norm(rows[:: self._map.cycles] - self._own, axis=1) / self._size
            if own[-1] < NEAR:
                return Destination(BACK, done + _first_below(own))
            others = [_from(known, rows[[0, -1]]) for known in self._known]
            if any(distance[-1] < known.radius for known, distance in zip(self._known, others, strict=True)):
                return Destination(ELSEWHERE, np.inf)
            done += passes
            visited.append(rows[1:])
            is_settling = any(distance[-1] < _FALLS * distance[0] for distance in (own, *others))
            is_at_saddle = done < _PATIENT and any(
                _from(saddle, rows[-1:])[0] < saddle.radius for saddle in self._saddles
            )
            if done >= search and not is_settling and not is_at_saddle:
                search = 2 * done
                if self._settles_in_another(state, rows):
                    return Destination(ELSEWHERE, np.inf)
        later = np.concatenate(visited)[self.longest // 2 * self._map.cycles :]
        if np.mean(_repeating(later) < _REPEATS * self._size) > 0.5:
            return Destination(UNDECIDED, np.inf)
        self.irregular += 1
        self._known.append(_Known(later, _MET * self._size))
        return Destination(ELSEWHERE, np.inf)

    def _settles_in_another(self, state: State, rows: Array) -> bool:
        """Whether a motion is settled in one that was not known, from its states so far and the last of them."""
        distances = np.linalg.norm(rows[-2 : -_CHUNK - 2 : -1] - rows[-1], axis=1)
        near = np.flatnonzero(distances < _REPEATS * self._size)
        another = self._another(state, int(near[0]) + 1) if near.size else None
        return another is not None and bool(_from(another, rows[-1:])[0] < another.radius)

    def _rows(self, march: Marched) -> Array:
        """Balanced states (R, N) at the starts of the periods T of a march, and at its end."""
        return np.array(march.samples.states[:, : self._states])

    def _another(self, state: State, cycles: int) -> _Known | None:
        """The stable motion, not the own one, that Newton's method leads to from a state; None: it does not.

        It is known from then on, and so is a saddle.
        """
        period_map = PeriodMap(self._map.system, cycles)
        try:
            orbit = shooting.shoot(period_map, state)
            rows = self._rows(period_map.marched(orbit.motion.start))[:-1]
        except (ConvergenceError, np.linalg.LinAlgError):
            return None
        same = NEAR * self._size
        if np.linalg.norm(rows - self._own, axis=1).min() < same:
            return None
        multipliers = orbit.multipliers
        kept = np.argsort(np.abs(multipliers - 1.0))[orbit.free.shape[1] :]
        margin = 1.0 - float(np.abs(multipliers[kept]).max(initial=0.0))
        motions = self._known if margin > 0.0 else self._saddles
        motion = next((known for known in motions if _from(known, rows[:1])[0] < same), None)
        if motion is None:
            radius = min(NEAR, _CONTRACTED * margin) if margin > 0.0 else _REPEATS
            motion = _Known(rows, radius * self._size)
            motions.append(motion)
        return motion if margin > 0.0 else None


def _from(known: _Known, y: Array) -> Array:
    """Distances (R,) of states (R, N) from the nearest one of a motion."""
    return np.asarray(np.linalg.norm(known.states[:, None] - y, axis=2).min(axis=0))


def _repeating(y: Array) -> Array:
    """How well (R - 8,) states repeat after one to 8 periods, the best of these."""
    distances = [np.linalg.norm(y[k : len(y) - _CHUNK + k] - y[:-_CHUNK], axis=1) for k in range(1, _CHUNK + 1)]
    return np.asarray(np.min(distances, axis=0))


def _first_below(distances: Array) -> float:
    """After how many passes the distance falls below NEAR for good, between passes as if it fell exponentially."""
    over = np.flatnonzero(distances >= NEAR)
    if not over.size:
        return 0.0
    before, after = np.log(distances[over[-1]]), np.log(max(distances[over[-1] + 1], 1e-300))
    return float(over[-1] + (before - np.log(NEAR)) / (before - after))
