"""A mapping given to ``fit`` in place of a data file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.measured.fitting.fit import recording_of
from gearrattle.measured.validation.pairing import paired
from gearrattle.recording import Channel, Recording

TIME = np.arange(64) / 64.0
SWING = 2.0 * np.sin(8.0 * np.pi * TIME)
MAPPING = """
schema = 1
file = "rig.csv"
[[channel]]
name = "n_gear"
quantity = "{quantity}"
of = "gear"
unit = "rad/s"
"""


@pytest.mark.parametrize("quantity", ["speed", "velocity"])
def test_a_mapping_is_a_recorded_motion(quantity: str, tmp_path: Path) -> None:
    gr.write(Recording(TIME, (Channel("n_gear", "", "", "rad/s", 83.0 + SWING),), "rig"), tmp_path / "rig.csv")
    path = tmp_path / "measurement.toml"
    path.write_text(MAPPING.format(quantity=quantity))
    tables = {
        "file": str(tmp_path / "rig.csv"),
        "channel": [{"name": "n_gear", "quantity": quantity, "of": "gear", "unit": "rad/s"}],
    }
    for data in (path, str(path), tables):
        mapped = recording_of(data)
        assert mapped is not None
        (recording,), _ = mapped
        np.testing.assert_array_equal(recording["n_gear"].values, 83.0 + SWING)


def test_a_mapping_of_a_mapping_is_still_named_by_recording(tmp_path: Path) -> None:
    gr.write(Recording(TIME, (Channel("n_gear", "", "", "rad/s", SWING),), "rig"), tmp_path / "rig.csv")
    (tmp_path / "measurement.toml").write_text(MAPPING.format(quantity="speed"))
    (tmp_path / "data.toml").write_text('[recording]\nfile = "measurement.toml"\nend = "0.5 s"\n')
    mapped = recording_of(tmp_path / "data.toml")
    assert mapped is not None
    assert mapped[0][0].names == ("n_gear",)


def test_a_speed_has_the_velocity_of_its_body_as_partner() -> None:
    """Without its mean, and only where the velocity itself was not measured."""
    simulated = Recording(TIME, (Channel("velocity.gear", "velocity", "gear", "rad/s", SWING),), "run")
    speed = Channel("n", "speed", "gear", "rad/s", 83.0 + SWING)
    pairing = paired(Recording(TIME, (speed,), "rig"), simulated, {})
    (one,) = pairing.measured
    np.testing.assert_allclose(one.values, SWING, atol=1e-13)
    assert pairing.notes == ("n: a speed, compared with velocity.gear without its mean, 83 rad/s",)
    velocity = Channel("w", "velocity", "gear", "rad/s", SWING)
    pairing = paired(Recording(TIME, (speed, velocity), "rig"), simulated, {})
    assert [one.name for one in pairing.measured] == ["w"]
    assert pairing.measured_alone == ("n",)
