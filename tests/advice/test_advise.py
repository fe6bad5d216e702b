"""Advice: what each line says and rests on, and how forecasts are scored."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.advice import Forecast, advise, scored
from gearrattle.advice.pilot import run_pilot
from gearrattle.analysis.stiffness import regions_visited
from gearrattle.errors import ModelError
from gearrattle.signals import dwell_of_regions, region_shares, steady
from gearrattle.simulation.settings import settled
from tests.comparison.cases import case

TOPICS = [
    "lumping",
    "scaling",
    "stiffness",
    "clearances",
    "contact ratios",
    "algorithm",
    "cost",
    "predictability",
    "other motions",
]


@pytest.fixture(scope="module")
def rattling() -> gr.typing.Advice:
    return advise(case("case3"), cycles=80, discard=40)


def test_every_topic_has_a_line_with_evidence(rattling: gr.typing.Advice) -> None:
    assert [line.topic for line in rattling.lines] == TOPICS
    assert all(line.words.endswith(".") and line.evidence for line in rattling.lines)
    assert all(line.words in rattling.report for line in rattling.lines)
    assert json.loads(json.dumps(rattling.to_dict(), allow_nan=False))["lines"][0]["topic"] == "lumping"


def test_lines_tell_what_the_calls_behind_them_found(rattling: gr.typing.Advice) -> None:
    model = case("case3")
    assert "gear double-sided" in rattling.line("clearances").words
    condition = gr.stiffness(model).condition
    assert f"balanced {condition['balanced']:.2g}" in rattling.line("scaling").evidence[0]
    pilot = gr.simulate(model, cycles=32, discard=16)
    worst = max(region.eigenvalues.r_lambda for region in regions_visited(pilot).regions)
    assert f"{worst:.4g}" in rattling.line("stiffness").words
    slopes = gr.contact_ratio(pilot)
    assert f"gear {slopes['gear']:.3g}" in rattling.line("contact ratios").words


def test_forecasts_are_settled_by_a_run(rattling: gr.typing.Advice) -> None:
    run = gr.simulate(case("case3"), cycles=80, discard=40)
    scores = rattling.scores(run)
    assert len(scores) == len(rattling.forecasts)
    settled_ones = {(s.forecast.quantity, s.forecast.subject): s for s in scores if "pilot" in s.forecast.by}
    horizon = settled_ones["predictable cycles", ""]
    assert horizon.happened == pytest.approx(run.predictability_horizon / run.trajectory.layout.period)
    assert horizon.right
    calls = settled_ones["function calls", ""]
    assert calls.happened == run.cost.function_calls
    assert settled_ones["mean slope", "gear"].happened == pytest.approx(gr.contact_ratio(run)["gear"], rel=1e-12)
    by_steps = rattling.scores(gr.simulate(case("case3"), algorithm="rkv", cycles=80, discard=40))
    assert {s.forecast.quantity for s in scores} - {s.forecast.quantity for s in by_steps} == {
        "function calls",
        "computing time",
    }


def test_what_counts_as_right() -> None:
    run = gr.simulate(case("case1_loaded"), cycles=40, discard=20)
    happened = {
        s.forecast.quantity: s.happened
        for s in scored(
            [Forecast(q, "", "", 1.0) for q in ("crossings a cycle", "function calls", "predictable cycles")], run
        )
    }
    crossings, calls = happened["crossings a cycle"], happened["function calls"]
    assert isinstance(crossings, float)
    assert isinstance(calls, float)
    cases = [
        (Forecast("crossings a cycle", "", "", 1.9 * crossings), True),
        (Forecast("crossings a cycle", "", "", 2.1 * crossings), False),
        (Forecast("function calls", "", "", 0.4 * calls), False),
        (Forecast("predictable cycles", "", "", math.inf), True),
        (Forecast("predictable cycles", "", "", 3.0), False),
        (Forecast("regime", "gear", "", "quiet"), True),
        (Forecast("regime", "gear", "", "single-sided"), False),
        (Forecast("corners", "gear", "", "not crossed"), True),
        (Forecast("mean slope", "gear", "", 0.91), True),
        (Forecast("mean slope", "gear", "", 0.89), False),
    ]
    assert [s.right for s in scored([forecast for forecast, _ in cases], run)] == [right for _, right in cases]
    assert scored([Forecast("regime", "nobody", "", "quiet")], run) == ()


def test_the_papers_rk4_step_is_advised_against() -> None:
    actual = advise(case("case3_loaded"), algorithm="rk4", step=0.0128 / 150, cycles=40)
    line = actual.line("algorithm")
    assert line.words.startswith("Do not use rk4 with the planned step of 85.33 µs: it is unstable.")
    assert "multiplies a mode by 1.688" in line.evidence[0]
    stable = advise(case("case3_loaded"), algorithm="rk4", step=0.0119 / 150, cycles=40)
    assert stable.line("algorithm").words.startswith("Use exact")


def test_a_quiet_driveline_is_told_so_with_its_certificate() -> None:
    model = case("case3_loaded").with_({"torque.0.mean": 101.25, "inertia.output_gear.drag_torque": 97.2})
    actual = advise(model, cycles=40)
    assert actual.line("clearances").words == "No clearance opens."
    assert "reaches no corner, so it is an exact motion" in actual.line("clearances").evidence[1]
    assert "any algorithm with error control" in actual.line("algorithm").words
    assert actual.line("predictability").words == "The motion is predictable point by point to the end of the run."


def test_lumping_is_tried_and_checked_by_flying_the_lumped_model() -> None:
    model = gr.loads(STIFF_SHAFT)
    lumped = advise(model, cycles=40).line("lumping")
    assert lumped.words == "Lump b into a: 3 bodies become 2."
    assert "same regimes" in lumped.evidence[-1]
    kept = advise(case("case3"), cycles=40, up_to="75 Hz").line("lumping")
    assert kept.words.startswith("Keep every body")
    assert "the band asked for: 75 Hz" in kept.evidence


def test_a_pilot_too_short_for_the_horizon_extrapolates() -> None:
    model = settled(case("case3_loaded"), {"cycles": 127, "discard": 27})
    long, short = run_pilot(model, 127), run_pilot(model, 127, cycles=6)
    assert long.predictable_cycles == gr.simulate(model).predictability_horizon / model_period(model)
    assert 0.5 < short.predictable_cycles / long.predictable_cycles < 2.0
    assert math.isinf(replace(long, planned=5).predictable_cycles)


def model_period(model: gr.Model) -> float:
    return gr.simulate(model, cycles=1).trajectory.layout.period


def test_dwell_times_of_regions_add_up_to_those_of_every_clearance() -> None:
    t = gr.simulate(case("case2"), cycles=30, discard=11).trajectory
    window, dwell = steady(t), dwell_of_regions(t)
    assert sum(dwell.values()) == pytest.approx(window.duration, rel=1e-12)
    for k in range(3):
        for label, share in region_shares(t, k, window).items():
            mine = sum(time for labels, time in dwell.items() if labels[k] == label)
            assert mine / window.duration == pytest.approx(share, abs=1e-12)


def test_visited_regions_come_with_their_shares_and_eigenvalues() -> None:
    run = gr.simulate(case("case3"), cycles=30, discard=10)
    visited = regions_visited(run).regions
    assert sum(entry.share for entry in visited) == pytest.approx(1.0, abs=1e-12)
    assert [entry.share for entry in visited] == sorted((entry.share for entry in visited), reverse=True)
    one = visited[1]
    direct = gr.stiffness(case("case3"), region=one.labels).eigenvalues
    np.testing.assert_allclose(np.sort_complex(one.eigenvalues.elastic), np.sort_complex(direct), rtol=1e-12)


@pytest.mark.parametrize(("settings", "match"), [({"cycles": 0}, "cycles"), ({"algorithm": "magic"}, "algorithm")])
def test_bad_settings_are_refused(settings: dict[str, object], match: str) -> None:
    with pytest.raises(ModelError, match=match):
        advise(case("case3"), **settings)


STIFF_SHAFT = """
schema = 1
name = "stiff shaft"
inertia = [ { name = "a", J = 0.3, drag = 0.01 }, { name = "b", J = 0.05 }, { name = "c", J = 0.02, drag = 0.2 } ]
[[coupling]]
name = "shaft"
between = ["a", "b"]
stiffness = 1e8
damping = 10.0
[[coupling]]
name = "spline"
between = ["b", "c"]
stiffness = 2000.0
damping = 1.0
clearance = 0.01
[excitation]
speed = 60.0
[[torque]]
on = "a"
mean = 4.0
harmonics = [ { order = 1, amplitude = 60.0 } ]
[[torque]]
on = "c"
mean = -4.0
"""
