"""Branches through families of motions, and the end of a family: the parameter at which its two edges meet.

A body that floats in its gap, or a slider that never slips, has a family of motions for every value of the parameter. A
branch holds one motion of each family. If this motion comes to an edge of its family, the branch continues with the
motion in the middle. Where the two edges meet, the family ends; beyond it the motions touch a corner. At the end I - M
is singular. So motions that touch are always followed towards the end of the family, even if the branch leads away from
it: the events just beyond the end are then the same both ways. A family with several free states has no unique middle:
at its edge the branch ends. Along an edge Newton's method finds motions that touch so lightly that the residual does
not show it; they are left out.

The length of a family, from edge to edge, is smooth in the parameter. The secant method finds its zero from motions in
the middle, always from inside the family, because at the end I - M is singular in more than the free direction.
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
Step = tuple[Point, Sequence[Event] | None]
"""A point of a branch, and the events before it; None: not located yet."""
# lengths, in largest corners
LEAST = 1e-7  # shortest family; the memory of a released slider gives a shorter one, which does not count
_SYMMETRIC = 0.1  # distance at which a symmetric motion belongs to another branch
_SHORT = 1e-11  # length of a family below rounding
# distances, in units of the parameter
_BACK = (1e-3, 1e-4, 1e-5)  # back into a family, for the slope of its length
_LOCATED = 1e-11  # from the last motion of a family to its end
_APART = 1e-6  # least distance of two motions that give the direction to the next one
_ALONG = 1e-5  # difference for the slope of a length
_KNOWN = 1e-9  # error of an end where the length changes slowly
_BEYOND = (1e-4, 1e-3, 1e-5, 1e-6, 1e-7)  # from the end of a family to motions that touch
_FARTHEST = 0.1  # largest distance from the last motion of a branch in a family to the family's end
_AHEAD = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4)  # step after a crossing has passed the begin of the period
_NEAREST = 1e-8  # from the end of a family: nearer to it rounding decides which motions touch
_NEAR = (_NEAREST, 1e-7, 1e-6)  # from the end of a family, larger where Newton's method does not converge
_INSIDE = (1e-6, 1e-4)  # from the end of a family to further motions inside it
# shares and numbers
_WITHIN = 0.1  # share of the length of a family: a state that moves by less from the middle stays inside
_UPRIGHT = 1e-3  # component of a tangent along the parameter: below it the branch is nearly vertical
_NEARER = 0.1  # share of the way to the end that a step leaves: at first, and times that at every further step
_MOST_LEFT = 0.9  # largest share of the way to the end that a step leaves
_STEPS = 40  # most steps from a motion of a family to its end
_CHANGES = (1e-5, 1e-6, 1e-7)  # shares of a number: half the difference for a gradient
_BENT = 1e-3  # share of a difference by which its two halves may differ
_MIDDLE = 0.1  # share of the length of a family: a branch nearer to the middle stays where it is
_STRAIGHT = 100.0  # largest change of the state [w] over the step of the parameter [units]
_SLACK = 1e-6  # change of w at the end of a family, where Newton's method may not converge
_AT_END = 1e-3  # largest change of w from a motion that touches near the end of a family to its last motion
_MOST = 100  # most motions that touch, from the first one beyond a family to its end


@dataclass(frozen=True)
class Line:
    """States as a linear function of the parameter."""

    state: State  # at ``parameter``
    parameter: float
    slope: Array  # (N,) derivative of the state with respect to the parameter [SI]

    def at(self, parameter: float) -> State:
        """Return the state at a parameter."""
        return State(self.state.y + (parameter - self.parameter) * self.slope, self.state.auxiliary_pieces)


def tangent_line(curve: Continuation, point: Point) -> Line:
    """Return the tangent of a branch at a point; if the branch is nearly vertical there, a constant state."""
    slope = point.tangent[:-1] * point.size / point.scale
    unit = curve.family.unit
    is_upright = abs(float(point.tangent[-1])) < _UPRIGHT
    slope = np.zeros_like(slope) if is_upright else slope / point.tangent[-1] / unit
    return Line(state_of(point), point.parameter, slope)


def state_of(point: Point, change: Array | float = 0.0) -> State:
    """Return the state in which the motion of a point begins, plus a change [SI]."""
    return State(point.state + change, point.motion.end.auxiliary_pieces)


def _through(earlier: Point, point: Point) -> Line:
    """The line through two motions."""
    slope = (point.state - earlier.state) / (point.parameter - earlier.parameter)
    return Line(state_of(point), point.parameter, slope)


def end_near(curve: Continuation, line: Line, way: float) -> tuple[Point, Line]:
    """Return the last motion of a family in a direction of the parameter, and a line through the middles there.

    If the length falls below rounding before it is zero, the end is extrapolated from the last motion. The tangent of
    the returned point is along the motions in the middle; the tangent of one motion of a family says nothing of these.

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
        with suppress(ConvergenceError):  # the extrapolated middle is too far off
            following, shorter = in_middle(curve, middle.at(parameter), parameter)
        # after a step out of the family try a shorter one; or the rest of the length is below rounding
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
    """The end of a family, at a distance ``left`` beyond a known motion, and the line through the middles."""
    along = np.append(middle.slope * curve.family.unit * near.scale / near.size, 1.0)
    along *= np.copysign(1.0 / np.linalg.norm(along), near.tangent[-1])
    return replace(near, parameter=near.parameter + left, tangent=along), middle


