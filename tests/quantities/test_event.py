"""Transients: first and hardest impact, peak torques, against closed forms and the log of crossings."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gearrattle as gr

STIFFNESS, INERTIA, STEP = 400.0, 0.01, 30.0
SHAFT = f"""
schema = 1
inertia = [{{ name = "a", J = {INERTIA} }}]
coupling = [{{ name = "shaft", between = ["a", "ground"], stiffness = {STIFFNESS} }}]
excitation = {{ speed = 100.0, duration = "0.3 s" }}
torque = [{{ on = "a", ramps = [{{ at = 0.05, to = {STEP} }}] }}]
"""
TIP_IN = gr.example("tip_in")


def test_a_step_twists_a_shaft_by_twice_its_static_torque():
    omega = math.sqrt(STIFFNESS / INERTIA)
    verdict = gr.criteria(gr.simulate(gr.loads(SHAFT), samples_per_cycle=2000))
    assert verdict.kind == "transient"
    assert verdict.first_impact is None
    peak = verdict.peak_torque["shaft"]
    assert abs(peak.value) == pytest.approx(2.0 * STEP, rel=1e-5)
    since = (peak.time - 0.05) % (2.0 * math.pi / omega)
    assert since == pytest.approx(math.pi / omega, abs=1e-4)


@pytest.mark.parametrize("over", [0.01, math.pi / 100.0, 0.1])
def test_a_slow_ramp_overshoots_as_the_closed_form_says(over: float):
    # undamped: the overshoot of a ramp of length t_r is |sin(w t_r / 2)| / (w t_r / 2)
    half = 0.5 * math.sqrt(STIFFNESS / INERTIA) * over
    model = gr.loads(SHAFT).with_({"torque.0.ramps.0.over": over})
    verdict = gr.criteria(gr.simulate(model, samples_per_cycle=2000))
    expected = STEP * (1.0 + abs(math.sin(half)) / half)
    assert abs(verdict.peak_torque["shaft"].value) == pytest.approx(expected, rel=1e-5)


def test_ramps_are_the_record_of_the_same_points():
    ramped = gr.simulate(TIP_IN)
    (ramp,) = TIP_IN.torques[0].ramps
    rise = ramp.to - TIP_IN.torques[0].mean
    points = {"time": [0.0, ramp.at, ramp.at + ramp.over, 10.0], "value": [0.0, 0.0, rise, rise]}
    record = {**points, "interpolation": "linear", "static": 0.0}
    recorded = gr.simulate(TIP_IN.with_({"torque.0.ramps": None, "torque.0.signal": record}), discard=0)
    np.testing.assert_allclose(ramped.events["time"], recorded.events["time"], rtol=1e-12)


def test_what_is_said_of_an_event_is_in_its_log():
    run = gr.simulate(TIP_IN)
    verdict = gr.criteria(run)
    event = verdict.event
    log = run.events
    inward = log["to_region"].abs() > log["from_region"].abs()
    assert verdict.first_impact == log["time"][inward].min()
    assert event.hardest.energy == pytest.approx(max(part.max_impact_energy or 0.0 for part in verdict.parts))
    assert event.hardest.part == verdict.parts[0].name
    assert event.first_impact <= event.hardest.time <= event.last_impact
    torque = run.data["element_torque"]
    for name, peak in verdict.peak_torque.items():
        sampled = float(np.abs(torque.sel(element=name)).max())
        assert abs(peak.value) == pytest.approx(sampled, rel=1e-2)
        assert abs(peak.value) >= sampled * (1.0 - 1e-12)
    assert event.sentence == verdict.sentence


def test_the_hardest_impact_grows_with_the_ramp_rate():
    energies = [
        gr.criteria(gr.simulate(TIP_IN.with_({"torque.0.ramps.0.over": over}))).event.hardest.energy
        for over in (0.0, 0.05, 0.2)
    ]
    assert energies == sorted(energies, reverse=True)


def test_the_start_up_of_a_steady_run_is_an_event_on_request():
    run = gr.simulate(gr.example("case3"), cycles=20, discard=0)
    assert gr.criteria(run).kind == "steady"
    assert gr.criteria(run).first_impact is None
    assert gr.criteria(run).peak_torque == {}
    assert gr.criteria(run, kind="transient").first_impact < 0.01
    with pytest.raises(gr.ModelError, match="steady"):
        gr.criteria(run, kind="slow")


def test_a_run_of_a_duration_has_whole_periods_and_is_judged_from_its_start():
    run = gr.simulate(TIP_IN)
    period = 2.0 * math.pi / TIP_IN.excitation.omega
    assert run.trajectory.discard == 0
    assert run.trajectory.cycles == math.ceil(TIP_IN.excitation.duration / period - 1e-9)
    assert gr.simulate(TIP_IN, cycles=3).trajectory.cycles == 3


def test_what_needs_inputs_that_repeat_refuses_ramps():
    with pytest.raises(gr.ModelError, match=r"torque\.0\.ramps"):
        gr.periodic(TIP_IN)
    assert gr.modes(TIP_IN).frequencies.size == len(TIP_IN.inertias)


def test_thresholds_of_a_call_and_plain_numbers_hold_for_an_event():
    run = gr.simulate(TIP_IN)
    every = gr.criteria(run, negligible={"impact_energy": 0.0}).event
    few = gr.criteria(run, negligible={"impact_energy": "9 mJ"}).event
    assert every.impacts > few.impacts == 1
    scaled = gr.nondimensionalize(TIP_IN).model
    sentence = gr.criteria(gr.simulate(scaled)).sentence
    assert not {"s", "ms", "J", "mJ", "N", "m"} & set(
        sentence.replace(";", "").replace(",", "").replace(".", "").split()
    )
