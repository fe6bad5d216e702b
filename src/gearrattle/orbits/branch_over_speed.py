"""Further motions of a driveline on the branches over the speed through known ones.

A driveline with clearances folds over the speed near its resonances, so the branch through one motion mostly comes back
to the same speed with others.

Takes a Model and Passes; gives Passes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.period_map import Pass
from gearrattle.errors import ConvergenceError
from gearrattle.model import Model
from gearrattle.orbits.over_value import family_of
from gearrattle.orbits.through_families import followed_through_families

_PATH = "excitation.speed"
_SPAN = 0.6  # of the speed, to both sides
_STEP = 0.05
_POINTS = 600  # of one branch
_ALL_POINTS = 6000  # of all branches


class OverSpeed:
    """What follows motions over the speed.

    Parameters
    ----------
    model
        the driveline.
    cycles
        periods T that its motions last.
    at_point
        called at every point of a branch; an exception from it ends the work.

    Attributes
    ----------
    points
        how many points have been followed.
    left
        how many branches were not followed to their ends.
    """

    def __init__(self, model: Model, cycles: int, at_point: Callable[[], None] | None = None) -> None:
        self._speed, self._at_point = model.excitation.omega, at_point
        self._span = _SPAN * self._speed
        self._curve = Continuation(family_of(model, _PATH, self._speed, cycles, self._span), longest=_STEP)
        self.points, self.left = 0, 0

    @property
    def is_used_up(self) -> bool:
        """Whether no further points are followed."""
        return self.points >= _ALL_POINTS

    def met_again(self, motion: Pass) -> Iterator[Pass]:
        """Yield the further motions at the model's speed on the branch through a motion."""
        for upward in (True, False):
            yield from self._one_way(motion, upward)

    def _one_way(self, motion: Pass, upward: bool) -> Iterator[Pass]:
        speed, ends = self._speed, (self._speed - self._span, self._speed + self._span)
        if self.is_used_up:
            return
        last = self.points + _POINTS
        try:
            before = self._curve.begin(motion.start, speed, upward=upward)
            for point, _ in followed_through_families(self._curve, before, ends):
                if (before.parameter - speed) * (point.parameter - speed) < 0.0:
                    yield self._curve.at_parameter(before, point, speed).motion
                before = point
                self.points += 1
                if self._at_point is not None:
                    self._at_point()
                if self.points >= last or self.is_used_up:
                    self.left += 1
                    return
        except ConvergenceError:
            self.left += 1
