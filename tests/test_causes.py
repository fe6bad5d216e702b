"""The cause of a rattle: closed forms, the exact motion where it is linear, and a gearbox at many speeds."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.analysis.linear.equivalent import equivalent
from gearrattle.analysis.linear.modal_response import damped_modes
from gearrattle.analysis.linear.response import steady_angles, turning_rates
from gearrattle.assembly import assemble
from gearrattle.causes import cause_of, equivalent_slopes
from tests.analysis.causes import GEARBOX, LINEAR, TWO_BODIES


@cache
def linear() -> gr.Run:
    """A driveline with two sources, one of them a transmission error, that crosses no corner."""
    return gr.simulate(gr.loads(LINEAR), cycles=28, discard=24, samples_per_cycle=256)


@cache
def gearbox(speed: str = "780 rpm") -> gr.Run:
    return gr.simulate(gr.loads(GEARBOX).with_({"excitation.speed": speed}), cycles=45, discard=15, audit=False)


def exact_amplitudes(run: gr.Run, body: str, orders: list[float]) -> np.ndarray:
    """Complex amplitudes of the simulated acceleration, of exp(i omega t)."""
    acceleration = run.data["acceleration"].sel(inertia=body).values
    after = run.trajectory.discard * run.trajectory.samples_per_cycle
    samples = acceleration[after:-1]
    time = run.trajectory.time[after:-1]
    omega = np.array(orders) * run.model.excitation.omega
    return 2.0 * np.mean(samples[:, None] * np.exp(-1j * omega * time[:, None]), axis=0)


@pytest.mark.parametrize("body", ["flywheel", "shaft", "gear"])
def test_of_a_linear_motion_the_estimate_is_the_motion(body: str) -> None:
    cause = gr.cause(linear(), body=body)
    assert cause is not None
    assert len(linear().events) == 0
    orders = sorted({item.order for item in cause.contributions})
    estimate = [sum(item.acceleration for item in cause.contributions if item.order == order) for order in orders]
    exact = exact_amplitudes(linear(), body, orders)
    np.testing.assert_allclose(estimate, exact, atol=1e-9 * np.abs(exact).max())
    assert cause.error < 1e-9
    assert sum(item.share for item in cause.contributions) == pytest.approx(1.0, abs=1e-12)


def test_modal_parts_add_up_to_the_response() -> None:
    system = assemble(gr.loads(LINEAR)).system
    stiffness, damping = equivalent_slopes(linear())
    torques = system.inputs.torque_cosine - 1j * system.inputs.torque_sine
    errors = system.inputs.error_cosine - 1j * system.inputs.error_sine
    direct = -(turning_rates(system) ** 2) * steady_angles(system, stiffness, damping)
    modes = damped_modes(system, stiffness, damping)
    for j, omega in enumerate(turning_rates(system).tolist()):
        torque = torques[:, j] + system.rows.T @ ((stiffness + 1j * omega * damping) * errors[:, j])
        parts = modes.parts(omega, torque)
        total = np.sum([part.acceleration for part in parts], axis=0)
        np.testing.assert_allclose(total, direct[:, j], atol=1e-11 * np.abs(direct[:, j]).max())
        assert [part.frequency > 0.0 for part in parts] == [False] + [True] * (len(parts) - 1)
        assert all(part.strain_energy.sum() == pytest.approx(1.0) for part in parts[1:])


def test_shares_do_not_change_with_the_size_of_the_excitation() -> None:
    model = gr.loads(LINEAR)
    twice = {f"torque.0.harmonics.{i}.amplitude": 2.0 * h.amplitude for i, h in enumerate(model.torques[0].harmonics)}
    error = {"mesh.pair.transmission_error.0.amplitude": 2.0 * model.elements[1].errors[0].amplitude}
    larger = gr.simulate(model.with_(twice | error), cycles=28, discard=24, samples_per_cycle=256)
    one, other = gr.cause(linear(), body="gear"), gr.cause(larger, body="gear")
    assert one is not None
    assert other is not None
    assert [item.share for item in other.contributions] == pytest.approx([item.share for item in one.contributions])
    sizes = [abs(item.acceleration) for item in one.contributions]
    assert [abs(item.acceleration) for item in other.contributions] == pytest.approx([2.0 * size for size in sizes])


@pytest.mark.parametrize("ratio", [0.1, 0.98, 1.4])
def test_two_bodies_have_the_mode_of_the_closed_form(ratio: float) -> None:
    driver, driven, stiffness, damping = 0.14, 0.0047, 68.75, 0.05
    both = 1.0 / driver + 1.0 / driven
    natural = np.sqrt(stiffness * both)
    omega = ratio * natural
    model = gr.loads(TWO_BODIES).with_({"excitation.speed": 0.5 * omega})
    cause = gr.cause(gr.simulate(model, cycles=4, discard=2), body="shaft")
    assert cause is not None
    (item,) = cause.contributions
    assert item.through is not None
    accelerance = (stiffness + 1j * omega * damping) / (
        -(omega**2) * driver * driven + (stiffness + 1j * omega * damping) * (driver + driven)
    )
    assert abs(item.acceleration) == pytest.approx(90.0 * abs(accelerance), rel=1e-10)
    if ratio < 0.5:  # the part of the rigid motion is the torque over all inertia
        assert item.through.elements == ()
        assert item.through.share == pytest.approx((90.0 / (driver + driven) / (90.0 * accelerance)).real, rel=1e-9)
        assert "as a rigid body" in cause.sentence
        return
    assert item.through.elements == ("damper",)
    assert item.through.frequency == pytest.approx(natural, rel=1e-10)
    assert item.through.damping_ratio == pytest.approx(0.5 * damping * both / natural, rel=1e-9)
    assert item.frequency / item.through.frequency == pytest.approx(ratio, rel=1e-10)
    speed = f"{natural / 2.0 * 30.0 / np.pi:.0f} rpm for order 2"
    assert speed in cause.sentence
    assert ("in resonance with it" in cause.sentence) == (ratio < 1.0)


def test_a_gearbox_rattles_through_the_mode_of_its_damper() -> None:
    cause = gr.cause(gearbox())
    assert cause is not None
    assert cause.body == "input_shaft"
    assert set(cause.parts) == {"m1", "m2", "m3", "m4", "m5", "m6"}
    first = cause.contributions[0]
    assert (first.source, first.order) == ("torque on flywheel", 2.0)
    assert first.share > 0.99
    assert first.through is not None
    assert first.through.elements == ("damper",)
    # by hand: all gears tied to their shaft, the damper in its first stage, friction let go: 586 rpm for order 2
    assert first.through.frequency / 2.0 * 30.0 / np.pi == pytest.approx(586.0, rel=0.05)
    assert "order 2 of the torque on flywheel at 26 Hz" in cause.sentence
    assert "\n" not in cause.sentence


@pytest.mark.parametrize("speed", ["740 rpm", "780 rpm", "920 rpm"])
def test_the_estimate_meets_a_gearbox_that_rattles(speed: str) -> None:
    """Below 750 rpm the damper works in two stages: its equivalent mode, not that of a stage, meets the motion."""
    cause = gr.cause(gearbox(speed), body="input_shaft")
    assert cause is not None
    exact = exact_amplitudes(gearbox(speed), "input_shaft", [2.0])
    assert abs(cause.contributions[0].acceleration) == pytest.approx(abs(exact[0]), rel=0.06)
    assert cause.error == pytest.approx(abs(cause.contributions[0].acceleration - exact[0]) / abs(exact[0]), abs=0.02)


def test_the_force_of_a_gap_along_a_sine_has_its_describing_function() -> None:
    """Of amplitude two half-gaps: 0.391 of the slope (Gelb, Vander Velde 1968), and the damping of contact."""
    phase = 2.0 * np.pi * np.arange(100_000) / 100_000
    deflection = 2.0 * np.sin(phase) + 0.3
    beyond = np.sign(2.0 * np.sin(phase)) * np.maximum(np.abs(2.0 * np.sin(phase)) - 1.0, 0.0)
    line = equivalent(deflection, 2.0 * np.cos(phase), 5.0 * beyond + 0.2 * np.cos(phase) + 7.0)
    assert line == pytest.approx((5.0 * 0.39100, 0.1), rel=1e-4)
    assert equivalent(np.ones(8), np.zeros(8), np.ones(8)) is None


def test_what_has_no_cause_says_none() -> None:
    assert gr.cause(linear()) is None  # nothing rattles
    assert cause_of(linear(), []) is None
    still = gr.loads(TWO_BODIES).with_({"torque.0.harmonics": []})
    assert gr.cause(gr.simulate(still, cycles=4, discard=2), body="shaft") is None
    swept = gr.loads(TWO_BODIES).with_({"excitation.sweep": {"from": "700 rpm", "to": "900 rpm", "over": "1 s"}})
    assert gr.cause(gr.simulate(swept, cycles=4, discard=2), body="shaft") is None


def test_a_body_there_is_not_is_refused() -> None:
    with pytest.raises(gr.ModelError, match="is no inertia of the driveline"):
        gr.cause(linear(), body="shafd")


def test_a_prescribed_body_moves_as_prescribed() -> None:
    motion = [{"on": "flywheel", "harmonics": [{"order": 2, "amplitude": "1 deg"}]}]
    model = gr.loads(TWO_BODIES).with_({"torque": [], "motion": motion})
    run = gr.simulate(model, cycles=164, discard=160)
    own, other = gr.cause(run, body="flywheel"), gr.cause(run, body="shaft")
    assert own is not None
    assert other is not None
    assert abs(own.contributions[0].acceleration) == pytest.approx(
        np.deg2rad(1.0) * (2.0 * model.excitation.omega) ** 2
    )
    assert "as prescribed" in own.sentence
    assert other.contributions[0].source == "motion of flywheel"
    assert other.error < 1e-8


def test_without_units_neither_rpm_nor_hertz_is_said() -> None:
    cause = gr.cause(gearbox())
    assert cause is not None
    bare = replace(cause, model=cause.model.model_copy(update={"units": "dimensionless"}))
    assert "rpm" not in bare.sentence
    assert "Hz" not in bare.sentence
