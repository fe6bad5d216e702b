"""Hooke joints: the series, the torque on the driving side, a motion against the joint's own nonlinear equations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.assembly.ripple import load_ripples
from gearrattle.model import Harmonic

OMEGA = 60.0
STIFFNESS = 4000.0
LOAD = 30.0
J_IN, J_OUT = 0.05, 0.08


def driveline(angle: float, **changes: object) -> gr.Model:
    """Return a driver and a driven body on a sprung joint."""
    coupling = {"name": "joint", "between": ["in", "out"], "stiffness": STIFFNESS, "damping": 1.0}
    coupling = coupling | {"hooke": {"angle": angle, "phase": 0.3}} | changes
    coupling = {key: value for key, value in coupling.items() if value is not None}
    return gr.Model.from_tables(
        {
            "schema": 1,
            "inertia": [{"name": "in", "J": J_IN}, {"name": "out", "J": J_OUT, "drag_torque": LOAD}],
            "coupling": [coupling],
            "excitation": {"speed": OMEGA},
            "torque": [{"on": "in", "mean": LOAD}],
        }
    )


@pytest.mark.parametrize("degrees", [0.0, 0.5, 12.0, 30.0, 45.0, 59.0])
def test_the_series_is_the_joint(degrees: float) -> None:
    angle, phi = np.radians(degrees), np.linspace(-1.5, 1.5, 301)
    joint = driveline(angle, hooke={"angle": angle}).couplings[0].hooke
    assert joint is not None
    error, slope = summed(joint.errors(), phi / OMEGA), summed(joint.load_ripple(), phi / OMEGA)
    output = np.arctan2(np.sin(phi), np.cos(phi) * np.cos(angle))
    assert np.max(np.abs(phi - error - output)) < 2e-15
    rate = np.cos(angle) / (1.0 - (np.sin(angle) * np.cos(phi)) ** 2)
    assert np.max(np.abs(1.0 - slope - rate)) < 2e-13


def nonlinear(angle: float, end: float, state: np.ndarray) -> np.ndarray:
    """Integrate T = k delta + c delta', delta = in - out - e(phi), with phi = Omega t + 0.3 + in from rest on; (4,)."""

    def e(phi: float) -> tuple[float, float]:
        output = np.arctan2(np.sin(phi), np.cos(phi) * np.cos(angle))
        output += 2.0 * np.pi * np.round((phi - output) / (2.0 * np.pi))
        return phi - output, 1.0 - np.cos(angle) / (1.0 - (np.sin(angle) * np.cos(phi)) ** 2)

    def rate(time: float, y: np.ndarray) -> list[float]:
        error, slope = e(OMEGA * time + 0.3 + y[0] - state[0])
        torque = STIFFNESS * (y[0] - y[1] - error) + 1.0 * (y[2] - y[3] - slope * (OMEGA + y[2]))
        return [y[2], y[3], (LOAD - (1.0 - slope) * torque) / J_IN, (torque - LOAD) / J_OUT]

    return np.asarray(solve_ivp(rate, (0.0, end), state, "DOP853", rtol=1e-12, atol=1e-15).y[:, -1])


@pytest.mark.parametrize("power", [1, 2])
def test_the_motion_is_that_of_the_joint_but_for_second_order(power: int) -> None:
    """Halving tan^2(beta/2) halves the motion and quarters what is left out; without the torque back it would not."""
    left, size = [], []
    for degrees in (4.0, 4.0 / np.sqrt(2.0)):
        model = driveline(np.radians(degrees))
        run = gr.simulate(model, cycles=1, discard=0, samples_per_cycle=64, audit=False)
        start = np.concatenate([run.data.angle.values[0], run.data.velocity.values[0]])
        mine = np.concatenate([run.data.angle.values[-1], run.data.velocity.values[-1]])
        theirs = nonlinear(np.radians(degrees), float(run.data.time[-1]), start)
        left.append(float(np.max(np.abs(mine - theirs)[2:])))
        size.append(float(np.max(np.abs(theirs - start)[2:])))
    if power == 1:
        assert size[0] / size[1] == pytest.approx(2.0, rel=0.02)
        assert left[0] < 5e-3 * size[0]
    else:
        assert left[0] / left[1] == pytest.approx(4.0, rel=0.1)


