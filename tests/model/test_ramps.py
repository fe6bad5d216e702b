"""Ramps of a torque: what may be written, and the level over time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.model.ramps import Ramp, level_over_time, spans_of

BASE: dict[str, Any] = {
    "schema": 1,
    "inertia": [{"name": "a", "J": 0.01}],
    "coupling": [{"name": "shaft", "between": ["a", "ground"], "stiffness": 100.0}],
    "excitation": {"speed": 100.0},
}


def with_torque(**torque: Any) -> gr.Model:
    return gr.Model.model_validate({**BASE, "torque": [{"on": "a", **torque}]})


def test_ramps_are_read_with_units_and_written_back():
    ramps = [{"at": "0.5 s", "over": "200 ms", "to": "80 N*m"}, {"at": 1.0, "to": -20.0}]
    model = with_torque(mean=-20.0, ramps=ramps)
    assert [(ramp.at, ramp.over, ramp.to) for ramp in model.torques[0].ramps] == [(0.5, 0.2, 80.0), (1.0, 0.0, -20.0)]
    assert gr.loads(model.to_toml()) == model
    slower = model.with_({"torque.0.ramps.0.over": "400 ms"})
    assert slower["torque.0.ramps.0.over"] == 0.4
    assert slower["torque.0.ramps.1.at"] == 1.0


@pytest.mark.parametrize(
    ("torque", "location", "rule"),
    [
        ({"ramps": [{"at": -1.0, "to": 1.0}]}, "at", "must not be negative"),
        ({"ramps": [{"at": 0.0, "over": "-1 s", "to": 1.0}]}, "over", "must not be negative"),
        ({"ramps": [{"at": 0.0, "to": "1 s"}]}, "to", "torque"),
        ({"ramps": [{"at": 0.0}]}, "to", "required"),
        ({"ramps": [{"at": 0.5, "over": 0.2, "to": 1.0}, {"at": 0.6, "to": 0.0}]}, "ramps.1.at", "at 0.7 s, or later"),
        ({"ramps": [{"to": 1.0}]}, "ramps.0.at", "the first ramp must say when it begins"),
        ({"ramps": [{"at": 0.5, "to": 1.0}, {"at": "1 N", "to": 0.0}]}, "ramps.1.at", "time"),
        ({"ramps": [{"at": 0, "to": 1.0}], "signal": {"time": [0.0, 1.0], "value": [0.0, 1.0]}}, "ramps", "or ramps"),
        ({"ramps": {"at": 0.0, "to": 1.0}}, "ramps", "array"),
    ],
)
def test_what_is_wrong_with_ramps_is_said(torque: dict[str, Any], location: str, rule: str):
    if "signal" in torque:
        torque["signal"]["interpolation"] = "linear"
    with pytest.raises((ModelError, ValueError)) as refused:
        gr.Model.model_validate({**BASE, "torque": [{"on": "a", **torque}]})
    assert location in str(refused.value)
    assert rule in str(refused.value)


@pytest.mark.parametrize(
    ("ramps", "time", "level"),
    [
        ([(0.5, 0.2, 80.0)], [0.0, 0.5, 0.6, 0.7, 9.0], [-20.0, -20.0, 30.0, 80.0, 80.0]),
        ([(0.0, 0.0, 80.0)], [0.0, 1.0], [80.0, 80.0]),
        ([(0.5, 0.0, 80.0)], [0.0, 0.4999, 0.5001, 2.0], [-20.0, -20.0, 80.0, 80.0]),
        ([(0.5, 0.0, 80.0), (0.5, 0.0, 10.0)], [0.4999, 0.5001], [-20.0, 10.0]),
        ([(0.0, 1.0, 0.0), (1.0, 1.0, -40.0)], [0.5, 1.0, 1.5, 3.0], [-10.0, 0.0, -20.0, -40.0]),
        ([(0.5, 1.0, 0.0), (None, 1.0, -40.0), (None, 0.0, 8.0)], [1.0, 1.5, 2.0, 3.0], [-10.0, 0.0, -20.0, 8.0]),
    ],
)
def test_the_level_goes_from_the_mean_to_each_ramp_and_stays(ramps, time, level):
    from gearrattle.assembly.records import curve_of

    signal = level_over_time([Ramp(at=at, over=over, to=to) for at, over, to in ramps], -20.0)
    np.testing.assert_allclose(-20.0 + curve_of(signal)(time), level, atol=1e-12)


def test_a_ramp_without_a_start_begins_when_the_one_before_has_ended():
    model = with_torque(mean=-20.0, ramps=[{"at": 0.5, "over": 0.1, "to": 0.0}, {"over": 0.2, "to": 80.0}])
    assert gr.loads(model.to_toml()) == model
    assert spans_of(model.torques[0].ramps) == [(0.5, 0.6), (0.6, pytest.approx(0.8))]
    slower = model.with_({"torque.0.ramps.0.over": 0.4})
    assert spans_of(slower.torques[0].ramps) == [(0.5, 0.9), (0.9, pytest.approx(1.1))]