def _inside(curve: Continuation, line: Line, backs: tuple[float, ...], way: float, least: float) -> tuple[Point, float]:
    """The motion in the middle of a family, and the family's length, at the first of some distances back.

    The length must exceed ``least``.
    """
    for back in backs:
        parameter = line.parameter - way * back * curve.family.unit
        with suppress(ConvergenceError):
            point, length = in_middle(curve, line.at(parameter), parameter)
            if length > least:
                return point, length
    raise ConvergenceError("no family ends near")


def in_middle(curve: Continuation, state: State, parameter: float) -> tuple[Point, float]:
    """Return the motion in the middle of the family near a state, at a parameter, and the length of the family.

    Without a family: the motion near the state, and 0.
    """
    near = begun(curve, state, parameter)
    inside = inside_of(curve, near)
    room = None if inside is None else room_of(curve.family.map_at(parameter), inside.motion)
    if inside is None or room is None:
        return near, 0.0
    return begun(curve, state_of(inside, room[0]), parameter), room[1]


def inside_of(curve: Continuation, point: Point) -> Point | None:
    """Return a motion of the family of a point: the point itself, or a motion near it if it touches lightly.

    None if the point belongs to no family.
    """
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
    """Return the motion near a state, as ``Continuation.begin``; in a symmetric driveline the symmetric one if near.

    A symmetric motion is in the middle of its family, and its branch goes on beyond the family. Near the family's end
    I - M is nearly singular in more than its free direction, while I - DH of the half-period map H is regular.
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
    """Return the derivative of the length of a family with respect to the parameter at its end [SI].

    It is that of a parabola through two lengths inside; NaN where these are not known.
    """
    line = tangent_line(curve, point)
    step = _ALONG * curve.family.unit
    for way in (1.0, -1.0):
        with suppress(ConvergenceError):
            near, far = (_inside(curve, line, (share * _ALONG,), way, 0.0)[1] for share in (1.0, 2.0))
            return -way * (4.0 * near - far) / (2.0 * step)
    return np.nan


def gradient_of_end(event: Event, curve: Continuation, families_of: FamiliesOf, value: float) -> float:
    """Return dp / dq of the end of a family by a central difference; arguments as of ``event_gradient.Drift``.

    Raises ConvergenceError: the end over q turns back near, so the difference is not accurate.
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
        # motions that touch lightly are held back: they may be too near to the end of a family
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
    """Whether a branch has advanced since the last family, and not only returned to the middle."""
    return earlier is None or last.parameter != earlier.parameter


def _further(curve: Continuation, recent: list[Point], ends: tuple[float, float]) -> list[Step]:
    """The steps beyond the last of recent motions, where ``Continuation.follow`` fails; empty if none are known."""
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
    """The next motion of a branch if a crossing that releases a slider has passed the begin of the period; else None.

    Except for the stretch of that slider, the motion is near to the last one.
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
    """The steps that replace the next point where a branch enters or leaves a family; otherwise none."""
    last = recent[-1]
    if last.free:
        return [] if point.free else (_within(curve, last, point) or _off_edge(curve, last, ends))
    inside = inside_of(curve, point)
    if inside is not None:
        with suppress(ConvergenceError):
            return _into_family(curve, recent, end_near(curve, tangent_line(curve, inside), -_way(last)), ends)
    return []


def _within(curve: Continuation, last: Point, point: Point) -> list[Step]:
    """The motion in the middle of the family at whose edge a point touches lightly; otherwise none."""
    inside = inside_of(curve, point)
    with suppress(ConvergenceError):
        if inside is not None:
            middle = _middle_at(curve, tangent_line(curve, inside), point.parameter, _way(last))
            return [(appended(last, middle), None)] if middle.free else []
    return []


def _off_edge(curve: Continuation, point: Point, ends: tuple[float, float]) -> list[Step]:
    """The motion in the middle of a point's family, or motions beyond its end; empty for a family without ends near."""
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
    """The motion at an end of the range, for a family that reaches up to there except for rounding."""
    end, middle = at
    unit = curve.family.unit
    if way * (end.parameter - limit) > _NEAREST * unit:
        return _middle_at(curve, middle, limit, way)
    w = np.append(middle.at(limit).y * end.scale / end.size, limit / unit)
    at_parameter = np.append(np.zeros(w.size - 1), 1.0)
    return replace(curve.near(w, at_parameter, end, slack=_SLACK), parameter=limit)


def _out_of_family(curve: Continuation, last: Point, at: tuple[Point, Line], limit: float) -> list[Step]:
    """The motions from a motion of a family, past the family's end, to one that touches, within the range's limit."""
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
    """The motions from one that touches, past the end of a family, into the family; empty if that is out of range.

    Recent motions too near to the end are removed from the branch.
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
    """The motion in the middle of a family at a parameter, which grows (``way`` 1) or falls (-1) along the branch."""
    state = state_of(in_middle(curve, middle.at(parameter), parameter)[0])
    return curve.begin(state, parameter, upward=way > 0.0)


def _joined(last: Point, parts: tuple[list[Point], list[Point]], end: Point) -> list[Step]:
    """The points before and behind the end of a family, continuing from a last point, with the event between them."""
    before = _appended(last, parts[0])
    end = appended([last, *before][-1], end)
    first, *others = _appended(end, parts[1])
    return [*((point, None) for point in before), (first, (Event(EDGE, end),)), *((point, None) for point in others)]


def _up_to_end(curve: Continuation, begin: Point, end: Point) -> list[Point]:
    """The motions of a branch that touch, from one of them (left out) up to the end of a family."""
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
    """Points that continue a branch from another point, with their lengths along the branch."""
    return [*accumulate([begin, *points], appended)][1:]


def _way(point: Point) -> float:
    return 1.0 if point.tangent[-1] > 0.0 else -1.0
