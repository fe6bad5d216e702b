"""What the turning points of two motions tell of the branch between them: whether it may do more than it seems to.

Every turning point of a deflection has a depth, by which it lies beyond a corner, and a slope of that along the branch
(``kernels.approaches``).

*Hidden touches.* If a touch comes and goes between two points, or goes and comes back, both have the same pattern, and
the crossings say nothing. But a depth that is negative at both can be positive in between only if it grows at the first
one and falls at the second one. While it bends one way its graph lies below both tangents: where these meet below zero
nothing is hidden, and where they meet above zero the branch is looked at there. A touch that goes and comes back is the
same with the opposite sign. If a motion touches what one beside it grazes (``landing``), although the slope of that
one's depth leads away from the corner, there is another grazing between both.

*Hidden loops.* Near grazings a branch may go back and forth in a loop too small for its tangent to tell. The depths
tell: over a step their change is the mean of both slopes, but for what is cubic in the step; and none that comes nearer
to its corner appears or is lost. The depth of what grazes at one end of a step and touches at the other has different
slopes on both sides: along the first step beyond it may become a few times as steep.

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
_GRAZES = 1e-6  # periods between a grazing and the turning point that it is
_FLAT = 1e-300  # [SI] slope that counts as zero
_LEAST = 1e-3  # share of the way from either end at which the branch is looked at, at least
_DEFECT = 0.25  # between the change of a depth and the mean of both slopes, over the larger slope
_COUNTS = 0.25  # slope over depth, from which a depth counts


class _Depths(NamedTuple):
    """The depths of turning points that two motions have in common [SI], and their slopes over the whole step."""

    before: Array
    after: Array
    slope_before: Array
    slope_after: Array
    bends: NDArray[np.bool_]  # whether one motion grazes there and the other one touches: slopes differ on both sides
    single: Array  # how far from the corner those are that only one of both motions has
    nearing: Array  # by how much these come nearer to it towards the other motion, over the whole step


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
    if min(_way_beyond(before, after, unit), _way_beyond(after, before, unit)) < 0.0:
        return 0.5
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
    of one motion alone comes nearer to its corner grows in proportion to it. A depth counts if its slope could take it
    to the corner within a few steps. Parameters are those of ``hidden_between``.
    """
    depths = _depths_of(before, after, unit)
    if depths is None:
        return np.inf
    steepest = np.maximum(np.abs(depths.slope_before), np.abs(depths.slope_after))
    counts = steepest > _COUNTS * np.minimum(np.abs(depths.before), np.abs(depths.after))
    counts &= ~depths.bends
    mean = 0.5 * (depths.slope_before + depths.slope_after)
    defect = (np.abs(depths.after - depths.before - mean)[counts] / (_DEFECT * steepest[counts])).max(initial=0.0)
    single = (depths.nearing / (_COUNTS * depths.single)).max(initial=0.0)
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
    single = np.concatenate([np.delete(one.depth, i), np.delete(other.depth, j)])
    nearing = -np.sign(single) * np.concatenate([np.delete(first, i), -np.delete(second, j)])
    bends = grazes(before, one)[i] & (other.depth[j] > 0.0) & (first[i] > 0.0)
    bends |= grazes(after, other)[j] & (one.depth[i] > 0.0) & (second[j] < 0.0)
    return _Depths(one.depth[i], other.depth[j], first[i], second[j], bends, np.abs(single), nearing)


def touches_beyond(grazing: Point, other: Point, unit: float) -> bool:
    """Return whether another motion touches the corner that one of the branch grazes, as the depth's slope tells."""
    return _way_beyond(grazing, other, unit) > 0.0


def _way_beyond(grazing: Point, other: Point, unit: float) -> float:
    """By how much a depth would grow from a motion that grazes to another one [SI]; 0 if that one does not touch."""
    turns, others = grazing.motion.turns, other.motion.turns
    if grazing.touch is None or turns is None or others is None:
        return 0.0
    i, j = _same(grazing, other, turns, others, unit)
    ours = i[grazes(grazing, turns)[i] & (others.depth[j] > 0.0)]
    return _length(grazing, other) * float(slopes_along(grazing, turns.slope[ours], unit).sum())


def rise_beyond(grazing: Point, touching: Point, unit: float) -> float:
    """Return how many times as steep as at a motion that grazes its depth is at one that touches; 1 at least."""
    turns, others = grazing.motion.turns, touching.motion.turns
    if turns is None or others is None:
        return 1.0
    i, j = _same(grazing, touching, turns, others, unit)
    ours = grazes(grazing, turns)[i] & (others.depth[j] > 0.0)
    slope = np.abs(slopes_along(grazing, turns.slope[i[ours]], unit))
    slope_beyond = np.abs(slopes_along(touching, others.slope[j[ours]], unit))
    return float((slope_beyond / np.maximum(slope, _FLAT)).max(initial=1.0))


def grazes(point: Point, turns: Turns) -> NDArray[np.bool_]:
    """Which turning point of a motion that grazes lies at its corner."""
    if point.touch is None:
        return np.zeros(len(turns.depth), np.bool_)
    is_same = (turns.watch == point.touch.watch) & (turns.upward == point.touch.upward)
    return np.asarray(is_same & (np.abs(turns.time - point.touch.time) < _GRAZES))


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
