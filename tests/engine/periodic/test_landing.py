"""The motion that grazes, from points before it: a closed form, and how few motions are followed."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import GRAZING
from gearrattle.engine.periodic.events.events_of_step import events_between
from gearrattle.engine.periodic.families import CompiledFamily
from gearrattle.engine.periodic.newton import Corrector
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.periodic.turning_points import grazing_ahead, landed
from gearrattle.orbits.periodic_search import periodic
from gearrattle.orbits.value_family import family_of
from tests.engine.periodic.test_grazing import DRAG, FREQUENCY, MEAN, PATH, oscillator
from tests.orbits.test_curve import paper_case

pytestmark = pytest.mark.compiled

CLOSED = (1.0 - MEAN) * abs(1.0 - FREQUENCY**2 + 1j * DRAG * FREQUENCY)  # amplitude at which the response grazes


def point_at(amplitude: float, *, upward: bool) -> tuple[Point, Continuation]:
    """A point of the branch over the amplitude, and its Continuation."""
    model = oscillator().with_({PATH: amplitude})
    curve = Continuation(family_of(model, PATH, amplitude, 1, 1.0))
    return curve.begin(periodic(model).motion.start, amplitude, upward=upward), curve


def landed_from(point: Point, curve: Continuation) -> Point:
    """The motion that grazes ahead of a point."""
    ahead = grazing_ahead(point)
    assert ahead is not None
    corrector = Corrector(curve.family, (point.scale, point.size))
    grazing = landed(corrector, point, ahead, 1.0)
    assert grazing is not None
    return grazing


@pytest.mark.parametrize(("share", "upward"), [(0.8, True), (0.99, True), (1.001, False)])
def test_from_both_sides_the_motion_grazes_where_the_closed_form_says(share: float, upward: bool) -> None:
    grazing = landed_from(*point_at(share * CLOSED, upward=upward))
    assert grazing.parameter == pytest.approx(CLOSED, abs=1e-11)
    assert grazing.word == ""
    assert grazing.touch is not None
    assert (grazing.tangent[-1] > 0.0) == upward


def test_a_grazing_takes_few_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    """The response is linear up to the grazing: one motion for the depth, one for what it was off, one to be sure."""
    point, curve = point_at(0.9 * CLOSED, upward=True)
    calls, follow = [], CompiledFamily.follow

    def counted(*arguments: object, **options: object) -> object:
        calls.append(1)
        return follow(*arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(CompiledFamily, "follow", counted)
    landed_from(point, curve)
    assert len(calls) <= 4


@pytest.mark.parametrize(("first", "last"), [(0.9, 1.1), (1.01, 0.9)])
def test_the_grazing_is_a_point_of_the_branch_and_its_event(first: float, last: float) -> None:
    point, curve = point_at(first * CLOSED, upward=last > first)
    low, high = sorted((first * CLOSED, last * CLOSED))
    points = [point, *curve.follow(point, low, high)]
    (grazing,) = [one for one in points if one.touch is not None]
    events = [event for before, after in pairwise(points) for event in events_between(curve, before, after)]
    assert [event.kind for event in events if event.kind == GRAZING] == [GRAZING]
    assert any(event.point is grazing for event in events)


@pytest.mark.long
@pytest.mark.parametrize("steps", [60.0, 240.0, 1000.0, 4000.0])
def test_with_every_step_case_1_has_the_same_grazings_doublings_and_folds(steps: float) -> None:
    """Loops of 1e-5 to 1e-3 of the range, and corners of the branch at which motions begin or cease to touch."""
    kinds = [event.kind for event in paper_case(190.0, 179.5, steps).events]
    assert [kinds.count(kind) for kind in ("grazing", "period doubling", "fold")] == [31, 23, 12]


@pytest.mark.long
def test_case_1_takes_few_motions_for_a_point(monkeypatch: pytest.MonkeyPatch) -> None:
    """From 300 to 150 rad/s: 4735 motions, 6214 where steps are cut until they pass each grazing."""
    calls, follow = [], CompiledFamily.follow

    def counted(*arguments: object, **options: object) -> object:
        calls.append(1)
        return follow(*arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(CompiledFamily, "follow", counted)
    curve = paper_case(300.0, 150.0)
    assert len(calls) < 5200
    kinds = [event.kind for event in curve.events]
    assert kinds.count("fold") == 24
    assert kinds.count("period doubling") == 36
    assert kinds.count("grazing") >= 62
    assert np.all(np.diff([event.point.length for event in curve.events]) >= 0.0)
