"""Values that are tables over the reference speed."""

from __future__ import annotations

import copy
import json
import pickle

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.errors import ModelError
from gearrattle.model import json_schema

TOML = """
schema = 1
inertia = [
  { name = "engine", J = 0.2, drag = 0.05 },
  { name = "wheel", J = 0.02, drag_torque = { speed = ["0 rpm", "6000 rpm"], value = [0.2, 1.4] } },
]
[[coupling]]
name = "joint"
between = ["engine", "wheel"]
stiffness = 800.0
clearance = 0.01
[excitation]
speed = "1000 rpm"
[[torque]]
on = "engine"
mean = { speed = ["500 rpm", "1000 rpm", "3000 rpm"], value = ["0.4 N*m", "0.6 N*m", "1 N*m"] }
harmonics = [ { order = 1, amplitude = { speed = [50.0, 350.0], value = [6.0, 3.0] } } ]
"""


def test_a_value_is_that_of_the_models_speed() -> None:
    model, rpm = gr.loads(TOML), np.pi / 30.0
    assert model.torques[0].mean == 0.6
    assert model.inertias[1].drag_torque == pytest.approx(0.4, rel=1e-12)
    assert model.torques[0].harmonics[0].amplitude == pytest.approx(6.0 - (1000 * rpm - 50.0) / 100.0, rel=1e-12)
    faster = model.with_({"excitation.speed": "2000 rpm"})
    assert faster.torques[0].mean == pytest.approx(0.8, rel=1e-12)
    assert faster.with_({"excitation.speed": "1000 rpm"}) == model
    assert model.with_({"excitation.frequency": 1000.0 / 60.0}).torques[0].mean == pytest.approx(0.6, rel=1e-12)


def test_it_simulates_as_the_plain_number_does() -> None:
    model = gr.loads(TOML).with_({"excitation.speed": "1700 rpm"})
    plain = gr.Model.from_tables(model.to_tables(at_speed=True))
    assert not isinstance(plain.to_tables()["torque"][0]["mean"], dict)
    np.testing.assert_array_equal(assemble(model).system.inputs.torque_sine, assemble(plain).system.inputs.torque_sine)
    np.testing.assert_array_equal(assemble(model).system.inputs.mean, assemble(plain).system.inputs.mean)
    runs = [gr.simulate(entry, cycles=4, discard=1, samples_per_cycle=16) for entry in (model, plain)]
    assert runs[0].data.equals(runs[1].data)


def test_tables_survive_files_copies_and_pickles() -> None:
    model = gr.loads(TOML)
    for other in (gr.loads(model.to_toml()), copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
        assert other == model
        assert other.with_({"excitation.speed": "2000 rpm"}).torques[0].mean == pytest.approx(0.8, rel=1e-12)


def test_other_forms_of_the_model_take_the_value() -> None:
    model = gr.loads(TOML)
    assert gr.nondimensionalize(model, length=0.01).model.excitation.omega == pytest.approx(1.0)
    lumped = gr.reduce(model.with_({"coupling.joint.clearance": None}), "1 Hz", limit=0.9).model
    assert sum(torque.mean for torque in lumped.torques) == pytest.approx(0.6, rel=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("speed = [50.0, 350.0]", "speed = [150.0, 350.0]", "covers 150 to 350 rad/s; the model's speed is 104.72"),
        ("speed = [50.0, 350.0]", "speed = [350.0, 50.0]", "ascend"),
        ("speed = [50.0, 350.0]", "speed = [50.0]", "equal length"),
        ("speed = [50.0, 350.0]", 'speed = ["50 Hz", "350 Hz"]', "rpm"),
        ("speed = [50.0, 350.0]", "rpm = [50.0, 350.0]", "keys speed and value"),
        ("value = [6.0, 3.0]", 'value = ["6 kg", "3 kg"]', "torque"),
        ("value = [6.0, 3.0]", "value = 6.0", "equal length"),
        ("value = [0.2, 1.4]", "value = [0.2, -1.4]", "negative"),
        ('speed = "1000 rpm"', 'speed = "1000 kg"', "kg"),
    ],
)
def test_wrong_tables_are_refused(old: str, new: str, match: str) -> None:
    assert old in TOML
    with pytest.raises(ModelError, match=match):
        gr.loads(TOML.replace(old, new, 1))


def test_the_schema_knows_them() -> None:
    assert json.dumps(json_schema()).count("a table over the reference speed") == 6


def test_a_study_over_speed_follows_the_tables() -> None:
    model = gr.loads(TOML)
    axes = {"excitation.speed": ["800 rpm", "2500 rpm"]}
    actual = gr.study(model, axes, ["contact share"], fixed={"simulation.cycles": 6, "simulation.discard": 2})
    run = gr.simulate(model.with_({"excitation.speed": "2500 rpm"}), cycles=6, discard=2, audit=False)
    share = next(e.value for e in gr.criteria(run).entries if e.quantity == "contact share")
    assert float(actual["contact share"][1, 0]) == share
