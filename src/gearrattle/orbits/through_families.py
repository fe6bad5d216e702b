"""Branches through families of motions: a body that floats in its gap, a slider that never slips.

Of a family the branch holds one motion for every value of the parameter. Where that comes to an edge of its family,
it moves to the middle. Where both edges meet the family ends, and the motions beyond it touch. There I - M is singular:
motions that touch are followed towards that end, also where the branch leaves it, so that what happens just beyond it
is seen both ways. A family with several free states has no one middle: at its edge the branch ends. Along an edge
Newton's method finds motions that touch by less than its residual; they are none and are left out.

Takes a Continuation and a first point; gives the points, and the events at edges.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events import Event
from gearrattle.engine.periodic.period_map import State
from gearrattle.engine.periodic.point import Point, appended, turned_around
from gearrattle.engine.periodic.release import passed_begin
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.families import moving_directions_of, room_of, touches_lightly
from gearrattle.orbits.family_ends import (
    EDGE,
    LEAST,
    Line,
    begun,
    end_near,
    in_middle,
    inside_of,
    state_of,
    tangent_line,
)

Array = NDArray[np.float64]
Step = tuple[Point, Sequence[Event] | None]
"""A point of a branch, and the events before it; None: not located yet."""

_MIDDLE = 0.1  # of the length of a family: a shorter way to the middle is not gone
_BEYOND = (1e-4, 1e-3, 1e-5, 1e-6, 1e-7)  # of the unit of the parameter: from the end of a family to motions that touch
_FARTHEST = 0.1  # of the unit of the parameter: the end of a family from the last motion of it
_AHEAD = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4)  # of the unit of the parameter: past the begin of the period
_STRAIGHT = 100.0  # times that: the state changes by less
_NEAREST = 1e-8  # of the unit of the parameter: nearer to the end of a family rounding decides which motions touch
_NEAR = (_NEAREST, 1e-7, 1e-6)  # the same, where Newton's method does not converge so near
_INSIDE = (1e-6, 1e-4)  # of the unit of the parameter: of a family that a branch comes into
_SLACK = 1e-6  # change of w at the end of a family, where Newton's method may not converge
_AT_END = 1e-3  # from w of the last motion of a family to one that touches and is so near to its end, at most
_MOST = 100  # motions that touch, from the first one beyond a family to its end


def followed_through_families(curve: Continuation, begin: Point, ends: tuple[float, float]) -> Iterator[Step]:
    """Yield the points of a branch after its first one, each with the events before it; None: not located yet.

    Parameters
    ----------
    curve
        the Continuation that follows it.
    begin
        its first point.
    ends
        of the range, ascending.

    Raises
    ------
    ConvergenceError
        the branch cannot be followed any further; also where there are no motions beyond a family.
    """
    start, earlier = begin, None
    while True:
        recent, passed = [start], list[Step]()  # what touches lightly waits: it may be too near to the end of a family
        try:
            for point in _followed(curve, start, ends):
                passed = _past_edge(curve, recent, point, ends)
                if passed and (recent[-1] is not start or _is_ahead(earlier, passed[-1][0])):
                    break
                recent.append(point)
                if point.free or not touches_lightly(point.motion):
                    yield from _unlocated(recent[1:])
                    recent = [point]
            else:
                yield from _unlocated(recent[1:])
                return
        except ConvergenceError:
            passed = _further(curve, recent, ends)
            if not passed or (recent[-1] is start and not (start.free and _is_ahead(earlier, passed[-1][0]))):
                yield from _unlocated(recent[1:])
                raise
        yield from _unlocated(recent[1:])
        yield from passed
        earlier, start = start, passed[-1][0]


def _unlocated(points: Sequence[Point]) -> list[Step]:
    """Points of a branch with the events before them not located yet."""
    return [(point, None) for point in points]


def _is_ahead(earlier: Point | None, last: Point) -> bool:
    """Whether a branch has come anywhere, and not only to the middle of a family again."""
    return earlier is None or last.parameter != earlier.parameter


def _further(curve: Continuation, recent: list[Point], ends: tuple[float, float]) -> list[Step]:
    """What comes after the last of recent motions from where the branch cannot be followed; empty: nothing is known."""
    last = recent[-1]
    beyond = _past_begin(curve, last, ends)
    if beyond is not None:
        return [(beyond, ())]
    with suppress(ConvergenceError):
        if last.free:
            return _off_edge(curve, last, ends)
        end, middle = end_near(curve, tangent_line(curve, last), -_way(last))
        distance = abs(end.parameter - last.parameter), float(np.linalg.norm(end.w - last.w))
        if max(distance[0] / curve.family.unit, distance[1]) < _AT_END:
            return _into_family(curve, recent, (end, middle), ends)
    return []


def _past_begin(curve: Continuation, last: Point, ends: tuple[float, float]) -> Point | None:
    """The next motion of a branch, where a crossing that lets a slider go has passed the begin of the period; or None.

    But for what that slider holds it is near to the last one.
    """
    if not curve.family.memories:
        return None
    state = passed_begin(curve.family.map_at(last.parameter), last.motion)
    if state is None:
        return None
    way, is_kept = _way(last), state.y == last.state
    for ahead in _AHEAD:
        parameter = last.parameter + way * ahead * curve.family.unit
        if not ends[0] < parameter < ends[1]:
            break
        with suppress(ConvergenceError):
            beyond = curve.begin(state, parameter, upward=way > 0.0)
            change = (beyond.w - last.w)[:-1][is_kept]
            if beyond.word == last.word and float(np.linalg.norm(change)) < _STRAIGHT * ahead:
                return appended(last, beyond)
    return None


def _followed(curve: Continuation, start: Point, ends: tuple[float, float]) -> Iterator[Point]:
    """Yield the points of a branch up to the edge of a family with several free states, which has no one middle."""
    last = start
    try:
        for point in curve.follow(start, *ends):
            if point.free != last.free:
                _refuse_edge(curve, max(last, point, key=lambda one: one.free))
            yield point
            last = point
    except ConvergenceError:
        if last.free:
            _refuse_edge(curve, last)
        raise


def _refuse_edge(curve: Continuation, point: Point) -> None:
    """Raise an error if the family of a point has several free states."""
    count = len(moving_directions_of(curve.family.map_at(point.parameter), point.motion))
    if count > 1:
        family = f"a family with {count} free states"
        raise ConvergenceError(f"the branch comes to the edge of {family} at {curve.family.shown(point.parameter)}")


def _past_edge(curve: Continuation, recent: list[Point], point: Point, ends: tuple[float, float]) -> list[Step]:
    """What comes instead of the next point where only one of it and the last one is of a family; empty: nothing."""
    last = recent[-1]
    if last.free:
        return [] if point.free else (_within(curve, last, point) or _off_edge(curve, last, ends))
    inside = inside_of(curve, point)
    if inside is not None:
        with suppress(ConvergenceError):
            return _into_family(curve, recent, end_near(curve, tangent_line(curve, inside), -_way(last)), ends)
    return []


def _within(curve: Continuation, last: Point, point: Point) -> list[Step]:
    """The motion in the middle of the family at whose edge a point touches lightly; empty: it does not."""
    inside = inside_of(curve, point)
    with suppress(ConvergenceError):
        if inside is not None:
            middle = _middle_at(curve, tangent_line(curve, inside), point.parameter, _way(last))
            return [(appended(last, middle), None)] if middle.free else []
    return []


def _off_edge(curve: Continuation, point: Point, ends: tuple[float, float]) -> list[Step]:
    """The motion in the middle of a point's family, or those beyond its end; empty for a family without ends near."""
    room, way = room_of(curve.family.map_at(point.parameter), point.motion), _way(point)
    if room is None:
        return []
    centre = State(point.state + room[0], point.motion.end.auxiliary_pieces)
    if room[1] > LEAST * point.size and np.linalg.norm(room[0] * point.scale) > _MIDDLE * room[1]:
        return [(appended(point, curve.begin(centre, point.parameter, upward=way > 0.0)), ())]
    try:
        at = end_near(curve, replace(tangent_line(curve, point), state=centre), way)
    except ConvergenceError:
        return []
    limit = ends[1] if way > 0.0 else ends[0]
    if way * (limit - at[0].parameter) <= _NEAREST * curve.family.unit:
        last = appended(point, _last_of(curve, at, limit, way))
        return [(last, None if last.free else ())]
    is_near = abs(at[0].parameter - point.parameter) < _FARTHEST * curve.family.unit
    return _out_of_family(curve, point, at, limit) if is_near else []