def summed(harmonics: Sequence[Harmonic], time: np.ndarray, ahead: float = 0.0) -> np.ndarray:
    """(t,) the sum of sines, each ahead by an angle."""
    return sum((h.amplitude * np.sin(h.order * OMEGA * time + h.phase + ahead) for h in harmonics), np.zeros(time.size))


def test_power_passes_the_joint() -> None:
    """What the driving side gives is what the driven side takes: (T - ripple) Omega = T (Omega - e')."""
    model, time = driveline(np.radians(20.0)), np.linspace(0.0, np.pi / OMEGA, 50)
    ripple = summed(load_ripples(model)["in"], time)
    faster = [h.model_copy(update={"amplitude": h.amplitude * h.order * OMEGA}) for h in model.elements[0].errors]
    rate = summed(faster, time, 0.5 * np.pi)
    assert np.max(np.abs((LOAD - ripple) * OMEGA - LOAD * (OMEGA - rate))) < 1e-12 * LOAD * OMEGA
    assert np.max(np.abs(ripple)) > 0.05 * LOAD


def test_the_load_is_that_of_the_static_equilibrium() -> None:
    model = driveline(np.radians(10.0))
    assert gr.equilibrium(model).deflection["joint"] == pytest.approx(LOAD / STIFFNESS, rel=1e-12)
    amplitude = load_ripples(model)["in"][0].amplitude
    assert amplitude == pytest.approx(-2.0 * LOAD * np.tan(np.radians(5.0)) ** 2, rel=1e-12)
    system = assemble(model).system
    assert np.hypot(system.inputs.torque_sine, system.inputs.torque_cosine)[0, 0] == pytest.approx(
        -amplitude, rel=1e-12
    )


def test_a_kinematic_error_moves_the_deflection() -> None:
    """A stiff coupling follows it: theta_out = theta_in - e(t)."""
    sine = {"order": 1, "amplitude": 1e-3, "phase": 0.4}
    model = driveline(0.1, hooke=None, kinematic_error=[sine], stiffness=1e9, damping=2000.0)
    run = gr.simulate(model, cycles=20, discard=10, audit=False)
    moved = (run.data.angle.sel(inertia="in") - run.data.angle.sel(inertia="out")).values[-200:]
    expected = 1e-3 * np.sin(OMEGA * run.data.time.values[-200:] + 0.4)
    assert np.max(np.abs(moved - expected - np.mean(moved - expected))) < 1e-7


def test_written_without_dimensions_a_joint_moves_alike() -> None:
    model = driveline(np.radians(15.0), clearance=0.005)
    scaled = gr.nondimensionalize(model)
    assert scaled.model.couplings[0].hooke is None
    ours = gr.simulate(model, cycles=3, audit=False)
    theirs = scaled.restore(gr.simulate(scaled.model, cycles=3, audit=False))
    assert np.max(np.abs(ours.data.velocity - theirs.data.velocity)) < 1e-9 * np.max(np.abs(ours.data.velocity))


def test_along_a_sweep_the_joint_follows_the_speed() -> None:
    """A sweep that hardly changes the speed gives the motion at that speed."""
    steady = driveline(np.radians(15.0))
    swept = steady.with_({"excitation.sweep": {"from": OMEGA, "to": OMEGA * (1.0 + 1e-9), "over": 10.0}})
    one, other = (gr.simulate(m, cycles=3, discard=0, audit=False) for m in (steady, swept))
    assert np.max(np.abs(one.data.velocity - other.data.velocity)) < 1e-5 * np.max(np.abs(one.data.velocity))


def test_without_an_equilibrium_a_joint_has_no_mean_load() -> None:
    stages = [{"stiffness": 100.0, "until": 0.01}, {"stiffness": 0.0}]
    limp = driveline(np.radians(15.0), stiffness=None, damping=None, stages=stages)
    with pytest.raises(gr.ModelError, match=r"coupling\.joint\.hooke.*acts back with its mean load"):
        gr.simulate(limp, cycles=1, initial="zero")
