"""Regions whose matrices are singular, defective or resonant: where closed forms in eigenvectors lose everything."""

from __future__ import annotations

import numpy as np
import pytest

from tests.laws.motion import simulate, times
from tests.oracles.compare import assert_exact
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Mesh, Stage, Torque


def pair(gap: dict, torque: Torque, drags: tuple[str, str] = ("0.0", "0.0"), speed: str = "3") -> Driveline:
    return Driveline(
        "pair",
        (Body("a", "1.0", drag=drags[0]), Body("b", "2.0", drag=drags[1])),
        (Coupling("gap", ("a", "b"), **gap),),
        torques=(torque,),
        speed=speed,
    ).start(("0.0", "0.0"), ("0.5", "0.0"))


@pytest.mark.parametrize("detune", ["0.0", "1e-12", "1e-9", "1e-6", "1e-3"])
def test_resonance_without_damping(detune):
    """sqrt(k (1 + 1/2)) = 3 for k = 6: the load sits on the mode, or a hair beside it; amplitudes grow as t."""
    speed = repr(3.0 * (1 + float(detune)))
    gap = {"stiffness": "6.0", "clearance": "0.4", "stiffness_ratio": "1.0", "damping_ratio": "1.0"}
    model = pair(gap, Torque("a", "0.0", (Harmonic("1", "0.3", "0.2"),)), speed=speed)
    assert assert_exact(model, 12).events > 10


def test_resonance_in_the_outer_stage_only():
    model = pair(
        {"stiffness": "6.0", "clearance": "0.05", "stiffness_ratio": "0.1"}, Torque("a", "0.0", (Harmonic("1", "0.3"),))
    )
    assert assert_exact(model, 12).events > 10


@pytest.mark.parametrize("drag", ["0.0", "1e-12", "1e-8", "1e-4"])
def test_free_flight_under_a_mean_torque(drag):
    """In the gap both bodies fly freely: eigenvalues 0 and -drag/J, a Jordan block when the drag is zero."""
    model = pair({"stiffness": "50.0", "damping": "0.2", "clearance": "0.5"}, Torque("a", "0.7"), (drag, drag))
    assert assert_exact(model, 8).events > 5


def test_parabolic_flight_hits_at_the_closed_form_time():
    model = Driveline(
        "falling",
        (Body("x", "2.0"),),
        (Coupling("gap", ("x", "ground"), "1e4", clearance="0.5"),),
        torques=(Torque("x", "3.0"),),
        speed="1",
    ).start(("0.0",), ("-0.4",))
    run = simulate(model, 1)
    assert float(run.events["time"][0]) == pytest.approx((0.4 + np.sqrt(0.16 + 2 * 1.5 * 0.5)) / 1.5, rel=1e-14)
    assert_exact(model, 1)


def test_a_train_that_runs_away_keeps_its_deflections():
    """The absolute angle passes 7e4 rad while the deflections stay at 1e-2: they must not lose its digits."""
    model = Driveline(
        "runaway",
        (Body("a", "1.0"), Body("b", "1.0")),
        (Coupling("gap", ("a", "b"), "400.0", "0.5", clearance="0.01"),),
        torques=(Torque("a", "5.0", (Harmonic("1", "6.0"),)), Torque("b", "4.0")),
        speed="2",
    ).start(("0.0", "0.0"), ("12000.0", "12000.0"))
    assert assert_exact(model, 2).events > 12


@pytest.mark.parametrize("excess", ["0.0", "1e-12", "-1e-12", "1e-8", "1e-4", "-1e-4"])
def test_critical_damping(excess):
    """k = 4, c = 4: a double root at -2; just above and below it two close real or complex ones."""
    c = repr(4.0 * (1 + float(excess)))
    model = Driveline(
        "critical",
        (Body("x", "1.0"),),
        (Coupling("gap", ("x", "ground"), stages=(Stage("4.0", c, "0.1"), Stage("9.0", "6.0"))),),
        torques=(Torque("x", "0.1", (Harmonic("1", "2.0"), Harmonic("2", "1.0", "0.5"))),),
        speed="0.9",
    ).start(("0.0",), ("1.0",))
    assert assert_exact(model, 6).events > 10


def test_critical_damping_of_several_modes_at_once():
    bodies = tuple(Body(f"x{i}", "1.0") for i in range(3))
    couplings = tuple(
        Coupling(f"gap{i}", (f"x{i}", "ground"), stages=(Stage("4.0", "4.0", "0.1"), Stage("4.0", "4.0")))
        for i in range(3)
    )
    link = (Coupling("link", ("x0", "x1"), "1e-9"), Coupling("link2", ("x1", "x2"), "2e-9"))
    model = Driveline(
        "three", bodies, couplings + link, torques=(Torque("x0", "0.1", (Harmonic("1", "2.0"),)),), speed="0.9"
    ).start(("0.0", "0.2", "-0.3"), ("1.0", "0.5", "0.0"))
    assert assert_exact(model, 5).events > 5


