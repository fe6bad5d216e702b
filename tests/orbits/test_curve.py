"""Branches go on past a step whose events cannot be located, and end where they may have jumped."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import DOUBLING, Event
from gearrattle.engine.periodic.events.events_of_step import changes_between, events_between
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError
from gearrattle.orbits import followed_branch as curves
from gearrattle.orbits.followed_branch import Curve, followed
from gearrattle.orbits.value_family import family_of, follower_over

AMPLITUDE = "torque.0.harmonics.0.amplitude"
GRAZING = 6.0531904


def paper_case(first: float, last: float, steps: float = 60.0) -> Curve:
    """The branch of the paper's case 1 over the speed, from the motion that it settles on at the first one."""
    model = gr.example("case1")
    state = gr.periodic(model.with_({"excitation.speed": first})).motion.start
    follower = Continuation(family_of(model, "excitation.speed", first, 1, 255.0), longest=1.0 / steps)
    begin = follower.begin(state, first, upward=last > first)
    return followed(follower, begin, (min(first, last), max(first, last)))


def is_consistent(curve: Curve) -> bool:
    """Whether every fold lies between two points on which the tangent turns, and every turn has its fold."""
    folds = [event.point.length for event in curve.events if event.kind == "fold"]
    passed = [
        sum(before.length < at <= after.length for at in folds) % 2 == (before.tangent[-1] * after.tangent[-1] < 0.0)
        for before, after in curve.steps()
    ]
    return all(passed)


@pytest.mark.long
def test_the_branch_of_case_1_passes_grazings_at_which_multipliers_leap() -> None:
    """At 184.64 and 180.74 rad/s steps hold a grazing with a period doubling 1e-9 beside it."""
    curve = paper_case(300.0, 179.5)
    assert curve.points[-1].parameter == 179.5
    assert curve.notes == ()
    assert is_consistent(curve)


@pytest.mark.compiled
def test_with_every_step_the_branch_of_case_1_goes_through_the_same_loop() -> None:
    """Over 0.06 rad/s four touches come and go, and the period doubles four times; 1e-3 of the range of the branch."""
    coarse, fine = (paper_case(186.0, 185.8, steps).events for steps in (60.0, 400.0))
    assert [event.kind for event in coarse].count("grazing") == 4
    assert [event.kind for event in coarse].count("period doubling") == 4
    assert [event.kind for event in coarse] == [event.kind for event in fine]
    values = [[event.point.parameter for event in events] for events in (coarse, fine)]
    np.testing.assert_allclose(*values, rtol=0, atol=1e-7)


@pytest.mark.compiled
@pytest.mark.parametrize(
    ("span", "pair"), [((168.0, 167.7), (167.81483, 167.81476)), ((161.6, 161.2), (161.35442, 161.34548))]
)
def test_with_every_step_the_branch_of_case_1_shows_touches_that_come_and_go(
    span: tuple[float, float], pair: tuple[float, float]
) -> None:
    """The turning points that touch appear and vanish within a step: its ends have none of them."""
    shown = [[e.point.parameter for e in paper_case(*span, steps).events if e.kind == "grazing"] for steps in (60, 400)]
    np.testing.assert_allclose(*shown, rtol=0, atol=1e-7)
    for value in pair:
        assert np.abs(np.array(shown[0]) - value).min() < 1e-5


@pytest.mark.compiled
def test_branches_of_doubled_period_of_case_1_lead_from_one_doubling_to_the_next() -> None:
    """Between 186 and 185.8 rad/s there are two: each begins at a period doubling and ends at the one after it.

    They are 4e-5 and 2e-4 of the range wide, and their motions never leave those of the first branch by much.
    """
    branch = gr.continuation(gr.example("case1"), "excitation.speed", (186.0, 185.8))
    (note,) = branch.notes
    assert note.startswith("What leaves at 6 period doublings of branches of doubled period (1775.00592 rpm, 1774.9")
    first, *doubled = branch.curves
    doublings = [event.point.parameter for event in first.events if event.kind == "period doubling"]
    assert [[curve.points[i].parameter for i in (0, -1)] for curve in doubled] == [doublings[:2], doublings[2:]]
    assert all(curve.cycles == 2 for curve in doubled)
    for curve in doubled:
        halves = [np.diff(point.motion.crossings.time.reshape(2, -1), axis=0) for point in curve.points[1:-1]]
        apart = [np.abs(half - half.mean()).max() for half in halves]
        assert min(apart) > 1e-12


