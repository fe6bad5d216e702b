"""A recording drives a model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError

EXAMPLES = Path(__file__).parents[2] / "examples"
MEASURED = gr.load(EXAMPLES / "measured_flywheel.toml")
CASE = gr.load(EXAMPLES / "paper" / "case3.toml")


def _record(quantity: str, subject: str = "flywheel", unit: str = "rad/s") -> gr.measured.Recording:
    time = 3.0 + np.arange(400) * 1e-3
    return gr.measured.Recording(
        time, (gr.measured.Channel("x", quantity, subject, unit, 80.0 + np.sin(100.0 * time)),), "rig.mat"
    )


def test_a_measured_flywheel_gives_the_run_of_the_model_that_names_the_file() -> None:
    """The speed of the file, read as a recording, instead of the one the model reads: the same bits."""
    record = gr.read(EXAMPLES / "measured" / "flywheel_speed.csv")
    assert record.channels[0].quantity == "velocity"
    other = gr.measured.drive(MEASURED, record, "n", "flywheel")
    one, two = (gr.simulate(m, cycles=2, discard=0, samples_per_cycle=64) for m in (MEASURED, other))
    np.testing.assert_array_equal(one.trajectory.angle, two.trajectory.angle)
    assert other.motions[0].signal.source.endswith("flywheel_speed.csv: n")


def test_a_motion_takes_the_place_of_torques_and_a_torque_is_added() -> None:
    moved = gr.measured.drive(CASE, _record("velocity"))
    assert [torque.on for torque in moved.torques] == ["input_gear"]
    assert moved.motions[0].on == "flywheel"
    assert moved.motions[0].signal.start == 3.0
    turned = gr.measured.drive(moved, _record("shaft angle", unit="rad"), about=81.0)
    assert len(turned.motions) == 1
    assert turned.motions[0].angle is not None
    assert turned.motions[0].about == 81.0
    pushed = gr.measured.drive(CASE, _record("torque", "hub", "N*m"), start=3.1, static=0.0)
    assert len(pushed.torques) == len(CASE.torques) + 1
    signal = pushed.torques[-1].signal
    assert signal is not None
    assert (signal.start, signal.static, signal.time.size) == (3.1, 0.0, 400)


@pytest.mark.parametrize(
    ("quantity", "unit", "interpolation"),
    [("torque", "N*m", "linear"), ("torque", "N*m", "step"), ("torque", "N*m", "cubic"), ("speed", "rad/s", "linear")],
)
def test_what_stands_between_samples(quantity: str, unit: str, interpolation: str) -> None:
    driven = gr.measured.drive(CASE, _record(quantity, "hub", unit), interpolation=interpolation)
    signal = driven.torques[-1].signal if quantity == "torque" else driven.motions[0].signal
    assert signal is not None
    assert signal.interpolation == interpolation


@pytest.mark.parametrize(
    ("record", "options", "words"),
    [
        (_record("velocity"), {"interpolation": "step"}, 'must be "cubic" or "linear" here'),
        (_record("torque"), {"interpolation": "line"}, 'did you mean "linear"'),
        (_record("sound pressure"), {"channel": "x"}, "sound pressure drives nothing; torque"),
        (_record("sound pressure"), {}, "0 channels can drive"),
        (_record("velocity", "flywheeel"), {}, 'did you mean "flywheel"'),
        (_record("velocity", ""), {}, "no inertia has this name"),
        (_record("velocity"), {"channel": "y"}, "is no channel"),
        (_record("velocity"), {"static": 1.0}, "belongs to a torque"),
        (_record("torque"), {"about": 1.0}, "belongs to a motion"),
        (_record("velocity"), {"start": 99.0}, "a run begins at its 99 s"),
    ],
)
def test_what_cannot_drive(record: gr.measured.Recording, options: dict[str, object], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        gr.measured.drive(CASE, record, **options)  # type: ignore[arg-type]
