"""What is located between two points of a branch, by families whose branches and multipliers are written down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import cosh, hypot, sinh

import numpy as np
import pytest

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events import DOUBLING, FOLD, events_between
from gearrattle.engine.periodic.family import Family
from gearrattle.engine.periodic.period_map import Pass, PeriodMap, State
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.periodic.touch import Touch
from gearrattle.engine.system.passages import Passages

Mapped = Callable[[np.ndarray, float], tuple[np.ndarray, np.ndarray, np.ndarray]]

SHARP, TIP = 0.1, 1e-10
"""Tangent of half the angle between both legs of a fold, and the parameter at its tip."""


class Written(Family):
    """A map that is written down: of the state and the parameter, the state later, its gradient and its slope."""

    def __init__(self, mapped: Mapped, states: int) -> None:
        self.mapped = mapped
        self.scale, self.size, self.cycles, self.unit = np.ones(states), 1.0, 1, 1.0
        self.clearances = self.memories = 0

    def map_at(self, parameter: float) -> PeriodMap:
        raise NotImplementedError

    def follow(
        self, state: State, parameter: float, touch: Touch | None = None, turns_along: np.ndarray | None = None
    ) -> tuple[Pass, np.ndarray]:
        del touch, turns_along
        later, gradient, slope = self.mapped(state.y, parameter)
        nothing = np.zeros(0)
        crossings = Passages(nothing, nothing.astype(np.int64), nothing.astype(np.int64), nothing, np.zeros((0, 0)))
        return Pass(state, State(later), gradient, nothing, crossings, 1.0, 1), slope


def point_at(family: Family, state: list[float], parameter: float, *, upward: bool) -> Point:
    return Continuation(family).begin(State(np.array(state)), parameter, upward=upward)


def turning_back(state: np.ndarray, parameter: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """p = -sqrt((u / SHARP)^2 + TIP^2): two legs nearly along p that meet in a fold as sharp as a corner."""
    (u,) = state
    root = hypot(u / SHARP, TIP)
    later = np.array([u + 0.01 * (parameter + root)])
    return later, np.array([[1.0 + 0.01 * u / (SHARP**2 * root)]]), np.array([0.01])


@pytest.mark.parametrize("ahead", [1e-9, 1e-8, 1e-6])
def test_a_fold_in_a_corner_of_the_branch_is_located(ahead: float) -> None:
    """Planes at right angles to the chord miss it: behind the first point they meet no motion at all."""
    family = Written(turning_back, 1)
    before, after = (
        point_at(family, [u], -hypot(u / SHARP, TIP), upward=upward) for u, upward in ((-1e-10, True), (ahead, False))
    )
    after = replace(after, length=float(np.linalg.norm(after.w - before.w)))
    assert before.tangent @ after.tangent < -0.9
    (event,) = events_between(Continuation(family), before, after)
    assert event.kind == FOLD
    assert event.point.parameter == pytest.approx(-TIP, abs=1e-12)


@pytest.mark.parametrize("steepness", [1e4, -1e4])
def test_a_multiplier_that_is_steep_beside_the_branch_is_located_on_it(steepness: float) -> None:
    """m = -1 + p + p^2 / 100 on the branch v = cosh(3 p); a motion 1e-6 beside it may have the other sign of m + 1."""

    def mapped(state: np.ndarray, parameter: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        x, v = state
        off = v - cosh(3.0 * parameter)
        m = -1.0 + parameter + 0.01 * parameter**2 + steepness * off
        slope = steepness * -3.0 * sinh(3.0 * parameter) + 1.0 + 0.02 * parameter
        later = np.array([m * x, v - 0.5 * off])
        return later, np.array([[m, steepness * x], [0.0, 0.5]]), np.array([slope * x, 1.5 * sinh(3.0 * parameter)])

    family = Written(mapped, 2)
    before, after = (point_at(family, [0.0, cosh(3.0 * p)], p, upward=True) for p in (-0.02, 0.03))
    after = replace(after, length=float(np.linalg.norm(after.w - before.w)))
    (event,) = events_between(Continuation(family), before, after)
    assert event.kind == DOUBLING
    assert event.point.parameter == pytest.approx(0.0, abs=1e-12)
