"""Motions between two successive points of a branch, and the zero of a test function between them.

Every motion of the stretch lies in a plane at right angles to its chord, as in ``Continuation.between``. Where the
branch turns back at a corner such planes miss it or meet it twice; there they are at right angles to the sum of the
tangents at both ends. A motion is predicted by the cubic through the two nearest known motions. So the more closely an
event is enclosed, the fewer iterations a motion takes: one at the end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.motion import Touch
from gearrattle.engine.periodic.point import Point, interpolated

Array = NDArray[np.float64]

_LOCATED = 1e-13  # accuracy of an event, as a share of the step and as arclength
_SLACK = 0.1  # error of w in a trial, over the square of the distance to the nearest known motion
_LEAST_ALONG = 0.02  # least cosine between normal and tangent for a prediction along the tangent
_TURNED_BACK = -0.1  # cosine between chord and tangent below which the branch has turned back
_CLOSER = 0.25  # largest shift of the cubic along the branch to the plane, over the distance of its two motions
_FARTHEST = 2.0  # distances between the two nearest motions up to which their cubic is better than a tangent
_JUMP = 1e-3  # a test function whose modulus is larger on both sides jumps over zero
_CHECKS = 6  # most searches for one zero
_ROUGHER = 10.0  # ratio of the errors of a trial and of the motion at a zero above which the sign is checked


class Stretch:
    """Motions between two points, by their share of the step.

    distance: between both points [w].
    located: accuracy of an event as a share of the step: motions are not more accurate in arclength.
    """

    def __init__(self, curve: Continuation, before: Point, after: Point) -> None:
        self._curve = curve
        self.before = before
        self.after = after
        self._known: list[tuple[float, Point]] = [(0.0, before), (1.0, after)]
        self.distance = float(np.linalg.norm(after.w - before.w))
        self.located = min(0.1, _LOCATED * max(1.0, 1.0 / (after.length - before.length)))
        self._normal = _normal_between(before, after)

    def at(
        self,
        share: float,
        *,
        is_trial: bool = False,
        touch: Touch | None = None,
        among: Callable[[Point], bool] | None = None,
    ) -> Point:
        """Return the motion at a share of the step.

        among: condition on the motions used for the prediction; None: all are used.
        """
        known = [one for one in self._known if among is None or among(one[1])]
        known.sort(key=lambda one: abs(one[0] - share))
        nearest, point = known[0]
        predicted = self._predicted(share, known)
        slack = _SLACK * (self.distance * (share - nearest)) ** 2 if is_trial else 0.0
        following = self._curve.near(predicted, self._normal, point, slack=slack, touch=touch)
        length = self.before.length + share * (self.after.length - self.before.length)
        following = self._curve.on_the_way(self.before, replace(following, length=length), self.after)
        self._known.append((share, following))
        return following

    def _predicted(self, share: float, known: list[tuple[float, Point]]) -> Array:
        """(N + 1,) a prediction in the plane of a share, from known motions, the nearest first."""
        nearest, point = known[0]
        target = interpolated(self.before, self.after, share)
        w = point.w
        apart = abs(known[1][0] - nearest) if len(known) > 1 else 0.0
        if apart > 0.0 and abs(share - nearest) <= _FARTHEST * apart:
            (low, lower), (high, upper) = sorted(known[:2], key=lambda one: one[0])
            own = (share - low) / (high - low)
            length = float(self._normal @ (upper.w - lower.w))
            w = interpolated(lower, upper, own)
            change = float(self._normal @ (target - w))
            if abs(change) < _CLOSER * length:
                w = interpolated(lower, upper, own + change / length)
        along = float(self._normal @ point.tangent)
        way = point.tangent / along if along > _LEAST_ALONG else self._normal  # at a corner of the branch
        return np.asarray(w + float(self._normal @ (target - w)) * way)


def _normal_between(before: Point, after: Point) -> Array:
    """(N + 1,) the direction of a branch from one point to the other."""
    chord = (after.w - before.w) / np.linalg.norm(after.w - before.w)
    if min(float(chord @ point.tangent) for point in (before, after)) >= _TURNED_BACK:
        return np.asarray(chord)
    both = before.tangent + after.tangent
    return np.asarray(both / np.linalg.norm(both))


def zero_between(
    curve: Continuation, before: Point, after: Point, test: Callable[[Point], float]
) -> tuple[Point, bool]:
    """Return the point where a test function changes its sign, and whether it jumps over zero there."""
    stretch = Stretch(curve, before, after)
    sides: dict[float, float] = {0.0: test(before), 1.0: test(after)}
    errors = {0.0: 0.0, 1.0: 0.0}

    def value(share: float) -> float:
        if share in sides:
            return sides[share]
        point = stretch.at(share, is_trial=True)
        value = test(point)
        nearest = min(abs(other - share) for other, at_other in sides.items() if at_other * value <= 0.0)
        sides[share] = value
        errors[share] = point.error
        return value if nearest * stretch.distance > point.error else 0.0  # within the error of the motion

    for _ in range(_CHECKS):
        share = float(brentq(value, 0.0, 1.0, xtol=stretch.located, rtol=1e-14))
        point = stretch.at(share)
        other = _other_side(sides, share, test(point))
        if errors[other] <= _ROUGHER * point.error:
            break
        sides[other] = test(stretch.at(other))
        errors[other] = 0.0  # a trial, whose sign may be wrong
    nearest = [sides[other] for other in sorted(sides, key=lambda other: abs(other - share))[:4]]
    return point, min(map(abs, nearest)) > _JUMP and min(nearest) < 0.0 < max(nearest)


def _other_side(sides: dict[float, float], share: float, value: float) -> float:
    """The nearest share at which a test function has another sign than the value at this one."""
    return min((other for other, at_other in sides.items() if at_other * value <= 0.0), key=lambda o: abs(o - share))
