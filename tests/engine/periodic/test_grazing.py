"""What a grazing does to the gradient: its kind by limits from both sides, its root against a closed form."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.linalg import expm

import gearrattle as gr
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import DOUBLING, GRAZING, Event
from gearrattle.engine.periodic.events.grazing import grazing_of
from gearrattle.orbits import Branch
from tests.oracles import stop_slider_mp as oracle

pytestmark = pytest.mark.compiled

PATH = "torque.0.harmonics.0.amplitude"
FREQUENCY, DRAG, MEAN, STIFFNESS = 0.8, 0.1, 0.1, 5.0
LAWS: dict[str, dict[str, Any]] = {
    "elastic": {},
    "damped": {"damping": 0.5, "damping_ratio": 0.0},
    "clipped": {"damping": 0.5, "contact_damping": "clipped"},
}


def oscillator(stiffness: float = STIFFNESS, **stop: Any) -> gr.Model:
    """x'' + 0.1 x' + x + stop(x) = 0.1 + amplitude sin(0.8 t), a stop at |x| = 1."""
    ends = {"between": ["body", "ground"]}
    return gr.Model.from_tables(
        {
            "schema": 1,
            "units": "dimensionless",
            "inertia": [{"name": "body", "J": 1.0, "drag": DRAG}],
            "coupling": [
                {"name": "spring", **ends, "stiffness": 1.0},
                {"name": "stop", **ends, "stiffness": stiffness, "clearance": 1.0, **stop},
            ],
            "excitation": {"frequency": FREQUENCY},
            "torque": [{"on": "body", "mean": MEAN, "harmonics": [{"order": 1, "amplitude": 0.3}]}],
        }
    )


def with_slider() -> gr.Model:
    """The oracle's: a stop from 1 on with a slider that slips at 0.05, its spring 2."""
    stages = [
        {"stiffness": 1.0, "until": 1.0},
        {"stiffness": 5.0, "hysteresis": 0.1, "stick_stiffness": 2.0},
    ]
    coupling = {"name": "stop", "between": ["body", "ground"], "stages": stages, "coast_stages": [{"stiffness": 1.0}]}
    tables = oscillator().to_tables()
    return gr.Model.from_tables({**tables, "coupling": [coupling]})


@cache
def branch_of(law: str, stiffness: float = STIFFNESS) -> Branch:
    return gr.continuation(oscillator(stiffness, **LAWS[law]), PATH, (0.3, 0.335), start="linear")


@cache
def branch_with_slider() -> Branch:
    return gr.continuation(with_slider(), PATH, (0.3, 0.352), start="linear")


def first_grazing(branch: Branch, watch: int = 0) -> tuple[Event, Continuation]:
    chosen = next(event for event in branch.curves[0].events if event.kind == GRAZING and event.watch == watch)
    return chosen, branch.follower(branch.curves[0])


def amplitude_of_grazing() -> float:
    """Below the stop x = 0.1 + amplitude / |...| sin(...)."""
    return (1.0 - MEAN) * abs(1.0 - FREQUENCY**2 + 1j * DRAG * FREQUENCY)


def closed_form(law: str) -> float:
    """The root of the trace: what the stop adds to the flow within sqrt(8 depth / acceleration)."""
    free = np.array([[0.0, 1.0], [-1.0, -DRAG]])
    damping = LAWS[law].get("damping", 0.0) if law == "damped" else 0.0  # clipped: damping acts for a time ~ s only
    inside = np.array([[0.0, 1.0], [-1.0 - STIFFNESS, -DRAG - damping]])
    entry, leaving = (np.array([[1.0, 0.0], [side * damping, 1.0]]) for side in (-1.0, 1.0))
    added = leaving @ inside @ entry - free
    depth = 1.0 / abs(1.0 - FREQUENCY**2 + 1j * DRAG * FREQUENCY)  # for a unit of the amplitude
    acceleration = FREQUENCY**2 * (1.0 - MEAN)
    trace = np.trace(expm(free * 2.0 * np.pi / FREQUENCY) @ added)
    return float(trace * np.sqrt(8.0 * depth / acceleration))


@pytest.mark.parametrize("law", ["elastic", "damped", pytest.param("clipped", marks=pytest.mark.long)])
def test_at_a_compliant_corner_the_gradient_is_continuous_with_the_root_of_a_closed_form(law: str) -> None:
    event, curve = first_grazing(branch_of(law))
    assert event.point.parameter == pytest.approx(amplitude_of_grazing(), rel=1e-10)
    assert event.grazing is not None
    assert event.grazing.kind == "compliant"
    assert event.grazing.root == pytest.approx(closed_form(law), rel=1e-5)
    changes = []
    for distance in (1e-5, 1e-7, 1e-9):
        apart, touching = (curve.moved_along(event.point, side * distance) for side in (-1.0, 1.0))
        np.testing.assert_allclose(apart.gradient, event.point.gradient, rtol=0, atol=10.0 * np.sqrt(1e-13))
        changes.append(float(np.linalg.norm(touching.gradient - event.point.gradient)))
    np.testing.assert_allclose(changes[:2], 10.0 * np.array(changes[1:]), rtol=0.02)


@pytest.mark.slow
def test_under_clipped_damping_losing_contact_is_a_grazing() -> None:
    """Near the corner both limits of the damping are crossed, with contact and without."""
    gap = {"name": "gap", "between": ["body", "ground"], "stiffness": 1.0, "clearance": 1.0, **LAWS["clipped"]}
    model = gr.Model.from_tables({**oscillator().to_tables(), "coupling": [gap]})
    branch = gr.continuation(model, PATH, (0.01, 0.06), start="linear")
    assert set(branch.events["kind"]) == {GRAZING}
    assert set(branch.events["grazing"]) == {"compliant"}
    (here,) = np.flatnonzero(branch.events["clearance"] == "gap")
    assert branch.event_levels[here, 0, 0] == pytest.approx(1.0, abs=1e-9)


