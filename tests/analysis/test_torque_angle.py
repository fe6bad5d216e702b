"""The static characteristic against closed forms and a fine path taken step by step."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from tests.architecture.places import EXAMPLES
from tests.laws.test_friction import CLUTCH, returned
from tests.oracles.driveline import Body, Coupling, Driveline


def of(coupling: Coupling) -> gr.Model:
    return gr.loads(Driveline("one", (Body("x", "1"),), (coupling,), speed="3").toml())


def test_one_slider_draws_masings_parallelogram() -> None:
    """Loop area 4 H (A - H / s), corners 2 H / s behind each turn."""
    model = of(Coupling("c", ("x", "ground"), "4", hysteresis="0.6", stick_stiffness="30"))
    loop = gr.torque_angle(model, "c", -0.5, 0.5)
    assert loop.loss == pytest.approx(4 * 0.3 * (0.5 - 0.3 / 30), rel=1e-14)
    assert loop.deflection == pytest.approx([-0.5, -0.48, 0.5, 0.48, -0.5], abs=1e-15)
    assert loop.torque == pytest.approx([-2.3, -1.62, 2.3, 1.62, -2.3], abs=1e-14)
    assert loop.elastic == pytest.approx(4 * loop.deflection, abs=1e-15)
    assert loop.turn == 2
    stuck = gr.torque_angle(model, "c", 0.1, 0.115)
    assert stuck.loss == pytest.approx(0.0, abs=1e-16)
    assert len(stuck.deflection) == 3


@pytest.mark.slow
def test_a_clutch_of_three_stages_follows_every_loop() -> None:
    """Against a path of 9000 small steps on either branch, away from the instants of letting go."""
    loop = gr.torque_angle(of(CLUTCH), "damper", -0.3, 0.6)
    legs = [np.linspace(a, b, 9001) for a, b in ((0, 0.6), (0.6, -0.3), (-0.3, 0.6), (0.6, -0.3))]
    path = np.concatenate(legs)
    up = slice(18002, 27003)
    down = slice(27003, 36004)
    torque, turn = returned(path), loop.turn
    away = np.min(np.abs(path[:, None] - np.array([-0.15, 0.0, 0.1, 0.4])), axis=1) > 1e-4
    for branch, points in ((up, slice(0, turn + 1)), (down, slice(turn, None))):
        way = 1 if branch is up else -1
        drawn = np.interp(path[branch], loop.deflection[points][::way], loop.torque[points][::way])
        assert np.abs(drawn - torque[branch])[away[branch]].max() < 1e-13
    area = np.sum(0.5 * (torque[18003:] + torque[18002:-1]) * np.diff(path[18002:]))
    assert loop.loss == pytest.approx(area, rel=1e-4)
    assert loop.torque[0] == loop.torque[-1]


def test_the_ends_may_be_words_and_have_defaults() -> None:
    model = gr.load(EXAMPLES / "clutch_friction.toml")
    loop = gr.torque_angle(model, "damper", "-5 deg", "6 deg")
    assert np.degrees([loop.deflection.min(), loop.deflection.max()]) == pytest.approx([-5.0, 6.0])
    whole = gr.torque_angle(model, "damper")
    assert np.degrees(whole.deflection.min()) < -9.0 * 1.25
    assert np.degrees(whole.deflection.max()) > 14.0 * 1.25
    spline = gr.torque_angle(model, "spline")
    assert spline.loss == 0.0
    assert gr.torque_angle(gr.example("case3"), "clutch").loss == 0.0, "stages, and friction nowhere"
    assert np.array_equal(spline.torque, spline.elastic)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (("clutch",), "there is no such coupling; there are damper, spline"),
        (("dampr",), 'did you mean "damper"'),
        (("gear",), "there is no such coupling"),
        (("damper", "5 deg", "2 deg"), "must lie below high"),
        (("damper", "5 mm", "9 deg"), "mm"),
        (("damper", float("nan"), 1.0), "low"),
    ],
)
def test_bad_input_is_one_clear_error(values: tuple, message: str) -> None:
    with pytest.raises(gr.ModelError, match=message):
        gr.torque_angle(gr.load(EXAMPLES / "clutch_friction.toml"), *values)


def test_friction_and_damping_share_the_loss() -> None:
    """The damping's share by a trapezoidal rule over samples, the friction's from what is left."""
    spring = Coupling("c", ("x", "ground"), "4", "0.3", hysteresis="0.6", stick_stiffness="30")
    model = gr.loads(Driveline("one", (Body("x", "1"),), (spring,), speed="1").start(("1",), ("0",)).toml())
    run = gr.simulate(model, cycles=1, samples_per_cycle=20000, discard=0)
    energy, speed = run.trajectory.energy, run.data.velocity.values[:, 0]
    damping = np.trapezoid(0.3 * speed**2, run.data.time.values)
    assert energy.element_loss[0] - energy.friction_loss[0] == pytest.approx(damping, rel=1e-7)
    assert energy.friction_loss[0] > 0.1
    dry = gr.loads(model.to_toml()).with_({"coupling.c.damping": 0.0})
    energy = gr.simulate(dry, cycles=3, discard=0).trajectory.energy
    assert energy.friction_loss[0] == pytest.approx(energy.element_loss[0], rel=1e-13)
