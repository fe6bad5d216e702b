"""Jenkins sliders against closed forms: loop area, free decay, micro-slip, stages; and their energy."""

from __future__ import annotations

from math import acos, atan2, pi, sin, sqrt

import numpy as np
import pytest

from tests.laws.motion import simulate
from tests.oracles.driveline import Body, Coupling, Driveline, Harmonic, Stage, Torque


def oscillator(loop: str, stick: str, start: str, *torques: Torque, speed: str = "1") -> Driveline:
    """One kilogram square metre on a spring of 4 N m/rad and a slider."""
    spring = Coupling("spring", ("x", "ground"), "4", hysteresis=loop, stick_stiffness=stick)
    return Driveline("slider", (Body("x", "1"),), (spring,), torques=torques, speed=speed).start((start,), ("0",))


def half_swing(amplitude: float, limit: float, stick: float) -> tuple[float, float, float]:
    """Times from a turning point to slip and to the next turning point, and its distance; K = 4, J = 1.

    The slider's spring is stretched by r = H / s at the start, by -r when it slips.
    """
    fast = sqrt(4.0 + stick)
    slow = 2.0
    reach = limit / stick
    centre = (stick * amplitude - limit) / (4.0 + stick)
    swing = amplitude - centre
    until_slip = acos((amplitude - 2 * reach - centre) / swing) / fast
    position, speed = amplitude - 2 * reach, -swing * fast * sin(fast * until_slip)
    away = position - limit / 4.0
    until_rest = atan2(-speed / slow, away) / slow  # away cos + speed/slow sin has its minimum half a turn later
    return until_slip, until_slip + (pi / slow - until_rest), sqrt(away**2 + (speed / slow) ** 2) - limit / 4.0


def test_free_decay_of_macro_slip_in_closed_form():
    limit, stick = 0.05, 60.0
    run = simulate(oscillator("0.1", "60", "1.5"), 3, 4096)
    passages = run.trajectory.auxiliaries.passages
    # From rest with an unloaded spring: the first stretch sticks until -r, then slips.
    centre = stick * 1.5 / 64.0
    first = acos((1.5 - limit / stick - centre) / (1.5 - centre)) / 8.0
    position, speed = 1.5 - limit / stick, -(1.5 - centre) * 8.0 * sin(8.0 * first)
    away = position - limit / 4.0
    amplitude = sqrt(away**2 + (speed / 2) ** 2) - limit / 4.0
    now = first + (pi - atan2(-speed / 2, away)) / 2
    want = [first, now]
    while now < run.trajectory.end:
        slip, rest, amplitude = half_swing(amplitude, limit, stick)
        want += [now + slip, now + rest]
        now += rest
    count = len(passages.time)
    assert count > 10
    assert np.max(np.abs(passages.time - want[:count])) < 1e-12
    assert want[count] > run.trajectory.end
    # K/2 (A^2 - B^2) = H (A + B - 2 r): the energy of a half swing, apart from its times.
    slip, rest, after = half_swing(1.0, limit, stick)
    assert 2.0 * (1.0 - after**2) == pytest.approx(limit * (1.0 + after - 2 * limit / stick), rel=1e-12)


def test_micro_slip_is_linear_with_both_springs():
    run = simulate(oscillator("100", "21", "0.3"), 5)
    t = run.data.time.values
    rest = 21.0 * 0.3 / 25.0  # where 4 x + 21 (x - 0.3) vanishes
    assert len(run.trajectory.auxiliaries.passages.time) == 0
    assert np.max(np.abs(run.data.angle.values[:, 0] - (rest + (0.3 - rest) * np.cos(5.0 * t)))) < 1e-13
    assert np.allclose(run.data.element_torque.values[:, 0], 25.0 * (run.data.angle.values[:, 0] - rest), atol=1e-12)


