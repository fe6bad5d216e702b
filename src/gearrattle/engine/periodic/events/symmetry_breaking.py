"""Breakings: a branch of symmetric motions, or of motions of half the length, is crossed by a branch of other motions.

The former are the fixed points of a map H over half of their length. For an even number of periods n, H is the map over
n / 2 periods; for an odd number and a symmetric driveline it is the half-period map (``symmetry``). In both cases
P = H(H(y)). Where a multiplier of H is -1, the period doubles or the symmetry breaks; I - DH is regular there, and the
branch of H continues smoothly. P has a multiplier 1 there, and branches of its fixed points cross: with a residual r of
P the motion is known only to the cube root of r, and the event to its square.

This file has the test function; ``events_of_step`` finds where it changes its sign, and ``location`` locates the event.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.location import zero_between
from gearrattle.engine.periodic.events.period_doubling import det_plus, nearest_to_minus_one
from gearrattle.engine.periodic.families import are_symmetric, half_of
from gearrattle.engine.periodic.multiplier_counts import nearest_to, not_free
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

SAME = 1e-4
"""Distance [w], the cube root of the residual, within which a motion is the same as a fixed point of H."""
_NEARER = (1.0, 0.1, 0.01)  # shares of a distance in which a breaking is sought
_ALONG = 0.999999  # least cosine between the tangents of a motion and of a fixed point of H that are equal


def half_curve(curve: Continuation, parameter: float) -> Continuation | None:
    """Return the Continuation of the fixed points of H; None if H does not exist."""
    family = curve.family
    if family.cycles % 2 == 1 and not are_symmetric(family, parameter):
        return None
    return curve.of(half_of(family))


def as_doubling(curve: Continuation, point: Point) -> tuple[Continuation, Point] | None:
    """Return the Continuation of H and the motion whose period doubles at a point; None if there is none.

    At such a point a branch of twice the period, or without symmetry, joins the branch of H.
    """
    halves = half_curve(curve, point.parameter)
    if halves is None:
        return None
    at_parameter = np.append(np.zeros(len(point.state)), 1.0)
    try:
        own = halves.near(point.w, at_parameter, replace(point, tangent=at_parameter, later=None))
    except ConvergenceError:
        return None
    is_near = float(np.linalg.norm(own.w - point.w)) < SAME
    own_distance, distance = (nearest_to_minus_one(one)[1] for one in (own, point))
    return (halves, own) if is_near and own_distance < distance else None


def as_fixed_point(curve: Continuation, point: Point, *, upward: bool) -> Point:
    """Return the symmetric motion that equals ``point`` except for rounding; if there is none, the point itself.

    Near a breaking P determines the motion only to the cube root of its residual, and its tangent may have any
    direction.
    """
    is_odd = curve.cycles % 2 == 1
    halves = half_curve(curve, point.parameter) if is_odd and not point.free else None
    if halves is None:
        return point
    at_parameter = np.append(np.zeros(len(point.state)), 1.0 if upward else -1.0)
    try:
        own = halves.near(point.w, at_parameter, replace(point, tangent=at_parameter, later=None))
        is_known = float(own.tangent @ point.tangent) > _ALONG
        if is_known or float(np.linalg.norm(own.w - point.w)) > SAME:
            return point
        motion, slope = curve.family.follow(own.motion.start, point.parameter)
    except ConvergenceError:
        return point
    return replace(own, motion=motion, slope=slope, parameter=point.parameter, length=point.length, orientation=0.0)


def breaking_between(curve: Continuation, before: Point, after: Point) -> Point | None:
    """Return the fixed point of H between two others at which one of its multipliers is -1; None if there is none."""
    halves = half_curve(curve, before.parameter)
    if halves is None:
        return None
    try:
        first = _among(halves, before)
        last = _among(halves, after)
        away = max(float(np.linalg.norm(own.w - whole.w)) for own, whole in ((first, before), (last, after)))
        if away > SAME or det_plus(first) * det_plus(last) >= 0.0:
            return None
        breaking, _ = zero_between(halves, first, last, det_plus)
        motion, slope = curve.family.follow(breaking.motion.start, breaking.parameter)
    except ConvergenceError:
        return None
    return replace(breaking, motion=motion, slope=slope, orientation=before.orientation, free=before.free)


def breaking_near(curve: Continuation, point: Point, farthest: float) -> Point | None:
    """Return the nearest fixed point of H at which one of its multipliers is -1; None if none is near."""
    halves = half_curve(curve, point.parameter)
    if halves is None:
        return None
    try:
        image = halves.family.follow(point.motion.start, point.parameter)[0].end
        middle = 0.5 * (point.state + image.y) * point.scale / point.size
        at_parameter = np.append(np.zeros(len(middle)), 1.0)
        centre = halves.near(np.append(middle, point.w[-1]), at_parameter, replace(point, later=None))
        for share in _NEARER:  # the multiplier does not show two breakings at this distance
            before, after = (halves.moved_along(centre, side * share * farthest) for side in (-1.0, 1.0))
            breaking = breaking_between(curve, before, replace(after, length=2.0 * share * farthest))
            if breaking is not None:
                return breaking
    except ConvergenceError:
        return None
    return None


def _among(halves: Continuation, point: Point) -> Point:
    """The fixed point of H near a motion."""
    return replace(halves.in_plane(replace(point, later=None)), length=point.length)


def det_minus(point: Point) -> float:
    """Return det(I - M), without the factors of free directions: zero where a multiplier is 1."""
    return float(np.prod(1.0 - not_free(point)).real)


def nearest_to_one(point: Point) -> tuple[complex, float]:
    """Return the multiplier nearest to 1, without free directions, and its distance; infinity without one."""
    return nearest_to(1.0, not_free(point))
