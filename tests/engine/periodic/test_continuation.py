"""Branches of the backlash oscillator: grazings in closed form, folds, the same branch with every step."""

from __future__ import annotations

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import DOUBLING, FOLD, GRAZING, Event
from gearrattle.engine.periodic.events.events_of_step import events_between
from gearrattle.engine.periodic.families import GeneralFamily
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.periodic.shooting import shoot
from tests.engine.periodic.test_shooting import at, oscillator

LOWEST, HIGHEST = 0.3, 1.6


def amplitude(w: float) -> float:
    """Of the motion in contact."""
    return 0.05 * w**2 / abs(1.0 - w**2 + 0.1j * w)


GRAZINGS = [brentq(lambda w: amplitude(w) - 0.1, *span, xtol=1e-15) for span in ((0.3, 0.95), (1.05, 1.6))]
"""In contact x = 1.1 + amplitude cos(...): the corner at 1 is touched where the amplitude is 0.1."""


def branch(longest: float, cycles: int = 1) -> Continuation:
    family = GeneralFamily(lambda w: oscillator(w).system, LOWEST, cycles)
    return Continuation(family, longest=longest)


@cache
def followed(longest: float) -> tuple[list[Point], list[Event]]:
    begin = oscillator(LOWEST)
    curve = branch(longest)
    points = [curve.begin(shoot(begin, at(1.1, 0.0)).motion.start, LOWEST)]
    points += curve.follow(points[0], LOWEST, HIGHEST)
    events = [e for one, other in pairwise(points) for e in events_between(curve, one, other)]
    return points, events


@pytest.mark.parametrize("longest", [0.1, *(pytest.param(longest, marks=pytest.mark.long) for longest in (0.02, 0.5))])
def test_with_every_step_the_branch_has_the_same_events(longest: float) -> None:
    points, events = followed(longest)
    assert points[-1].parameter == HIGHEST
    assert [event.kind for event in events] == [GRAZING, FOLD, FOLD, GRAZING]
    assert not any(event.is_collision for event in events)
    actual = [event.point.parameter for event in events]
    np.testing.assert_allclose([actual[0], actual[3]], GRAZINGS, rtol=0, atol=1e-9)
    np.testing.assert_allclose(actual, [event.point.parameter for event in followed(0.1)[1]], rtol=0, atol=1e-9)


def test_at_a_fold_a_multiplier_is_one_and_the_branch_turns() -> None:
    points, events = followed(0.1)
    folds = [event.point for event in events if event.kind == FOLD]
    for point in folds:
        assert np.abs(point.multipliers - 1.0).min() < 1e-6
        assert abs(point.tangent[-1]) < 1e-6
    between = [p for p in points if folds[0].length < p.length < folds[1].length]
    assert between
    assert all(p.tangent[-1] < 0.0 for p in between)
    assert all(abs(p.multipliers[0]) > 1.0 for p in between)
    assert all(abs(p.multipliers[0]) < 1.0 for p in points if p not in between)


def test_every_point_is_a_periodic_motion_with_the_right_determinant() -> None:
    for point in followed(0.1)[0]:
        period_map = oscillator(point.parameter)
        np.testing.assert_allclose(period_map.later(point.motion.start).y, point.motion.start.y, rtol=0, atol=1e-11)
        assert np.prod(point.multipliers) == pytest.approx(np.exp(-0.1 * period_map.length), rel=1e-10)


def test_back_again_it_meets_itself() -> None:
    """From the last point downwards, through both folds, to where the motion in contact is known."""
    last = followed(0.1)[0][-1]
    curve = branch(0.1)
    begin = curve.begin(last.motion.start, last.parameter, upward=False)
    points = [begin, *curve.follow(begin, 0.5, HIGHEST)]
    assert sum(np.diff(np.sign([p.tangent[-1] for p in points])) != 0) == 2
    end = points[-1]
    wave = 0.05 * end.parameter**2 / (1.0 - end.parameter**2 + 0.1j * end.parameter)
    np.testing.assert_allclose(end.state, [1.1 + wave.real, (1j * end.parameter * wave).real], rtol=0, atol=1e-11)


def test_over_two_periods_nothing_doubles_where_no_multiplier_is_minus_one() -> None:
    """The events of a branch of 2 T are those of T; multipliers are squares."""
    begin = oscillator(1.45, 2)
    curve = branch(0.1, cycles=2)
    first = curve.begin(shoot(begin, at(1.0, 0.0)).motion.start, 1.45)
    once = oscillator(1.45)
    squares = shoot(once, at(1.0, 0.0)).multipliers ** 2
    np.testing.assert_allclose(np.sort_complex(first.multipliers), np.sort_complex(squares), rtol=0, atol=1e-10)
    following = next(curve.follow(first, 1.4, 1.6))
    assert DOUBLING not in [event.kind for event in events_between(curve, first, following)]
