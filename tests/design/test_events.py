"""Decisions about events: how slow a ramp must be, and which change softens it."""

from __future__ import annotations

import pytest

import gearrattle as gr

PATH = "torque.0.ramps.0.over"


def hardest(model: gr.Model) -> float:
    event = gr.criteria(gr.simulate(model, audit=False)).event
    assert event is not None
    assert event.hardest is not None
    return event.hardest.energy


def test_how_slow_a_ramp_must_be():
    model = gr.example("tip_in")
    answer = gr.threshold(model, PATH, ("50 ms", "400 ms"), "largest impact energy < 5 mJ", workers=1)
    low, high = answer.bracket
    assert answer.value == high
    assert hardest(model.with_({PATH: low})) >= 5e-3 > hardest(model.with_({PATH: high}))
    assert set(answer.data["start"].values[(answer.data["holds"].values >= 0).any(axis=0)]) == {"rest"}
    assert answer.sentence.startswith(
        "Duration of the ramp of the torque on rotor: largest impact energy below 5 mJ from"
    )
    assert answer.tables()[0].head == ("value", "from rest", "hardest impact", "part")


def test_a_remedy_of_an_event_holds_in_the_event():
    model = gr.example("tip_in")
    answer = gr.remedies(model, {"mesh.*.backlash": {"factor": (0.2, 1.0)}, PATH: {"factor": (1.0, 8.0)}}, "half")
    assert answer.speeds == (model.excitation.omega,)
    before = hardest(model)
    certified = [remedy for remedy in answer.remedies if remedy.holds]
    assert certified
    for remedy in certified:
        assert hardest(model.with_(remedy.changes)) < 0.5 * before


def test_a_sweep_is_no_event():
    with pytest.raises(gr.ModelError, match="a sweep of the speed"):
        gr.threshold(gr.example("run_up"), "torque.0.mean", (1.0, 2.0))
