"""The flow's gradient with sliders and limiters: against finite differences of whole runs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.system.coordinates import relative_coordinates
from tests.oracles.dressed import dressed_problem
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Stage, Torque


def ends(model: gr.Model, angle: np.ndarray, velocity: np.ndarray, cycles: int) -> tuple[np.ndarray, gr.Run]:
    """End state (deflections, velocities, stretches) from a start."""
    start = {"angle": angle.tolist(), "velocity": velocity.tolist()}
    run = gr.simulate(model, cycles=cycles, samples_per_cycle=8, discard=0, initial=start, audit=False)
    system = assemble(model).system
    basis = relative_coordinates(system).basis
    last, auxiliaries = run.trajectory, run.trajectory.auxiliaries
    held = np.zeros(0) if auxiliaries is None else auxiliaries.memory[-1, list(system.memories)]
    return np.concatenate([basis @ last.angle[-1], last.velocity[-1], held]), run


def switches(run: gr.Run) -> int:
    return 0 if run.trajectory.auxiliaries is None else len(run.trajectory.auxiliaries.passages.time)


def hold_gradient(model: gr.Model, angle: np.ndarray, velocity: np.ndarray, cycles: int) -> int:
    """Compare column by column, steps halved until both sides switch alike; return the switches passed."""
    coordinates = relative_coordinates(assemble(model).system)
    count = len(coordinates.elements)
    _, run = ends(model, angle, velocity, cycles)
    matrix = run.flow_gradient.values
    grown = max(1.0, np.abs(matrix).max())
    for j in range(count + len(velocity)):
        eps = 1e-6 / grown
        shift = np.eye(count + len(velocity))[j] * eps
        moved = [
            ends(model, angle + s * coordinates.angle_from_basis @ shift[:count], velocity + s * shift[count:], cycles)
            for s in (1, -1)
        ]
        assert switches(moved[0][1]) == switches(moved[1][1]) == switches(run)
        difference = (moved[0][0] - moved[1][0]) / (2 * eps)
        assert np.abs(difference - matrix[:, j]).max() <= 2e-5 * grown
    return switches(run)


@pytest.mark.parametrize(("family", "seed"), [("chain", 0), ("staged", 1), ("tree", 1), ("mesh", 0), ("staged", 3)])
def test_gradient_is_the_finite_difference_of_the_flow(family, seed):
    model = dressed_problem(family, seed).model
    start = [np.array([float(x) for x in values]) for values in (model.angle, model.velocity)]
    assert hold_gradient(gr.loads(model.toml()), *start, 1) > 3


@pytest.mark.parametrize("speed", ["1.2", "0.9", "2.1"])
def test_gradient_through_engaging_slipping_and_letting_go(speed):
    """One inertia over the break of a stage whose friction begins there."""
    stages = (Stage("1", "0.1", "0.5"), Stage("9", "0.2", None, "0.6", "40"))
    coupling = Coupling("c", ("x", "ground"), stages=stages)
    torque = Torque("x", "0.4", (Harmonic("1", "0.8"),))
    model = Driveline("x", (Body("x", "1"),), (coupling,), torques=(torque,), speed="1").start(("0",), (speed,))
    run_of = gr.loads(model.toml())
    assert hold_gradient(run_of, np.zeros(1), np.array([float(speed)]), 2) > 8


def test_a_slider_that_slips_forgets_and_one_that_sticks_remembers():
    """d stretch(end) / d x(start): 0 after slip, 1 - cos with both springs while it sticks."""
    model = Driveline(
        "x", (Body("x", "1"),), (Coupling("c", ("x", "ground"), "4", hysteresis="0.4", stick_stiffness="21"),)
    ).start(("0.001",), ("0",))
    loaded = gr.loads(model.toml())
    _, stuck = ends(loaded, np.array([0.001]), np.zeros(1), 1)
    t = 2 * np.pi
    want = np.array([[np.cos(5 * t), np.sin(5 * t) / 5], [-5 * np.sin(5 * t), np.cos(5 * t)]])
    gradient = stuck.flow_gradient
    # the stretch is a state of its own: with it, x and v alone see K = 4 and what the slider adds is in its column
    whole = gradient.values[:2, :2] + np.outer(gradient.values[:2, 2], [1.0, 0.0])
    assert np.abs(whole - want).max() < 1e-12
    slipping = replace(model, angle=("0.5",))
    _, slips = ends(gr.loads(slipping.toml()), np.array([0.5]), np.zeros(1), 1)
    assert switches(slips) > 2
    assert np.abs(slips.flow_gradient.values[:, 2]).max() > 0.0
    assert np.linalg.matrix_rank(slips.flow_gradient.values, tol=1e-9) == 2


def test_a_motion_with_friction_settles_and_has_no_horizon():
    model = Driveline(
        "x",
        (Body("x", "1"),),
        (Coupling("c", ("x", "ground"), "4", hysteresis="0.4", stick_stiffness="21"),),
        torques=(Torque("x", "0", (Harmonic("1", "1"),)),),
        speed="1.1",
    ).start(("0.5",), ("0",))
    run = gr.simulate(gr.loads(model.toml()), cycles=60, samples_per_cycle=8, discard=30)
    assert run.predictability_horizon == float("inf")
    assert run.lyapunov_exponents[0] < -1e-3
