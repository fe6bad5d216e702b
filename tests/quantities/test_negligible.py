"""Severity: which impacts are touches, by energy and by speed, and what that changes and what not."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.quantities.evaluation import judge
from gearrattle.quantities.verdict_parts import Part
from gearrattle.signals import SEVERITIES, find_impacts, steady
from gearrattle.trajectory import NegligibleImpacts, Trajectory
from tests.quantities.test_severity import GROUNDED
from tests.signals.handmade import Row, layout, trajectory, two_gaps

HITS: list[Row] = [
    (1.0, 0, 0, 1, 0.5, 0.0),
    (1.5, 0, 1, 0, -0.5, 3.0),
    (2.0, 0, 0, -1, -1.0, 3.0),
    (2.5, 0, -1, 0, 1.0, 2.0),
]
"""Impacts of a mesh on both flanks, at 0.5 and 1 m/s."""
TWO: list[Row] = [
    (1.0, 0, 0, 1, 0.2, 0.0),
    (1.5, 0, 1, 0, -0.2, 0.0),
    (2.0, 1, 0, 1, 0.1, 0.0),
    (2.2, 1, 1, 0, -0.1, 0.0),
    (2.4, 1, 0, -1, -0.1, 0.0),
    (2.6, 1, -1, 0, 0.1, 0.0),
]
"""A coupling hit at 0.2 rad/s on one side (element 0), a mesh at 0.1 m/s on both (element 1)."""


def parts(motion: Trajectory, **limits: float) -> dict[str, Part]:
    verdict = judge(motion, negligible=NegligibleImpacts(**limits))
    return {part.name: part for part in verdict.parts}


def test_an_impact_of_exactly_the_threshold_is_none_below_it() -> None:
    motion = trajectory(rows=HITS)
    largest = parts(motion)["gear"].max_impact_energy
    assert largest is not None
    assert parts(motion, energy=largest)["gear"].severity == "rattles"
    assert parts(motion, energy=math.nextafter(largest, math.inf))["gear"].severity == "touches"
    assert parts(motion, speed=1.0)["gear"].severity == "rattles"
    assert parts(motion, speed=math.nextafter(1.0, 2.0))["gear"].severity == "touches"


def test_one_impact_above_all_thresholds_makes_it_rattle() -> None:
    """The impact at 0.5 m/s is below, that at 1 m/s is not; an impact below either threshold is a touch."""
    motion = trajectory(rows=HITS)
    assert parts(motion, speed=0.75)["gear"].severity == "rattles"
    assert parts(motion, speed=0.75, energy=1e6)["gear"].severity == "touches"
    assert parts(motion, speed=2.0, energy=1e-9)["gear"].severity == "touches"


def test_speeds_of_lines_and_of_angles_have_thresholds_of_their_own() -> None:
    motion = trajectory(two_gaps(), TWO)
    severities = {
        (speed, angular): tuple(
            part.severity for _, part in sorted(parts(motion, speed=speed, angular_speed=angular).items())
        )
        for speed in (0.0, 0.15)
        for angular in (0.0, 0.25)
    }
    assert severities == {
        (0.0, 0.0): ("rattles", "rattles"),
        (0.15, 0.0): ("touches", "rattles"),  # gear, spring
        (0.0, 0.25): ("rattles", "touches"),
        (0.15, 0.25): ("touches", "touches"),
    }


def test_raising_a_threshold_never_raises_a_severity_and_changes_nothing_else() -> None:
    run = gr.simulate(gr.example("case3"), cycles=20, discard=10)
    plain = gr.criteria(run, negligible={"impact_energy": 0.0})
    energies = sorted(part.max_impact_energy for part in plain.parts if part.max_impact_energy is not None)
    before = dict.fromkeys((part.name for part in plain.parts), SEVERITIES.index("rattles"))
    seen = set()
    for energy in (0.0, 1e-9, *(factor * e for e in energies for factor in (0.999, 1.001)), 1e3):
        verdict = gr.criteria(run, negligible={"impact_energy": energy})
        now = {part.name: SEVERITIES.index(part.severity) for part in verdict.parts}
        assert all(now[name] <= before[name] for name in now)
        before = now
        seen.add(verdict.headline)
        assert verdict.verdict == plain.verdict
        same = {part.name: replace(part, severity="quiet") for part in verdict.parts}
        assert same == {part.name: replace(part, severity="quiet") for part in plain.parts}
    assert {"touches", plain.headline} <= seen
    assert plain.severity == "rattles"
    assert verdict.severity == "touches"


def test_severity_is_that_of_the_impacts_one_by_one() -> None:
    """Against the table of impacts, which reads the log by itself."""
    run = gr.simulate(gr.example("manual_transmission"), cycles=20, discard=10)
    motion = run.trajectory
    impacts = find_impacts(motion).within(steady(motion))
    limits = NegligibleImpacts(energy=float(np.median(impacts.energy)), speed=0.01, angular_speed=0.3)
    judged = {part.name: part for part in judge(motion, negligible=limits).parts}
    for k, name in enumerate(motion.layout.clearance_names):
        mine = impacts.of(k)
        slowest = limits.speed if motion.layout.is_mesh[motion.layout.clearance[k]] else limits.angular_speed
        matters = (mine.energy >= limits.energy) & (np.abs(mine.velocity) >= slowest)
        part = judged[name]
        expected = "rattles" if matters.any() else "touches"
        assert part.severity == (expected if part.separates else "quiet")


def test_the_worst_severity_comes_first_then_the_worst_regime() -> None:
    """The mesh is hit on both sides, but softly: the coupling on one side rattles, and stands before it."""
    verdict = judge(trajectory(two_gaps(), TWO), negligible=NegligibleImpacts(speed=0.15))
    assert [(part.name, part.regime, part.severity) for part in verdict.parts] == [
        ("spring", "single-sided", "rattles"),
        ("gear", "double-sided", "touches"),
    ]
    assert (verdict.verdict, verdict.severity, verdict.headline) == ("double-sided", "rattles", "single-sided")
    assert verdict.sentence.startswith("Rattle over the 4 cycles judged: spring hits its drive side only")
    assert " Negligible touches: gear touches both flanks, 0.5 impacts per cycle" in verdict.sentence


def test_touches_alone_are_no_rattle_in_headline_and_sentence() -> None:
    verdict = judge(trajectory(rows=HITS), negligible=NegligibleImpacts(energy=1e6))
    assert str(verdict).startswith("touches: No gap rattles over the 4 cycles judged. Negligible touches: gear")
    assert [part.rattles for part in verdict.parts] == [False]
    assert verdict.to_dict()["severity"] == "touches"
    assert not any("assumed" in note for note in verdict.notes)


def test_an_assumed_energy_is_said_in_the_rule_and_noted_where_it_decides() -> None:
    limits = NegligibleImpacts(energy=1e6, is_assumed=True)
    verdict = judge(trajectory(rows=HITS), negligible=limits)
    assert "an energy below 10⁶ J (this energy is assumed" in verdict.rule
    assert [note for note in verdict.notes if note.startswith("gear touches: negligible is an impact with an energy")]
    rattling = judge(trajectory(rows=HITS), negligible=replace(limits, energy=1e-9))
    assert not any("assumed" in note for note in rattling.notes)


def test_a_gap_that_opens_and_does_not_meet_again_touches_if_anything_is_negligible() -> None:
    motion = trajectory(layout(), [(1.0, 0, 1, 0, -0.5, 0.0)], initial=[1])
    assert parts(motion)["gear"].severity == "rattles"
    assert parts(motion, energy=1e-9)["gear"].severity == "touches"


def test_no_energy_threshold_applies_where_no_body_is_free() -> None:
    fixed = layout(prescribed=(0, 1))
    motion = trajectory(fixed, HITS)
    assert parts(motion)["gear"].max_impact_energy is None
    assert parts(motion, energy=1e9)["gear"].severity == "rattles"
    assert parts(motion, energy=1e9, speed=1.5)["gear"].severity == "touches"


def test_a_closed_form_energy_decides() -> None:
    """J v^2 / 2 of a free body that hits ground: 0.2 kg m^2 at 2 rad/s."""
    run = gr.simulate(gr.loads(GROUNDED.format(load=0.0, torque="", angle=0.0, velocity=2.0)))
    assert gr.criteria(run, negligible={"impact_energy": "0.399 J"}).severity == "rattles"
    assert gr.criteria(run, negligible={"impact_energy": "401 mJ"}).severity == "touches"
    assert gr.criteria(run, negligible={"angular_approach_speed": "19 rpm"}).severity == "rattles"
    assert gr.criteria(run, negligible={"angular_approach_speed": "20 rpm"}).severity == "touches"


def test_the_model_the_call_and_the_default_in_this_order() -> None:
    model = gr.example("case3")
    silent = gr.criteria(gr.simulate(model, cycles=4, discard=2))
    assert silent.negligible == NegligibleImpacts(energy=1e-6, is_assumed=True)
    says = model.with_({"criteria.negligible.approach_speed": "2 mm/s", "criteria.negligible.impact_energy": 0})
    run = gr.simulate(says, cycles=4, discard=2)
    assert gr.criteria(run).negligible == NegligibleImpacts(speed=2e-3)
    called = gr.criteria(run, negligible={"impact_energy": "3 mJ"})
    assert called.negligible == NegligibleImpacts(energy=3e-3, speed=2e-3)
    findings = gr.run(model, cycles=4, discard=2, negligible={"impact_energy": "3 mJ"})
    assert findings.verdict.negligible == NegligibleImpacts(energy=3e-3)
    assert findings.motion.model.criteria.negligible is not None  # a saved run is judged alike


def test_a_saved_run_is_judged_by_its_own_thresholds(tmp_path: Path) -> None:
    model = gr.example("case3").with_({"criteria.negligible.impact_energy": "1 J"})
    run = gr.simulate(model, cycles=4, discard=2)
    run.save(tmp_path / "run.nc")
    judged = gr.criteria(gr.open_run(tmp_path / "run.nc"))
    assert judged.severity == "touches"
    assert judged.to_dict() == gr.criteria(run).to_dict()


@pytest.mark.parametrize(
    ("negligible", "words"),
    [
        ({"impact_energy": "1 N"}, "must be an energy"),
        ({"impact_energy": -1.0}, "must not be negative"),
        ({"approach_speed": "1 rpm"}, "must be a speed along the line of action"),
        ({"angular_approach_speed": "1 mm/s"}, "must be an angular velocity"),
        ({"energy": 1.0}, "unknown key"),
        (1e-6, "must be a table"),
    ],
)
def test_what_is_no_threshold_is_refused(negligible: dict[str, float | str], words: str) -> None:
    run = gr.simulate(gr.example("case3"), cycles=1, discard=0)
    with pytest.raises(gr.ModelError, match=words):
        gr.criteria(run, negligible=negligible)


def test_nothing_is_negligible_without_dimensions_unless_numbers_say_so() -> None:
    scaled = gr.nondimensionalize(gr.example("case3")).model
    run = gr.simulate(scaled.with_({"criteria.negligible": None}), cycles=12, discard=6)
    verdict = gr.criteria(run)
    assert verdict.negligible == NegligibleImpacts()
    assert verdict.rule.endswith("No impact is negligible.")
    assert verdict.severity == "rattles"
    assert all(part.rattles == part.separates for part in verdict.parts)
    assert gr.criteria(run, negligible={"impact_energy": 1e9}).severity == "touches"
    with pytest.raises(gr.ModelError, match="dimensionless"):
        gr.criteria(run, negligible={"impact_energy": "1 uJ"})


def test_a_model_without_its_dimensions_is_judged_alike() -> None:
    """The thresholds are scaled with it: those of energy, of speed and of angular speed, and the assumed one."""
    limits = {"criteria.negligible.approach_speed": "20 mm/s", "criteria.negligible.angular_approach_speed": "2 rad/s"}
    for changes in ({}, limits, {"criteria.negligible.impact_energy": "5 mJ"}):
        model = gr.example("case3").with_(changes)
        scaled = gr.nondimensionalize(model).model
        settings = {"cycles": 12, "discard": 6}
        here, there = (gr.criteria(gr.simulate(one, **settings)) for one in (model, scaled))
        assert [(p.name, p.severity) for p in here.parts] == [(p.name, p.severity) for p in there.parts]
