"""A recording says what it holds, and refuses what it does not."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.errors import ModelError
from gearrattle.recording import Channel, Recording

TIME = np.arange(5) * 0.25
RIG = Recording(
    TIME,
    (
        Channel("n1", "velocity", "flywheel", "rad/s", np.sin(TIME)),
        Channel("n2", "velocity", "gear", "rad/s", np.cos(TIME)),
    ),
    "rig.csv",
)


def test_a_channel_is_found_by_its_name_or_by_what_it_holds() -> None:
    """A quantity alone finds the first; with a subject that of the subject; nothing where there is none."""
    assert RIG["n2"].subject == "gear"
    assert RIG.find("velocity") is RIG["n1"]
    assert RIG.find("velocity", "gear") is RIG["n2"]
    assert RIG.find("torque") is None
    assert RIG.find("velocity", "hub") is None


def test_a_name_that_is_not_there_is_refused_with_those_that_are() -> None:
    """The message names the source and the channels."""
    with pytest.raises(ModelError, match=r"rig.csv.*n3.*n1, n2"):
        RIG["n3"]


def test_the_interval_is_that_of_uniform_samples_only() -> None:
    """A gap in the samples is no interval."""
    assert RIG.interval == 0.25
    assert RIG.with_(time=np.array([0.0, 0.25, 0.5, 1.0, 1.25])).interval is None
    assert RIG.with_(time=np.array([0.0])).interval is None
