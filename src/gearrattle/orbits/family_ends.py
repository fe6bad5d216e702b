"""Branches through families of motions, and where a family ends: at a value at which its edges meet.

A body that floats in its gap, or a slider that never slips, has a family of motions for every value of the parameter. A
branch holds one of each family. Where that comes to an edge of its family, it moves to the middle. Where both edges
meet the family ends, and the motions beyond it touch. There I - M is singular: motions that touch are followed towards
that end, also where the branch leaves it, so that what happens just beyond it is seen both ways. A family with several
free states has no one middle: at its edge the branch ends. Along an edge Newton's method finds motions that touch by
less than its residual; they are none and are left out.

The length of a family, from edge to edge, is smooth in the parameter. Its zero is sought by the secant method among the
motions in the middle, always from inside: at the end I - M is singular beyond the free direction.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import Event
from gearrattle.engine.periodic.events.slider_release import passed_begin
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.point import Point, appended, turned_around
from gearrattle.engine.periodic.shooting import shoot
from gearrattle.engine.periodic.symmetry import half_period_map
from gearrattle.engine.periodic.two_parameters.event_gradient import FamiliesOf
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.motion_families import moving_directions_of, room_of, touches_lightly, within_family

Array = NDArray[np.float64]
EDGE = "end of a family"
"""Kind of event: the edges of a family meet."""
LEAST = 1e-7  # of the largest corner: what is shorter is no family, such as the memory of a slider that is released
_BACK = (1e-3, 1e-4, 1e-5)  # of the unit of the parameter: back into a family, to see how fast its length falls
_WITHIN = 0.1  # of the length of a family: a state that moves by less from the middle stays inside
_UPRIGHT = 1e-3  # part of a tangent along the parameter
_SYMMETRIC = 0.1  # of the largest corner: a symmetric motion farther away is of another branch
_NEARER = 0.1  # share of the way to its end that is left: at first, and of the share before
_LOCATED = 1e-11  # of the unit of the parameter: a motion of the family so near to its end is the last one
_APART = 1e-6  # of the unit of the parameter: two motions so far apart at least tell where the next one is
_SHORT = 1e-11  # of the largest corner: the length of a family that rounding hides
_MOST_LEFT = 0.9  # share of the way to an end: the shortest step towards it that is tried
_STEPS = 40  # from a motion of a family to its end
_ALONG = 1e-5  # of the unit of the parameter: the difference for the slope of a length
_CHANGES = (1e-5, 1e-6, 1e-7)  # of a number: half the difference for a gradient
_BENT = 1e-3  # of a difference: by how much its halves may differ
_KNOWN = 1e-9  # of the unit of the parameter: to so much ends are known where lengths change slowly
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


@dataclass(frozen=True)
class Line:
    """States over the parameter, on a straight line."""

    state: State  # of a motion on it
    parameter: float
    slope: Array  # (N,) of the state over the parameter [SI]

    def at(self, parameter: float) -> State:
        """Return the state at a parameter."""
        return State(self.state.y + (parameter - self.parameter) * self.slope, self.state.auxiliary_pieces)


def tangent_line(curve: Continuation, point: Point) -> Line:
    """Return the tangent of a branch at a point; where that is nearly upright, the same state all along."""
    slope = point.tangent[:-1] * point.size / point.scale
    unit = curve.family.unit
    is_upright = abs(float(point.tangent[-1])) < _UPRIGHT
    slope = np.zeros_like(slope) if is_upright else slope / point.tangent[-1] / unit
    return Line(state_of(point), point.parameter, slope)


def state_of(point: Point, change: Array | float = 0.0) -> State:
    """Return the state in which the motion of a point begins, changed by so much [SI]."""
    return State(point.state + change, point.motion.end.auxiliary_pieces)


def _through(earlier: Point, point: Point) -> Line:
    """The line through two motions."""
    slope = (point.state - earlier.state) / (point.parameter - earlier.parameter)
    return Line(state_of(point), point.parameter, slope)


def end_near(curve: Continuation, line: Line, way: float) -> tuple[Point, Line]:
    """Return the last motion of a family in a direction of the parameter, and a line through its middle there.

    Where rounding hides the family before its length is zero, the end is extrapolated, and the motion is the last one.
    Its tangent is along the motions in the middle: that of a motion of a family does not tell where these go.

    Raises ConvergenceError: no family ends near.
    """
    # two motions inside the family, and the line through them
    near, length = _inside(curve, line, (0.0, *_BACK), way, LEAST * curve.family.size)
    line = replace(line, state=state_of(near), parameter=near.parameter)
    steepest = float(np.linalg.norm(line.slope * near.scale)) * curve.family.unit
    far, far_length = _inside(curve, line, (min(_BACK[0], _WITHIN * length / max(steepest, length)),), way, length)
    middle = _through(far, near)
    share = _NEARER
    unit = curve.family.unit
    # the secant method for the zero of its length
    for _ in range(_STEPS):
        left = (near.parameter - far.parameter) * length / (far_length - length)
        if abs(left) < _LOCATED * unit:
            return _last_at(near, left, middle, curve)
        parameter = near.parameter + (1.0 - share) * left
        following = near
        shorter = 0.0
        with suppress(ConvergenceError):  # too far from a middle that does not move evenly
            following, shorter = in_middle(curve, middle.at(parameter), parameter)
        # a step that led out of the family is tried shorter, or rounding hides what is left
        if not 0.0 < shorter < length:
            if share >= _NEARER and (abs(left) < _KNOWN * unit or length < _SHORT * near.size):
                return _last_at(near, left, middle, curve)
            share = 0.5 * (1.0 + share) if share >= _NEARER else _NEARER
            if share > _MOST_LEFT:
                break
            continue
        share *= _NEARER
        if abs(left) > _APART * unit:
            middle = _through(near, following)
        far = near
        far_length = length
        near = following
        length = shorter
    raise ConvergenceError("the length of the family does not come to zero")


def _last_at(near: Point, left: float, middle: Line, curve: Continuation) -> tuple[Point, Line]:
    """The last motion of a family, a little beyond one that is known, and the line through its middle."""
    along = np.append(middle.slope * curve.family.unit * near.scale / near.size, 1.0)
    along *= np.copysign(1.0 / np.linalg.norm(along), near.tangent[-1])
    return replace(near, parameter=near.parameter + left, tangent=along), middle


def _inside(curve: Continuation, line: Line, backs: tuple[float, ...], way: float, least: float) -> tuple[Point, float]:
    """The first motion in the middle of a family longer than a least, of some ways back; and its length."""
    for back in backs:
        parameter = line.parameter - way * back * curve.family.unit
        with suppress(ConvergenceError):
            point, length = in_middle(curve, line.at(parameter), parameter)
            if length > least:
                return point, length
    raise ConvergenceError("no family ends near")


def in_middle(curve: Continuation, state: State, parameter: float) -> tuple[Point, float]:
    """Return the motion in the middle of the family near a state, at a parameter; and the length of the family."""
    near = begun(curve, state, parameter)
    inside = inside_of(curve, near)
    room = None if inside is None else room_of(curve.family.map_at(parameter), inside.motion)
    if inside is None or room is None:
        return near, 0.0
    return begun(curve, state_of(inside, room[0]), parameter), room[1]


def inside_of(curve: Continuation, point: Point) -> Point | None:
    """Return a motion of a family; for one that touches lightly at its edge a motion near that; None: of no family."""
    if point.free:
        return point
    if not touches_lightly(point.motion):
        return None
    inside = within_family(curve.family.map_at(point.parameter), point.motion)
    with suppress(ConvergenceError):
        near = curve.begin(State(inside.start.y, inside.end.auxiliary_pieces), point.parameter)
        near = turned_around(near) if float(near.tangent[-1] * point.tangent[-1]) < 0.0 else near
        return near if near.free else None
    return None


def begun(curve: Continuation, state: State, parameter: float, *, upward: bool = True) -> Point:
    """Return the motion near a state, as ``Continuation.begin``; of a symmetric driveline the symmetric one, if near.

    The symmetric motion is in the middle of its family and goes on beyond. Where the family ends I - M is nearly
    singular in more than its free direction, and I - DH is regular.
    """
    half = half_period_map(curve.family.map_at(parameter).system, curve.cycles)
    if half is not None:
        with suppress(ConvergenceError):
            symmetric = shoot(half, state).motion.start
            if np.linalg.norm((symmetric.y - state.y) * half.scale) < _SYMMETRIC * half.size:
                state = symmetric
    return curve.begin(state, parameter, upward=upward)


def end_again(event: Event, curve: Continuation, change: Array) -> Event:
    """Return the end of a family in a changed driveline, near a predicted (N + 1,) change of w.

    Raises ConvergenceError: no family ends near.
    """
    point = event.point
    state = state_of(point, change[:-1] * point.size / point.scale)
    line = replace(tangent_line(curve, point), state=state, parameter=point.parameter + change[-1] * curve.family.unit)
    for way in (1.0, -1.0):
        with suppress(ConvergenceError):
            return replace(event, point=end_near(curve, line, way)[0])
    raise ConvergenceError("no family ends near")


def slope_of_length(point: Point, curve: Continuation) -> float:
    """Return the slope of the length of a family over the parameter at its end [SI], by a parabola; NaN: not known."""
    line = tangent_line(curve, point)
    step = _ALONG * curve.family.unit
    for way in (1.0, -1.0):
        with suppress(ConvergenceError):
            near, far = (_inside(curve, line, (share * _ALONG,), way, 0.0)[1] for share in (1.0, 2.0))
            return -way * (4.0 * near - far) / (2.0 * step)
    return np.nan


def gradient_of_end(event: Event, curve: Continuation, families_of: FamiliesOf, value: float) -> float:
    """Return dp / dq of the end of a family by a central difference; parameters are those of ``event_gradient.Drift``.

    Raises ConvergenceError: the end moves too fast: it turns back over q near.
    """
    unchanged = np.zeros_like(event.point.w)
    rounding = _KNOWN * curve.family.unit
    for change in (share * abs(value) for share in _CHANGES):
        with suppress(ConvergenceError):
            ends = [end_again(event, curve.of(family), unchanged).point.parameter for family in families_of(change)]
            behind = event.point.parameter - ends[0]
            ahead = ends[1] - event.point.parameter
            if abs(ahead - behind) <= max(_BENT * abs(ahead + behind), rounding):
                return (ahead + behind) / (2.0 * change)
    raise ConvergenceError("the end of the family turns back over the number near")


def followed_through_families(curve: Continuation, begin: Point, ends: tuple[float, float]) -> Iterator[Step]:
    """Yield the points of a branch after its first one, each with the events before it; None: not located yet.

    Raises ConvergenceError: the branch cannot be followed any further, or there are no motions beyond a family.
    """
    start = begin
    earlier = None
    while True:
        # what touches lightly waits: it may be too near to the end of a family
        recent = [start]
        passed = list[Step]()
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
        earlier = start
        start = passed[-1][0]


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
    way = _way(last)
    is_kept = state.y == last.state
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
    room = room_of(curve.family.map_at(point.parameter), point.motion)
    way = _way(point)
    if room is None:
        return []
    centre = state_of(point, room[0])
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
    """The motion at an end of the range up to which a family reaches, except for rounding."""
    end, middle = at
    unit = curve.family.unit
    if way * (end.parameter - limit) > _NEAREST * unit:
        return _middle_at(curve, middle, limit, way)
    w = np.append(middle.at(limit).y * end.scale / end.size, limit / unit)
    at_parameter = np.append(np.zeros(w.size - 1), 1.0)
    return replace(curve.near(w, at_parameter, end, slack=_SLACK), parameter=limit)


def _out_of_family(curve: Continuation, last: Point, at: tuple[Point, Line], limit: float) -> list[Step]:
    """The motions from one of a family to one that touches, past the end of that; a range has its limit beyond it."""
    end, middle = at
    way = _way(last)
    unit = curve.family.unit
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
    """
    end, middle = at
    nearest = _NEAREST * curve.family.unit
    is_near = [abs(point.parameter - end.parameter) <= nearest for point in recent[1:]]
    count = 1 + (is_near.index(True) if True in is_near else len(is_near))
    last = recent[count - 1]
    way = _way(last)
    ahead = way * np.array([end.parameter - last.parameter, (ends[1] if way > 0.0 else ends[0]) - end.parameter])
    if ahead.min() <= -nearest:
        return []
    touching = _up_to_end(curve, last, end)
    inside = list[Point]()
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
    """The motions of a branch that touch from one of them, which is left out, up to the end of a family."""
    unit = curve.family.unit
    distance = begin.parameter - end.parameter
    side = 1.0 if distance > 0.0 else -1.0
    first = curve.beginning_with(abs(distance) / unit)
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
