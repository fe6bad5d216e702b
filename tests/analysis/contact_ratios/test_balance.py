"""Periodic motions behind fixed points: against exact runs, closed forms, and the flow's gradient along a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from benchmarks.forecast.measure import measure_one, score
from benchmarks.forecast.models import model, train

import gearrattle as gr
from gearrattle.analysis.contact_ratios.forecast import Linearisation, forecast
from gearrattle.analysis.contact_ratios.harmonic_balance import balance, multipliers
from gearrattle.assembly import assemble
from tests.analysis.contact_ratios.test_forecast import oscillator

PAPER = Path(__file__).parents[3] / "examples" / "paper"


@pytest.fixture(scope="module")
def case_1():
    return forecast(assemble(gr.load(PAPER / "case1_loaded.toml")).system)


@pytest.mark.slow
def test_the_stable_motion_is_the_one_simulated(case_1) -> None:
    """Loaded case 1 from rest: linearisation tells a gain of 0.208, the motion behind it has the run's."""
    run = gr.simulate(gr.load(PAPER / "case1_loaded.toml"), cycles=200, discard=150, samples_per_cycle=1024)
    slope, gain = gr.contact_ratio(run), gr.contact_ratio(run, "describing")
    near = [p for p in case_1.points if p.confirmed and abs(p.gain[0] - gain["clutch"]) < 0.02]
    (point,) = near
    assert point.ratios[0] == pytest.approx(gain.to_numpy(), abs=2e-4)
    assert point.ratios[1] == pytest.approx(slope.to_numpy(), abs=2e-3)
    assert abs(point.gain[0] - gain["clutch"]) > 5e-3


def test_the_middle_branch_is_unstable(case_1) -> None:
    quiet, outer, middle = case_1.points
    assert (quiet.confirmed, outer.confirmed, middle.confirmed) == (True, True, False)
    assert quiet.gain[0] < middle.gain[0] < outer.gain[0]
    assert middle.motion.settled
    assert middle.motion.multiplier > 1.5
    assert middle.ratios[0] is middle.gain


def test_three_branches_of_a_bent_resonance_are_two_motions() -> None:
    points = sorted(forecast(oscillator(0.08, 0.6, alpha=0.1)).points, key=lambda p: p.deviation[0])
    assert [p.confirmed for p in points] == [True, False, True]


@pytest.mark.parametrize("mean", [0.05, 0.8])
def test_multipliers_of_a_motion_within_one_piece_are_the_linear_ones(mean: float) -> None:
    """exp(-c T / 2m) twice below critical damping: slopes 0.1 and 1 with damping 0.01 and 0.1, half gap 1."""
    system = oscillator(1e-3, 2.0, mean)
    rest = mean / 0.1 if mean < 0.1 else mean + 0.9
    damping = 0.01 if mean < 0.1 else 0.1
    actual = multipliers(system, np.full((1, 64), rest))
    assert actual == pytest.approx(np.exp(-0.5 * damping * system.inputs.period), rel=1e-12)


@pytest.mark.parametrize("seed", [*(pytest.param(seed, marks=pytest.mark.long) for seed in (103, 107)), 118])
def test_multipliers_are_those_of_the_flow_along_a_run(seed: int) -> None:
    """The exact run's own gradient over one settled period; a shift of all angles is apart."""
    driveline = train(seed)
    system, samples = assemble(driveline).system, 4096
    settled = gr.simulate(driveline, cycles=400, audit=False).trajectory
    start = {"angle": (settled.angle[-1] - settled.angle[-1, 0]).tolist(), "velocity": settled.velocity[-1].tolist()}
    run = gr.simulate(driveline, cycles=1, discard=0, samples_per_cycle=samples, initial=start, audit=False)
    deflection = system.rows @ run.trajectory.angle[:-1].T
    want = np.sort(np.abs(np.linalg.eigvals(run.variation.gradient())))[::-1]
    actual = multipliers(system, deflection)
    assert len(run.events) > 0
    assert actual[0] == pytest.approx(1.0, abs=1e-9)
    assert actual[1 : 1 + want.size] == pytest.approx(want, abs=1e-4)
    point = forecast(system).points[0]
    assert point.confirmed
    assert point.motion.multiplier == pytest.approx(1.0, abs=1e-6)


def test_what_has_no_clearance_or_no_period_seeks_no_motion() -> None:
    system = oscillator(0.6, 0.7)
    linear = Linearisation(system)
    assert linear.periodic
    assert forecast(system).points[0].motion is not None
    beating = gr.Model.from_tables(
        {
            "schema": 1, "units": "dimensionless", "inertia": [{"name": "body", "J": 1.0}],
            "coupling": [{"name": "gap", "between": ["body", "ground"], "stiffness": 1.0, "damping": 0.2,
                          "clearance": 1.0, "stiffness_ratio": 0.5, "damping_ratio": 0.5}],
            "excitation": {"speed": 1.7},
            "torque": [{"on": "body", "harmonics": [{"order": 1, "amplitude": 1.0},
                                                    {"order": 2**0.5, "amplitude": 1.0}]}],
        }
    )  # fmt: skip
    reported = gr.contact_ratio(beating)
    assert reported.attrs["fixed_points"][0]["motion"] == "not sought"
    assert "no periodic motion was sought" in reported.attrs["notes"][-1]


def test_a_motion_without_corners_is_its_fixed_point() -> None:
    """Inside one piece the distortion is nothing: the first look settles it."""
    system = oscillator(1e-3, 2.0, 0.8)
    actual = balance(system, np.array([1.0]), np.array([0.1]), Linearisation(system).means)
    assert actual.stable
    assert (actual.gain[0], actual.mean_slope[0]) == (pytest.approx(1.0), pytest.approx(1.0))


@pytest.mark.long
def test_the_score_of_small_trains() -> None:
    """Six trains of the published page: confirmed forecasts are right but where a second motion exists."""
    rows = [measure_one("train", seed, model("train", seed)) for seed in range(101, 107)]
    confirmed = [row for row in rows if row["motion"] == "stable"]
    for key, limit in (("gain", 1e-3), ("mean_slope", 1e-3)):
        before, after = score(confirmed, "linearised", key), score(confirmed, "told", key)
        assert after["median"] < limit
        assert after["median"] < before["median"]
        assert after["within"] >= before["within"]
        assert after["largest"] > 0.2  # seed 106: stable, and not the motion met; if this fails, say so on the page
    assert len(confirmed) == 5
    rest = [row for row in rows if row["motion"] != "stable"]
    assert score(rest, "told", "gain") == score(rest, "linearised", "gain")
