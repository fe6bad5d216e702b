"""What counts as rattle: a clearance that separates, not a spring that changes its stage."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.quantities.evaluation import judge
from gearrattle.signals import gap_names
from tests.signals.handmade import chain, staged, trajectory

STAGED = staged([-1.0, 1.0], -1, [5.0, 1.0, 5.0])
"""Stiffness in all its stages."""
FREE_AND_STAGED = staged([-2.0, -1.0, 1.0, 2.0], -2, [9.0, 5.0, 0.0, 5.0, 9.0])
"""A free first stage between two outer ones a side."""


def test_a_stage_change_is_no_rattle() -> None:
    verdict = judge(trajectory(STAGED, chain([0, 1, 0, -1, 0], [0.5, 1.0, 1.5, 2.0])))
    spring = next(part for part in verdict.parts if part.name == "spring")
    assert (verdict.verdict, spring.regime, spring.rattles) == ("quiet", "double-sided", False)
    assert verdict.sentence.startswith("No gap rattles")
    assert gap_names(STAGED) == ()


def test_a_gap_that_stays_in_contact_and_changes_stage_is_no_rattle() -> None:
    """Its regime is that of the corners at which it separates; the stage changes are told as such."""
    verdict = judge(trajectory(FREE_AND_STAGED, chain([1, 2, 1, 2, 1], [0.5, 1.0, 1.5, 2.0]), initial=[1]))
    spring = next(part for part in verdict.parts if part.name == "spring")
    assert (verdict.verdict, spring.regime, spring.gap, spring.rattles) == ("quiet", "quiet", True, False)
    assert "spring changes stage on its drive side only" in verdict.sentence.lower()


def test_a_gap_that_separates_rattles_whatever_its_outer_stages_do() -> None:
    regions, times = [1, 2, 1, 0, 1], [0.5, 1.0, 1.5, 2.0]
    verdict = judge(trajectory(FREE_AND_STAGED, chain(regions, times), initial=[1]))
    spring = next(part for part in verdict.parts if part.name == "spring")
    assert (verdict.verdict, spring.regime, spring.rattles) == ("single-sided", "single-sided", True)


CLUTCH_AND_GEAR = """
schema = 1
name = "A staged clutch that changes stage, and a gear with backlash that is held"
inertia = [
  { name = "flywheel", J = 0.2 }, { name = "hub", J = 0.01, drag = 0.02 },
  { name = "gear", J = 1e-4, drag_torque = 1.0 },
]
torque = [{ on = "flywheel", mean = 3.0, harmonics = [{ order = 2, amplitude = 150.0 }] }]

[excitation]
speed = 100.0

[[coupling]]
name = "clutch"
between = ["flywheel", "hub"]
stages = [{ until = 0.004, stiffness = 300.0, damping = 0.3 }, { stiffness = 900.0, damping = 0.9 }]

[[mesh]]
name = "mesh"
between = ["hub", "gear"]
radii = [0.05, 0.05]
stiffness = 1e7
damping = 300.0
backlash = 1e-4

[simulation]
cycles = 30
discard = 20
"""


def test_a_study_counts_no_stage_changes_as_rattle() -> None:
    """The clutch works through its corner in every sample; the mesh alone can rattle, and its probability is told."""
    model = gr.loads(CLUTCH_AND_GEAR)
    vary = {"inertia.gear.drag_torque": {"distribution": "uniform", "from": 0.9, "to": 1.1}}
    actual = gr.study(model, outputs=["verdict", "regime"], vary=vary, samples=8, seed=2)
    regime = actual["regime"]
    assert (regime.sel(part="clutch") > 0).all()
    assert (actual["verdict"] == regime.sel(part="mesh")).all()
    probability = gr.studies.rattle_probability(actual)
    assert probability["part"].values.tolist() == ["mesh"]
    whole = gr.studies.rattle_probability(actual, "verdict")
    assert float(whole["probability"]) == float(probability["probability"].sel(part="mesh"))
    for code, sample in zip(actual["verdict"].values, actual["inertia.gear.drag_torque"].values, strict=True):
        alone = gr.criteria(gr.simulate(model.with_({"inertia.gear.drag_torque": float(sample)})))
        assert ("quiet", "single-sided", "double-sided")[int(code)] == alone.verdict


def test_the_page_of_a_study_says_rattle_of_gaps_alone() -> None:
    """No sentence, bar or table names the clutch with a probability of rattle."""
    from gearrattle.report.study_pages.grid_page import summary_of
    from gearrattle.report.study_tables import probability_table

    vary = {"inertia.gear.drag_torque": {"distribution": "uniform", "from": 0.9, "to": 1.1}}
    actual = gr.study(gr.loads(CLUTCH_AND_GEAR), outputs=["regime"], vary=vary, samples=8, seed=2)
    assert "clutch" not in summary_of(actual)
    assert "mesh rattles in" in summary_of(actual)
    assert [row[0] for row in probability_table(actual).rows] == ["mesh"]
    only_clutch = actual.isel(part=np.array([0]))
    assert summary_of(only_clutch) == "No part has a gap: nothing can rattle."
    assert probability_table(only_clutch).rows == ()


@pytest.mark.parametrize("name", ["fifth_gear", "case1"])
def test_what_rattles_is_a_gap(name: str) -> None:
    path = "examples/manual_transmission.toml" if name == "fifth_gear" else "examples/paper/case1.toml"
    run = gr.simulate(gr.load(path), cycles=12, discard=6)
    verdict = gr.criteria(run)
    assert {part.name for part in verdict.parts if part.rattles} <= set(gap_names(run.trajectory.layout))
