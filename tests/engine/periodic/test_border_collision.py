"""Where the gradient jumps a branch folds, doubles or goes on: the piecewise-linear normal form, in closed form.

    x -> A x + mu b,      A = [[tau, 1], [-delta, 0]],      b = (1, 0),

with other tau, delta for x_1 < 0 and for x_1 > 0, has the fixed points x_1 = mu / (1 - tau + delta), x_2 = -delta x_1,
those that lie on their own side. Both meet in the border x_1 = 0 at mu = 0, where the gradient jumps: they vanish there
(*fold*) if det(I - A) = 1 - tau + delta has another sign on both sides, and the motion of twice the period begins there
if det(I + A) = 1 + tau + delta has.

M. di Bernardo, C. J. Budd, A. R. Champneys, P. Kowalczyk, Piecewise-smooth Dynamical Systems, Springer 2008, chapter 3.
"""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import DOUBLING, FOLD, GRAZING, Event
from gearrattle.engine.periodic.events.events_of_step import events_between
from gearrattle.engine.periodic.families import Family
from gearrattle.engine.periodic.motion import Pass, State, Touch
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.system.crossings_in_order import Passages

LEFT = (0.5, 0.2)
VANISHES, DOUBLES, GOES_ON = (2.0, 0.3), (-1.6, 0.3), (0.9, 0.4)
"""tau and delta on the right: det(I - A) < 0, det(I + A) < 0, none of both."""


class NormalForm(Family):
    """The normal form as the map of a driveline in which a slider slips while x_1 > 0."""

    def __init__(self, right: tuple[float, float]) -> None:
        self.sides = LEFT, right
        self.scale, self.size, self.cycles, self.unit, self.clearances = np.ones(2), 1.0, 1, 1.0, 0

    def gradient(self, x: np.ndarray) -> np.ndarray:
        tau, delta = self.sides[int(x[0] > 0.0)]
        return np.array([[tau, 1.0], [-delta, 0.0]])

    def fixed_point(self, side: int, mu: float) -> np.ndarray:
        tau, delta = self.sides[side]
        return np.array([1.0, -delta]) * mu / (1.0 - tau + delta)

    def map_at(self, parameter: float) -> Any:
        del parameter
        return SimpleNamespace(system=SimpleNamespace(clearances=(), auxiliaries=[SimpleNamespace(kind="slider")]))

    def follow(
        self, state: State, parameter: float, touch: Touch | None = None, turns_along: np.ndarray | None = None
    ) -> tuple[Pass, np.ndarray]:
        del touch, turns_along
        x, gradient, b = state.y, self.gradient(state.y), np.array([1.0, 0.0])
        root = np.sqrt(max(x[0], 0.0))  # two crossings in the middle of the period meet at velocity zero
        times = np.array([0.5 - 0.1 * root, 0.5 + 0.1 * root])[: 2 * int(root > 0.0)]
        ups, watches = np.array([1, 0])[: times.size], np.zeros(times.size, np.int64)
        crossings = Passages(times, watches, ups, root * (2.0 * ups - 1.0), np.zeros((times.size, 0)))
        end = State(gradient @ x + parameter * b)
        return Pass(state, end, gradient, np.zeros(0), crossings, 1.0, 1), b


def followed(family: NormalForm) -> tuple[list[Point], list[Event]]:
    curve = Continuation(family)
    begin = curve.begin(State(family.fixed_point(0, -1.0)), -1.0)
    points = [begin, *curve.follow(begin, -1.0, 1.0)]
    return points, [event for pair in pairwise(points) for event in events_between(curve, *pair)]


@pytest.mark.parametrize(
    ("right", "kinds"), [(VANISHES, [GRAZING, FOLD]), (DOUBLES, [GRAZING, DOUBLING]), (GOES_ON, [GRAZING])]
)
def test_in_a_border_collision_what_happens_is_what_the_determinants_say(
    right: tuple[float, float], kinds: list[str]
) -> None:
    family = NormalForm(right)
    points, events = followed(family)
    assert [event.kind for event in events] == kinds
    assert [event.is_collision for event in events] == [False, True][: len(kinds)]
    assert events[0].grazing is not None
    assert events[0].grazing.kind == "jump"
    for event in events:
        assert event.point.parameter == pytest.approx(0.0, abs=1e-10)
        np.testing.assert_allclose(event.point.state, 0.0, rtol=0, atol=1e-10)
    assert points[-1].parameter == (-1.0 if FOLD in kinds else 1.0)
    for point in points:
        side = int(point.state[0] > 0.0)
        np.testing.assert_allclose(point.state, family.fixed_point(side, point.parameter), rtol=0, atol=1e-11)
    assert {int(point.state[0] > 0.0) for point in points} == {0, 1}
