"""Periodic motions against closed forms, differences, and what their multipliers must be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.engine.periodic.motion import DECIDED, State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.shooting import shoot
from gearrattle.engine.system.auxiliary import OFF, STICK
from gearrattle.errors import ConvergenceError

OSCILLATOR: dict[str, Any] = {
    "schema": 1,
    "units": "dimensionless",
    "inertia": [{"name": "body", "J": 1.0, "drag": 0.1}],
    "coupling": [{"name": "gap", "between": ["body", "ground"], "stiffness": 1.0, "clearance": 1.0}],
}
"""x'' + 0.1 x' + f(x) = 0.1 + 0.05 W^2 cos(W t), half gap 1."""

PAIR: dict[str, Any] = {
    "schema": 1,
    "inertia": [{"name": "engine", "J": 0.1}, {"name": "wheel", "J": 0.02}],
    "coupling": [{"name": "gap", "between": ["engine", "wheel"], "stiffness": 2000.0, "damping": 0.3}],
    "excitation": {"speed": 100.0},
    "torque": [
        {"on": "engine", "mean": 2.0, "harmonics": [{"order": 1, "amplitude": 20.0}]},
        {"on": "wheel", "mean": -2.0},
    ],
}


def oscillator(frequency: float, cycles: int = 1) -> PeriodMap:
    cosine = {"order": 1, "amplitude": 0.05 * frequency**2, "phase": np.pi / 2}
    torque = [{"on": "body", "mean": 0.1, "harmonics": [cosine]}]
    tables = {**OSCILLATOR, "excitation": {"frequency": frequency}, "torque": torque}
    return PeriodMap(assemble(gr.Model.from_tables(tables)).system, cycles)


def pair(drag: float = 0.0, **coupling: float) -> PeriodMap:
    """Two bodies with a half gap of 0.01 that turn freely, and whatever else their coupling has."""
    inertia = [{**body, "drag": drag} for body in PAIR["inertia"]]
    tables = {**PAIR, "inertia": inertia, "coupling": [{**PAIR["coupling"][0], "clearance": 0.01, **coupling}]}
    return PeriodMap(assemble(gr.Model.from_tables(tables)).system)


def at(*values: float) -> State:
    return State(np.array(values))


def test_in_contact_it_is_the_linear_motion() -> None:
    """x = 1 + 0.1 + |H| cos(W t + phi); multipliers exp(lambda T)."""
    w = 0.6
    period_map = oscillator(w)
    orbit = shoot(period_map, at(1.2, 0.0))
    wave = 0.05 * w**2 / (1.0 - w**2 + 0.1j * w)
    want = [1.1 + wave.real, (1j * w * wave).real]
    np.testing.assert_allclose(orbit.motion.start.y, want, rtol=0, atol=1e-14)
    root = np.exp((-0.05 + 1j * np.sqrt(1.0 - 0.05**2)) * 2.0 * np.pi / w)
    np.testing.assert_allclose(
        np.sort_complex(orbit.multipliers), np.sort_complex([root, root.conjugate()]), atol=1e-13
    )
    assert len(orbit.motion.crossings.time) == 0
    assert orbit.free.shape == (2, 0)


@pytest.mark.parametrize("frequency", [0.8, 1.0, 1.3])
def test_through_impacts_the_product_of_the_multipliers_is_that_of_the_drag(frequency: float) -> None:
    """det M = exp(-0.1 T): every saltation has the determinant 1, for the damping does not jump."""
    period_map = oscillator(frequency)
    orbit = shoot(period_map, at(0.5, 0.0))
    assert len(orbit.motion.crossings.time) == 2
    assert orbit.residual < 1e-12
    assert np.prod(orbit.multipliers) == pytest.approx(np.exp(-0.1 * period_map.length), rel=1e-12)


@pytest.mark.parametrize("state", [(0.5, 0.3), (1.3, -0.4), (-2.0, 0.1)])
@pytest.mark.parametrize("cycles", [1, 2])
def test_the_gradient_is_that_of_differences(state: tuple[float, float], cycles: int) -> None:
    period_map = oscillator(0.9, cycles)
    begin = at(*state)
    motion, h = period_map(begin), 1e-5
    for j in range(2):
        step = h * np.eye(2)[j]
        ahead, behind = period_map(State(begin.y + step)), period_map(State(begin.y - step))
        difference = (ahead.end.y - behind.end.y) / (2.0 * h)
        np.testing.assert_allclose(motion.gradient[:, j], difference, rtol=0, atol=1e-7 * np.abs(motion.gradient).max())


def test_two_passes_are_one_of_twice_the_length() -> None:
    once, twice = oscillator(0.9), oscillator(0.9, 2)
    begin = at(0.5, 0.3)
    first = once(begin)
    second, both = once(first.end), twice(begin)
    np.testing.assert_allclose(both.end.y, second.end.y, rtol=0, atol=1e-13)
    np.testing.assert_allclose(both.gradient, second.gradient @ first.gradient, rtol=0, atol=1e-12)