@pytest.mark.parametrize(("stick", "speed"), [("30", "1.1"), ("300", "0.9"), ("8", "3.1")])
def test_the_area_of_the_loop_is_what_friction_took(stick, speed):
    """4 H (A - H / s) a cycle at the steady amplitude A, and the same from the audit (Jenkins 1962)."""
    limit, drive = 0.2, Torque("x", "0", (Harmonic("1", "2"),))
    before, run = (simulate(oscillator("0.4", stick, "0.5", drive, speed=speed), cycles, 512) for cycles in (400, 401))
    angle, velocity, acceleration = (run.data[name].values[-513:, 0] for name in ("angle", "velocity", "acceleration"))
    widest = np.argmax(np.abs(angle))
    amplitude = abs(angle[widest]) + velocity[widest] ** 2 / abs(2 * acceleration[widest])
    assert np.abs(angle[-1] - angle[0]) < 1e-9
    lost = run.trajectory.energy.element_loss[0] - before.trajectory.energy.element_loss[0]
    assert lost == pytest.approx(4 * limit * (amplitude - limit / float(stick)), rel=1e-6)


CLUTCH = Coupling(
    "damper",
    ("x", "ground"),
    stages=(
        Stage("3", until="0.1", hysteresis="0.3", stick_stiffness="60"),
        Stage("12", until="0.4", hysteresis="0.8", stick_stiffness="100"),
        Stage("40", hysteresis="2", stick_stiffness="400"),
    ),
    coast_stages=(
        Stage("5", until="0.15", hysteresis="0.5", stick_stiffness="70"),
        Stage("30", hysteresis="1.1", stick_stiffness="90"),
    ),
    preload="0.2",
)


def returned(path: np.ndarray) -> np.ndarray:
    """Quasi-static torque of CLUTCH along a path of deflections: elastic stages and clipped springs, by hand.

    A spring is (low, high, s, H): between low and high it follows the deflection and is clipped to H, elsewhere it is
    relaxed; where it is engaged the deflection counts from the break.
    """
    drive, coast = [(0.0, 0.1, 3.0), (0.1, 0.4, 12.0), (0.4, np.inf, 40.0)], [(0.0, 0.15, 5.0), (0.15, np.inf, 30.0)]
    springs = [
        (-np.inf, np.inf, 60.0, 0.15),
        (0.1, np.inf, 100.0, 0.25),
        (0.4, np.inf, 400.0, 0.6),
        (-np.inf, 0.0, 70.0, 0.1),
        (-np.inf, -0.15, 90.0, 0.3),
    ]
    out = np.full(len(path), 0.2)
    for sign, stages in ((1.0, drive), (-1.0, coast)):
        for inner, outer, slope in stages:
            out += sign * slope * np.clip(sign * path - inner, 0.0, outer - inner)
    for low, high, stiffness, limit in springs:
        force = 0.0
        for i in range(1, len(path)):
            inside = np.clip([path[i - 1], path[i]], low, high)
            force = np.clip(force + stiffness * (inside[1] - inside[0]), -limit, limit)
            if not low < path[i] < high:
                force = 0.0
            out[i] += force
    return out


def test_the_torque_of_a_staged_clutch_follows_its_loops():
    """Every sample against the deflections before it: no time, no velocity and no region enters."""
    drive = Torque("x", "1", (Harmonic("1", "7"), Harmonic("2", "5", "1.0")))
    model = Driveline("clutch", (Body("x", "0.5", drag="0.4"),), (CLUTCH,), torques=(drive,), speed="3")
    run = simulate(model.start(("0.05",), ("0",)), 2, 16384)
    deflection = run.data.deflection.values[:, 0]
    torque = run.data.element_torque.values[:, 0]
    error = np.abs(torque - returned(deflection))
    assert deflection.min() < -0.3
    assert deflection.max() > 0.6
    assert np.max(error) < 1e-4  # a turning point between two samples is missing in the path
    assert len(set(run.trajectory.layout.auxiliary_names)) == 5
    assert {int(s) for s in np.unique(run.data.slider.values)} == {0, 1, 2, 3}
    assert run.cost.energy_residual < 1e-12


