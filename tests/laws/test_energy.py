"""Balances that hold whatever the corners do: energy of free vibration, momentum of a free train."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from tests.laws.motion import simulate
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Mesh, Stage, Torque
from tests.oracles.random_drivelines import random_problem


def potential(element, delta: np.ndarray) -> np.ndarray:
    """Energy stored by a law, stage by stage from the centre."""
    energy = float(Fraction(element.preload)) * delta
    for sign, stages in zip((1, -1), element.sides, strict=True):
        reach = np.maximum(sign * delta, 0.0)
        force = 0.0
        inner = 0.0
        for stage in stages:
            k = float(Fraction(stage.stiffness))
            outer = np.inf if stage.until is None else float(Fraction(stage.until))
            part = np.clip(reach, inner, outer) - inner
            energy = energy + force * part + 0.5 * k * part**2
            force, inner = force + k * (outer - inner) if np.isfinite(outer) else 0.0, outer
    return energy


def energy_of(model: Driveline, run) -> np.ndarray:
    J = np.array([float(b.J) for b in model.bodies])
    names = [b.name for b in model.bodies]
    angle = run.data["angle"].values
    total = 0.5 * run.data["velocity"].values ** 2 @ J
    for element in model.elements:
        delta = np.zeros(len(angle))
        for end, radius, sign in zip(element.between, element.radii, (1, -1), strict=True):
            if end != "ground":
                delta = delta + sign * float(radius) * angle[:, names.index(end)]
        total = total + potential(element, delta)
    return total


def free(model: Driveline) -> Driveline:
    """Take away loads, damping and transmission errors."""
    from dataclasses import replace

    def undamped(stages):
        return None if stages is None else tuple(replace(s, damping="0") for s in stages)

    return replace(
        model,
        bodies=tuple(replace(b, drag="0.0", drag_torque="0.0") for b in model.bodies),
        couplings=tuple(
            replace(c, damping="0.0", stages=undamped(c.stages), coast_stages=undamped(c.coast_stages))
            for c in model.couplings
        ),
        meshes=tuple(replace(m, damping="0.0", error=()) for m in model.meshes),
        torques=(),
    )


@pytest.mark.parametrize(
    ("family", "seed"),
    [("undamped", 0), ("undamped", 3), ("tree", 2), ("staged", 1), ("mesh", 1), ("free-flight", 3), ("everything", 0)],
)
def test_free_vibration_keeps_its_energy(family, seed):
    problem = random_problem(family, seed)
    model = free(problem.model)
    run = simulate(model, 3 * problem.cycles)
    energy = energy_of(model, run)
    assert len(run.events) > 5
    assert np.max(np.abs(energy / energy[0] - 1)) < 1e-10


def test_ten_thousand_impacts_keep_their_energy():
    model = Driveline(
        "two bodies and a hard gap",
        (Body("a", "1.0"), Body("b", "0.3")),
        (Coupling("hold", ("a", "ground"), "3.0"), Coupling("gap", ("a", "b"), "5e4", clearance="0.02")),
        speed="1",
    ).start(("0.1", "0.1"), ("0.0", "0.5"))
    run = simulate(model, 150)
    energy = energy_of(model, run)
    assert len(run.events) > 10_000
    assert np.max(np.abs(energy / energy[0] - 1)) < 1e-10


def test_momentum_of_a_free_train_is_the_integral_of_its_loads():
    model = Driveline(
        "free train",
        (Body("a", "0.7"), Body("b", "0.2", drag_torque="0.05"), Body("c", "1.1")),
        (
            Coupling("clutch", ("a", "b"), stages=(Stage("2.0", "0.1", "0.1"), Stage("30.0", "0.3"))),
            Coupling("spline", ("b", "c"), "200.0", "0.05", clearance="0.05"),
        ),
        torques=(Torque("a", "0.3", (Harmonic("1", "1.5", "0.4"), Harmonic("2", "0.8"))), Torque("c", "-0.2")),
        speed="1.7",
    ).start(("0", "0", "0"), ("1.0", "0.5", "0.2"))
    run = simulate(model, 40)
    t = run.data.time.values
    waves = 1.5 * (np.cos(0.4) - np.cos(1.7 * t + 0.4)) / 1.7 + 0.8 * (1 - np.cos(3.4 * t)) / 3.4
    want = 0.7 * 1.0 + 0.2 * 0.5 + 1.1 * 0.2 + (0.3 - 0.05 - 0.2) * t + waves
    actual = run.data["velocity"].values @ [0.7, 0.2, 1.1]
    assert np.max(np.abs(actual - want)) < 1e-11 * np.max(np.abs(want))
    assert len(run.events) > 50


def test_geared_momentum_is_referred_through_the_radii():
    model = Driveline(
        "geared pair",
        (Body("wheel", "0.5"), Body("pinion", "0.02")),
        meshes=(Mesh("mesh", ("wheel", "pinion"), ("0.12", "0.04"), "4e5", "20.0", "1e-4"),),
        torques=(Torque("wheel", "0.0", (Harmonic("1", "3.0"),)), Torque("pinion", "0.1")),
        speed="30",
    ).start(("0", "0"), ("0.0", "0.0"))
    run = simulate(model, 30)
    t = run.data.time.values
    actual = run.data["velocity"].values @ [0.5, 0.02 * 3.0]
    want = 3.0 * (1 - np.cos(30 * t)) / 30 + 0.1 * 3.0 * t
    assert np.max(np.abs(actual - want)) < 1e-11 * np.max(np.abs(want))
    assert len(run.events) > 20


def test_energy_lost_is_what_the_damping_took():
    """The dissipation comes from a quadrature of c delta'^2 over samples, apart from the program's propagation."""
    model = Driveline(
        "bilinear",
        (Body("x", "1.0"),),
        (Coupling("spring", ("x", "ground"), stages=(Stage("4.0", "0.1"),), coast_stages=(Stage("9.0", "0.3"),)),),
        speed="1",
    ).start(("0.0",), ("1.0",))
    run = simulate(model, 2, 4_000)
    t = run.data.time.values
    x = run.data["angle"].values[:, 0]
    v = run.data["velocity"].values[:, 0]
    energy = 0.5 * v**2 + 0.5 * np.where(x > 0, 4.0, 9.0) * x**2
    coefficient = np.where(run.data["region"].values[:, 0] == 0, 0.1, 0.3)
    at = np.searchsorted(t, run.events["time"])  # each crossing closes one stretch and opens the next
    speed, before = run.events["velocity"].to_numpy(), coefficient[at - 1]
    nodes = np.insert(t, np.repeat(at, 2), np.repeat(run.events["time"], 2))
    power = np.insert(
        coefficient * v**2,
        np.repeat(at, 2),
        np.column_stack([before, coefficient[at]]).ravel() * np.repeat(speed, 2) ** 2,
    )
    lost = np.sum((power[1:] + power[:-1]) / 2 * np.diff(nodes))
    assert len(at) >= 4
    assert energy[0] - energy[-1] == pytest.approx(lost, rel=1e-6)
