"""Special points of the curve of an event over two values: where it ends, or meets that of another event.

Two folds meet in a cusp, and neither exists beyond it: the curve ends there. It may end as well where a fold meets a
grazing, or go on beyond (the engine's ``two_parameters``). Where a curve of folds turns back over the second value, an
isolated branch shrinks to a point, or two branches join. Two ends of families meet where their length is least: their
test function is that length.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.base import FOLD, GRAZING, NEIMARK_SACKER, Event
from gearrattle.engine.periodic.two_parameters.relocation import polynomial_at, relocated
from gearrattle.engine.periodic.two_parameters.special_points import (
    CUSP,
    FOLD_AT_DOUBLING,
    GRAZING_AT_DOUBLING,
    MEETING,
    TANGENCY,
    TURNING,
    fold_at_doubling,
    grazing_at_doubling,
    grazing_near,
    meeting_of_grazing,
    meeting_of_two,
    resonance,
    resonance_of,
    tangency,
)
from gearrattle.errors import ConvergenceError, ModelError
from gearrattle.orbits.family_ends import EDGE

if TYPE_CHECKING:
    import xarray as xr


Array = NDArray[np.float64]
FARTHEST = 0.2  # largest distance that an event may move in a step, in units of w
PREDICTED_FROM = 3  # last points, by a parabola through them
_AT_TURNING = 1e-8  # of the value: to so much is known where a curve of folds turns back
_MOST_VALUES = 60  # that are tried for that
_INSIDE = 0.02  # of where that is sought: so far from both ends it must lie
_REACH = 0.1  # of the range: a special point farther from the last known event is another one's
_MET = 1e-3  # of the last step: the event was met there, so a point at which it vanishes lies no farther back
_BEHIND = {MEETING: 1.0, FOLD_AT_DOUBLING: np.inf}
"""The same where rounding hides the event: a fold may stay at a grazing, or be lost in a doubling."""
_BACK = 7  # last points of a fold from which a grazing near is sought, and of a grazing for its acceleration
_NEAR_HALF = 1e-3  # of the size of the state: what misses by less nearly repeats after half its periods
_NOT_ROUNDING = 5e-4  # the same: what misses by more tells where it will
_STAYS = 0.01  # of how much its motion misses: a grazing so near to a fold stays there
_SPACED = 1.4  # of the slope of a length: that of the next one for the extrapolation, at least
_LEVEL = 0.2  # of the same: what must be left of it, at most
_TRIED = 0.1  # of the distance between two points: the first step from there to where a fold meets a grazing
SAME = 1e-5  # of both ranges: special points of two curves that lie nearer are the same
Follower = Callable[[float], Continuation]
"""The branch over the value, by the second value."""


class OverBoth(NamedTuple):
    """The branches through an event over both values."""

    value: Follower
    second: Callable[[float, float], Continuation]  # by the value and a second value near


@dataclass(frozen=True)
class Located:
    """An event at a second value; what is special about it."""

    second: float
    event: Event
    special: str = ""
    slope: float = np.nan  # of its test function along the branch
    word: str = ""  # of its pattern, but for its touch
    missed: tuple[Array, ...] = ()  # by how much its motion fails to repeat after fewer periods, half of them first


@dataclass(frozen=True)
class SpecialPoint:
    """A point at which curves of events end or meet.

    Attributes
    ----------
    kind
        one of ``special`` in ``Branch.boundary``.
    value, second
        where [SI].
    """

    kind: str
    value: float
    second: float


def special_points_of(curves: Sequence[xr.Dataset], spans: tuple[float, float]) -> list[SpecialPoint]:
    """Return the special points of curves, once each: a cusp is the end of two folds; ``spans`` of both values [SI]."""
    points: list[SpecialPoint] = []
    for curve in curves:
        columns = (curve[name].values.tolist() for name in ("special", "value", "second"))
        for kind, value, second in zip(*columns, strict=True):
            is_known = any(
                point.kind == kind
                and abs(point.value - value) < SAME * spans[0]
                and abs(point.second - second) < SAME * spans[1]
                for point in points
            )
            if kind and not is_known:
                points.append(SpecialPoint(str(kind), float(value), float(second)))
    return points


def with_special_points(over: OverBoth, rows: list[Located], end: float) -> list[Located]:
    """The rows from the model's own value to an end with their special points, the last one where the curve ends."""
    follower = over.value
    if rows[-1].second != end and len(rows) > 1:
        rows = _last(over, rows, end)
    out = rows[:1]
    for before, after in pairwise(rows):
        out += [after] if after.special else [*_between(follower, before, after), after]
    return out


