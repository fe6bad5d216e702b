"""The motion of a branch that grazes, from a point before it: Newton's method for the motion and its depth together.

    P(u; p) - u = 0,      depth(u, p) = -e,      e -> 0

The depth of a turning point (``kernels.approaches``, ``general_turns``) and its gradient are exact and smooth on the
side without contact, and so is the map there. Every iteration leaves as much of the depth as the last one was off, so
no motion touches.

Takes a Corrector and a Point; gives a Point that grazes, and the step to try from there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic import patterns
from gearrattle.engine.periodic.corrector import Corrector
from gearrattle.engine.periodic.equations import Bordered
from gearrattle.engine.periodic.period_map import Pass
from gearrattle.engine.periodic.point import Guess, Point, turned_around
from gearrattle.engine.periodic.touch import Touch
from gearrattle.engine.periodic.turning import grazes
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

_ITERATIONS, _RETREATS = 12, 3
_LEFT = 0.05  # of the depth that the first iteration leaves
_OFF = 3.0  # times what the depth is expected to be off: so much is left
_CLOSE = 1e-12  # of w: so near to the corner a motion grazes
_AIM = 0.3  # of that: the depth to aim at
_NEAR = 1e-6  # change of w from which the next motion is likely to be the last one
_BEYOND = 0.2  # of the way to a grazing with contact before it: so far beyond it Newton's method begins
_AT_ONCE = 1e-10  # of w: what comes to its corner so near beyond another turning point does so with it
_SAME = 1e-3  # periods: a turning point that moves by less is the same
_ANGLE, _LARGEST_ANGLE = 0.2, 0.25  # [rad] by which the tangent may turn: aimed at, and at most
_LEAST_OF_STEP, _MOST_OF_STEP = 0.01, 0.3  # shares by which a step is shortened


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
        touch, own = grazing.touch, self.touch
        if touch is None or (touch.watch, touch.upward) != (own.watch, own.upward):
            return False
        return abs(touch.time - own.time) < _SAME


def grazing_ahead(point: Point) -> Ahead | None:
    """Return the turning point that comes to its corner next, as the tangent tells; None if none does."""
    turns = point.motion.turns
    if turns is None or not len(turns.depth):
        return None
    is_nearing = (turns.slope * turns.depth < 0.0) & ~grazes(point, turns)
    distance = np.full(len(turns.slope), np.inf)
    distance[is_nearing] = np.abs(turns.depth[is_nearing] / turns.slope[is_nearing])
    distance[distance < _AT_ONCE] = np.inf
    k = int(np.argmin(distance))
    if not np.isfinite(distance[k]):
        return None
    touch = Touch(int(turns.watch[k]), int(turns.upward[k]), float(turns.time[k]))
    return Ahead(float(distance[k]), touch, float(turns.time_slope[k]), float(turns.depth[k]))


def landed(corrector: Corrector, point: Point, ahead: Ahead, farthest: float) -> Point | None:
    """Return the motion that grazes, from the side without contact.

    Parameters
    ----------
    corrector
        of the branch.
    point
        of the branch.
    ahead
        what comes to its corner next.
    farthest
        from the point [w].

    Returns
    -------
    Point | None
        None if it is not found.
    """
    try:
        return _Search(corrector, point, ahead).run(farthest)
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


class _Search:
    """Newton's method for one grazing."""

    def __init__(self, corrector: Corrector, point: Point, ahead: Ahead) -> None:
        self._corrector, self._point, self._ahead = corrector, point, ahead
        share = 1.0 + _BEYOND if ahead.touches else 1.0 - _LEFT
        distance = share * ahead.distance
        self._guess = point.guess(point.w + distance * point.tangent)
        self._time = ahead.touch.time + distance * ahead.time_slope
        without_contact = None if ahead.touches else (point.guess(point.w), ahead.touch.time)
        self._last: tuple[Guess, float] | None = without_contact  # the last such motion, and its instant
        self._retreats, self._target, self._depth = 0, np.nan, np.nan
        self._is_near = False

    def run(self, farthest: float) -> Point | None:
        """Return the motion that grazes; None if it is not found."""
        for _ in range(_ITERATIONS):
            if np.linalg.norm(self._guess.w - self._point.w) > farthest:
                return None
            touch = replace(self._ahead.touch, time=self._time)
            row = self._point.tangent if self._is_near else None
            motion, slope = self._corrector.followed(self._guess, touch, row)
            approach = motion.approach
            if approach is None or approach.slope is None or approach.time_slope is None or approach.depth > 0.0:
                if not self._retreat():
                    return None
                continue
            residual, matrix = self._corrector.residual(motion), self._corrector.matrix(motion, slope)
            row, time_row = (
                self._corrector.row(slope, approach.part, motion) for slope in (approach.slope, approach.time_slope)
            )
            steep, now, self._time = float(np.linalg.norm(row)), approach.depth, approach.time
            is_motion = np.linalg.norm(residual) <= self._corrector.least(self._guess, matrix)
            if is_motion and -now <= _CLOSE * steep and motion.turns is not None:
                return self._point_at(motion, slope, matrix)
            target = self._next_target(now, _CLOSE * steep)
            right = np.append(-residual, (target - now) / steep)
            change = Bordered(matrix, row / steep).solution(right)
            self._last = self._guess, self._time
            self._is_near = bool(np.linalg.norm(change) < _NEAR)
            self._guess, self._time = self._guess.moved(change), self._time + float(time_row @ change)
        return None

    def _retreat(self) -> bool:
        """Go half of the way back to the last motion without contact; whether there is one."""
        if self._last is None or self._retreats == _RETREATS:
            return False
        guess, time = self._last
        self._guess, self._time = self._guess.halfway(guess), 0.5 * (self._time + time)
        self._retreats, self._target = self._retreats + 1, np.nan
        return True

    def _next_target(self, now: float, close: float) -> float:
        """The depth to aim at: less of it is left the better the last one was met."""
        left = _LEFT * abs(now)
        if np.isfinite(self._target):
            left = min(left, _OFF * abs(now - self._target) * (now / self._depth) ** 2)
        self._target, self._depth = -max(left, _AIM * close), now if now < 0.0 else -close
        return self._target

    def _point_at(self, motion: Pass, slope: Array, matrix: Array) -> Point | None:
        """The point of the branch at a motion that grazes; None if other crossings are missing or added."""
        before, touch = self._point, replace(self._ahead.touch, time=self._time % motion.cycles)
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
    is_near = np.abs(turns.depth) < _AT_ONCE * np.abs(turns.slope)
    return bool((is_near & ~grazes(point, turns)).any())
