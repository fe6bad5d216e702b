"""What is located between two points of a branch, by families whose branches and multipliers are written down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import cosh, hypot, sinh, sqrt
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import DOUBLING, FOLD, GRAZING, PATTERN
from gearrattle.engine.periodic.events.events_of_step import events_between
from gearrattle.engine.periodic.families import Family
from gearrattle.engine.periodic.motion import Pass, State, Touch
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.system.crossings_in_order import Passages

Mapped = Callable[[np.ndarray, float], tuple[np.ndarray, np.ndarray, np.ndarray]]
Crossed = Callable[[float], list[tuple[float, int, int, float]]]

SHARP, TIP = 0.1, 1e-10
"""Tangent of half the angle between both legs of a fold, and the parameter at its tip."""


class Written(Family):
    """A map that is written down.

    Of the state and the parameter: the state later, its gradient and its slope. Of the parameter: the crossings, each
    its time, what it crosses, whether upward, and its velocity.
    """

    def __init__(self, mapped: Mapped, states: int, crossed: Crossed = lambda _: []) -> None:
        self.mapped, self.crossed = mapped, crossed
        self.scale, self.size, self.cycles, self.unit = np.ones(states), 1.0, 1, 1.0
        self.clearances = self.memories = 0

    def map_at(self, parameter: float) -> Any:
        del parameter
        return SimpleNamespace(system=SimpleNamespace(clearances=(), auxiliaries=3 * [SimpleNamespace(kind="slider")]))

    def follow(
        self, state: State, parameter: float, touch: Touch | None = None, turns_along: np.ndarray | None = None
    ) -> tuple[Pass, np.ndarray]:
        del touch, turns_along
        later, gradient, slope = self.mapped(state.y, parameter)
        rows = sorted(self.crossed(parameter))
        times, watches, ups, velocities = np.array(rows).reshape(-1, 4).T
        indices = watches.astype(np.int64), ups.astype(np.int64)
        crossings = Passages(times, *indices, velocities, np.zeros((len(rows), 0)))
        return Pass(state, State(later), gradient, np.zeros(0), crossings, 1.0, 1), slope


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


def test_a_grazing_between_two_exchanges_that_cancel_is_not_taken_for_one_of_them() -> None:
    """From 0.5 to 0.7 two elements cross in the other order; at 0.6 a third one begins to slip."""

    def mapped(state: np.ndarray, parameter: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return 0.5 * (state + parameter), np.array([[0.5]]), np.array([0.5])

    def crossed(parameter: float) -> list[tuple[float, int, int, float]]:
        second = 0.3 + (parameter - 0.5) * (parameter - 0.7)
        rows = [(0.3, 0, 1, 1.0), (0.8, 0, 0, -1.0), (second, 1, 1, 1.0), (0.9, 1, 0, -1.0)]
        if parameter > 0.6:
            root = sqrt(parameter - 0.6)
            rows += [(0.6 - 0.1 * root, 2, 1, root), (0.6 + 0.1 * root, 2, 0, -root)]
        return rows

    family = Written(mapped, 1, crossed)
    before, after = (point_at(family, [p], p, upward=True) for p in (0.45, 0.76))
    after = replace(after, length=float(np.linalg.norm(after.w - before.w)))
    events = events_between(Continuation(family), before, after)
    assert [event.kind for event in events] == [PATTERN, GRAZING, PATTERN]
    assert [event.point.parameter for event in events] == pytest.approx([0.5, 0.6, 0.7], abs=1e-9)
    assert events[1].watch == 2