def _between(follower: Follower, before: Located, after: Located) -> list[Located]:
    """The special point between two rows; none if there is none."""
    kind = before.event.kind
    step = 0.5 * (after.second - before.second)
    known = {row.second: row.event for row in (before, after)}
    points = list[Located]()
    if turns_around(before, after):
        points = _sought(lambda: grazing_at_doubling(known, follower, step), GRAZING_AT_DOUBLING)
    elif kind == GRAZING and before.event.point.tangent[-1] * after.event.point.tangent[-1] < 0.0:
        is_apart = min(least_missed(before), least_missed(after)) > _NEAR_HALF  # else the tangent is upright by itself
        points = _sought(lambda: meeting_of_grazing(known, follower, step), MEETING) if is_apart else []
    elif kind == FOLD and before.event.point.pattern != after.event.point.pattern:
        points = _meeting_of_fold(follower, before, after) or _meeting_of_fold(follower, after, before)
    ends = sorted((before.second, after.second))
    return [point for point in points if ends[0] < point.second < ends[1]]


def least_missed(row: Located) -> float:
    """By how much the motion of a row fails to repeat after fewer periods; infinite for one of one period."""
    return min((float(np.linalg.norm(missed)) for missed in row.missed), default=np.inf)


def turns_around(before: Located, after: Located) -> bool:
    """Whether a grazing repeats after half of its periods between two rows: then the halves change their roles."""
    has_half = bool(before.missed) and before.event.point.motion.cycles % 2 == 0
    is_grazing = before.event.kind == GRAZING
    return is_grazing and has_half and float(before.missed[0] @ after.missed[0]) < 0.0


def _last(over: OverBoth, rows: list[Located], end: float) -> list[Located]:
    """The rows up to where the curve ends, with the special point there if one is near."""
    last = rows[-1]
    step = rows[-1].second - rows[-2].second
    farthest = _REACH * abs(end - rows[0].second)
    for points in _ends(over, rows):
        near = list[tuple[float, Located]]()
        for point in points:
            ahead = (point.second - last.second) * np.sign(step)
            if -_BEHIND.get(point.special, _MET) * abs(step) <= ahead < farthest:
                near.append((ahead, point))
        if near:
            _, point = min(near, key=lambda pair: pair[0])
            return [*(row for row in rows if (point.second - row.second) * step > 0.0), point]
    return rows


def _ends(over: OverBoth, rows: list[Located]) -> Iterator[list[Located]]:
    """Yield the special points near the last row at which its curve may end, those that are sure first.

    Beside a resonance or a doubling the test function is so flat that it seems to have a meeting of two.
    """
    follower = over.value
    if rows[-1].event.kind == EDGE:
        yield _sought(lambda: _turning_of_end(rows), TURNING)
        return
    known = [(row.second, row.event) for row in rows[-PREDICTED_FROM:]]
    (before, _), (second, event) = known[-2:]
    if event.kind == NEIMARK_SACKER:
        yield _sought(lambda: resonance(known[-2], known[-1], follower), resonance_of(event))
    if event.kind in (FOLD, GRAZING) and event.point.motion.cycles % 2 == 0:
        yield _at_doubling(follower, rows)
    if event.kind == GRAZING:
        yield _sought(lambda: tangency([(row.second, row.event) for row in rows[-_BACK:]], follower), TANGENCY)
    special = CUSP if event.kind == FOLD else TURNING
    points = _sought(lambda: meeting_of_two(event, follower, second, second - before), special)
    if event.kind == FOLD:
        meetings = (_meeting_of_fold(follower, after, before) for before, after in reversed([*pairwise(rows[-_BACK:])]))
        points += next((meeting for meeting in meetings if meeting), [])
        points += _sought(lambda: _turning(rows, over.second), TURNING)
    yield points


def _at_doubling(follower: Follower, rows: list[Located]) -> list[Located]:
    """The point at which folding or grazing motions come to repeat after half of their periods; none if none is near.

    Where a fold stays at a grazing, that comes to it as well.
    """
    missed = {row.second: float(np.linalg.norm(row.missed[0])) for row in rows}
    if missed[rows[-1].second] > _NEAR_HALF:
        return []
    spaced = list[Located]()
    for row in reversed(rows):
        if missed[row.second] > (2.0 * missed[spaced[-1].second] if spaced else _NOT_ROUNDING):
            spaced.append(row)
    for row in spaced[:_BACK]:
        step = _TRIED * (rows[-1].second - row.second)
        farthest = _STAYS * missed[row.second]
        known = {row.second: row.event} if row.event.kind == GRAZING else _grazings_near(follower, farthest, row)
        if points := _sought(partial(grazing_at_doubling, known, follower, step), GRAZING_AT_DOUBLING):
            return points
    if rows[0].event.kind != FOLD:
        return []
    folds = [(missed[row.second], row.second, row.event) for row in spaced[:PREDICTED_FROM]]
    points = _sought(lambda: fold_at_doubling(folds), FOLD_AT_DOUBLING)
    return [point for point in points if (point.second - folds[0][1]) * (rows[-1].second - rows[0].second) > 0.0]


