"""Where symmetric motions lose their symmetry, located on the branch of symmetric motions alone.

The symmetric motions of a symmetric driveline are the fixed points of its half-period map H (``symmetry``). Where
their symmetry breaks a multiplier of H is -1, and I - DH is regular: their branch goes on smoothly. The whole period
map has a multiplier 1 there. Three of its branches cross, and to a residual r the motion is known to the cube root of
r alone, the place to its square.

Takes a Continuation of whole periods and two of its Points; gives a Point.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.family import Family
from gearrattle.engine.periodic.period_map import Along, Pass, State
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.periodic.symmetry import HalfPeriodMap, is_symmetric
from gearrattle.engine.periodic.touch import Touch
from gearrattle.engine.periodic.zero import zero_between
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

_SYMMETRIC = 1e-4  # of w: motions of the branch nearer than this to a symmetric one are symmetric


class HalfPeriodFamily(Family):
    """The half-period map of a family of symmetric drivelines; its motions are without turning points.

    Parameters
    ----------
    whole
        the family over all periods, an odd number.
    """

    def __init__(self, whole: Family) -> None:
        self._whole, self._half = whole, whole.part(0.0, 0.5 * whole.cycles)
        self.scale, self.size, self.unit = whole.scale, whole.size, whole.unit
        self.cycles, self.clearances, self.memories = whole.cycles, whole.clearances, whole.memories

    def map_at(self, parameter: float) -> HalfPeriodMap:
        """Return the half-period map of one driveline."""
        return HalfPeriodMap(self._whole.map_at(parameter).system, self.cycles)

    def follow(
        self, state: State, parameter: float, touch: Touch | None = None, turns_along: Array | Along | None = None
    ) -> tuple[Pass, Array]:
        """Follow a state over half of its periods, and mirror it; see ``Family.follow``.

        Raises
        ------
        NotImplementedError
            a touch or turning points are asked for.
        """
        if touch is not None or turns_along is not None:
            raise NotImplementedError
        motion, slope = self._half.follow(state, parameter)
        if motion.end.auxiliary_pieces is None:
            end = State(-motion.end.y)
        else:
            end = self.map_at(parameter).mirrored(motion.end)
        return replace(motion, end=end, gradient=-motion.gradient, turned=-motion.turned), -slope


def symmetric_curve(curve: Continuation, parameter: float) -> Continuation | None:
    """Return what follows the symmetric motions alone; None where a driveline is not symmetric.

    Parameters
    ----------
    curve
        follows all motions.
    parameter
        of the driveline.
    """
    family = curve.family
    if family.cycles % 2 == 0 or not is_symmetric(family.map_at(parameter).system):
        return None
    return curve.of(HalfPeriodFamily(family))


def breaking_between(curve: Continuation, before: Point, after: Point) -> Point | None:
    """Return the motion between two others at which the symmetry breaks; None where it does not.

    Parameters
    ----------
    curve
        the Continuation of the branch.
    before, after
        points that follow one another.
    """
    symmetric = symmetric_curve(curve, before.parameter)
    if symmetric is None:
        return None
    try:
        first, last = _symmetric(symmetric, before), _symmetric(symmetric, after)
        away = max(float(np.linalg.norm(own.w - whole.w)) for own, whole in ((first, before), (last, after)))
        if away > _SYMMETRIC or _doubling(first) * _doubling(last) >= 0.0:
            return None
        breaking, _ = zero_between(symmetric, first, last, _doubling)
        motion, slope = curve.family.follow(breaking.motion.start, breaking.parameter)
    except ConvergenceError:
        return None
    return replace(breaking, motion=motion, slope=slope, orientation=before.orientation, free=before.free)


def breaking_near(curve: Continuation, point: Point, farthest: float) -> Point | None:
    """Return the motion nearest to a nearly symmetric one at which the symmetry breaks; None where none is near.

    Parameters
    ----------
    curve
        the Continuation of the branch.
    point
        a motion of it.
    farthest
        arclength of the symmetric motions on either side.
    """
    symmetric = symmetric_curve(curve, point.parameter)
    if symmetric is None:
        return None
    try:
        mirrored = symmetric.family.follow(point.motion.start, point.parameter)[0].end
        middle = 0.5 * (point.state + mirrored.y) * point.scale / point.size
        normal = np.append(np.zeros(len(middle)), 1.0)
        whole = replace(point, later=None)
        centre = symmetric.near(np.append(middle, point.w[-1]), normal, whole)
        before, after = (symmetric.moved_along(centre, side * farthest) for side in (-1.0, 1.0))
    except ConvergenceError:
        return None
    return breaking_between(curve, before, replace(after, length=2.0 * farthest))


def _symmetric(symmetric: Continuation, point: Point) -> Point:
    """A motion among the symmetric ones alone."""
    return replace(symmetric.in_plane(replace(point, later=None)), length=point.length)


def _doubling(point: Point) -> float:
    """det(I + DH)."""
    return float(np.prod(1.0 + point.multipliers).real)
