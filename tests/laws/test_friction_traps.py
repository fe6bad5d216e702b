"""The traps of stick and slip, each with a model in which it bites, held against fifty digits."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from tests.laws.motion import simulate
from tests.oracles.dressed import hold, switch_faults
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Mesh, Stage, Torque
from tests.oracles.fixed_point import to_float
from tests.oracles.random_drivelines import Problem
from tests.oracles.stick_slip import solve

PARTS = ("1e-3", "1e-6", "1e-9", "1e-11", "-1e-11", "-1e-9", "-1e-6", "-1e-3")


def one_body(coupling: dict, start: tuple[str, str], *torques: Torque, **settings: str) -> Driveline:
    """One body of inertia 1 against the ground."""
    spring = Coupling("c", ("x", "ground"), **coupling)
    model = Driveline("one body", (Body("x", "1"),), (spring,), torques=torques, speed=settings.get("speed", "1"))
    return model.start((start[0],), (start[1],))


def decimal(value: Fraction) -> str:
    """Exact decimal of a fraction whose denominator divides a power of ten."""
    return f"{value.numerator * 10**40 // value.denominator}e-40"


@pytest.mark.parametrize("part", PARTS)
def test_a_slip_as_brief_as_can_be(part):
    """The spring is stretched by 0.096 at most, once in 2 pi / 5; it slips where H / s is less by a part."""
    loop = Fraction("4.032") * (1 - Fraction(part))
    model = one_body({"stiffness": "4", "hysteresis": decimal(loop), "stick_stiffness": "21"}, ("0.3", "0"), speed="5")
    _, exact = hold(Problem(model, 1, 24))
    assert bool(exact.switches) == (not part.startswith("-"))


def sliding(velocity: Fraction) -> Driveline:
    """A body on a slider alone, pushed by its mean torque H; its speed swings."""
    push = Torque("x", "0.5", (Harmonic("1", "0.4", "1"),))
    spring = {"stiffness": "0", "hysteresis": "1", "stick_stiffness": "50"}
    return one_body(spring, ("0", decimal(velocity)), push)


@pytest.fixture(scope="module")
def grazing() -> Fraction:
    """The start velocity from which the slipping body's speed touches zero once, to thirteen digits."""
    low, high = Fraction(1, 20), Fraction(1, 2)
    for _ in range(44):
        middle = (low + high) / 2
        sticks = any(s.to == "stick" or s.to.startswith("stick") for s in solve(sliding(middle), 1, 2).switches[1:])
        low, high = (middle, high) if sticks else (low, middle)
    return high


@pytest.mark.parametrize(
    "part",
    [
        "1e-2",
        "1e-6",
        "1e-10",
        "-1e-12",
        "-1e-8",
        *(pytest.param(part, marks=pytest.mark.long) for part in ("1e-4", "1e-8", "1e-12", "-1e-10", "-1e-6")),
    ],
)
def test_a_slip_that_almost_stops(grazing, part):
    model = sliding(grazing * (1 - Fraction(part)))
    exact = solve(model, 1, 24)
    run = simulate(model, 1)
    if abs(Fraction(part)) >= Fraction("1e-8"):  # a shorter stop moves the spring by less than 1e-12 of its reach
        assert not switch_faults(run, exact)
    assert any(s.to.startswith("stick") for s in exact.switches[1:]) == (not part.startswith("-"))
    assert np.abs(run.data.angle.values - exact.array("angle")).max() < 1e-9


@pytest.mark.parametrize("start", ["1.7", *(pytest.param(start, marks=pytest.mark.long) for start in ("1.3", "4"))])
def test_slip_begins_exactly_at_a_break(start):
    """H / s is the break's deflection, so both come at one instant; and let go there as it starts to stick."""
    stages = (Stage("4", "0", "0.25", "5", "10"), Stage("16", "0.1", None, "7", "30"))
    model = one_body({"stages": stages}, ("0", start))
    _, exact = hold(Problem(model, 2, 24))
    run = simulate(model, 2)
    passages = run.trajectory.auxiliaries.passages
    at_break = run.events["time"][0]
    assert len(exact.events) > 0
    assert np.min(np.abs(passages.time[passages.watch == 1] - at_break)) < 1e-15


def test_two_sliders_that_switch_at_once():
    spring = {"stiffness": "3", "hysteresis": "0.3", "stick_stiffness": "50"}
    couplings = (Coupling("one", ("x", "ground"), **spring), Coupling("two", ("ground", "x"), **spring))
    push = Torque("x", "0", (Harmonic("1", "2"),))
    model = Driveline("pair", (Body("x", "1"),), couplings, torques=(push,), speed="1.3").start(("0.4",), ("0",))
    run = simulate(model, 6)
    times = run.trajectory.auxiliaries.passages.time
    assert len(times) % 2 == 0
    assert len(times) > 20
    assert np.max(np.abs(times[::2] - times[1::2])) < 1e-14
    single = replace(couplings[0], stiffness="6", hysteresis="0.6", stick_stiffness="100")
    alone = simulate(replace(model, couplings=(single,)), 6)
    assert np.max(np.abs(alone.data.angle.values - run.data.angle.values)) < 1e-12
    hold(Problem(model, 2, 24))


