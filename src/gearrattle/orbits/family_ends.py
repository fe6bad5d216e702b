"""Where a family of motions ends: its edges meet there, at a value of the parameter.

The length of a family, from edge to edge, is smooth in the parameter. Its zero is sought by the secant method among the
motions in the middle, always from inside: at the end I - M is singular beyond the free direction.

Takes a Continuation and a motion of a family; gives the last motion of it, also in a changed driveline.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.drift import FamiliesOf
from gearrattle.engine.periodic.events import Event
from gearrattle.engine.periodic.period_map import State
from gearrattle.engine.periodic.point import Point, turned_around
from gearrattle.engine.periodic.shooting import shoot
from gearrattle.engine.periodic.symmetry import half_period_map
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.families import room_of, touches_lightly, within_family

Array = NDArray[np.float64]

EDGE = "end of a family"
"""Kind of event: the edges of a family meet."""
LEAST = 1e-7  # of the largest corner: what is shorter is no family, such as the memory of a slider that is let go
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


@dataclass(frozen=True)
class Line:
    """States over the parameter, on a straight line.

    Attributes
    ----------
    state, parameter
        of a motion on it.
    slope
        (N,) of the state over the parameter [SI].
    """

    state: State
    parameter: float
    slope: Array

    def at(self, parameter: float) -> State:
        """Return the state at a parameter."""
        return State(self.state.y + (parameter - self.parameter) * self.slope, self.state.auxiliary_pieces)


def tangent_line(curve: Continuation, point: Point) -> Line:
    """Return the tangent of a branch at a point; where that is nearly upright, the same state all along."""
    slope, unit = point.tangent[:-1] * point.size / point.scale, curve.family.unit
    is_upright = abs(float(point.tangent[-1])) < _UPRIGHT
    slope = np.zeros_like(slope) if is_upright else slope / point.tangent[-1] / unit
    return Line(state_of(point), point.parameter, slope)


def state_of(point: Point) -> State:
    """Return the state in which the motion of a point begins."""
    return State(point.state, point.motion.end.auxiliary_pieces)


def _through(earlier: Point, point: Point) -> Line:
    """The line through two motions."""
    slope = (point.state - earlier.state) / (point.parameter - earlier.parameter)
    return Line(state_of(point), point.parameter, slope)


def end_near(curve: Continuation, line: Line, way: float) -> tuple[Point, Line]:
    """Return the last motion of a family in a direction of the parameter, and a line through its middle there.

    Where rounding hides the family before its length is zero, the end is extrapolated, and the motion is the last one.
    Its tangent is along the motions in the middle: that of a motion of a family does not tell where these go.

    Parameters
    ----------
    curve
        the Continuation of the driveline.
    line
        near motions of the family. At its parameter is one of the family, or one near its end.
    way
        the direction, 1 or -1.

    Raises
    ------
    ConvergenceError
        no family ends near.
    """
    near, length = _inside(curve, line, (0.0, *_BACK), way, LEAST * curve.family.size)
    line = replace(line, state=state_of(near), parameter=near.parameter)
    steepest = float(np.linalg.norm(line.slope * near.scale)) * curve.family.unit
    far, far_length = _inside(curve, line, (min(_BACK[0], _WITHIN * length / max(steepest, length)),), way, length)
    middle, share, unit = _through(far, near), _NEARER, curve.family.unit
    for _ in range(_STEPS):
        left = (near.parameter - far.parameter) * length / (far_length - length)
        if abs(left) < _LOCATED * unit:
            return _last_at(near, left, middle, curve)
        parameter = near.parameter + (1.0 - share) * left
        following, shorter = near, 0.0
        with suppress(ConvergenceError):  # too far from a middle that does not move evenly
            following, shorter = in_middle(curve, middle.at(parameter), parameter)
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
        far, far_length, near, length = near, length, following, shorter
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
    middle = State(inside.state + room[0], inside.motion.end.auxiliary_pieces)
    return begun(curve, middle, parameter), room[1]


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
    """Return the end of a family in a changed driveline.

    Parameters
    ----------
    event
        where it was.
    curve
        the Continuation of the changed driveline, in the units of the event's point.
    change
        (N + 1,) predicted change of w, in these units.

    Raises
    ------
    ConvergenceError
        no family ends near.
    """
    point = event.point
    state = State(point.state + change[:-1] * point.size / point.scale, point.motion.end.auxiliary_pieces)
    line = replace(tangent_line(curve, point), state=state, parameter=point.parameter + change[-1] * curve.family.unit)
    for way in (1.0, -1.0):
        with suppress(ConvergenceError):
            return replace(event, point=end_near(curve, line, way)[0])
    raise ConvergenceError("no family ends near")


def slope_of_length(point: Point, curve: Continuation) -> float:
    """Return the slope of the length of a family over the parameter at its end [SI], by a parabola; NaN: not known."""
    line, step = tangent_line(curve, point), _ALONG * curve.family.unit
    for way in (1.0, -1.0):
        with suppress(ConvergenceError):
            near, far = (_inside(curve, line, (share * _ALONG,), way, 0.0)[1] for share in (1.0, 2.0))
            return -way * (4.0 * near - far) / (2.0 * step)
    return np.nan


def gradient_of_end(event: Event, curve: Continuation, families_of: FamiliesOf, value: float) -> float:
    """Return dp / dq of the end of a family by a central difference; parameters are those of ``drift.Drift``.

    Raises
    ------
    ConvergenceError
        the end moves too fast: it turns back over q near.
    """
    unchanged, rounding = np.zeros_like(event.point.w), _KNOWN * curve.family.unit
    for change in (share * abs(value) for share in _CHANGES):
        with suppress(ConvergenceError):
            ends = [end_again(event, curve.of(family), unchanged).point.parameter for family in families_of(change)]
            behind, ahead = event.point.parameter - ends[0], ends[1] - event.point.parameter
            if abs(ahead - behind) <= max(_BENT * abs(ahead + behind), rounding):
                return (ahead + behind) / (2.0 * change)
    raise ConvergenceError("the end of the family turns back over the number near")