def test_friction_begins_unloaded_at_its_break_and_is_let_go_there():
    stages = (Stage("1", until="0.5"), Stage("9", hysteresis="0.6", stick_stiffness="1000"))
    model = Driveline("two stages", (Body("x", "1"),), (Coupling("c", ("x", "ground"), stages=stages),), speed="1")
    run = simulate(model.start(("0",), ("1.2",)), 1, 20000)
    out, back = run.events["time"].to_numpy()[:2]
    t = run.data.time.values
    torque = run.data.element_torque.values[:, 0]
    delta = run.data.deflection.values[:, 0]
    slider = run.data.slider_force.values[:, run.trajectory.layout.auxiliary_names.index("c.drive.1")]
    assert np.all(slider[(t < out) | ((t > back) & (t < run.events["time"][2]))] == 0.0)
    inside = (t > out) & (t < back)
    assert abs(slider[inside][0]) < 1000 * 1.2 * t[1]  # no more than the first sample's way
    assert slider[inside].max() == 0.3
    assert slider[inside][-1] == -0.3
    assert np.allclose(torque[~inside & (delta > 0) & (delta < 0.5)], delta[~inside & (delta > 0) & (delta < 0.5)])
    # Over a way W: H r / 2 + H (W - r) out, H (W - 2 r) back, r = H / s.
    speeds = run.events["velocity"].to_numpy()[:2]
    widest = delta[inside].max()
    lost = 0.5 * (speeds[0] ** 2 - speeds[1] ** 2)
    assert lost == pytest.approx(2 * 0.3 * (widest - 0.5) - 2.5 * 0.3**2 / 1000, rel=1e-5)
    assert run.trajectory.energy.element_loss[0] >= lost - 1e-12


@pytest.mark.parametrize("side", ["drive", "coast"])
def test_sides_mirrored_give_a_mirrored_motion(side):
    stages = (Stage("2", "0.1", "0.2", "0.1", "40"), Stage("15", "0.2", None, "0.7", "200"))
    other = (Stage("6", "0.1", "0.3", "0.4", "90"), Stage("25", "0.1", None, "0.5", "100"))
    turned = (stages, other) if side == "drive" else (other, stages)
    coupling = Coupling("c", ("x", "ground"), stages=turned[0], coast_stages=turned[1])
    mirrored = Coupling("c", ("x", "ground"), stages=turned[1], coast_stages=turned[0])
    motions = []
    for entry, sign in ((coupling, 1), (mirrored, -1)):
        torque = Torque("x", "0", (Harmonic("1", str(3 * sign)),))
        model = Driveline("m", (Body("x", "1"),), (entry,), torques=(torque,), speed="2")
        motions.append(simulate(model.start((str(0.4 * sign),), ("0",)), 8))
    one, two = motions
    assert np.max(np.abs(one.data.angle.values + two.data.angle.values)) < 1e-11
    assert len(one.trajectory.auxiliaries.passages.time) == len(two.trajectory.auxiliaries.passages.time) > 50


def test_forced_motion_that_only_sticks_is_the_linear_response():
    """Amplitude F / (K + s - J w^2), and a swing about where the slider was engaged."""
    stick = 21.0
    speed = 3.0
    force = 0.5
    size = force / (25.0 - speed**2)
    drive = Torque("x", "0", (Harmonic("1", str(force), str(pi / 2)),))
    model = oscillator("100", str(stick), repr(size), drive, speed=str(speed))
    run = simulate(model, 3)
    t, rest = run.data.time.values, stick * size / 25.0
    want = size * np.cos(speed * t) + rest * (1 - np.cos(5.0 * t))
    assert np.max(np.abs(run.data.angle.values[:, 0] - want)) < 1e-13
