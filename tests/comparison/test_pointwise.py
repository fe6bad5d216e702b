"""True errors that were put into a motion by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.comparison import error_history, pointwise
from gearrattle.errors import ModelError
from tests import synthetic
from tests.signals import handmade

REFERENCE = synthetic.trajectory()
T = synthetic.PERIOD


def off_by(deflection=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0, 0.0), growth=None):
    shape = np.ones_like(REFERENCE.time) if growth is None else growth(REFERENCE.time)
    return replace(
        REFERENCE,
        deflection=REFERENCE.deflection + np.multiply.outer(shape, deflection),
        velocity=REFERENCE.velocity + np.multiply.outer(shape, velocity),
    )


def test_a_motion_against_itself_has_no_error_and_passes_nothing():
    actual = pointwise(REFERENCE, REFERENCE)
    assert actual.deflection.tolist() == [0.0, 0.0, 0.0]
    assert actual.velocity.tolist() == [0.0] * 4
    assert np.all(np.isinf(actual.passed))
    assert actual.samples == REFERENCE.time.size


def test_errors_are_in_half_gaps_and_rms_velocities():
    actual = pointwise(off_by((0.016, -0.005867, 5e-6), (0.3, 0.0, -0.2, 0.0)), REFERENCE)
    np.testing.assert_allclose(actual.deflection, [0.1, 0.1, 0.1], rtol=1e-9)
    level = REFERENCE.velocity.std(axis=0)
    np.testing.assert_allclose(actual.velocity, [0.3 / level[0], 0.0, 0.2 / level[2], 0.0], rtol=1e-9)
    assert actual.worst == pytest.approx(0.1)


def test_errors_beyond_the_horizon_do_not_count_but_the_growth_is_told():
    """An error of exp(t/T - 20) half gaps passes 1e-6 at (20 + ln 1e-6) T and 1e-3 at (20 + ln 1e-3) T."""
    values = off_by((0.0, 0.0, 5e-5), growth=lambda t: np.exp(t / T - 20.0))
    actual = pointwise(values, REFERENCE, 7.0 * T)
    assert actual.deflection[2] == pytest.approx(np.exp(-13.0), rel=1e-6)
    assert actual.horizon == pytest.approx(7.0 * T)
    expected = (20.0 + np.log(1e-6)) * T
    assert expected < actual.passed[0] <= expected + T / REFERENCE.samples_per_cycle
    assert np.all(np.isinf(actual.passed[1:]))
    assert actual.to_dict()["passed"][1] is None


def test_a_corner_at_zero_is_measured_by_the_largest_deflection():
    plate = handmade.staged([0.0], -1, [0.0, 100.0])
    motion = handmade.trajectory(plate)
    moving = replace(motion, deflection=4.0 * np.sin(handmade.OMEGA * motion.time)[:, None])
    actual = pointwise(replace(moving, deflection=moving.deflection + 1.0), moving)
    assert actual.deflection.tolist() == pytest.approx([0.25])
    assert pointwise(replace(motion, deflection=motion.deflection + 1.0), motion).deflection.tolist() == [np.inf]


def test_a_drift_does_not_flatter_and_a_constant_velocity_is_no_scale():
    drifting = replace(REFERENCE, velocity=REFERENCE.velocity + 1000.0)
    actual = pointwise(replace(drifting, velocity=drifting.velocity + 0.3), drifting)
    np.testing.assert_allclose(actual.velocity, 0.3 / REFERENCE.velocity.std(axis=0), rtol=1e-9)
    still = replace(REFERENCE, velocity=np.full_like(REFERENCE.velocity, 0.1))
    assert np.all(np.isinf(pointwise(replace(still, velocity=still.velocity + 1e-3), still).velocity))


def test_without_clearances_the_error_is_that_of_velocities():
    text = """
    schema = 1
    units = "SI"
    inertia = [{ name = "a", J = 1.0 }, { name = "b", J = 1e3 }]
    coupling = [{ name = "s", between = ["a", "b"], stiffness = 100.0, damping = 0.1 }]
    excitation = { speed = 8.0 }
    torque = [{ on = "a", harmonics = [{ order = 1, amplitude = 30.0 }] }]
    """
    model, grid = gr.loads(text), {"cycles": 4, "discard": 0, "samples_per_cycle": 64}
    truth = gr.simulate(model, **grid).trajectory
    rough = gr.simulate(model, algorithm="rk2", step=0.02, **grid).trajectory
    actual = pointwise(rough, truth)
    level = truth.velocity.std(axis=0).max()
    assert actual.unit == "of the rms velocity"
    assert actual.worst == pytest.approx(np.abs(rough.velocity - truth.velocity).max() / level)
    assert actual.worst > 1e-3
    assert pointwise(truth, truth).worst == 0.0
    assert np.isfinite(actual.passed[1])


def test_not_a_number_is_no_small_error():
    values = off_by()
    values.deflection[100, 1] = np.nan
    assert pointwise(values, REFERENCE).deflection[1] == np.inf
    assert error_history(values, REFERENCE, np.ones(3))[100].tolist() == [0.0, np.inf, 0.0]


def test_other_grids_and_drivelines_are_refused():
    with pytest.raises(ModelError, match="samples from 0 s"):
        pointwise(synthetic.trajectory(cycles=11), REFERENCE)
    with pytest.raises(ModelError, match="of the driveline flywheel, hub"):
        pointwise(handmade.trajectory(), REFERENCE)
    with pytest.raises(ModelError, match="same corners"):
        pointwise(handmade.trajectory(handmade.layout(corners=(np.array([1.0]),))), handmade.trajectory())
