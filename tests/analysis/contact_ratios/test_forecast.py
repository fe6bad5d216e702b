"""Equivalent linearisation: closed forms of one oscillator, means that carry loads, motions that cross nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.analysis.contact_ratios.describing import under_sine
from gearrattle.analysis.contact_ratios.forecast import Linearisation, forecast
from gearrattle.assembly import assemble
from gearrattle.engine.system.equilibrium import equilibrium
from gearrattle.engine.system.law import Stage, staged
from gearrattle.engine.system.piecewise import PiecewiseSystem
from tests.engine.system.drivelines import inputs

PAPER = Path(__file__).parents[3] / "examples" / "paper"


def oscillator(force: float, frequency: float, mean: float = 0.0, alpha: float = 0.1) -> PiecewiseSystem:
    """One grounded inertia of 1 on a two-stage spring of slope 1, half gap 1, damping 0.1 that steps by alpha too."""
    stages = [Stage(alpha, 0.1 * alpha, 1.0), Stage(1.0, 0.1, None)]
    values = inputs(
        1,
        1,
        cycles=np.array([1.0]),
        period=np.array(2 * np.pi / frequency),
        mean=np.array([mean]),
        torque_sine=np.array([[force]]),
    )
    return PiecewiseSystem(np.ones(1), np.zeros(1), np.ones((1, 1)), (staged(stages, stages),), values)


@pytest.mark.parametrize("mean", [0.0, 0.05, 0.8])
@pytest.mark.parametrize("frequency", [0.4, pytest.param(0.7, marks=pytest.mark.long), 1.5])
def test_one_oscillator_satisfies_the_closed_forms(frequency: float, mean: float) -> None:
    system = oscillator(0.6, frequency, mean)
    actual = forecast(system)
    assert actual.points
    for point in actual.points:
        amplitude = float(np.sqrt(2.0) * point.deviation[0])
        want = under_sine(system.laws[0], amplitude, float(point.mean[0]))
        assert point.gain[0] == pytest.approx(want.gain, abs=2e-4)
        assert point.mean_slope[0] == pytest.approx(want.mean_slope, abs=2e-3)
        assert want.mean_force == pytest.approx(mean, abs=2e-4)
        dynamic = want.gain - frequency**2 + 1j * frequency * want.damping
        assert amplitude * abs(dynamic) == pytest.approx(0.6, rel=2e-3)


def test_all_three_branches_of_a_bent_resonance_are_kept() -> None:
    """A hardening spring driven a little above its soft frequency: large, middle and small motion."""
    actual = forecast(oscillator(0.08, 0.6, alpha=0.1))
    deviation = sorted(float(point.deviation[0]) for point in actual.points)
    assert len(deviation) == 3
    assert deviation[0] < 1 / np.sqrt(2) < deviation[1]


def test_a_linear_driveline_is_its_own_fixed_point() -> None:
    system = oscillator(0.6, 0.7)
    linear = PiecewiseSystem(
        system.inertia,
        system.drag,
        system.rows,
        (staged([Stage(1.0, 0.1, None)], [Stage(1.0, 0.1, None)]),),
        system.inputs,
    )
    actual = forecast(linear)
    assert (actual.searches, actual.failed, actual.points[0].gain.size) == (1, 0, 0)


@pytest.mark.slow
def test_a_fixed_point_that_crosses_nothing_is_a_motion() -> None:
    """Loaded case 1 has one inside the clutch's first stage, beside the motion that begins at rest."""
    model = gr.load(PAPER / "case1_loaded.toml")
    system = assemble(model).system
    quiet = next(p for p in forecast(system).points if p.gain == pytest.approx([0.1, 1.0], abs=1e-12))
    assert quiet.mean_slope == pytest.approx(quiet.gain, abs=1e-12)
    values, rest = system.inputs, equilibrium(system)
    omega = 2 * np.pi * values.cycles / values.period
    spring, damping = system.stiffness_of(rest.pieces), system.damping_of(rest.pieces)
    torque = values.torque_cosine - 1j * values.torque_sine
    wave = np.array(
        [
            np.linalg.solve(spring - w * w * np.diag(system.inertia) + 1j * w * damping, torque[:, j])
            for j, w in enumerate(omega)
        ]
    )
    start = {"angle": (rest.angle + wave.sum(axis=0).real).tolist(), "velocity": (1j * omega @ wave).real.tolist()}
    run = gr.simulate(model, cycles=20, discard=10, samples_per_cycle=256, initial=start)
    assert len(run.events) == 0
    deflection = run.trajectory.deflection[10 * 256 : -1]
    assert deflection.std(axis=0) == pytest.approx(quiet.deviation, rel=1e-6)
    assert gr.contact_ratio(run).to_list() == pytest.approx([0.1, 1.0])


def test_the_answer_does_not_depend_on_the_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    system = assemble(gr.load(PAPER / "case2.toml")).system
    shares = np.array([0.13, 0.34, 0.01, 0.13, 0.34, 0.01])
    coarse = Linearisation(system).answer(shares)
    monkeypatch.setattr("gearrattle.analysis.contact_ratios.forecast.FEWEST_SAMPLES", 8192)
    assert coarse == pytest.approx(Linearisation(system).answer(shares), abs=2e-3)


@pytest.mark.long
@pytest.mark.parametrize("number", [1, 2, 3])
def test_loaded_teeth_stay_in_contact_and_some_clutch_gain_is_near(number: int) -> None:
    model = gr.load(PAPER / f"case{number}_loaded.toml")
    reported = gr.contact_ratio(model, "describing")
    true = gr.contact_ratio(gr.simulate(model, cycles=120, discard=60, samples_per_cycle=256), "describing")
    points = reported.attrs["fixed_points"]
    assert all(point["gain"]["gear"] == pytest.approx(1.0, abs=1e-9) for point in points)
    assert true["gear"] == pytest.approx(1.0, abs=1e-9)
    assert min(abs(point["gain"]["clutch"] - true["clutch"]) for point in points) < 0.02
