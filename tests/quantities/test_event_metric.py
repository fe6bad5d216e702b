"""Metrics of events: what is measured of them, and that averages over cycles are not."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.quantities.metric_sources import recording_of
from gearrattle.quantities.quantity_table import METRICS
from gearrattle.report.reliability import trust

STIFFNESS, INERTIA, STEP = 400.0, 0.01, 30.0
SHAFT = f"""
schema = 1
inertia = [{{ name = "a", J = {INERTIA} }}]
coupling = [{{ name = "shaft", between = ["a", "ground"], stiffness = {STIFFNESS} }}]
excitation = {{ speed = 100.0, duration = "0.3 s" }}
torque = [{{ on = "a", ramps = [{{ at = 0.05, to = {STEP} }}] }}]
"""
TIP_IN = gr.example("tip_in")


def values(table) -> dict[tuple[str, str], float]:
    return {(row.subject, row.quantity): row.value for row in table.itertuples()}


def test_a_step_on_an_undamped_shaft_has_levels_in_closed_form() -> None:
    omega = math.sqrt(STIFFNESS / INERTIA)
    measured = values(gr.metrics(gr.simulate(gr.loads(SHAFT), samples_per_cycle=4000)))
    assert measured["a", "peak angular acceleration"] == pytest.approx(STEP / INERTIA, rel=1e-9)
    assert measured["shaft", "peak torque"] == pytest.approx(2.0 * STEP, rel=1e-5)
    # torque T (1 - cos w t) from the step to the end, which is never settled
    end = math.ceil(0.3 * 100.0 / (2.0 * math.pi)) * 2.0 * math.pi / 100.0
    length = omega * (end - 0.05)
    square = 1.5 - 2.0 * math.sin(length) / length + 0.25 * math.sin(2.0 * length) / length
    assert measured["shaft", "rms torque"] == pytest.approx(STEP * math.sqrt(square), rel=1e-3)
    assert measured["driveline", "time to settle"] == pytest.approx(end - 0.05)


def test_an_event_has_what_its_verdict_says() -> None:
    run = gr.simulate(TIP_IN)
    event = gr.criteria(run).event
    table = gr.metrics(run)
    measured = values(table)
    assert measured["driveline", "first impact"] == event.first_impact
    assert measured["driveline", "impacts"] == event.impacts
    assert measured["driveline", "hardest impact"] == event.hardest.energy
    assert measured[event.hardest.part, "largest impact energy"] == pytest.approx(event.hardest.energy)
    assert measured["driveline", "time to settle"] == pytest.approx(event.settled - 0.2)
    losses = gr.metrics(run, names=["impact_loss"], kind="steady")
    rates = values(losses)
    length = float(run.trajectory.time[-1])
    for gap in ("rotor_spline", "first_stage", "final_drive"):
        assert measured[gap, "energy lost in impacts"] == pytest.approx(rates[gap, "impact loss rate"] * length)
    peak = np.abs(run.data["acceleration"].sel(inertia="pinion")).max()
    assert measured["pinion", "peak angular acceleration"] >= float(peak)


def test_averages_over_cycles_are_not_measured_of_an_event() -> None:
    run = gr.simulate(TIP_IN)
    table = gr.metrics(run)
    assert set(table.metric) == {"event", "separation"}
    assert "force_statistics" in table.attrs["notes"][0]
    asked = gr.metrics(run, names=["force_statistics", "event"])
    refused = asked[asked.metric == "force_statistics"]
    assert len(refused) == 1
    assert math.isnan(refused.value.iloc[0])
    assert "says nothing of an event" in refused.note.iloc[0]
    steady = gr.metrics(run, kind="steady")
    assert set(steady.metric) == {metric.name for metric in METRICS}


def test_the_start_up_of_a_steady_run_and_a_recording_are_events_on_request() -> None:
    run = gr.simulate(gr.example("case3"), cycles=20, discard=0)
    assert "event" not in set(gr.metrics(run).metric)
    assert "event" in set(gr.metrics(run, kind="transient").metric)
    simulated = gr.simulate(TIP_IN)
    recorded = values(gr.metrics(recording_of(simulated.trajectory), kind="transient"))
    assert recorded["half_shafts", "peak torque"] == pytest.approx(1082.0, rel=1e-3)
    assert ("driveline", "first impact") not in recorded
    with pytest.raises(gr.ModelError, match="chunks"):
        gr.metrics(iter([run]), kind="transient")
    with pytest.raises(gr.ModelError, match="kind"):
        gr.metrics(run, kind="slow")


def test_the_page_of_a_run_measures_the_event() -> None:
    assert {row.name for row in gr.run(TIP_IN).metrics} == {"event", "separation"}


def test_the_page_of_an_event_compares_no_halves_of_the_run() -> None:
    settled = " ".join(trust(gr.run(TIP_IN)))
    assert "second half" not in settled
    assert "has not settled" not in settled
    assert "has not settled" in " ".join(trust(gr.run(TIP_IN.with_({"excitation.duration": 0.24}))))
    assert "second half" in " ".join(trust(gr.run(gr.example("case3"), cycles=20, discard=10)))
