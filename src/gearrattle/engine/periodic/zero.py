"""Where a test function changes its sign between two points of a branch.

Takes a Continuation, two of its Points and a function of Points; gives a Point.
"""

from __future__ import annotations

from collections.abc import Callable

from scipy.optimize import brentq

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.periodic.stretch import Stretch

_JUMP = 1e-3  # a test function that stays farther from zero than this on both sides jumps over zero
_CHECKS = 6  # searches for one zero
_ROUGHER = 10.0  # times as far off as the motion at a zero: the sign at a trial is checked


def zero_between(
    curve: Continuation, before: Point, after: Point, test: Callable[[Point], float]
) -> tuple[Point, bool]:
    """Return the point where a test function changes its sign, and whether it jumps over zero there.

    Parameters
    ----------
    curve
        the Continuation of the branch.
    before, after
        points that follow one another, with values of different signs.
    test
        the function.

    Raises
    ------
    ConvergenceError
        the branch cannot be followed in between.
    """
    stretch = Stretch(curve, before, after)
    sides: dict[float, float] = {0.0: test(before), 1.0: test(after)}
    errors = {0.0: 0.0, 1.0: 0.0}

    def value(share: float) -> float:
        if share in sides:
            return sides[share]
        point = stretch.at(share, is_trial=True)
        value = test(point)
        nearest = min(abs(other - share) for other, at_other in sides.items() if at_other * value <= 0.0)
        sides[share], errors[share] = value, point.error
        return value if nearest * stretch.distance > point.error else 0.0  # nearer than the motion itself is known

    for _ in range(_CHECKS):
        share = float(brentq(value, 0.0, 1.0, xtol=stretch.located, rtol=1e-14))
        point = stretch.at(share)
        other = _other_side(sides, share, test(point))
        if errors[other] <= _ROUGHER * point.error:
            break
        sides[other], errors[other] = test(stretch.at(other)), 0.0  # a trial so far, whose sign may be wrong
    nearest = [sides[other] for other in sorted(sides, key=lambda other: abs(other - share))[:4]]
    return point, min(map(abs, nearest)) > _JUMP and min(nearest) < 0.0 < max(nearest)


def _other_side(sides: dict[float, float], share: float, value: float) -> float:
    """The nearest share at which a test function has another sign than the value at this one."""
    return min((other for other, at_other in sides.items() if at_other * value <= 0.0), key=lambda o: abs(o - share))