def test_two_bodies_whose_sliders_slip_at_once():
    couplings = tuple(
        Coupling(f"c{i}", (f"x{i}", "ground"), "3", "0.1", hysteresis="0.3", stick_stiffness="50") for i in range(2)
    )
    bodies = (Body("x0", "1"), Body("x1", "1"))
    model = Driveline("twins", bodies, couplings, speed="1").start(("0.4", "-0.4"), ("0", "0"))
    run = simulate(model, 3)
    assert np.max(np.abs(run.data.angle.values.sum(axis=1))) < 1e-14
    hold(Problem(model, 2, 24))


def test_rest_is_rest():
    spring = {"stiffness": "4", "hysteresis": "0.6", "stick_stiffness": "21", "damping": "0.1"}
    still = simulate(one_body(spring, ("0", "0")), 500)
    assert len(still.trajectory.auxiliaries.passages.time) == 0
    assert np.all(still.data.angle.values == 0.0)
    held = simulate(one_body({**spring, "stiffness": "0"}, ("0", "0"), Torque("x", "0.2999")), 500)
    # up to almost H the overshoot slips, then it sticks for ever at 0.2999 / s from the anchor
    assert held.data.slider_force.values[-1, 0] == pytest.approx(0.2999, rel=1e-12)
    assert np.abs(held.data.velocity.values[-1, 0]) < 1e-13
    loaded = simulate(one_body({**spring, "stiffness": "0"}, ("0", "0"), Torque("x", "0.3001")), 40)
    assert loaded.data.slider.values[-1, 0] == 1
    assert loaded.data.velocity.values[-1, 0] == pytest.approx(0.0001 / 0.1, rel=1e-2)


@pytest.mark.parametrize("stick", ["1e4", "1e6", "1e8"])
def test_a_stick_stiffness_that_is_nearly_rigid(stick):
    spring = {"stiffness": "4", "hysteresis": "0.6", "stick_stiffness": stick}
    model = one_body(spring, ("1", "0"), Torque("x", "0", (Harmonic("1", "0.5"),)), speed="2.5")
    run = simulate(model, 4)
    assert run.cost.energy_residual < 1e-12
    if stick != "1e8":
        hold(Problem(model, 1, 12))
    # the limit is Coulomb friction: half a swing loses 2 H / K of its amplitude, 0.15, while nothing pushes
    free = simulate(replace(model, torques=()), 3, 2000)
    turned = free.data.angle.values[:, 0]
    assert turned.min() == pytest.approx(-(1 - 2 * 0.3 / 4), abs=2 / float(stick) + 1e-5)


def dropped(damping):
    """A body dropped on its stop: bounces, the damping clipped both ways, and comes to rest in contact."""
    stop = {"stiffness": "2e3", "damping": damping, "clearance": "0.01", "contact_damping": "clipped"}
    return one_body(stop, ("0", "0"), Torque("x", "1"))


@pytest.mark.parametrize("damping", ["0.5", "20", pytest.param("4000", marks=pytest.mark.long)])
def test_clipped_contact_under_a_load_that_holds_it_to_fifty_digits(damping):
    hold(Problem(dropped(damping), 1, 24))


@pytest.mark.parametrize("damping", ["0.5", "20", "4000"])
def test_clipped_contact_under_a_load_that_holds_it(damping):
    model = dropped(damping)
    run = simulate(model, 2, 4000)
    force = run.data.force.values[:, 0]
    spring = 2e3 * np.maximum(run.data.deflection.values[:, 0] - 0.01, 0.0)
    assert force.min() >= 0.0
    assert np.all(force <= 2 * spring * (1 + 1e-12) + 1e-9)
    assert run.cost.energy_residual < 1e-12


def test_a_mesh_with_transmission_error_and_clipped_damping():
    mesh = Mesh("m", ("a", "b"), ("0.05", "0.08"), "3e6", "900", "1e-4", (Harmonic("7", "1e-5"),), "clipped")
    torques = (Torque("a", "2", (Harmonic("1", "6"),)), Torque("b", "-3.2"))
    model = Driveline("gears", (Body("a", "0.01"), Body("b", "0.03")), (), (mesh,), torques, speed="80")
    run = simulate(model.start(("0", "0"), ("0", "0")), 4)
    assert len(run.events) > 20
    assert len(run.trajectory.auxiliaries.passages.time) >= 2 * len(run.events)
    _, exact = hold(Problem(model.start(("0", "0"), ("0", "0")), 1, 24))
    assert to_float(exact.time[-1]) > 0.07


@pytest.mark.parametrize(("speed", "region"), [("1", 1), ("-1", 0)])
def test_a_start_on_a_corner_decided_by_another_slider(speed, region):
    """a rests on its corner; b moves away from it on a slider alone, whose spring is not stretched yet."""
    couplings = (
        Coupling("wall", ("a", "ground"), stages=(Stage("0", until="0.1"), Stage("50"))),
        Coupling("rub", ("b", "a"), "0", hysteresis="2", stick_stiffness="30"),
    )
    model = Driveline("towed", (Body("a", "1"), Body("b", "1")), couplings, speed="3").start(
        ("0.1", "0.3"), ("0", speed)
    )
    run = simulate(model, 1)
    assert int(run.data.region.values[0, 0]) == region
    assert len(run.events) == 0 or run.events["time"][0] > 1e-3
    hold(Problem(model, 1, 24))
