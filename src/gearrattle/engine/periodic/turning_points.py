"""What the turning points of a motion tell of the branch: which one grazes next, what two motions hide between them.

Every turning point of a deflection has a depth, by which it lies beyond a corner, and a slope of that along the branch
(``kernels.turning_point_depths``).

*Hidden touches.* If a touch comes and goes between two points, or goes and comes back, both have the same pattern, and
the crossings say nothing. But a depth that is negative at both can be positive in between only if it grows at the first
one and falls at the second one. While it bends one way its graph lies below both tangents: where these meet below zero
nothing is hidden, and where they meet above zero the branch is looked at there. A touch that goes and comes back is the
same with the opposite sign. So is a pair of turning points that appears and vanishes: there a rate comes nearest to
zero at both points, and its distance beyond zero is the depth. And a turning point that one motion alone has, or such a
rate, may be led to zero by its slope before the other motion: the branch is looked at a little beyond. Where one touch
goes and another one comes, at the other corner, the pattern is the same as well, but a depth changes its sign. If a
motion touches what one beside it grazes, although the slope of that one's depth leads away from the corner, there is
another grazing between both.

*Hidden loops.* Near grazings a branch may go back and forth in a loop too small for its tangent to tell. The depths
tell: over a step their change is the mean of both slopes, except for cubic terms; and none that comes nearer
to its corner appears or is lost. The depth of what grazes at one end of a step and touches at the other has different
slopes on both sides: along the first step beyond it may become a few times as steep.

*The next grazing.* It is found by Newton's method for the motion and its depth together:

    P(u; p) - u = 0,      depth(u, p) = -e,      e -> 0

The depth of a turning point and its gradient (``kernels.corner_approach``) are exact and smooth on the side without
contact, and so is the map there. Every iteration leaves as much of the depth as the last one was off, so no motion
touches.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic import patterns
from gearrattle.engine.periodic.equations import Bordered
from gearrattle.engine.periodic.motion import OF_TURNS, Dips, Pass, Touch, Turns
from gearrattle.engine.periodic.newton import Corrector
from gearrattle.engine.periodic.point import Guess, Point, turned_around
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_MOVED = 1.0 / 32.0  # periods that a turning point may move between two points
_WIDER = 2.0  # times what its slope says: so far a level may move over a step
_BORN = 1.0 / 128.0  # periods between two turning points and the dip of the rate that they have come from
_GRAZES = 1e-6  # periods between a grazing and the turning point that it is
_KINDS = 4  # values of the column UPWARD
_FLAT = 1e-300  # [SI] slope that counts as zero
_LEAST = 1e-3  # share of the way from either end at which the branch is looked at, at least
_DEFECT = 0.25  # between the change of a depth and the mean of both slopes, over the larger slope
_A_LITTLE_MORE = 1.5  # times the way to where a depth reaches zero: there the branch is looked at
_COUNTS = 0.25  # slope over depth, from which a depth counts
_ITERATIONS = 12
_RETREATS = 3
_LEFT = 0.05  # of the depth that the first iteration leaves
_OFF = 3.0  # times what the depth is expected to be off: so much is left
_CLOSE = 1e-12  # of w: so near to the corner a motion grazes
_AIM = 0.3  # of that: the depth to aim at
_NEAR = 1e-6  # change of w from which the next motion is likely to be the last one
_BEYOND = 0.2  # of the way to a grazing with contact before it: so far beyond it Newton's method begins
_WITH_IT = 1e-10  # of w: what comes to its corner so near beyond another turning point does so with it
_SAME_TURN = 1e-3  # periods: a turning point that moves by less is the same
# [rad] by which the tangent may turn: aimed at, and at most
_ANGLE = 0.2
_LARGEST_ANGLE = 0.25
# shares by which a step is shortened
_LEAST_OF_STEP = 0.01
_MOST_OF_STEP = 0.3


def hidden_between(before: Point, after: Point) -> float | None:
    """Return the share of the way at which a touch may have come or gone; None: there is none."""
    known = _common(before, after)
    if known is None:
        return None
    if min(way_beyond(before, after), way_beyond(after, before)) < 0.0:
        return 0.5
    length = length_between(before, after)
    one, other = (turns._replace(dips=_near_corners(turns.dips, length)) for turns in known[:2])
    common = known[2]
    dips = _same(before, after, one.dips, other.dips)
    if before.word == after.word and _passes_corner(before, after, one, other, common):
        return 0.5
    touches = _hidden(length, one, other, common)
    pairs = _hidden(length, one.dips, other.dips, dips)
    share, excess = max(touches, pairs, key=lambda pair: pair[1])
    return share if excess > 0.0 else _lost(before.motion.cycles, length, one, other, common)


def _passes_corner(before: Point, after: Point, one: Turns, other: Turns, common: tuple[IntArray, IntArray]) -> bool:
    """Whether a turning point that two motions have in common touches in one of them alone.

    Where both have the same pattern another one then touches in the other motion, such as one at the opposite corner:
    it is crossed to and fro in the same directions.
    """
    i, j = common
    is_known = grazes(before, one)[i] | grazes(after, other)[j]
    return bool(((one.depth[i] * other.depth[j] < 0.0) & ~is_known).any())


def _near_corners(dips: Dips, length: float) -> Dips:
    """The dips near which a pair of turning points might reach a corner over a step.

    The level moves, and a pair that is 1/128 of a period apart lies on both sides of it by less than the rate allows.
    """
    way = _WIDER * np.abs(length * dips.level_slope) + _BORN * np.abs(length * dips.slope)
    is_near = dips.level < way
    return Dips._make(part[is_near] for part in dips)


def _hidden(
    length: float, one: Turns | Dips, other: Turns | Dips, common: tuple[IntArray, IntArray]
) -> tuple[float, float]:
    """At which share of the way a depth lies highest beyond zero, and how high, over what it is at both ends."""
    i, j = common
    return beyond_zero(one.depth[i], other.depth[j], length * one.slope[i], length * other.slope[j])


def beyond_zero(before: Array, after: Array, slope_before: Array, slope_after: Array) -> tuple[float, float]:
    """Return where values of one sign at both ends of a step lie farthest beyond zero, as their slopes tell.

    before, after: (E,) values at both ends.
    slope_before, slope_after: (E,) their slopes there, over the whole step.
    Returns the share of the way, and how far beyond zero both tangents meet there, over the sum of both values; 0 where
    no value comes nearer to zero from both ends.
    """
    side = -np.sign(before)
    rises = side * slope_before
    falls = -side * slope_after
    nears = (rises > 0.0) & (falls > 0.0) & (before * after > 0.0)
    if not nears.any():
        return 0.5, 0.0
    low, high, rises, falls = (np.abs(part[nears]) for part in (before, after, rises, falls))
    meet = np.clip((falls - high + low) / (rises + falls), 0.0, 1.0)
    passed = (rises * meet - low) / (low + high)
    worst = int(np.argmax(passed))
    return float(np.clip(meet[worst], _LEAST, 1.0 - _LEAST)), float(passed[worst])


def _lost(cycles: int, length: float, one: Turns, other: Turns, common: tuple[IntArray, IntArray]) -> float | None:
    """A share of the way a little beyond where a depth of one motion alone reaches zero, as its slope tells.

    Of turning points that both motions have the depths agree with the slopes: see ``agreeing_step``.
    """
    ours, theirs = (_without(turns, same) for turns, same in zip((one, other), common, strict=True))
    ways = [_way_to_zero(cycles, length, ours, theirs), _way_to_zero(cycles, -length, theirs, ours)]
    if min(ways) >= 1.0:
        return None
    share = float(np.clip(_A_LITTLE_MORE * min(ways), _LEAST, 0.5))
    return share if ways[0] <= ways[1] else 1.0 - share


def _without(turns: Turns, chosen: IntArray) -> Turns:
    """Turning points except for some, with all dips."""
    kept = {name: np.delete(getattr(turns, name), chosen) for name in OF_TURNS}
    return turns._replace(dips=turns.dips, **kept)


def _way_to_zero(cycles: int, length: float, ours: Turns, theirs: Turns) -> float:
    """The least share of the way at which a depth that one motion alone has reaches zero, infinite if none does.

    A rate that reaches zero has become two turning points: where the other motion has those, nothing is lost.
    """
    dips = ours.dips
    apart = times_between(dips.time + length * dips.time_slope, theirs.time, cycles)
    is_there = (dips.watch[:, None] == theirs.watch) & (apart < _BORN)
    is_lost = is_there.sum(axis=1) < 2
    depth = np.concatenate([ours.depth, dips.depth[is_lost]])
    slope = length * np.concatenate([ours.slope, dips.slope[is_lost]])
    return float((np.abs(depth) / np.maximum(-np.sign(depth) * slope, _FLAT)).min(initial=np.inf))


def agreeing_step(before: Point, after: Point) -> float:
    """Return how many times as long a step may be for the depths of its motions to change as their slopes say.

    From 1 on they agree. What the slopes leave out grows with the third power of a step. The way that a turning point
    of one motion alone comes nearer to its corner grows in proportion to it. A depth counts if its slope could take it
    to the corner within a few steps. Parameters are those of ``hidden_between``.
    """
    known = _common(before, after)
    if known is None:
        return np.inf
    one, other, (i, j) = known
    length = length_between(before, after)
    # turning points that both motions have: the change of the depth and the mean of its slopes
    slope = length * one.slope
    slope_after = length * other.slope
    mean = 0.5 * (slope[i] + slope_after[j])
    steepest = np.maximum(np.abs(slope[i]), np.abs(slope_after[j]))
    counts = steepest > _COUNTS * np.minimum(np.abs(one.depth[i]), np.abs(other.depth[j]))
    # where one motion grazes and the other one touches slopes differ on both sides
    counts &= ~(grazes(before, one)[i] & (other.depth[j] > 0.0) & (slope[i] > 0.0))
    counts &= ~(grazes(after, other)[j] & (one.depth[i] > 0.0) & (slope_after[j] < 0.0))
    defect = (np.abs(other.depth[j] - one.depth[i] - mean)[counts] / (_DEFECT * steepest[counts])).max(initial=0.0)
    # turning points that one motion has alone: by how much they come nearer to the corner towards the other one
    single = np.concatenate([np.delete(one.depth, i), np.delete(other.depth, j)])
    nearing = -np.sign(single) * np.concatenate([np.delete(slope, i), -np.delete(slope_after, j)])
    share = (nearing / np.maximum(_COUNTS * np.abs(single), _FLAT)).max(initial=0.0)
    return float(1.0 / max(np.sqrt(defect), share, 1e-9))


class Passed(NamedTuple):
    """A turning point that touches at one end of a step and not at the other, where it does not touch."""

    touch: Touch
    depth: float  # [SI]
    slope: float  # of the depth towards the other end, over the whole step [SI]
    time_slope: float  # of the instant, by the same [periods]


def passed_between(apart: Point, touching: Point) -> Passed | None:
    """Return the only turning point with a negative depth in one motion and a positive one in the other, or None."""
    known = _common(apart, touching)
    if known is None:
        return None
    one, other, (i, j) = known
    touches = np.flatnonzero((one.depth[i] < 0.0) & (other.depth[j] > 0.0))
    if touches.size != 1:
        return None
    k = i[touches[0]]
    length = length_between(apart, touching)
    touch = Touch(int(one.watch[k]), int(one.upward[k]), float(one.time[k]))
    return Passed(touch, float(one.depth[k]), float(length * one.slope[k]), float(length * one.time_slope[k]))


def way_beyond(grazing: Point, other: Point) -> float:
    """Return by how much a depth would grow from a motion that grazes to another one [SI]; 0 if that does not touch.

    Where it is positive the other motion touches what the first one grazes, as the slope of the depth tells.
    """
    known = _common(grazing, other)
    if grazing.touch is None or known is None:
        return 0.0
    turns, others, (i, j) = known
    ours = i[grazes(grazing, turns)[i] & (others.depth[j] > 0.0)]
    return length_between(grazing, other) * float(turns.slope[ours].sum())


def rise_beyond(grazing: Point, touching: Point) -> float:
    """Return how many times as steep as at a motion that grazes its depth is at one that touches; 1 at least."""
    known = _common(grazing, touching)
    if known is None:
        return 1.0
    turns, others, (i, j) = known
    ours = grazes(grazing, turns)[i] & (others.depth[j] > 0.0)
    slope = np.maximum(np.abs(turns.slope[i[ours]]), _FLAT)
    return float((np.abs(others.slope[j[ours]]) / slope).max(initial=1.0))


def grazes(point: Point, turns: Turns) -> NDArray[np.bool_]:
    """Which turning point of a motion that grazes lies at its corner."""
    if point.touch is None:
        return np.zeros(len(turns.depth), np.bool_)
    is_same = (turns.watch == point.touch.watch) & (turns.upward == point.touch.upward)
    return np.asarray(is_same & (np.abs(turns.time - point.touch.time) < _GRAZES))


def length_between(one: Point, other: Point) -> float:
    """Return how far it is from one point to another [arclength]; negative if it goes backwards."""
    step = other.w - one.w
    return float(np.copysign(np.linalg.norm(step), step @ one.tangent))


def _common(before: Point, after: Point) -> tuple[Turns, Turns, tuple[IntArray, IntArray]] | None:
    """The turning points of two motions, and which of them are the same; None where they are not known."""
    one = before.motion.turns
    other = after.motion.turns
    return None if one is None or other is None else (one, other, _same(before, after, one, other))


def _same(before: Point, after: Point, one: Turns | Dips, other: Turns | Dips) -> tuple[IntArray, IntArray]:
    """Which turning points of two motions are the same: by the corner, and each the nearest of the other in time.

    Their instants move along the branch, in a row of rebounds by more than the time from one to the next. So the change
    of the instant is compared with the mean of both slopes.
    """
    cycles = before.motion.cycles
    length = length_between(before, after)
    middle = one.time + 0.5 * length * one.time_slope
    other_middle = other.time - 0.5 * length * other.time_slope
    apart = times_between(middle, other_middle, cycles)
    kinds, other_kinds = (_KINDS * turns.watch + turns.upward for turns in (one, other))
    apart[(kinds[:, None] != other_kinds) | ~(apart <= _MOVED)] = np.inf
    if not apart.size:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    i = np.arange(len(one.time))
    j = np.argmin(apart, axis=1)
    is_mutual = np.isfinite(apart[i, j]) & (np.argmin(apart, axis=0)[j] == i)
    return i[is_mutual], j[is_mutual]


def times_between(times: Array, others: Array, cycles: int) -> Array:
    """Return how far apart instants of a motion are from others, whichever way round its periods."""
    apart = times[:, None] - others
    return np.asarray(np.abs(apart - cycles * np.rint(apart / cycles)))


class Ahead(NamedTuple):
    """A turning point that is expected to graze."""

    distance: float  # along the tangent [arclength]
    touch: Touch
    time_slope: float  # of its instant, along the tangent [periods]
    depth: float  # [SI]

    @property
    def touches(self) -> bool:
        """Whether the motions before the grazing touch."""
        return self.depth > 0.0

    def is_of(self, grazing: Point) -> bool:
        """Whether it is what a motion grazes."""
        touch = grazing.touch
        own = self.touch
        if touch is None or (touch.watch, touch.upward) != (own.watch, own.upward):
            return False
        return abs(touch.time - own.time) < _SAME_TURN


def grazing_ahead(point: Point) -> Ahead | None:
    """Return the turning point that comes to its corner next, as the tangent tells; None if none does."""
    turns = point.motion.turns
    if turns is None or not len(turns.depth):
        return None
    is_nearing = (turns.slope * turns.depth < 0.0) & ~grazes(point, turns)
    distance = np.full(len(turns.slope), np.inf)
    distance[is_nearing] = np.abs(turns.depth[is_nearing] / turns.slope[is_nearing])
    distance[distance < _WITH_IT] = np.inf
    k = int(np.argmin(distance))
    if not np.isfinite(distance[k]):
        return None
    touch = Touch(int(turns.watch[k]), int(turns.upward[k]), float(turns.time[k]))
    return Ahead(float(distance[k]), touch, float(turns.time_slope[k]), float(turns.depth[k]))


def landed(corrector: Corrector, point: Point, ahead: Ahead, farthest: float) -> Point | None:
    """Return the motion that grazes, from the side without contact.

    farthest: from the point [w].
    Returns None if it is not found.
    """
    try:
        return _Landing(corrector, point, ahead).run(farthest)
    except ConvergenceError:
        return None


def first_step_beyond(corrector: Corrector, grazing: Point, step: float, shortest: float) -> float:
    """Return the step from a motion that grazes to those that touch, as long as the tangent turns little over it.

    It turns in proportion to the root of the step.
    """
    while step > shortest:
        try:
            motion, slope = corrector.followed(grazing.guess(grazing.w + step * grazing.tangent))
        except ConvergenceError:
            step *= _MOST_OF_STEP
            continue
        equations = Bordered(corrector.matrix(motion, slope), grazing.tangent)
        tangent = equations.null_vector(grazing.tangent)[0][: len(grazing.tangent)]
        angle = float(np.arccos(min(abs(float(tangent @ grazing.tangent)), 1.0)))
        if angle < _LARGEST_ANGLE:
            break
        step *= float(np.clip((_ANGLE / angle) ** 2, _LEAST_OF_STEP, _MOST_OF_STEP))
    return step


class _Landing:
    """Newton's method for one grazing."""

    def __init__(self, corrector: Corrector, point: Point, ahead: Ahead) -> None:
        self._corrector = corrector
        self._point = point
        self._ahead = ahead
        share = 1.0 + _BEYOND if ahead.touches else 1.0 - _LEFT
        distance = share * ahead.distance
        self._guess = point.guess(point.w + distance * point.tangent)
        self._time = ahead.touch.time + distance * ahead.time_slope
        without_contact = None if ahead.touches else (point.guess(point.w), ahead.touch.time)
        self._last: tuple[Guess, float] | None = without_contact  # the last such motion, and its instant
        self._retreats = 0
        self._target = np.nan
        self._depth = np.nan
        self._is_near = False

    def run(self, farthest: float) -> Point | None:
        """Return the motion that grazes; None if it is not found."""
        for _ in range(_ITERATIONS):
            if np.linalg.norm(self._guess.w - self._point.w) > farthest:
                return None
            # the motion, and its extremum near the corner
            touch = replace(self._ahead.touch, time=self._time)
            row = self._point.tangent if self._is_near else None
            motion, slope = self._corrector.followed(self._guess, touch, row)
            approach = motion.approach
            if approach is None or approach.depth > 0.0:
                if not self._retreat():
                    return None
                continue
            # the equations: it repeats, and the depth is the one that is sought
            residual = self._corrector.residual(motion)
            matrix = self._corrector.matrix(motion, slope)
            row, time_row = (
                self._corrector.row(slope, approach.part, motion) for slope in (approach.slope, approach.time_slope)
            )
            steep = float(np.linalg.norm(row))
            now = approach.depth
            self._time = approach.time
            is_motion = np.linalg.norm(residual) <= self._corrector.least(self._guess, matrix)
            if is_motion and -now <= _CLOSE * steep and motion.turns is not None:
                return self._point_at(motion, slope, matrix)
            # Newton's step
            target = self._next_target(now, _CLOSE * steep)
            right = np.append(-residual, (target - now) / steep)
            change = Bordered(matrix, row / steep).solution(right)
            self._last = self._guess, self._time
            self._is_near = bool(np.linalg.norm(change) < _NEAR)
            self._guess = self._guess.moved(change)
            self._time = self._time + float(time_row @ change)
        return None

    def _retreat(self) -> bool:
        """Go half of the way back to the last motion without contact; whether there is one."""
        if self._last is None or self._retreats == _RETREATS:
            return False
        guess, time = self._last
        self._guess = self._guess.halfway(guess)
        self._time = 0.5 * (self._time + time)
        self._retreats = self._retreats + 1
        self._target = np.nan
        return True

    def _next_target(self, now: float, close: float) -> float:
        """The depth to aim at: less of it is left the better the last one was met."""
        left = _LEFT * abs(now)
        if np.isfinite(self._target):
            left = min(left, _OFF * abs(now - self._target) * (now / self._depth) ** 2)
        self._target = -max(left, _AIM * close)
        self._depth = now if now < 0.0 else -close
        return self._target

    def _point_at(self, motion: Pass, slope: Array, matrix: Array) -> Point | None:
        """The point of the branch at a motion that grazes; None if other crossings are missing or added."""
        before = self._point
        touch = replace(self._ahead.touch, time=self._time % motion.cycles)
        point = self._corrector.point_at(self._guess, motion, slope, before.tangent, Bordered(matrix, before.tangent))
        if point.orientation * before.orientation < 0.0:
            point = turned_around(point)
        point = replace(point, touch=touch)
        same = bool(patterns.touches(point.word, before.word)) if self._ahead.touches else point.word == before.word
        return point if same and not _touches_at_once(point) else None


def _touches_at_once(point: Point) -> bool:
    """Whether another turning point lies at its corner as well; True where that is not known."""
    turns = point.motion.turns
    if turns is None:
        return True
    is_near = np.abs(turns.depth) < _WITH_IT * np.abs(turns.slope)
    return bool((is_near & ~grazes(point, turns)).any())