def test_a_stop_of_a_stiffness_that_is_not_resolved_is_rigid() -> None:
    """Where the root ruled, its quotient would not change between 3e-7 of the amplitude and a thousandth of that."""
    event, curve = first_grazing(branch_of("elastic", 5e5))
    assert event.grazing is not None
    assert event.grazing.kind == "rigid"
    quotients = []
    for change in (3e-7, 3e-10):
        point = curve.moved_along(event.point, change / curve.family.unit)
        away = point.parameter - event.point.parameter
        quotients.append(np.trace(point.gradient - event.point.gradient) / np.sqrt(away))
    assert quotients[1] < 2.0 * quotients[0] < -4e5


@pytest.mark.long
def test_where_a_slider_begins_to_slip_the_gradient_jumps_and_the_period_doubles_there() -> None:
    branch = branch_with_slider()
    event, curve = first_grazing(branch, 1)
    assert event.grazing is not None
    assert event.grazing.kind == "jump"
    assert np.isnan(event.grazing.root)
    table = branch.events[branch.events["branch"] == 0]
    assert table["kind"].tolist() == [GRAZING, DOUBLING, GRAZING, DOUBLING]
    assert table["collision"].tolist() == [False, False, False, True]
    assert table["grazing"].tolist() == ["compliant", "", "jump", ""]
    assert table["value"].iloc[3] == table["value"].iloc[2]
    for side in (-1, 1):
        assert np.sign(np.linalg.det(np.eye(3) + curve.moved_along(event.point, side * 1e-9).gradient)) == side


@pytest.mark.long
def test_where_a_slider_begins_to_slip_amplitude_and_determinants_are_those_of_the_oracle() -> None:
    """The amplitude, and det(I - M) and det(I + M) on both sides, against thirty digits."""
    event, curve = first_grazing(branch_with_slider(), 1)
    with mp.workdps(30):
        stop = oracle.Stop(mpf("0.8"), mpf(2), mpf("0.05"))
        near = tuple(mpf(float(x)) for x in event.point.state[:2])
        amplitude, state = oracle.touching(stop, mpf(event.point.parameter), (near[0], near[1]))
        assert abs(float(amplitude - event.point.parameter)) < 1e-10
        for side in (-1, 1):
            shifted = amplitude * (1 + side * mpf(10) ** -9)
            gradient = oracle.gradient(stop, shifted, oracle.orbit(stop, shifted, state))
            want = [float(mp.det(mp.eye(2) + sign * gradient)) for sign in (-1, 1)]
            point = curve.moved_along(event.point, side * 1e-9)
            actual = [float(np.linalg.det(np.eye(3) + sign * point.gradient)) for sign in (-1, 1)]
            np.testing.assert_allclose(actual, want, rtol=0, atol=1e-3)
            assert np.sign(want[1]) == side


@pytest.mark.long
def test_the_doubled_branch_ends_where_it_joins_the_other_in_the_jump() -> None:
    """Beyond, both halves of its motions are the same: there is no branch of its own any more."""
    branch = branch_with_slider()
    single, doubled = branch.events[branch.events["branch"] == 0], branch.events[branch.events["branch"] == 1]
    assert doubled["kind"].tolist() == [GRAZING, "fold", GRAZING, DOUBLING]
    assert doubled["collision"].iloc[-1]
    assert doubled["value"].iloc[-1] == pytest.approx(single["value"].iloc[3], abs=1e-9)
    curve = branch.curves[1]
    assert curve.cycles == 2
    assert curve.points[-1] is curve.events[-1].point
    assert branch.notes == ()
    single_map = branch.follower(branch.curves[0]).family.map_at
    distances = np.array([abs(p.parameter - curve.points[-1].parameter) for p in curve.points])
    gaps = np.array([np.abs(single_map(p.parameter).later(p.motion.start).y - p.state).max() for p in curve.points])
    assert gaps[-1] < 1e-9
    assert gaps[1:][distances[1:] > 1e-9].min() > 1e-9
    assert gaps.max() > 0.01


@pytest.mark.parametrize("law", ["elastic", "damped"])
def test_the_root_of_any_driveline_is_that_of_the_compiled_loop(law: str) -> None:
    """What the loop knows of the touch is left out, so it is worked out as for drivelines that have no such loop."""
    event, curve = first_grazing(branch_of(law))
    assert event.touch is not None
    point = replace(event.point, motion=replace(event.point.motion, approach=None))
    assert grazing_of(curve, point, event.touch).root == pytest.approx(closed_form(law), rel=1e-4)


@pytest.mark.slow
def test_the_root_is_that_of_the_trace_where_other_short_visits_are_near() -> None:
    """A loose gear with many impacts: the trace beside every grazing, on the side that touches."""
    branch = gr.continuation(gr.example("case1"), "excitation.speed", ("1432 rpm", "1405 rpm"))
    chosen = [(curve, e) for curve, own in zip(branch.curves, branch.events_of_curves, strict=True) for e in own]
    roots = 0
    for curve, event in chosen:
        if event.grazing is None or abs(event.grazing.root) < 1e-2:
            continue
        follower, point = branch.follower(curve), event.point
        sides = [follower.moved_along(point, side * 3e-9) for side in (-1.0, 1.0)]
        touching, apart = sorted(sides, key=lambda other: len(other.word), reverse=True)
        way = abs(touching.parameter - point.parameter)
        gained = float(np.trace(touching.gradient) - np.trace(apart.gradient))
        assert gained / np.sqrt(way) == pytest.approx(event.grazing.root, rel=0.03)
        roots += 1
    assert roots == 4
