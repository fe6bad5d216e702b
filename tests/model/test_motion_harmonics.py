"""Harmonics of a prescribed motion in the model file: units, errors, paths, labels, schema, and the way back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly.scaled import dimensional, dimensionless
from gearrattle.engine.system.characteristic import Scales
from gearrattle.model import Model, json_schema
from gearrattle.model.path_labels import path_label

TEXT = """
schema = 1
[[inertia]]
name = "engine"
J = 0.1
[[inertia]]
name = "load"
J = 0.02
[[coupling]]
name = "shaft"
between = ["engine", "load"]
stiffness = 100.0
[excitation]
speed = 30.0
[[motion]]
on = "engine"
harmonics = [{ order = 1, amplitude = "0.5 deg" }, { order = 2, amplitude = 0.003, phase = "90 deg" }]
"""
SINE = {"order": 1, "amplitude": 0.01}
RECORD = {"time": [0.0, 1.0, 2.0, 3.0], "value": [1.0, 2.0, 1.0, 0.0]}


def with_motion(**keys: Any) -> Model:
    return Model.from_tables({**gr.loads(TEXT).to_tables(), "motion": [{"on": "engine", **keys}]})


def test_amplitudes_are_angles() -> None:
    first, second = gr.loads(TEXT).motions[0].harmonics
    assert (first.amplitude, first.phase) == (np.deg2rad(0.5), 0.0)
    assert (second.order, second.amplitude, second.phase) == (2.0, 0.003, np.pi / 2.0)
    assert gr.loads(TEXT).motions[0].signal is None


def test_what_is_written_reads_as_the_same() -> None:
    model = gr.loads(TEXT)
    assert gr.loads(model.to_toml()) == model
    text, points = model.to_stored()
    assert gr.loads(text, stored=points) == model
    assert points == {}
    assert "speed" not in model.to_tables()["motion"][0]  # type: ignore[index]


@pytest.mark.parametrize(
    ("keys", "location", "words"),
    [
        ({}, "motion.0", "needs one of speed, angle and harmonics; try: give exactly one"),
        ({"speed": RECORD, "harmonics": [SINE]}, "motion.0.harmonics", "not speed and harmonics"),
        ({"angle": RECORD, "harmonics": [SINE]}, "motion.0.harmonics", "not angle and harmonics"),
        ({"speed": RECORD, "angle": RECORD}, "motion.0.angle", "not speed and angle"),
        (
            {"speed": RECORD, "angle": RECORD, "harmonics": [SINE]},
            "motion.0.harmonics",
            "speed and angle and harmonics",
        ),
        ({"harmonics": []}, "motion.0.harmonics", "needs at least one harmonic"),
        ({"harmonics": [SINE], "about": 30.0}, "motion.0.about", "harmonics have none"),
        (
            {"harmonics": [{"order": 0, "amplitude": 0.1}]},
            "motion.0.harmonics.0.order",
            "a constant angle is no harmonic",
        ),
        ({"harmonics": [{"order": -1, "amplitude": 0.1}]}, "motion.0.harmonics.0.order", "must be greater than zero"),
        ({"harmonics": [{"order": 1}]}, "motion.0.harmonics.0.amplitude", "required"),
        ({"harmonics": [{**SINE, "amplitude": "1 mm"}]}, "motion.0.harmonics.0.amplitude", "angle"),
        ({"harmonics": [{**SINE, "amplitud": 1}]}, "motion.0.harmonics.0.amplitud", "unknown key"),
        ({"harmonics": SINE}, "motion.0.harmonics", "must be an array"),
    ],
)
def test_one_clear_error(keys: dict[str, Any], location: str, words: str) -> None:
    with pytest.raises(gr.ModelError) as caught:
        with_motion(**keys)
    (problem,) = caught.value.problems
    assert problem.place == location
    assert words in f"{problem.rule}; try: {problem.remedy}"
    assert problem.remedy or "required" in words


def test_the_error_names_the_line() -> None:
    text = TEXT.replace("harmonics = ", "about = 3.0\nharmonics = ")
    with pytest.raises(gr.ModelError, match=r"model.toml:17: motion.0.about: found 3.0; is the mean speed of a record"):
        gr.loads(text, "model.toml")


def test_an_order_too_high_for_a_phase_is_named() -> None:
    with pytest.raises(gr.ModelError, match=r"motion.0.harmonics.0.order"):
        gr.simulate(gr.loads(TEXT).with_({"motion.0.harmonics.0.order": 1e17}))


def test_paths_change_and_list_harmonics() -> None:
    model = gr.loads(TEXT)
    changed = model.with_({"motion.0.harmonics.0.amplitude": "0.2 deg", "motion.0.harmonics.1.order": 3})
    assert changed.motions[0].harmonics[0].amplitude == np.deg2rad(0.2)
    assert changed.motions[0].harmonics[1].order == 3.0
    assert {"motion.0.harmonics.0.amplitude", "motion.0.harmonics.1.phase"} <= set(model.paths())
    recorded = model.with_({"motion.0.harmonics": None, "motion.0.speed": RECORD})
    assert recorded.motions[0].signal is not None
    with pytest.raises(gr.ModelError, match="goes by index from 0 to 1"):
        model.with_({"motion.0.harmonics.2.amplitude": 0.1})


def test_labels_say_order_and_unit() -> None:
    model = gr.loads(TEXT)
    assert path_label("motion.0.harmonics.1.amplitude", model) == ("motion amplitude of engine, order 2", "rad")
    assert path_label("motion.0.harmonics.0.phase", model) == ("motion phase of engine, order 1", "rad")


def test_the_schema_knows_them() -> None:
    schema: Any = json_schema()
    harmonics = schema["$defs"]["Motion"]["properties"]["harmonics"]
    sine = schema["$defs"][harmonics["items"]["$ref"].rpartition("/")[2]]
    assert set(sine["required"]) == {"order", "amplitude"}
    assert "rad" in str(sine["properties"]["amplitude"])


def test_amplitudes_scale_as_angles() -> None:
    scales = Scales(frequency=30.0, angle=0.02, radius=0.05, inertia=0.1)
    model = gr.loads(TEXT)
    scaled = dimensionless(model, scales)
    assert [h.amplitude for h in scaled.motions[0].harmonics] == pytest.approx([np.deg2rad(0.5) / 0.02, 0.15])
    assert [h.phase for h in scaled.motions[0].harmonics] == [0.0, np.pi / 2.0]
    back = dimensional(scaled, scales)
    assert [h.amplitude for h in back.motions[0].harmonics] == pytest.approx([np.deg2rad(0.5), 0.003])
