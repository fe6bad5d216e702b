"""Wrong input is told with place, value, rule and remedy, and nothing is compared."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.recording import Channel, Recording
from tests.measured.validation import made


def _named(quantity: str, subject: str, unit: str) -> Recording:
    record = made.record()
    return record.with_(channels=(Channel("a", quantity, subject, unit, record["a"].values),))


@pytest.mark.parametrize(
    ("record", "said"),
    [
        (_named("velocity", "gear", "rad/s"), "rig: found a (velocity of gear); has no channel in common"),
        (_named("acceleration", "", "rad/s^2"), "a (acceleration of an unknown subject)"),
        (_named("acceleration", "wheel", "g"), 'rig: a: found unit "g"; acceleration.wheel has "rad/s^2"'),
        (made.record(seconds=0.3), "rig: found 5 whole cycles of 0.05 s in 0.2"),
        (made.record(rate=100.0), "5 samples in a cycle of 0.05 s; at least 8 samples in a cycle are needed"),
        (made.record(gain=0.0, noise=1.0), "clock: a: found a correlation of"),
    ],
)
def test_records_that_cannot_be_compared(record: Recording, said: str) -> None:
    with pytest.raises(gr.ModelError, match=re.escape(said)):
        gr.validate(made.run(), record)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"match": {"b": "velocity.wheel"}}, "match: found b; is no channel of rig; there are a"),
        ({"match": {"a": "velocity.hub"}}, "match: found velocity.hub; is no channel"),
        ({"trend": "quadratic"}, "trend"),
        ({"clock": "sun"}, "clock"),
        ({"clock_by": "b"}, "clock_by: found b; is no measured channel that is compared; these are a"),
        ({"band": (50.0, 20.0)}, "band: found 50.0 to 20.0 Hz; must ascend"),
        ({"band": (0.0, 1e4)}, "band: found up to 10000 Hz; must be at most 512 Hz"),
        ({"start": 2.0, "end": 1.0}, "start, end"),
        ({"start": 2.2}, "at least 8 cycles are needed"),
        ({"thresholds": {"gear": 1.0}}, "thresholds: found gear; is no clearance with a measured force"),
        ({"noise": {"b": 1.0}}, "noise: found b"),
        ({"noise": {"a": -1.0}}, "noise, calibration: a: found -1.0"),
        ({"parameters": {"inertia.wheel.K": 1.0}}, "parameters: found inertia.wheel.K; is not a path of the model"),
        ({"parameters": {"inertia.wheel.J": 3.0}}, "a standard error must lie between 0 and the value, 2"),
        ({"parameters": {"inertia.wheel.J": 0.1}, "draws": 1}, "draws: found 1; must be a whole number from 2"),
        ({"settings": {"cycles": 5}}, "settings: found cycles; settings are for a simulation"),
    ],
)
def test_arguments_that_say_nothing(arguments: dict[str, Any], said: str) -> None:
    with pytest.raises(gr.ModelError, match=re.escape(said)):
        gr.validate(made.run(), made.record(), **arguments)


def test_a_run_without_a_period(tmp_path: Path) -> None:
    swept = made.MODEL.replace('frequency = "20 Hz"', 'sweep = { from = "1200 rpm", to = "1500 rpm", over = "1 s" }')
    with pytest.raises(gr.ModelError, match="the speed changes along the run, so it has no period"):
        gr.validate(gr.loads(swept), made.record())


def test_a_run_too_short_is_told_as_the_run() -> None:
    with pytest.raises(gr.ModelError, match=r"wheel, exact: found 5 whole cycles"):
        gr.validate(gr.loads(made.MODEL), made.record(), settings={"cycles": 10, "discard": 4})


def test_a_constant_channel_has_no_sigma() -> None:
    record = made.record()
    still = Channel("w", "velocity", "wheel", "rad/s", np.full(record.time.size, 3.0))
    actual = gr.validate(made.run(), record.with_(channels=(*record.channels, still)))
    assert np.isnan(actual["w"].level("rms").sigma)
    assert "nothing was measured" in " ".join(actual.findings)
    assert actual.to_dict()["pairs"][1]["levels"][1]["sigma"] is None


def test_a_channel_called_as_a_body_is_of_that_body() -> None:
    record = made.record()
    named = record.with_(channels=(Channel("wheel", "acceleration", "", record["a"].unit, record["a"].values),))
    by_name = gr.validate(made.run(), named)
    by_subject = gr.validate(made.run(), record)
    assert "wheel: taken for acceleration.wheel by its name" in by_name.notes
    numbers = by_subject.to_dataframe().drop(columns="channel")
    assert by_name.to_dataframe().drop(columns="channel").equals(numbers)
