"""Labels of paths: words and units for every path of every example, none of them a path."""

from __future__ import annotations

from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.model.path_labels import path_label
from gearrattle.model.paths import value_at

EXAMPLES = Path(__file__).parents[2] / "examples"
MODELS = sorted([*EXAMPLES.glob("*.toml"), *EXAMPLES.glob("paper/*.toml")])
WITHOUT_UNIT = (
    "order",
    "cycles",
    "discard",
    "faces",
    "number",
    "teeth",
    "wetted",
    "films",
    "samples_per_cycle",
    "tolerance",
    "ratio",
    "share",
    "fewer",
    "schema",
    "cylinders",
    "orders",
    "scale",
)


@pytest.mark.parametrize("file", MODELS, ids=lambda file: file.stem)
def test_every_path_of_every_example_has_words_of_its_own_and_its_unit(file: Path) -> None:
    model = gr.load(file)
    labels = {path: path_label(path, model) for path in model.paths()}
    words = [label.words for label in labels.values()]
    assert len(set(words)) == len(words)
    for path, (text, unit) in labels.items():
        assert path not in text or "." not in path
        assert not any(part.isdigit() and f".{part}" in text for part in path.split("."))
        value = value_at(model.to_tables(), path)
        is_number = isinstance(value, float | int) and not isinstance(value, bool)
        if is_number and model.units == "SI" and not path.endswith(WITHOUT_UNIT):
            assert unit, path
        assert "*" not in unit
        assert "^" not in unit
        if model.units == "dimensionless":
            assert unit == ""


def test_labels_say_part_quantity_and_unit() -> None:
    model = gr.load(EXAMPLES / "manual_transmission.toml")
    assert path_label("mesh.second_mesh.backlash", model) == ("backlash of mesh second_mesh", "m")
    assert path_label("inertia.hub.J", model) == ("moment of inertia of hub", "kg m²")
    assert path_label("coupling.damper.stages.0.stiffness", model) == (
        "stiffness of stage 1 of coupling damper",
        "N m/rad",
    )
    assert path_label("torque.0.harmonics.1.amplitude", model) == ("torque amplitude on flywheel, order 4", "N m")
    assert path_label("mesh.second_mesh.radii.1", model) == ("base radius 2 of mesh second_mesh", "m")
    assert path_label("excitation.speed", model) == ("speed", "rad/s")
    assert path_label("simulation.cycles", model) == ("simulated cycles", "")


def test_states_have_labels_as_paths_have() -> None:
    model = gr.load(EXAMPLES / "manual_transmission.toml")
    assert path_label("initial.deflection.second_mesh", model) == ("initial deflection of second_mesh", "m")
    assert path_label("rate.second_mesh", model) == ("rate of second_mesh", "m/s")
    assert path_label("rate.spline", model) == ("rate of spline", "rad/s")
    assert path_label("angle.hub", model) == ("angle of hub", "rad")
    oscillator = gr.load(EXAMPLES / "rattle_oscillator.toml")
    assert path_label("deflection.flanks", oscillator) == ("deflection of flanks", "")


def test_a_table_over_speed_has_the_units_of_its_columns() -> None:
    model = gr.load(EXAMPLES / "run_up.toml")
    assert path_label("torque.0.harmonics.0.amplitude.speed", model).unit == "rad/s"
    assert path_label("torque.0.harmonics.0.amplitude.value", model).unit == "N m"


def test_two_torques_on_one_inertia_and_two_sines_of_one_order_are_told_apart() -> None:
    model = gr.loads(
        """
schema = 1
[[inertia]]
name = "disc"
J = 1.0
[[coupling]]
name = "shaft"
between = ["disc", "ground"]
stiffness = 10.0
[excitation]
speed = 10.0
[[torque]]
on = "disc"
mean = 1.0
harmonics = [ { order = 1, amplitude = 1.0 }, { order = 1, amplitude = 2.0 } ]
[[torque]]
on = "disc"
mean = 1.0
harmonics = [ { order = 1, amplitude = 1.0 }, { order = 1, amplitude = 2.0 } ]
"""
    )
    words = [path_label(path, model).words for path in model.paths()]
    assert len(set(words)) == len(words)
    assert "mean torque on disc (2 of 2)" in words


@pytest.mark.parametrize("file", MODELS, ids=lambda file: file.stem)
def test_what_contains_a_path_has_a_label_too(file: Path) -> None:
    """A list of sines, one of them, a side of a planetary set: a path may end at any of its keys."""
    model = gr.load(file)
    for path in model.paths():
        keys = path.split(".")
        for length in range(2, len(keys)):
            words = path_label(".".join(keys[:length]), model).words
            assert words == words.strip() != ""


def test_one_sine_is_called_by_its_order() -> None:
    model = gr.example("planetary_set")
    words = path_label("planetary.set.transmission_error.sun.0", model).words
    assert words.startswith("transmission error of planetary")
