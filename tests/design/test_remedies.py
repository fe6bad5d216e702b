"""Remedies against a closed form; what is remembered; what is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.design import motions
from gearrattle.design.halving import Tried
from gearrattle.design.motions import PUSHED, REST, Asked, moved_on
from gearrattle.design.target import ENERGY, target_of
from gearrattle.errors import Cancelled, ModelError
from tests.design.oscillator import LIMIT, loaded_gear

AMPLITUDE = "torque.0.harmonics.0.amplitude"
CANDIDATES = {
    "torque.0.mean": {"factor": (0.5, 4.0), "cost": 3.0},
    AMPLITUDE: {"factor": (0.3, 1.2), "cost": 1.0},
}


def test_the_smallest_changes_that_make_it_quiet():
    answer = gr.remedies(loaded_gear(1.5 * LIMIT), CANDIDATES, speeds=[], pairs=False)
    first, second = answer.remedies
    assert first.holds
    assert second.holds
    # A* = 1.5 of the mean, or the amplitude down to 1 / 1.5
    assert first.changes[AMPLITUDE].times == pytest.approx(1.0 / 1.5, rel=0.03)
    assert first.changes[AMPLITUDE].times < 1.0 / 1.5
    assert second.changes["torque.0.mean"].times == pytest.approx(1.5, rel=0.03)
    assert first.cost < second.cost
    assert not answer.own.holds
    assert answer.table["certified"].tolist() == [True, True]
    assert answer.table["value"].tolist() == [first.changes[AMPLITUDE].times, second.changes["torque.0.mean"].times]


def test_every_certified_remedy_is_quiet_at_every_speed():
    model = loaded_gear(1.5 * LIMIT)
    answer = gr.remedies(model, CANDIDATES, pairs=False)
    assert len(answer.speeds) == 3
    for remedy in answer.remedies:
        assert remedy.holds
        for speed in answer.speeds:
            run = gr.simulate(model.with_({**remedy.changes, "excitation.speed": speed}), audit=False)
            assert gr.criteria(run).verdict == "quiet"


@pytest.mark.slow
def test_a_remedy_says_which_body_gets_more_of_the_motion():
    model = gr.example("six_speed").with_({"simulation.cycles": 30, "simulation.discard": 10})
    candidate = {"coupling.spline.clearance": {"factor": (0.3, 1.0)}}
    answer = gr.remedies(model, candidate, "half", speeds=[], pairs=False)
    (remedy,) = answer.remedies
    levels = [study_of(model.with_(changes)) for changes in ({}, remedy.changes)]
    rises = levels[1] / levels[0]
    assert float(rises.max()) > 1.1
    body = str(rises.inertia[int(np.argmax(rises.values))].values)
    before, after = (float(level.sel(inertia=body)) for level in levels)
    words = f"transmissibility (rms) to {body} rises: {before:.3g} to {after:.3g}"
    assert words in remedy.side_effects


def study_of(model: gr.Model):
    """The transmissibility of every inertia."""
    return gr.study(model, {"simulation.cycles": [30]}, ["TR rms"], workers=1)["TR rms"].isel({"simulation.cycles": 0})


def test_what_changes_nothing_is_no_change():
    model = gr.example("six_speed").with_({"simulation.cycles": 6, "simulation.discard": 2})
    candidate = {"coupling.damper.stages.2.stiffness": {"factor": (0.7, 1.3)}}  # a stage that the motion never reaches
    (remedy,) = gr.remedies(model, candidate, speeds=[], pairs=False).remedies
    assert remedy.changes == {}
    assert "no other value is better" in remedy.change


def test_a_driveline_that_is_quiet_at_its_own_speed_alone_needs_a_remedy():
    model = loaded_gear(0.998 * LIMIT)
    one = gr.remedies(model, {AMPLITUDE: {"factor": (0.9, 1.1)}}, pairs=False)
    (remedy,) = one.remedies
    assert one.own.verdict == "quiet"
    assert remedy.holds
    for speed in one.speeds:
        run = gr.simulate(model.with_({**remedy.changes, "excitation.speed": speed}), audit=False)
        assert gr.criteria(run).verdict == "quiet"
    # what is tried of one candidate is no motion of the driveline as it is
    assert gr.remedies(model, CANDIDATES, pairs=False).own == one.own


def test_what_a_spring_does_is_no_impact_of_a_gap():
    model = gr.example("manual_transmission").with_({"torque.0.harmonics.0.amplitude": gr.factor(3)})
    target = target_of(model, "quiet")
    values = moved_on(Asked(model, REST, None, target.outputs, 1)).values
    energies = dict(zip(target.output_named(ENERGY).subjects, target.energies(values), strict=True))
    largest = dict(zip(target.output_named(ENERGY).subjects, values[ENERGY], strict=True))
    assert largest["damper"] > 0.0
    assert energies["damper"] == 0.0
    assert all(energies[gap] == largest[gap] for gap in target.severity.gaps if largest[gap] > 0.0)


def test_the_hardest_motion_does_not_depend_on_the_order_they_ran_in():
    model = loaded_gear(1.5 * LIMIT)
    target = target_of(model, "quiet")
    rest = moved_on(Asked(model, REST, None, target.outputs, 1))
    pushed = replace(rest, start=PUSHED)
    assert Tried(1.0, target, [rest, pushed]).hardest is Tried(1.0, target, [pushed, rest]).hardest


def test_two_changes_together_where_none_alone_is_enough():
    candidates = {"torque.0.mean": {"factor": (0.9, 1.3)}, AMPLITUDE: {"factor": (0.8, 1.1)}}
    answer = gr.remedies(loaded_gear(1.5 * LIMIT), candidates, speeds=[])
    pair = next(remedy for remedy in answer.remedies if len(remedy.changes) == 2)
    assert pair.holds
    assert pair is answer.remedies[0]
    ratio = pair.changes["torque.0.mean"].times / pair.changes[AMPLITUDE].times
    assert 1.5 <= ratio < 1.3 / 0.8
    assert not any(remedy.holds for remedy in answer.remedies[1:])


def test_half_as_hard_is_half_the_energy():
    answer = gr.remedies(loaded_gear(3.0 * LIMIT), {AMPLITUDE: {"factor": (0.2, 1.2)}}, "half", speeds=[], pairs=False)
    (remedy,) = answer.remedies
    assert remedy.holds
    assert remedy.hardest_impact < 0.5 * answer.own.hardest_impact


def test_motions_that_are_kept_are_not_simulated_again(tmp_path, monkeypatch):
    first = gr.remedies(loaded_gear(1.5 * LIMIT), CANDIDATES, keep=tmp_path)
    assert any(tmp_path.iterdir())

    def refuse(*_arguments, **_options):
        raise AssertionError("simulated again")

    monkeypatch.setattr(motions, "simulate", refuse)
    again = gr.remedies(loaded_gear(1.5 * LIMIT), CANDIDATES, keep=tmp_path)
    assert again.remedies == first.remedies


def test_a_damaged_motion_is_simulated_again(tmp_path):
    first = gr.remedies(loaded_gear(1.5 * LIMIT), CANDIDATES, speeds=[], keep=tmp_path)
    for file in tmp_path.iterdir():
        file.write_bytes(file.read_bytes()[:100])
    again = gr.remedies(loaded_gear(1.5 * LIMIT), CANDIDATES, speeds=[], keep=tmp_path)
    assert again.remedies == first.remedies


def test_a_search_that_is_stopped_tells_what_it_knows():
    calls = 0

    def stop(_share: float) -> None:
        nonlocal calls
        calls += 1
        if calls > 6:
            raise Cancelled("enough")

    answer = gr.remedies(loaded_gear(1.5 * LIMIT), CANDIDATES, speeds=[], workers=1, progress=stop)
    assert any("stopped" in note for note in answer.notes)


def test_the_default_list_has_what_the_driveline_has():
    model = gr.example("manual_transmission")
    from gearrattle.design.candidates import candidates_of

    paths = [candidate.variable.path for candidate in candidates_of(model, None)]
    assert paths[:2] == ["inertia.*.drag_torque", "mesh.*.backlash"]
    assert len(paths) == len(set(paths)) > 4


@pytest.mark.parametrize(
    ("candidates", "location"),
    [
        ({}, "candidates"),
        ({"torque.0.no": (1.0, 2.0)}, "torque.0.no"),
        ({AMPLITUDE: {"factor": (2.0, 3.0)}}, "range"),
        ({AMPLITUDE: {"factor": (0.5, 1.5), "cost": -1.0}}, "cost"),
    ],
)
def test_what_is_wrong_is_said_before_anything_runs(candidates, location):
    with pytest.raises(ModelError) as refused:
        gr.remedies(loaded_gear(), candidates)
    assert location in str(refused.value)


def test_its_page_says_all(tmp_path):
    answer = gr.remedies(loaded_gear(1.5 * LIMIT), CANDIDATES, speeds=[], pairs=False)
    page = gr.save(answer, tmp_path / "page")
    text = page.read_text(encoding="utf-8")
    assert "torque amplitude on gear" in text
    assert "certified" in text