def _last_of(curve: Continuation, at: tuple[Point, Line], limit: float, way: float) -> Point:
    """The motion at an end of the range up to which a family reaches, but for rounding."""
    (end, middle), unit = at, curve.family.unit
    if way * (end.parameter - limit) > _NEAREST * unit:
        return _middle_at(curve, middle, limit, way)
    w = np.append(middle.at(limit).y * end.scale / end.size, limit / unit)
    at_parameter = np.append(np.zeros(w.size - 1), 1.0)
    return replace(curve.near(w, at_parameter, end, slack=_SLACK), parameter=limit)


def _out_of_family(curve: Continuation, last: Point, at: tuple[Point, Line], limit: float) -> list[Step]:
    """The motions from one of a family to one that touches, past the end of that; a range has its limit beyond it.

    Raises
    ------
    ConvergenceError
        no motion touches there, or its branch does not lead to the end.
    """
    (end, middle), way, unit = at, _way(last), curve.family.unit
    nearest = end.parameter - way * _NEAREST * unit
    for ahead in _BEYOND:
        parameter = way * min(way * limit, way * end.parameter + ahead * unit)
        with suppress(ConvergenceError):
            beyond = begun(curve, middle.at(parameter), parameter, upward=way < 0.0)
            if not beyond.free:
                touching = [turned_around(back) for back in reversed([beyond, *_up_to_end(curve, beyond, end)])]
                is_before = way * (nearest - last.parameter) > 0.0
                inside = [_middle_at(curve, middle, nearest, way)] if is_before else []
                return _joined(last, (inside, touching), end)
    raise ConvergenceError(f"no motion was found beyond the end of a family at {curve.family.shown(end.parameter)}")


