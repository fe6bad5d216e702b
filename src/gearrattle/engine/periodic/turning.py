"""What the turning points of two motions tell of the branch between them: whether it may do more than it seems to.

Every turning point of a deflection has a depth, by which it lies beyond a corner, and a slope of that along the branch
(``kernels.approaches``).

*Hidden touches.* If a touch comes and goes between two points, or goes and comes back, both have the same pattern, and
the crossings say nothing. But a depth that is negative at both can be positive in between only if it grows at the first
one and falls at the second one. While it bends one way its graph lies below both tangents: where these meet below zero
nothing is hidden, and where they meet above zero the branch is looked at there. A touch that goes and comes back is the
same with the opposite sign.

*Hidden loops.* Near grazings a branch may go back and forth in a loop too small for its tangent to tell. The depths
tell: over a step their change is the mean of both slopes, but for what is cubic in the step; and none that may reach
its corner appears or is lost.

Takes Points that follow one another; gives a share of the way, how long a step may be, and which turning point touches.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.period_map import Turns
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.periodic.touch import Touch

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

_MOVED = 1.0 / 32.0  # periods that a turning point may move between two points
_LEAST = 1e-3  # share of the way from either end at which the branch is looked at, at least
_DEFECT = 0.25  # between the change of a depth and the mean of both slopes, over the larger slope
_COUNTS = 0.25  # slope over depth, from which a depth counts


class _Depths(NamedTuple):
    """The depths of turning points that two motions have in common [SI], and their slopes over the whole step."""

    before: Array
    after: Array
    slope_before: Array
    slope_after: Array
    single: Array  # how far from the corner those are that only one of both motions has
    single_slope: Array


def hidden_between(before: Point, after: Point, unit: float) -> float | None:
    """Return the share of the way at which a touch may have come or gone; None: there is none.

    Parameters
    ----------
    before, after
        two points that follow one another.
    unit
        of the parameter.
    """
    depths = _depths_of(before, after, unit)
    if depths is None:
        return None
    side = -np.sign(depths.before)
    rises, falls = side * depths.slope_before, -side * depths.slope_after
    nears = (rises > 0.0) & (falls > 0.0) & (depths.before * depths.after > 0.0)
    if not nears.any():
        return None
    low, high, rises, falls = (np.abs(part[nears]) for part in (depths.before, depths.after, rises, falls))
    meet = np.clip((falls - high + low) / (rises + falls), 0.0, 1.0)
    passed = rises * meet - low
    worst = int(np.argmax(passed / (low + high)))
    return float(np.clip(meet[worst], _LEAST, 1.0 - _LEAST)) if passed[worst] > 0.0 else None


def agreeing_step(before: Point, after: Point, unit: float) -> float:
    """Return how many times as long a step may be for the depths of its motions to change as their slopes say.

    From 1 on they agree. What the slopes leave out grows with the third power of a step. The way that a turning point
    of one motion alone may have come grows in proportion to it. A depth counts if its slope could take it to the corner
    within a few steps. Parameters are those of ``hidden_between``.
    """
    depths = _depths_of(before, after, unit)
    if depths is None:
        return np.inf
    steepest = np.maximum(np.abs(depths.slope_before), np.abs(depths.slope_after))
    counts = steepest > _COUNTS * np.minimum(np.abs(depths.before), np.abs(depths.after))
    mean = 0.5 * (depths.slope_before + depths.slope_after)
    defect = (np.abs(depths.after - depths.before - mean) / (_DEFECT * steepest))[counts].max(initial=0.0)
    single = (depths.single_slope / (_COUNTS * depths.single)).max(initial=0.0)
    return float(1.0 / max(np.sqrt(defect), single, 1e-9))


class Passed(NamedTuple):
    """A turning point that touches at one end of a step and not at the other, where it does not touch."""

    touch: Touch
    depth: float  # [SI]
    slope: float  # of the depth towards the other end, over the whole step [SI]
    time_slope: float  # of the instant, by the same [periods]


def passed_between(apart: Point, touching: Point, unit: float) -> Passed | None:
    """Return the only turning point with a negative depth in one motion and a positive one in the other, or None."""
    one, other = apart.motion.turns, touching.motion.turns
    if one is None or other is None:
        return None
    i, j = _same(apart, touching, one, other, unit)
    touches = np.flatnonzero((one.depth[i] < 0.0) & (other.depth[j] > 0.0))
    if touches.size != 1:
        return None
    k = i[touches[0]]
    length = _length(apart, touching)
    slope, time_slope = (length * slopes_along(apart, rows[k], unit) for rows in (one.slope, one.time_slope))
    touch = Touch(int(one.watch[k]), int(one.upward[k]), float(one.time[k]))
    return Passed(touch, float(one.depth[k]), float(slope), float(time_slope))


def _depths_of(before: Point, after: Point, unit: float) -> _Depths | None:
    """What two motions have in common; None where their turning points are not known."""
    one, other = before.motion.turns, after.motion.turns
    if one is None or other is None:
        return None
    i, j = _same(before, after, one, other, unit)
    length = _length(before, after)
    first, second = (length * slopes_along(p, turns.slope, unit) for p, turns in ((before, one), (after, other)))
    single = np.abs(np.concatenate([np.delete(one.depth, i), np.delete(other.depth, j)]))
    single_slope = np.abs(np.concatenate([np.delete(first, i), np.delete(second, j)]))
    return _Depths(one.depth[i], other.depth[j], first[i], second[j], single, single_slope)


def _length(one: Point, other: Point) -> float:
    """How far it is from one point to another [arclength]; negative if it goes backwards."""
    step = other.w - one.w
    return float(np.copysign(np.linalg.norm(step), step @ one.tangent))


def slopes_along(point: Point, slopes: Array, unit: float) -> Array:
    """Return the derivatives along the branch of what has slopes (..., N + 1), by the state [SI] and the parameter."""
    return np.asarray(slopes @ (point.tangent * np.append(point.size / point.scale, unit)))


def _same(before: Point, after: Point, one: Turns, other: Turns, unit: float) -> tuple[IntArray, IntArray]:
    """Which turning points of two motions are the same: by the corner, and each the nearest of the other in time.

    Their instants move along the branch, in a row of rebounds by more than the time from one to the next. So the change
    of the instant is compared with the mean of both slopes.
    """
    cycles, length = before.motion.cycles, _length(before, after)
    moves, other_moves = (
        length * slopes_along(p, turns.time_slope, unit) for p, turns in ((before, one), (after, other))
    )
    apart = (one.time + 0.5 * moves)[:, None] - (other.time - 0.5 * other_moves)[None, :]
    apart = np.abs((apart + 0.5 * cycles) % cycles - 0.5 * cycles)
    apart[(one.watch[:, None] != other.watch) | (one.upward[:, None] != other.upward) | ~(apart <= _MOVED)] = np.inf
    if not apart.size:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    i, j = np.arange(len(one.time)), np.argmin(apart, axis=1)
    is_mutual = np.isfinite(apart[i, j]) & (np.argmin(apart, axis=0)[j] == i)
    return i[is_mutual], j[is_mutual]
