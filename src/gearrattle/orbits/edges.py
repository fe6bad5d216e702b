"""Branches through families of motions: a body that floats in its gap, a slider that never slips.

Of a family the branch holds one motion for every value of the parameter. Where that comes to an edge of its family,
it moves to the middle. Where both edges meet the family ends, and the motions beyond it touch. A family with several
free states has no one middle: at its edge the branch ends. Along an edge Newton's method finds motions that touch by
less than its residual; they are none and are left out.

Takes a Continuation and a first point; gives the points, and the events at edges.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events import Event
from gearrattle.engine.periodic.period_map import State
from gearrattle.engine.periodic.point import Point, appended
from gearrattle.engine.periodic.release import passed_begin
from gearrattle.engine.periodic.shooting import shoot
from gearrattle.engine.periodic.symmetry import half_period_map
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.freedom import moving_directions_of, room_of

Array = NDArray[np.float64]

EDGE = "end of a family"
"""Kind of event: the edges of a family meet."""
_LEAST = 1e-7  # of the largest corner: what is shorter is no family, such as the memory of a slider that is let go
_MIDDLE = 1e-3  # of the largest corner: a shorter way to the middle is not gone
_BEYOND = (1e-4, 1e-3, 1e-5, 1e-6, 1e-7)  # of the unit of the parameter: from the end of a family to motions that touch
_BACK = 1e-3  # of the unit of the parameter: back into a family, to see how fast its length falls
_FARTHEST = 0.1  # of the unit of the parameter: the end of a family from the last motion of it
_SYMMETRIC = 0.1  # of the largest corner: a symmetric motion farther away is of another branch
_AHEAD = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4)  # of the unit of the parameter: past the begin of the period
_STRAIGHT = 100.0  # times that: the state changes by less
_NEARER = 0.1  # share of the way to its end that is left, each time
_LOCATED = 1e-11  # of the unit of the parameter: a motion of the family so near to its end is the last one
_APART = 1e-6  # of the unit of the parameter: two motions so far apart at least tell where the next one is


def followed_through_families(
    curve: Continuation, begin: Point, ends: tuple[float, float]
) -> Iterator[tuple[Point, Sequence[Event] | None]]:
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
    start = last = begin
    while True:
        try:
            for point in _followed(curve, start, ends):
                moved = _off_edge(curve, last) if last.free and not point.free else None
                if moved is not None:
                    yield moved
                    start = last = moved[0]
                    break
                yield point, None
                last = point
            else:
                return
        except ConvergenceError:
            beyond = None if last is start else _past_begin(curve, last, ends)
            if beyond is None:
                raise
            yield beyond, ()
            start = last = beyond


def _past_begin(curve: Continuation, last: Point, ends: tuple[float, float]) -> Point | None:
    """The next motion of a branch, where a crossing that lets a slider go has passed the begin of the period; or None.

    But for what that slider holds it is near to the last one.
    """
    if not curve.family.memories:
        return None
    state = passed_begin(curve.family.map_at(last.parameter), last.motion)
    if state is None:
        return None
    way, is_kept = (1.0 if last.tangent[-1] > 0.0 else -1.0), state.y == last.state
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
            if bool(point.free) != bool(last.free):
                _refuse_edge(curve, last if last.free else point)
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
        raise ConvergenceError(f"the branch comes to the edge of {family} at the parameter {point.parameter:.9g}")


def _off_edge(curve: Continuation, point: Point) -> tuple[Point, Sequence[Event]] | None:
    """The motion in the middle of a point's family, or beyond the end of that; None for a family without ends near."""
    room = room_of(curve.family.map_at(point.parameter), point.motion)
    if room is None or room[1] < _LEAST * point.size:
        return None
    if np.linalg.norm(room[0] * point.scale) > _MIDDLE * point.size:
        state = State(point.state + room[0], point.motion.end.auxiliary_pieces)
        return appended(point, curve.begin(state, point.parameter, upward=bool(point.tangent[-1] > 0.0))), ()
    end, earlier = _end_of(curve, point)
    if abs(end.parameter - point.parameter) > _FARTHEST * curve.family.unit:
        return None
    way = 1.0 if point.tangent[-1] > 0.0 else -1.0
    for ahead in _BEYOND:
        with suppress(ConvergenceError):
            parameter = end.parameter + way * ahead * curve.family.unit
            beyond = _begun(curve, _extrapolated(earlier, end, parameter), parameter, upward=way > 0.0)
            if not beyond.free:
                return appended(end, beyond), (Event(EDGE, end),)
    raise ConvergenceError(f"no motion was found beyond the end of a family at the parameter {end.parameter:.9g}")


def _end_of(curve: Continuation, point: Point) -> tuple[Point, Point]:
    """The last motion of a family, where its length, smooth in the parameter, falls to zero; and an earlier one."""
    way = 1.0 if point.tangent[-1] > 0.0 else -1.0
    near, length = _in_middle(curve, State(point.state, point.motion.end.auxiliary_pieces), point.parameter)
    back = point.parameter - way * _BACK * curve.family.unit
    far, far_length = _in_middle(curve, _extrapolated(point, near, back), back)
    earlier = far
    while length < far_length:
        left = (near.parameter - far.parameter) * length / (far_length - length)
        if abs(left) < _LOCATED * curve.family.unit:
            break
        parameter = near.parameter + (1.0 - _NEARER) * left
        following, shorter = _in_middle(curve, _extrapolated(earlier, near, parameter), parameter)
        if not 0.0 < shorter < length:
            break
        earlier = near if abs(left) > _APART * curve.family.unit else earlier
        far, far_length, near, length = near, length, following, shorter
    return appended(point, near), earlier


def _in_middle(curve: Continuation, state: State, parameter: float) -> tuple[Point, float]:
    """The motion in the middle of the family near a state, at a parameter; and the length of the family."""
    moved = _begun(curve, state, parameter)
    room = room_of(curve.family.map_at(parameter), moved.motion)
    if room is None:
        return moved, 0.0
    middle = State(moved.state + room[0], moved.motion.end.auxiliary_pieces)
    return _begun(curve, middle, parameter), room[1]


def _begun(curve: Continuation, state: State, parameter: float, *, upward: bool = True) -> Point:
    """The motion near a state; of a symmetric driveline the symmetric one, if it is that near.

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


def _extrapolated(earlier: Point, point: Point, parameter: float) -> State:
    """The state at a parameter on the straight line through two points; that of the second if they share theirs."""
    change = point.parameter - earlier.parameter
    if change == 0.0:
        return State(point.state, point.motion.end.auxiliary_pieces)
    slope = (point.state - earlier.state) / change
    return State(point.state + (parameter - point.parameter) * slope, point.motion.end.auxiliary_pieces)