@pytest.mark.long
def test_the_branch_of_case_1_reaches_its_end() -> None:
    curve = paper_case(300.0, 45.0)
    assert curve.points[-1].parameter == 45.0
    assert not curve.note
    assert sum(event.kind == "grazing" for event in curve.events) > 700


def fails_at_the_grazing(curve: Continuation, before: Point, after: Point) -> list[Event]:
    if (not before.word) != (not after.word):
        raise ConvergenceError("Newton's method does not converge")
    return events_between(curve, before, after)


def test_where_events_cannot_be_located_the_branch_goes_on_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    model = gr.example("rattle_oscillator")
    whole = gr.continuation(model, AMPLITUDE, (5.9, 6.3), start="linear")
    monkeypatch.setattr(curves, "events_between", fails_at_the_grazing)
    branch = gr.continuation(model, AMPLITUDE, (5.9, 6.3), start="linear")
    assert branch.curves[0].points[-1].parameter == whole.curves[0].points[-1].parameter
    (step,) = branch.curves[0].unlocated
    (grazing,) = whole.events.loc[whole.events["kind"] == "grazing", "value"]
    assert grazing == pytest.approx(GRAZING, abs=1e-6)
    assert step.before.parameter <= grazing <= step.after.parameter
    assert step.after.parameter - step.before.parameter < 0.4 / 60.0 / 4.0
    assert changes_between(step.before, step.after) == ["grazing"]
    (note,) = branch.notes
    assert f"between {step.before.parameter:.9g} and {step.after.parameter:.9g} are not located" in note
    assert "Newton's method does not converge" in note
    assert "grazing" in note
    others = whole.events[whole.events["kind"] != "grazing"]
    assert branch.events["kind"].tolist() == others["kind"].tolist()
    np.testing.assert_allclose(branch.events["value"], others["value"], rtol=0, atol=1e-9)


def test_shorter_steps_lead_from_a_point_to_the_next_and_not_to_another_branch() -> None:
    model = gr.example("backlash_oscillator")
    family = family_of(model, "excitation.speed", 0.6, 1, 1.0)
    curve = Continuation(family, longest=1.0 / 60.0)
    first = gr.periodic(model.with_({"excitation.speed": 0.6})).motion.start
    one = [curve.begin(first, 0.6), *curve.follow(curve.begin(first, 0.6), 0.6, 0.9)]
    for before, after in pairwise(one[:6]):
        points = curve.with_shorter_steps(before, after)
        assert points[-1] is after
        assert len(points) >= 4
        assert all(x.length < y.length for x, y in pairwise(points))
    aside = np.linalg.svd(one[1].tangent[None])[2][-1]
    displaced = replace(one[1], w=one[1].w + 0.1 * one[1].length * aside)
    with pytest.raises(ConvergenceError, match="do not lead"):
        curve.with_shorter_steps(one[0], displaced)


def test_where_the_branch_may_have_jumped_it_ends_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def elsewhere(*_: Any) -> list[Point]:
        raise ConvergenceError("shorter steps do not lead there")

    monkeypatch.setattr(curves, "events_between", fails_at_the_grazing)
    monkeypatch.setattr(Continuation, "with_shorter_steps", elsewhere)
    branch = gr.continuation(gr.example("rattle_oscillator"), AMPLITUDE, (5.9, 6.3), start="linear")
    assert branch.curves[0].points[-1].parameter < GRAZING
    assert branch.notes == ("A branch ends inside the range: shorter steps do not lead there.",)


