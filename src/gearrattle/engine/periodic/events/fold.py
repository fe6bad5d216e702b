"""Folds: the parameter turns back, T_p = 0, where T_p is the tangent's part along the parameter; a multiplier passes 1.

The sign change of T_p is found by ``events_of_step`` and located by ``location.zero_between``.
"""

from __future__ import annotations

import numpy as np

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.point import Point

VERTICAL = 1e-9
"""Below this |T_p| is rounding: the branch is vertical there, or folds."""
_HALVINGS = 12  # most halvings of a step in which a hidden fold is sought


def along_parameter(point: Point) -> float:
    """Return T_p."""
    return float(point.tangent[-1])


def is_vertical(before: Point, after: Point) -> bool:
    """Return whether a step of a branch is vertical: the parameter stays, and a multiplier stays at 1.

    A vertical part may end in a motion that grazes. A step from that motion counts as vertical too: beyond it the
    branch may go either way, so the signs of the test functions at that motion are rounding.
    """
    ends = [(abs(along_parameter(point)) < VERTICAL, point.touch is not None) for point in (before, after)]
    return all(vertical for vertical, _ in ends) or any(vertical and grazes for vertical, grazes in ends)


def hidden_fold(curve: Continuation, before: Point, after: Point) -> Point | None:
    """Return a point of a step at which T_p has the other sign than at both ends; None if no such point is found."""
    if is_vertical(before, after):
        return None
    for _ in range(_HALVINGS):
        if not _goes_back(before, after):
            return None
        middle = curve.between(before, after, 0.5)
        if along_parameter(middle) * along_parameter(before) < 0.0:
            return middle
        before, after = (before, middle) if _goes_back(before, middle) else (middle, after)
    return None


def _goes_back(before: Point, after: Point) -> bool:
    """Whether T_p has one sign at both ends of a step, and the other in the middle of the cubic through the ends."""
    first = along_parameter(before)
    last = along_parameter(after)
    chord = after.w - before.w
    middle = 1.5 * float(chord[-1]) - 0.25 * (first + last) * float(np.linalg.norm(chord))
    return first * last > 0.0 and first * middle < 0.0
