"""The oracle against closed forms, and against the equations of motion written a second time."""

from __future__ import annotations

from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

from tests.literature import systems
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Torque
from tests.oracles.equilibrium_mp import equilibrium
from tests.oracles.exact_mp import growth, solve
from tests.oracles.fixed_point import real
from tests.oracles.random_drivelines import FAMILIES, random_problem


@pytest.fixture(autouse=True)
def _fifty_digits():
    with mp.workdps(70):
        yield


def close(a, b, digits: int = 48) -> bool:
    return abs(mpf(a) - mpf(b)) <= mpf(10) ** -digits * max(1, abs(mpf(b)))


def test_gap_oscillator_crosses_at_the_closed_form_times_for_ever():
    exact = solve(systems.gap_oscillator(), 12, 4)
    times = [real(e.time) for e in exact.events]
    w, b, A = mpf(2), mpf("0.5"), mpf("1.25")
    flight, contact, first = 2 * b / (w * (A - b)), mp.pi / w, mp.pi / (2 * w)
    want = [first + (i // 2) * contact + ((i + 1) // 2) * flight for i in range(len(times))]
    assert len(times) == sum(
        t <= 24 * mp.pi for t in [first + i // 2 * contact + (i + 1) // 2 * flight for i in range(99)]
    )
    assert all(close(t, x) for t, x in zip(times, want, strict=True))
    assert close(flight + contact + flight + contact, "4.47492598692312657", 16)
    assert [(e.from_region, e.to_region) for e in exact.events[:4]] == [(1, 0), (0, -1), (-1, 0), (0, 1)]


def test_trilinear_period_and_amplitude():
    exact = solve(systems.trilinear(), 2, 200)
    ki, ko, b, v0 = mpf("0.64"), mpf(9), mpf("0.2"), mpf("0.7")
    vb = mp.sqrt(v0**2 - ki * b**2)
    period = 4 * (mp.asin(b * mp.sqrt(ki) / v0) / mp.sqrt(ki) + mp.atan2(vb, mp.sqrt(ko) * ki * b / ko) / mp.sqrt(ko))
    assert close(real(exact.events[4].time - exact.events[0].time), period)
    assert close(period, "3.16407419339278037", 16)
    assert abs(exact.array("deflection").max() - 0.413378901687433091) < 2e-4


@pytest.mark.parametrize("damped", [False, True])
def test_bilinear_period_and_decay(damped):
    exact = solve(systems.bilinear(damped), 2, 4)
    z1, z2 = (mpf("0.02"), mpf("0.05")) if damped else (mpf(0), mpf(0))
    half1, half2 = mp.pi / mp.sqrt(1 - z1**2), mp.pi / (3 * mp.sqrt(1 - z2**2))
    ratio = mp.exp(-mp.pi * (z1 / mp.sqrt(1 - z1**2) + z2 / mp.sqrt(1 - z2**2)))
    assert close(real(exact.events[0].time), half1)
    assert close(real(exact.events[1].time), half1 + half2)
    assert close(real(exact.events[1].rate), ratio)
    assert [(e.from_region, e.to_region) for e in exact.events[:2]] == [(0, -1), (-1, 0)]


def test_struck_pair():
    exact = solve(systems.struck_pair(), 1, 2)
    want = ("0.151183299793715739", "0.148854376289275298", "6.00170355985988", "6.23935275087575")
    values = [*exact.angle[-1], *exact.velocity[-1]]
    assert all(close(real(x), y, 14) for x, y in zip(values, want, strict=True))


def test_struck_pair_in_closed_form():
    exact = solve(systems.struck_pair(), 1, 2)
    Ja, Jb, k, c, T, t = mpf("0.25"), mpf("0.04"), mpf(1800), mpf("1.2"), mpf(35), mpf("0.05")
    mu = Ja * Jb / (Ja + Jb)
    w2, d = k / mu, c / (2 * mu)
    wd = mp.sqrt(w2 - d**2)
    twist = T / Ja / w2 * (1 - mp.exp(-d * t) * (mp.cos(wd * t) + d / wd * mp.sin(wd * t)))
    centre = T * t**2 / 2 / (Ja + Jb)
    assert close(real(exact.angle[-1][0]), centre + Jb / (Ja + Jb) * twist)
    assert close(real(exact.angle[-1][1]), centre - Ja / (Ja + Jb) * twist)


def test_three_stage_clutch():
    exact = solve(systems.three_stage_clutch(), 1, 4)
    assert close(real(exact.events[8].time - exact.events[0].time), "0.054843526866589971", 17)
    turning = [e for e in exact.events if e.to_region == 2]
    assert all(
        close(
            real(e.rate) ** 2, 45**2 - (50 * mpf("0.05") ** 2 + 600 * mpf("0.15") ** 2 + 5 * mpf("0.15")) / mpf("0.12")
        )
        for e in turning
    )


def test_two_body_backlash():
    exact = solve(systems.two_body_backlash(), 1, 2)
    want = ("0.561188003790941962", "0.509468424696395138", "-2.11430269757913", "0.222944531344402799")
    values = [*exact.angle[-1], *exact.velocity[-1]]
    assert all(close(real(x), y, 14) for x, y in zip(values, want, strict=True))
    assert len(exact.events) == 10
    assert close(real(exact.events[0].time), "0.0517903237784", 12)


def test_resonance_without_damping_grows_linearly():
    model = Driveline(
        "resonance",
        (Body("x", "2"),),
        (Coupling("spring", ("x", "ground"), "18"),),
        torques=(Torque("x", "0", (Harmonic("1", "1", "0.5"),)),),
        speed="3",
        angle=("0.25",),
        velocity=("-1",),
    )
    exact = solve(model, 4, 3)
    for time, angle in zip(exact.time, exact.angle, strict=True):
        t, w, phase, a = real(time), mpf(3), mpf("0.5"), mpf("0.5")
        forced = -a * t / (2 * w) * mp.cos(w * t + phase) + a / (2 * w**2) * mp.cos(phase) * mp.sin(w * t)
        assert close(real(angle[0]), mpf("0.25") * mp.cos(w * t) - mp.sin(w * t) / w + forced)


def test_a_perturbation_of_a_free_rotor_grows_as_the_time():
    model = Driveline(
        "free pair", (Body("a", "1"), Body("b", "1")), (Coupling("gap", ("a", "b"), "1", clearance="1000"),)
    ).start(("0", "0"), ("0", "0"))
    exact = solve(model, 5, 10)
    factor = growth(model, 5, 10, exact, np.ones((2, 1)))
    first = solve(model, 5, 10, perturbation=1 << 128, seed=1)
    d, v = real(first.deflection[0][0]), real(first.rate[0][0])
    assert factor[-1] == pytest.approx(float(abs(d + 10 * mp.pi * v) / max(abs(d), abs(v))), rel=1e-12)


def elastic(element, delta: float) -> float:
    """The elastic force, by adding up the stages passed on the way from the centre: written apart from the oracle."""
    drive, coast = element.sides
    sign, stages = (1, drive) if delta > 0 else (-1, coast)
    force, inner = float(Fraction(element.preload)), 0.0
    for stage in stages:
        outer = np.inf if stage.until is None else float(Fraction(stage.until))
        force += sign * float(Fraction(stage.stiffness)) * max(0.0, min(abs(delta), outer) - inner)
        inner = outer
    return force


def coefficient(element, delta: float) -> float:
    """The damping coefficient at a deflection."""
    stages = element.sides[0 if delta > 0 else 1]
    return next(float(Fraction(s.damping)) for s in stages if s.until is None or abs(delta) < float(Fraction(s.until)))


def right_side(model: Driveline, t: float, y: np.ndarray) -> np.ndarray:
    """The equations of motion in floats, read off the file's rules."""
    n, speed = len(model.bodies), float(model.speed)
    names = [b.name for b in model.bodies]
    torque = np.array([-float(b.drag_torque) for b in model.bodies]) - [float(b.drag) for b in model.bodies] * y[n:]
    for load in model.torques:
        wave = sum(float(h.amplitude) * np.sin(float(h.order) * speed * t + float(h.phase)) for h in load.harmonics)
        torque[names.index(load.on)] += float(load.mean) + wave
    for element in model.elements:
        row = np.zeros(n)
        for end, radius, sign in zip(element.between, element.radii, (1, -1), strict=True):
            if end != "ground":
                row[names.index(end)] += sign * float(radius)
        e = [(float(h.amplitude), float(h.order) * speed, float(h.phase)) for h in element.error]
        delta = row @ y[:n] - sum(a * np.sin(w * t + p) for a, w, p in e)
        rate = row @ y[n:] - sum(a * w * np.cos(w * t + p) for a, w, p in e)
        torque -= row * (elastic(element, delta) + coefficient(element, delta) * rate)
    return np.concatenate([y[n:], torque / [float(b.J) for b in model.bodies]])


QUICK = ("loop", "staged", "mesh", "undamped")
FAMILIES_BY_COST = [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in FAMILIES]


@cache
def solved(family):
    problem = random_problem(family, 1)
    return problem.model, solve(problem.model, min(problem.cycles, 2), problem.samples_per_cycle)


@pytest.mark.parametrize("family", FAMILIES_BY_COST)
def test_the_oracle_solves_the_equations_of_motion(family):
    model, exact = solved(family)
    n, t = len(model.bodies), exact.array("time")
    states = np.hstack([exact.array("angle"), exact.array("velocity")])
    for i, acceleration in enumerate(exact.array("acceleration")):
        want = right_side(model, t[i], states[i])[n:]
        assert np.allclose(acceleration, want, rtol=1e-9, atol=1e-9 * np.abs(exact.array("acceleration")).max())
    for i in (0, len(t) // 2):
        piece = solve_ivp(
            lambda s, y: right_side(model, s, y),
            (t[i], t[i + 1]),
            states[i],
            "DOP853",
            rtol=1e-11,
            atol=1e-13,
            max_step=(t[i + 1] - t[i]) / 25,
        )
        scale = np.abs(states).max(axis=0) + 1e-9
        assert np.max(np.abs(piece.y[:, -1] - states[i + 1]) / scale) < 2e-6


@pytest.mark.parametrize("family", FAMILIES_BY_COST)
def test_crossings_and_sampled_regions_tell_one_story(family):
    exact = solved(family)[1]
    now, events = list(exact.region[0]), list(exact.events)
    for time, regions in zip(exact.time, exact.region, strict=True):
        while events and events[0].time <= time:
            event = events.pop(0)
            assert now[event.element] == event.from_region
            assert abs(event.to_region - event.from_region) == 1
            assert (event.rate > 0) == (event.to_region > event.from_region)
            now[event.element] = event.to_region
        assert now == regions
    assert not events


@pytest.mark.parametrize("seed", range(6))
def test_equilibrium_balances(seed):
    model = random_problem("static", seed).model
    angles = np.array([float(x) for x in equilibrium(model)])
    still = Driveline(
        model.name,
        model.bodies,
        model.couplings,
        tuple(type(m)(m.name, m.between, m.radii, m.stiffness, m.damping, m.backlash) for m in model.meshes),
        tuple(Torque(t.on, t.mean) for t in model.torques),
        model.speed,
    )
    n = len(angles)
    acceleration = right_side(still, 0.0, np.concatenate([angles, np.zeros(n)]))[n:]
    names = [body.name for body in model.bodies] + ["ground"]
    acceleration = np.append(acceleration, 0.0)
    for element in model.elements:  # no deflection accelerates
        ends = [float(r) * acceleration[names.index(e)] for e, r in zip(element.between, element.radii, strict=True)]
        assert ends[0] - ends[1] == pytest.approx(0, abs=1e-10)