def test_overdamped_and_stiff():
    model = Driveline(
        "stiff",
        (Body("a", "1.0"), Body("b", "1e-2")),
        (
            Coupling("shaft", ("a", "b"), "1e5", "100.0"),
            Coupling("gap", ("b", "ground"), "20.0", "0.1", clearance="0.1"),
        ),
        torques=(Torque("a", "0.0", (Harmonic("1", "1.0"),)),),
        speed="60",
    ).start(("0.0", "0.0"), ("2.0", "1.0"))
    assert assert_exact(model, 3).events > 0


def test_a_damper_without_a_spring():
    model = Driveline(
        "damper",
        (Body("a", "1.0"), Body("b", "1.0")),
        (Coupling("damper", ("a", "b"), "0.0", "0.7"), Coupling("gap", ("b", "ground"), "30.0", clearance="0.1")),
        torques=(Torque("a", "0.2", (Harmonic("1", "1.0"),)),),
        speed="1.5",
    ).start(("0.0", "0.0"), ("0.5", "0.0"))
    assert assert_exact(model, 6).events > 3


def test_equal_natural_frequencies():
    bodies = tuple(Body(f"x{i}", "1.0") for i in range(4))
    couplings = tuple(
        Coupling(f"gap{i}", (f"x{i}", "ground"), "9.0", clearance="0.1", stiffness_ratio="0.5") for i in range(4)
    )
    model = Driveline(
        "degenerate",
        bodies,
        couplings,
        torques=(Torque("x0", "0.0", (Harmonic("1", "0.2"),)), Torque("x2", "0.1", (Harmonic("2", "0.3"),))),
        speed="3",
    ).start(("0.0", "0.05", "-0.1", "0.2"), ("1.0", "0.5", "0.3", "0.0"))
    assert assert_exact(model, 4).events > 20


@pytest.mark.parametrize("ratio", [*(pytest.param(ratio, marks=pytest.mark.long) for ratio in ("1e4", "1e6")), "1e8"])
def test_stiffness_ratios(ratio):
    """A soft clutch and a mesh up to 1e8 times stiffer, which rattles: R_lambda up to 1e4."""
    k = float(ratio)
    model = Driveline(
        "stiff mesh",
        (Body("a", "1.0"), Body("b", "0.4"), Body("c", "0.1")),
        (Coupling("clutch", ("a", "b"), "1.0", "0.05", clearance="0.02", stiffness_ratio="0.1"),),
        (Mesh("mesh", ("b", "c"), ("1.0", "1.0"), repr(k), repr(0.05 * k**0.5), repr(2 / k**0.5)),),
        torques=(Torque("a", "0.0", (Harmonic("1", "2.0"),)), Torque("c", "-0.3")),
        speed=repr(k**0.5 / 40),
    ).start(("0.02", "0.0", "0.0"), ("0.0", "0.3", "-0.2"))
    assert assert_exact(model, 4).events >= 2


def test_real_modes_count_towards_the_bound():
    """Two heavily damped bodies: all eigenvalues are real, and none may be taken for half of a complex pair."""
    model = Driveline(
        "overdamped pair",
        (Body("a", "1.0"), Body("b", "1.0")),
        (
            Coupling("first", ("a", "b"), "7.2", "2.2", "0.086", "0.1", "0.5"),
            Coupling("second", ("b", "ground"), "1.6", "21.0", "0.029", "0.1", "1.0"),
        ),
        torques=(Torque("a", "0.0", (Harmonic("1", "17.0"),)),),
        speed="2.0",
    ).start(("0.0", "0.0"), ("0.61", "0.61"))
    run = simulate(model, 2)
    assert times(run, "second")[0] == pytest.approx(0.1310873779919553, abs=1e-13)
    assert_exact(model, 2)


def test_real_modes_of_geared_loops_count_towards_the_bound():
    model = Driveline(
        "overdamped loops",
        (Body("b0", "681.9"), Body("b1", "0.007082"), Body("b2", "0.2278"), Body("b3", "0.01605"), Body("b4", "528.0")),
        (
            Coupling("c0", ("b0", "b2"), "3.558", "3.252"),
            Coupling("c1", ("b1", "b3"), "0.06664", "0.327", "6.324e-05"),
        ),
        (
            Mesh("m0", ("b1", "b0"), ("0.1041", "0.02788"), "150.1", "38.67", "3.841e-05"),
            Mesh("m1", ("b3", "b0"), ("0.7837", "0.1328"), "0.1838", "0.0", "5.803e-05"),
            Mesh("m2", ("b4", "b3"), ("0.1484", "0.06507"), "41.86", "0.0", "4.937e-06"),
        ),
        speed="0.998",
    ).start(
        ("0.000828168563", "0.006197984122", "0.0", "-0.001024264197", "0.0001473270571"),
        ("0.01268", "-0.05635", "-0.02769", "0.04425", "0.07641"),
    )
    assert assert_exact(model, 1).events >= 4