def _into_family(
    curve: Continuation, recent: list[Point], at: tuple[Point, Line], ends: tuple[float, float]
) -> list[Step]:
    """The motions from one that touches to the first of a family, past the end of that; empty: it is out of range.

    Recent motions too near to the end are no part of the branch, and are taken out.

    Raises
    ------
    ConvergenceError
        the branch does not lead to the end.
    """
    (end, middle), nearest = at, _NEAREST * curve.family.unit
    is_near = [abs(point.parameter - end.parameter) <= nearest for point in recent[1:]]
    count = 1 + (is_near.index(True) if True in is_near else len(is_near))
    last = recent[count - 1]
    way = _way(last)
    ahead = way * np.array([end.parameter - last.parameter, (ends[1] if way > 0.0 else ends[0]) - end.parameter])
    if ahead.min() <= -nearest:
        return []
    touching, inside = _up_to_end(curve, last, end), list[Point]()
    for distance in (_NEAREST, *_INSIDE):
        parameter = end.parameter + way * distance * curve.family.unit
        with suppress(ConvergenceError):
            if ends[0] < parameter < ends[1]:
                inside.append(_middle_at(curve, middle, parameter, way))
    if not inside:
        return []
    del recent[count:]
    return _joined(last, (touching, inside), end)


def _middle_at(curve: Continuation, middle: Line, parameter: float, way: float) -> Point:
    """The motion in the middle of a family at a parameter, of a branch that goes a way (1 or -1)."""
    state = state_of(in_middle(curve, middle.at(parameter), parameter)[0])
    return curve.begin(state, parameter, upward=way > 0.0)


def _joined(last: Point, parts: tuple[list[Point], list[Point]], end: Point) -> list[Step]:
    """The points before and behind the end of a family, after a last one, with that event between them."""
    before = _appended(last, parts[0])
    end = appended([last, *before][-1], end)
    first, *others = _appended(end, parts[1])
    return [*((point, None) for point in before), (first, (Event(EDGE, end),)), *((point, None) for point in others)]


def _up_to_end(curve: Continuation, begin: Point, end: Point) -> list[Point]:
    """The motions of a branch that touch from one of them, which is left out, up to the end of a family.

    Raises
    ------
    ConvergenceError
        the branch does not lead there.
    """
    unit, distance = curve.family.unit, begin.parameter - end.parameter
    side, first = (1.0 if distance > 0.0 else -1.0), curve.beginning_with(abs(distance) / unit)
    for near in _NEAR:
        if abs(distance) <= near * unit:
            return []
        nearest = end.parameter + side * near * unit
        points = list[Point]()
        with suppress(ConvergenceError):
            for point in first.follow(begin, *sorted((nearest, side * np.inf))):
                if point.free or len(points) == _MOST:
                    break
                points.append(point)
            if points and points[-1].parameter == nearest and np.linalg.norm(points[-1].w - end.w) < _AT_END:
                return points
    raise ConvergenceError("the branch does not lead to the end of the family")


def _appended(begin: Point, points: list[Point]) -> list[Point]:
    """Points that follow another one and one another, with their lengths along the branch."""
    return [*accumulate([begin, *points], appended)][1:]


def _way(point: Point) -> float:
    return 1.0 if point.tangent[-1] > 0.0 else -1.0
