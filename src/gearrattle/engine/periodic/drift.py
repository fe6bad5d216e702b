"""How an event of a branch moves with a number of the driveline: its gradient, by implicit differentiation.

An event is a point of the branch at which a test function vanishes (``events``). Let q be the number. In the plane
through the event at right angles to the branch the motion moves by w_q, its parameter by p_q, its test function by
tau_q; along the branch the test function has the slope tau_s. So the event moves along the branch by
s_q = - tau_q / tau_s, and

    dp / dq = p_q + T_p s_q,      T_p: the tangent's part along the parameter.

At a fold T_p is zero, and this is - psi P_q / psi P_p, psi the left null vector of I - M. Differences are central;
the quantities differenced (motions, determinants, the depth of a touch) are exact. Beside a grazing, where determinants
have a root, they are taken over shorter steps. On the touching side of a grazing the motions vary with the square root
of the depth. So the gradient is taken on the other side, at three distances, and extrapolated to distance zero by a
parabola.

Takes an event and the families on both sides of q; gives a derivative.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events import DOUBLING, FOLD, GRAZING, NEIMARK_SACKER, TESTS, Event
from gearrattle.engine.periodic.family import Family
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.periodic.touch import depth
from gearrattle.engine.periodic.unit_circle import pair_product
from gearrattle.errors import ConvergenceError

KINDS = (FOLD, DOUBLING, NEIMARK_SACKER, GRAZING)
"""Kinds of events that have a gradient."""
ALONG = 1e-5  # arclength from an event to the points of the central difference along the branch
_CHANGE = 1e-5  # of q: half the difference
_SHARES = (1.0, 0.1, 0.01, 0.001)  # of both, the first over which the test function is straight
_BENT = 0.01  # a test function that bends less is straight
_APART, _CHANGE_APART = (1e-4, 3e-5), 1e-6
"""Arclengths from a grazing to where its gradient is taken, and half the difference of q there: no motion may touch."""

FamiliesOf = Callable[[float], tuple[Family, Family]]


def gradient_of(event: Event, curve: Continuation, families_of: FamiliesOf, value: float) -> float:
    """Return dp / dq of an event.

    Parameters
    ----------
    event
        of one of the ``KINDS``.
    curve
        the Continuation of its branch.
    families_of
        gives the driveline with q smaller, and with q larger, by a change [SI].
    value
        of q [SI], not zero.

    Raises
    ------
    ConvergenceError
        there is no motion near the event.
    ValueError
        the kind of event has no test function, or the gradient jumps there.
    """
    if event.kind not in KINDS or event.is_collision:
        raise ValueError(f"the gradient of an event of the kind {event.kind} is not known")
    if event.kind != GRAZING:
        for share in _SHARES:
            slope, bend = slope_along(event, event.point, curve, share * ALONG)
            if bend <= _BENT:
                change = share * _CHANGE * abs(value)
                return _gradient_at(event, event.point, curve, families_of(change), (slope, change))
        raise ConvergenceError("a grazing lies too near to the event")
    change, points = _CHANGE_APART * abs(value), _apart(event, curve)
    families = families_of(change)
    one, two, three = (
        _gradient_at(event, point, curve, families, (slope_along(event, point, curve, ALONG)[0], change))
        for point in points
    )
    return 3.0 * one - 3.0 * two + three


def slope_along(event: Event, point: Point, curve: Continuation, along: float) -> tuple[float, float]:
    """Return the slope of the test function along the branch, and how much it bends at an event, where it is zero.

    That is the difference of the slopes on both sides over their sum: large beside a grazing, where there is a root.
    """
    behind, ahead = (test_of(event, curve.family, curve.moved_along(point, side * along)) for side in (-1.0, 1.0))
    return (ahead - behind) / (2.0 * along), abs(ahead + behind) / max(abs(ahead - behind), np.finfo(float).tiny)


def _gradient_at(
    event: Event, point: Point, curve: Continuation, families: tuple[Family, Family], of: tuple[float, float]
) -> float:
    """The derivative of the parameter at which the test function has the value that it has at a point.

    ``of``: the slope of the test function along the branch, and half the difference of q.
    """
    slope, change = of
    shifted = [curve.of(family).in_plane(point) for family in families]
    tests = [test_of(event, family, other) for family, other in zip(families, shifted, strict=True)]
    test_slope = (tests[1] - tests[0]) / (2.0 * change)
    shift = (shifted[1].parameter - shifted[0].parameter) / (2.0 * change)
    return float(shift - point.tangent[-1] * curve.family.unit * test_slope / slope)


def _apart(event: Event, curve: Continuation) -> list[Point]:
    """Three points on the side of a grazing without contact, at even distances, with no other event between them."""
    for step in (side * distance for distance in _APART for side in (1.0, -1.0)):
        points = [curve.moved_along(event.point, times * step) for times in (1, 2, 3)]
        if test_of(event, curve.family, points[0]) < 0.0 and len({point.word for point in points}) == 1:
            return points
    raise ConvergenceError("the motions on both sides of the grazing touch, or touch something else")


def test_of(event: Event, family: Family, point: Point) -> float:
    """Return the test function of an event, at a point nearby."""
    if event.kind == GRAZING:
        assert event.touch is not None
        return depth(family.map_at(point.parameter), point.motion.start, event.touch)[0]
    if event.kind == NEIMARK_SACKER:
        return pair_product(point, event.point)
    test: Callable[[Point], float] = TESTS[event.kind]
    return test(point)