def _sought(find: Callable[[], tuple[float, Event]], special: str) -> list[Located]:
    """The special point that is sought; none where there is none near."""
    with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
        return [Located(*find(), special)]
    return []


def _meeting_of_fold(follower: Follower, row: Located, other: Located) -> list[Located]:
    """The point near a row of a fold, and another one, at which it meets a grazing; none if none is near."""
    known = _grazings_near(follower, np.inf, row, other)
    step = _TRIED * abs(other.second - row.second)
    points = _sought(lambda: meeting_of_grazing(known, follower, step), MEETING)
    return [replace(point, event=replace(point.event, kind=FOLD)) for point in points]


def _grazings_near(follower: Follower, farthest: float, *rows: Located) -> dict[float, Event]:
    """By second value, the grazings nearest to folds, at an arclength of no more than the farthest."""
    known = dict[float, Event]()
    for row in rows:
        with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
            grazing = grazing_near(row.event, follower(row.second))
            if grazing and abs(grazing.point.length) < farthest:
                known[row.second] = grazing
    return known


def _turning(rows: list[Located], across: Callable[[float, float], Continuation]) -> tuple[float, Event]:
    """The point ahead at which a curve of folds turns back: an extremum of the second value over the value.

    A fold of the branch over the value is one of the branch over the second value as well, and has the same tangent.
    """
    last = rows[-1]
    side = np.sign(rows[-1].second - rows[-2].second)
    begin = last.event.point.parameter
    width = _twice_to_turning(rows)
    curve = across(begin, last.second)
    w = np.append(last.event.point.w[:-1], last.second / curve.family.unit)
    known = {begin: replace(last.event, point=replace(last.event.point, parameter=last.second, w=w))}

    def way_back(value: float) -> float:
        event = known[min(known, key=lambda other: abs(other - value))]
        known[value] = relocated(event, across(value, event.point.parameter), np.zeros_like(w), FARTHEST)
        return float(-side * known[value].point.parameter)

    options = {"xatol": _AT_TURNING * abs(begin), "maxiter": _MOST_VALUES}
    bounds = sorted((begin, begin + width))
    value = float(minimize_scalar(way_back, bounds=bounds, method="bounded", options=options).x)
    if not _INSIDE < (value - begin) / width < 1.0 - _INSIDE:
        raise ConvergenceError("the curve does not turn back near")
    point = known[value].point
    return point.parameter, replace(last.event, point=replace(point, parameter=value))


def _twice_to_turning(rows: list[Located]) -> float:
    """Twice the change of the value from the last point to where a parabola through the last three turns back."""
    if len(rows) < PREDICTED_FROM:
        raise ConvergenceError("too few points are known")
    one, two, three = rows[-PREDICTED_FROM:]
    values = [row.event.point.parameter for row in (one, two, three)]
    if len(set(values)) < len(values):
        raise ConvergenceError("the value does not move")
    earlier = (two.second - one.second) / (values[1] - values[0])
    later = (three.second - two.second) / (values[2] - values[1])
    bend = (later - earlier) / (values[2] - values[0])
    slope = later + bend * (values[2] - values[1])
    if bend * slope * (values[2] - values[1]) >= 0.0:
        raise ConvergenceError("the curve does not turn back ahead")
    return -slope / bend


def _turning_of_end(rows: list[Located]) -> tuple[float, Event]:
    """The point ahead at which a curve of ends of families turns back: the length of the family has no slope there.

    The second value has an extremum over that slope, so it is extrapolated over its square and cube.
    """
    spaced = [rows[-1]]
    for row in reversed(rows):
        if abs(row.slope) > _SPACED * abs(spaced[-1].slope):
            spaced.append(row)
    if len(spaced) < PREDICTED_FROM or abs(rows[-1].slope) > _LEVEL * abs(spaced[-1].slope):
        raise ConvergenceError("the length of the family keeps its slope")
    known = spaced[:PREDICTED_FROM]
    powers = np.array([row.slope for row in known])[:, None] ** (0, 2, 3)
    second = float(np.linalg.solve(powers, [row.second for row in known])[0])
    value = float(polynomial_at([(row.slope, np.array([row.event.point.parameter])) for row in known], 0.0)[0])
    last = rows[-1].event
    return second, replace(last, point=replace(last.point, parameter=value))
