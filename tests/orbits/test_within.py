"""Answers within a time: branches where it suffices for them, else sweeps; and words for what is missing."""

from __future__ import annotations

import pytest

import gearrattle as gr
from gearrattle.errors import Cancelled, ConvergenceError, ModelError
from gearrattle.orbits import branches_or_sweeps
from gearrattle.orbits.balanced import balanced

AMPLITUDE = "torque.0.harmonics.0.amplitude"
SPEED = "excitation.speed"


def test_with_time_enough_the_branch_is_the_answer() -> None:
    model = gr.example("rattle_oscillator")
    whole = gr.continuation(model, AMPLITUDE, (4.0, 7.0))
    shares: list[float] = []
    bounded = gr.continuation(model, AMPLITUDE, (4.0, 7.0), within="1000 s", progress=shares.append)
    assert bounded.sweeps is None
    assert bounded.events.equals(whole.events)
    assert bounded.notes == whole.notes
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_where_branches_take_too_long_sweeps_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(branches_or_sweeps, "_COMPILED", 1e-9)
    monkeypatch.setattr(branches_or_sweeps, "_GENERAL", 1e-9)
    model = gr.example("backlash_oscillator")
    branch = gr.continuation(model, SPEED, (0.55, 0.95), within=1000.0)
    assert branch.sweeps is not None
    assert branch.curves == ()
    assert branch.sentence.startswith("Over speed from 0.55 to 0.95: two stable motions from ")
    assert "Going up the motion jumps at " in branch.sentence
    assert branch.data.sizes["point"] == 0
    assert branch.data.sizes["motion"] == len(branch.sweeps.up) + len(branch.sweeps.down)
    assert any(note.startswith("No branch was followed") for note in branch.notes)
    # a short branch through a jump locates it: it is a fold
    exact = gr.continuation(model, SPEED, (0.55, 0.95)).events
    folds = sorted(exact.loc[exact["kind"] == "fold", "value"])
    located = [jump for jump in branch.sweeps.jumps if jump.kind == "fold"]
    assert sorted(jump.value for jump in located) == pytest.approx(folds, abs=1e-9)


def test_a_stop_leaves_what_was_followed() -> None:
    def stop(share: float) -> None:
        if share > 0.1:
            raise Cancelled

    model = gr.example("rattle_oscillator")
    branch = gr.continuation(model, AMPLITUDE, (3.0, 6.7), within=1000.0, progress=stop)
    assert branch.curves
    assert branch.notes[-1].startswith("Stopped: 1 branch followed, the last one to ")
    assert branch.sentence


def test_nothing_known_is_an_error_with_a_remedy() -> None:
    with pytest.raises(ConvergenceError, match="no motion was known after 1e-09 s"):
        gr.continuation(gr.example("rattle_oscillator"), AMPLITUDE, (3.0, 6.7), within=1e-9)
    with pytest.raises(ConvergenceError, match="within 1e-09 s"):
        gr.periodic(gr.example("rattle_oscillator"), within=1e-9)


def test_all_motions_known_when_the_time_is_over_are_the_result() -> None:
    def stop(share: float) -> None:
        if share > 0.35:
            raise Cancelled

    orbits = gr.periodic(gr.example("backlash_oscillator"), every=True, within=1000.0, progress=stop)
    assert orbits
    assert all("stopped before its end" in orbit.notes[-1] for orbit in orbits)


@pytest.mark.parametrize("time", [-1.0, "5 rpm", "soon"])
def test_a_time_without_sense_is_refused(time: float | str) -> None:
    for call in (
        lambda: gr.periodic(gr.example("rattle_oscillator"), within=time),
        lambda: gr.continuation(gr.example("rattle_oscillator"), AMPLITUDE, (3.0, 6.7), within=time),
    ):
        with pytest.raises(ModelError, match="within"):
            call()


def test_means_that_lack_a_rounding_are_balanced_silently() -> None:
    free = {
        "schema": 1,
        "inertia": [{"name": "engine", "J": 0.1}, {"name": "gear", "J": 0.01, "drag_torque": "0.3 N*m"}],
        "coupling": [
            {"name": "shaft", "between": ["engine", "gear"], "stiffness": 100.0, "damping": 0.1, "clearance": 0.01}
        ],
        "excitation": {"speed": "1500 rpm"},
        "torque": [
            {"on": "engine", "mean": "0.2999982 N*m", "harmonics": [{"order": 2, "amplitude": "5 N*m"}]},
        ],
    }
    model = gr.Model.from_tables(free)
    assert balanced(model)["torque.0.mean"] == "balance"
    assert balanced(model, "torque.0.mean") is model
    orbit = gr.periodic(model)
    assert orbit.residual < 1e-9
    assert not any("balance" in note for note in orbit.notes)
    with pytest.raises(ModelError, match="must balance"):
        gr.periodic(model.with_({"torque.0.mean": 0.2999}))