def test_a_free_train_without_drag_keeps_its_speed() -> None:
    """Every speed repeats: one multiplier is 1, and its direction is the motion of the train as a whole."""
    period_map = pair()
    orbit = shoot(period_map, at(0.012, 3.0, 2.5), settle=3)
    assert orbit.free.shape == (3, 1)
    assert np.abs(orbit.multipliers - 1.0).min() < 1e-9
    direction = orbit.free[:, 0]
    np.testing.assert_allclose(direction / direction[1], [0.0, 1.0, 1.0], atol=1e-7)
    momentum = np.array([0.0, 0.1, 0.02])
    later = period_map(orbit.motion.start)
    assert momentum @ later.end.y == pytest.approx(momentum @ later.start.y, rel=1e-12)


def test_with_drag_it_is_isolated_and_does_not_drift() -> None:
    period_map = pair(drag=0.01)
    orbit = shoot(period_map, at(0.011, 0.0, 0.0), settle=5)
    assert orbit.free.shape == (3, 0)
    assert abs(orbit.motion.turned[0]) < 1e-10


def test_a_slider_that_slips_forgets_and_one_that_sticks_is_free() -> None:
    slipping = pair(drag=0.02, hysteresis=3.0)
    orbit = shoot(slipping, at(0.011, 0.0, 0.0, 0.0), settle=5)
    assert np.abs(orbit.multipliers).min() < 1e-12
    assert orbit.free.shape == (4, 0)
    sticking = pair(drag=0.02, hysteresis=300.0)
    orbit = shoot(sticking, at(0.0, 0.0, 0.0, 0.0), settle=5)
    assert np.abs(orbit.multipliers - 1.0).min() < 1e-9
    assert orbit.free.shape == (4, 1)


def test_torques_that_do_not_balance_have_no_periodic_motion() -> None:
    tables = {**PAIR, "torque": [PAIR["torque"][0], {"on": "wheel", "mean": -1.9}]}
    period_map = PeriodMap(assemble(gr.Model.from_tables(tables)).system)
    with pytest.raises(ConvergenceError, match="no motion that repeats after 1 period "):
        shoot(period_map, at(0.0, 0.0, 0.0), settle=1)


def test_inputs_that_do_not_repeat_are_refused() -> None:
    tables = {
        **PAIR,
        "torque": [{"on": "engine", "signal": {"time": [0.0, 0.1, 0.2, 0.3], "value": [0.0, 1.0, 0.0, 2.0]}}],
    }
    with pytest.raises(ValueError, match="do not repeat"):
        PeriodMap(assemble(gr.Model.from_tables(tables)).system)


def test_a_motion_of_a_train_with_five_gaps_is_found() -> None:
    """Newton's method goes round in circles until the motion has been followed long enough."""
    bodies = [f"body{i}" for i in range(8)]
    couplings = [
        {"name": f"c{i}", "between": bodies[i : i + 2], "stiffness": 4000.0 + 500.0 * (3 * i % 7), "damping": 0.5}
        for i in range(7)
    ]
    for i in (0, 2, 3, 4, 6):
        couplings[i]["clearance"] = 0.004
    harmonics = [{"order": 1, "amplitude": 30.0}, {"order": 2, "amplitude": 8.0}]
    tables = {
        "schema": 1,
        "inertia": [
            {"name": name, "J": 0.02 * (1.0 + 0.3 * (7 * i % 5)), "drag": 0.02} for i, name in enumerate(bodies)
        ],
        "coupling": couplings,
        "excitation": {"speed": 100.0},
        "torque": [{"on": "body0", "mean": 4.0, "harmonics": harmonics}, {"on": "body7", "mean": -4.0}],
    }
    orbit = gr.periodic(gr.Model.from_tables(tables))
    assert orbit.residual < 1e-12
    assert len(orbit.motion.crossings.time) > 20


def test_a_slider_that_its_region_lets_go_carries_nothing_whatever_its_start_says() -> None:
    """The dual mass flywheel at rest lies inside the stages whose sliders a start says to be loaded."""
    period_map = PeriodMap(assemble(gr.example("dual_mass_flywheel")).system)
    zero = period_map.state_of(np.zeros(period_map.system.size), np.zeros(period_map.system.size))
    memory = np.full(period_map.flow.memory.size, 0.01)
    loaded = State(np.append(zero.y[: -memory.size], memory), np.zeros(len(period_map.system.auxiliaries), np.int64))
    start = period_map(loaded).start
    assert start.auxiliary_pieces is not None
    assert start.auxiliary_pieces.tolist() == [STICK, OFF, OFF, DECIDED, DECIDED]
    np.testing.assert_array_equal(start.y[-memory.size :], [0.01, 0.0, 0.0])
