"""Where a motion goes: back to a stable motion, to another one, or it is not known.

A motion is back where it is so near to its own one that the difference dies out as small ones do: from pass to pass it
must follow the gradient of the own motion, up to a part of itself that cannot keep it from dying out. It has gone
elsewhere where it is as near to another stable motion, which Newton's method finds from where the motion about repeats.
Near an unstable motion it may stay for thousands of periods and still go either way: there it is neither. What neither
comes back nor repeats for as long as it is followed, a chaotic motion, counts as elsewhere; others that meet its states
go there too. What about repeats at the end of that, nearer and nearer or farther and farther from itself, and is near
to no stable motion, is undecided.

All distances are in units of the smallest corner: a soft part that swings far hides nothing of the others.

Takes a PeriodMap, a motion and states; gives Destinations.
"""

from __future__ import annotations

from functools import reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.equations import shortest_solution
from gearrattle.engine.periodic.motion import Pass, State, multipliers_of
from gearrattle.engine.periodic.period_map import Marched, PeriodMap
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

BACK, ELSEWHERE, UNDECIDED = "back", "elsewhere", "undecided"
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
        self._map, self._size = period_map, smallest_corner(period_map)
        states, gradients = self._followed(motion.start, period_map.cycles)
        first, later, near = slice(1), slice(1, None), NEAR * self._size
        self._own = _Known(states[first], near, gradients.part(first))
        self._known = [_Known(states[later], near, gradients.part(later))] if period_map.cycles > 1 else []
        self._decay = -float(np.log(np.clip(np.abs(multipliers_of(motion.gradient)[0]), 1e-3, 1.0 - 1e-12)))
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
        past = np.zeros((0, self._own.states.shape[1]))
        while done < self.longest:
            passes = max(self._chunk, done // (_LOOKS * _CHUNK) * _CHUNK)
            try:
                march = self._map.marched(state, passes)
            except ConvergenceError:
                return Destination(UNDECIDED, np.inf)
            rows, state = self._rows(march), self._map.sampled(march, -1)
            past = np.concatenate([past[-1 - 2 * MOST_PERIODS : -1], rows])
            own = self._own.distances(rows[:: self._map.cycles])
            if self._own.attracts(past, own[-1]):
                return Destination(BACK, max(0.0, done + self._passes_until_near(own / self._size)))
            others = [known.distances(rows[[0, -1]]) for known in self._known]
            if any(known.attracts(past, off[-1]) for known, off in zip(self._known, others, strict=True)):
                return Destination(ELSEWHERE, np.inf)
            done += passes
            visited.append(rows[1:])
            is_settling = any(distance[-1] < _FALLS * distance[0] for distance in (own, *others))
            is_at_saddle = done < _PATIENT and any(
                saddle.distances(rows[-1:])[0] < saddle.radius for saddle in self._saddles
            )
            if done >= search and not is_settling and not is_at_saddle:
                search = 2 * done
                if self._settles_in_another(state, past):
                    return Destination(ELSEWHERE, np.inf)
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
        before, after = np.log(distances[over[-1]]), np.log(max(distances[over[-1] + 1], 1e-300))
        return float(over[-1] + (before - np.log(NEAR)) / (before - after))

    def _settles_in_another(self, state: State, past: Array) -> bool:
        """Whether a motion is settled in one that was not known, from its states so far.

        A motion of many periods may about repeat earlier, near a saddle: it repeats better after all of them.
        """
        distances = np.linalg.norm(past[-2 : -MOST_PERIODS - 2 : -1] - past[-1], axis=1)
        least = _REPEATS * self._size
        for i, distance in enumerate(distances):
            if distance < least:
                another, least = self._another(state, i + 1), _FALLS * distance
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
            multipliers = orbit.multipliers
            kept = np.argsort(np.abs(multipliers - 1.0))[orbit.free.shape[1] :]
            is_stable = float(np.abs(multipliers[kept]).max(initial=0.0)) < 1.0
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
        period_map, scale = PeriodMap(self._map.system), self._map.scale
        states, steps = list[Array](), list[Array]()
        for _ in range(cycles):
            period = period_map(start)
            states.append(period.start.y * scale)
            steps.append(scale[:, None] * period.gradient / scale)
            start = period.end
        gradients = np.array([reduce(_after, steps[k:] + steps[:k]) for k in range(cycles)])
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


def _after(first: Array, second: Array) -> Array:
    """The gradient of one period after another."""
    return np.asarray(second @ first)


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