@pytest.mark.compiled
@pytest.mark.parametrize("steps", [60.0, 240.0])
def test_a_pair_that_leaves_the_unit_circle_comes_back_whatever_the_step(steps: float) -> None:
    """On case 1 the pair returns in a step on which a real multiplier leaves: a fold follows at once."""
    curve = paper_case(164.4, 164.3, steps)
    crossings = [event for event in curve.events if event.kind == "Neimark-Sacker"]
    assert [round(event.point.parameter, 3) for event in crossings] == [164.305, 164.302]
    for event in crossings:
        pairs = np.abs(event.point.multipliers[event.point.multipliers.imag > 0.0])
        assert np.abs(pairs - 1.0).min() < 1e-3  # beside a grazing multipliers leap
    folds = [event.point.length for event in curve.events if event.kind == "fold"]
    assert 0.0 < folds[0] - crossings[1].point.length < 1e-4


@pytest.mark.compiled
def test_a_fold_beside_a_grazing_is_not_taken_for_a_crossing_of_branches() -> None:
    """At 184.763138 rad/s the branch of case 1 turns by nearly half a turn; 1e-10 of arclength beyond it grazes."""
    model = gr.example("case1")
    state = gr.periodic(model.with_({"excitation.speed": 184.77})).motion.start
    follower = Continuation(family_of(model, "excitation.speed", 184.77, 1, 1.5), longest=1.0 / 60.0)
    curve = followed(follower, follower.begin(state, 184.77, upward=False), (184.76, 184.77))
    kinds = [event.kind for event in curve.events if abs(event.point.parameter - 184.763138) < 1e-6]
    assert kinds == ["fold", "grazing"]
    assert is_consistent(curve)


@pytest.mark.slow
def test_a_branch_of_doubled_period_ends_where_it_joins_its_parent_and_is_followed_once() -> None:
    """Its halves become the same at 0.722120622; at the event they still differ by 2e-5 of the state."""
    contact = {"stiffness": 1.0, "damping": 0.03, "damping_ratio": 1.0, "clearance": 1.0}
    torque = {"on": "gear", "mean": 0.21, "harmonics": [{"order": 1, "amplitude": 0.24}]}
    model = gr.Model.from_tables(
        {
            "schema": 1,
            "name": "oscillator",
            "units": "dimensionless",
            "inertia": [{"name": "gear", "J": 1.0}],
            "coupling": [{"name": "mesh", "between": ["gear", "ground"], **contact}],
            "excitation": {"speed": 0.75},
            "torque": [torque],
        }
    )
    start = {"angle": [-0.52480327], "velocity": [0.43093832]}  # of several unstable motions inside a chaotic one
    branch = gr.continuation(model, "excitation.speed", (0.4, 1.1), start=start)
    doublings = branch.events.loc[(branch.events["branch"] == 0) & (branch.events["kind"] == DOUBLING), "value"]
    joint = [value for value in doublings.tolist() if 0.7 < value < 0.75]
    assert joint == pytest.approx([0.722120622], abs=1e-8)
    (doubled,) = (
        curve for curve in branch.curves if curve.cycles == 2 and max(p.parameter for p in curve.points) > 0.7
    )
    assert doubled.events[-1].kind == DOUBLING
    assert doubled.events[-1].point.parameter == pytest.approx(joint[0], abs=1e-9)
    values = [event.point.parameter for event in doubled.events]
    assert len({round(value, 9) for value in values}) == len(values)  # nothing twice


def test_both_motions_between_a_fold_and_the_points_around_it_are_known() -> None:
    """The step over a fold has no change of sign there; the motions cancel in the sum of signs."""
    branch = gr.continuation(gr.example("backlash_oscillator"), "excitation.speed", (0.6, 0.95))
    curve = branch.curves[0]
    follower = follower_over(branch.model, branch.path, branch.range, 1, first=0.6)
    folds = [event.point for event in curve.events if event.kind == "fold"]
    assert len(folds) == 2
    for fold in folds:
        index = int(np.searchsorted([point.length for point in curve.points], fold.length)) - 1
        around = [point.parameter for point in curve.points[index : index + 2]]
        nearest = min(around, key=lambda value: abs(value - fold.parameter))
        value = 0.5 * (nearest + fold.parameter)
        motions = [point for i, point in curve.motions_at(follower, value) if i == index]
        assert len(motions) == 2
        signs = [np.sign(np.linalg.det(np.eye(2) - point.gradient)) for point in motions]
        assert sum(signs) == 0.0
