"""A path with a star means all values that match; a factor is of what the model says: against changes made by hand."""

from __future__ import annotations

from typing import Any

import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.model import Model
from gearrattle.model.path_labels import path_label
from gearrattle.model.path_values import Varied, change_in_si, in_si
from gearrattle.model.paths import path_names, resolved

DRAGS = {"inertia.input_shaft.drag_torque": 0.3, "inertia.gear_a.drag_torque": 0.2, "inertia.gear_b.drag_torque": 0.1}
TOML = """
schema = 1
inertia = [
  { name = "flywheel", J = 0.1 },
  { name = "input_shaft", J = 2e-3, drag_torque = 0.3 },
  { name = "gear_a", J = 1e-3, drag_torque = 0.2 },
  { name = "gear_b", J = 5e-4, drag_torque = 0.1 },
]
torque = [
  { on = "flywheel", mean = 0.7, harmonics = [{ order = 2, amplitude = 90 }, { order = 4, amplitude = 25 }] },
  { on = "input_shaft", harmonics = [{ order = 1, amplitude = 1 }] },
]
[[coupling]]
name = "damper"
between = ["flywheel", "input_shaft"]
stages = [{ stiffness = 100, until = "4 deg" }, { stiffness = 500 }]
[[mesh]]
name = "a"
between = ["input_shaft", "gear_a"]
radii = ["20 mm", "40 mm"]
stiffness = 3e8
backlash = "0.1 mm"
[[mesh]]
name = "b"
between = ["input_shaft", "gear_b"]
radii = ["25 mm", "35 mm"]
stiffness = 3e8
backlash = "0.2 mm"
[excitation]
speed = "800 rpm"
[simulation]
cycles = 20
"""


@pytest.fixture(scope="module")
def model() -> Model:
    return gr.loads(TOML)


@pytest.mark.parametrize(
    ("changes", "by_hand"),
    [
        ({"inertia.*.drag_torque": gr.factor(3)}, {path: 3.0 * own for path, own in DRAGS.items()}),
        ({"inertia.*.drag_torque": {"factor": 3}}, {path: 3.0 * own for path, own in DRAGS.items()}),
        ({"inertia.gear*.drag_torque": "5 N*m"}, dict.fromkeys([*DRAGS][1:], 5.0)),
        ({"mesh.*.backlash": "0.3 mm"}, {"mesh.a.backlash": 3e-4, "mesh.b.backlash": 3e-4}),
        ({"*backlash": gr.factor(0.5)}, {"mesh.a.backlash": 0.5 * 1e-4, "mesh.b.backlash": 0.5 * 2e-4}),
        (
            {"torque.*.harmonics.*.amplitude": gr.factor(2)},
            {
                "torque.0.harmonics.0.amplitude": 180.0,
                "torque.0.harmonics.1.amplitude": 50.0,
                "torque.1.harmonics.0.amplitude": 2.0,
            },
        ),
        (
            {"coupling.damper.stages.*.stiffness": gr.factor(1.5)},
            {"coupling.damper.stages.0.stiffness": 150.0, "coupling.damper.stages.1.stiffness": 750.0},
        ),
        ({"mesh.*.radii.1": gr.factor(2)}, {"mesh.a.radii.1": 2 * 0.04, "mesh.b.radii.1": 2 * 0.035}),
        ({"inertia.*.drag_torque": None}, dict.fromkeys(DRAGS)),
        ({"simulation.cycles": gr.factor(2)}, {"simulation.cycles": 40}),
        ({"excitation.speed": gr.factor(1.5)}, {"excitation.speed": 1.5 * gr.loads(TOML).excitation.omega}),
    ],
)
def test_a_change_is_the_one_made_by_hand(model: Model, changes: dict[str, Any], by_hand: dict[str, Any]) -> None:
    assert model.with_(changes) == model.with_(by_hand)
    assert resolved(model.to_tables(), changes).keys() == by_hand.keys()


def test_factors_multiply_and_one_changes_nothing(model: Model) -> None:
    """Of what the model says at the time: three times, then twice, is six times."""
    assert model.with_({"*.drag_torque": gr.factor(1)}) == model
    twice = model.with_({"mesh.*.backlash": gr.factor(4)}).with_({"mesh.*.backlash": gr.factor(2)})
    assert twice == model.with_({"mesh.*.backlash": gr.factor(8)})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"inertia.*.drag_torqe": gr.factor(3)},
            r"inertia.\*.drag_torqe: matches no value.*did you mean \"drag_torque\"",
        ),
        ({"inertia.wheel*.drag_torque": 1.0}, r"matches no value.*inertia.input_shaft.drag_torque, inertia.gear_a"),
        ({"clutch.*.slope": 1.0}, r"there are schema, inertia, coupling, mesh"),
        ({"inertia.flywheel.drag_torque": gr.factor(3)}, "says nothing here"),
        ({"inertia.*.name": gr.factor(3)}, r"inertia.flywheel.name: found \"flywheel\"; a factor needs a number"),
        ({"mesh.*.radii": gr.factor(3)}, r"mesh.a.radii: found \[0.02, 0.04\]; a factor needs a number"),
        ({"coupling.damper.stages": gr.factor(3)}, r"coupling.damper.stages.*a factor needs a number"),
        ({"mesh.*.backlash": gr.factor(-1)}, r"mesh.a.backlash: found -0.0001; must not be negative"),
        ({"mesh.*.backlash": {"factor": "3"}}, r"factor: found \"3\"; must be a finite number"),
        ({"mesh.*.backlash": 1e-4, "mesh.a.backlash": 2e-4}, r"mesh.a.backlash: is changed twice, by mesh.\*.backlash"),
    ],
)
def test_what_has_no_meaning_is_refused(model: Model, changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        model.with_(changes)


def test_a_factor_of_an_amplitude_over_speed_is_refused(model: Model) -> None:
    """The pattern matches the table; it is not passed over."""
    over_speed = {"speed": [50.0, 200.0], "value": [90.0, 60.0]}
    varied = model.with_({"torque.0.harmonics.0.amplitude": over_speed})
    assert "torque.0.harmonics.0.amplitude" in varied.paths("torque.*.amplitude")
    with pytest.raises(ModelError, match=r"torque.0.harmonics.0.amplitude: found a table; a factor needs a number"):
        varied.with_({"torque.*.amplitude": gr.factor(2)})


@pytest.mark.parametrize("times", ["3", None, True, float("nan"), float("inf")])
def test_a_factor_is_a_finite_number(times: Any) -> None:
    with pytest.raises(ModelError, match=r"factor: .*must be a finite number"):
        gr.factor(times)


def test_the_paths_that_match_are_those_that_are_set(model: Model) -> None:
    assert model.paths("*") == model.paths() == path_names(model.to_tables())
    assert model.paths("inertia.*.drag_torque") == tuple(DRAGS)
    assert model.paths("*backlash*") == ("mesh.a.backlash", "mesh.b.backlash")
    assert model.paths("mesh.a.backlash") == ("mesh.a.backlash",)
    assert model.paths("mesh.(a|b).backlash") == ()
    assert set(model.paths("*.stages.*")) == {path for path in model.paths() if ".stages." in path}


def test_a_path_reads_what_it_sets(model: Model) -> None:
    """Every value that is set, and the objects of tables; defaults where the file is silent."""
    for path in model.paths():
        assert model.with_({path: model[path]}) == model
    assert model["mesh.a"] is model.meshes[0]
    assert model["coupling.damper.stages.1"].stiffness == 500.0
    assert model["inertia"] == model.inertias
    assert model["excitation"] is model.excitation
    assert model["mesh.b.radii.1"] == 0.035
    assert model["inertia.flywheel.drag_torque"] == 0.0
    assert model["motion"] == ()


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("mesh.c.backlash", "no mesh is named c; there are a, b"),
        ("mesh.a.backlsh", "no backlsh.*did you mean"),
        ("torque.2.mean", "goes by index from 0 to 1"),
        ("clutch", "there is no clutch; there are"),
        ("mesh.*.backlash", r"several values \(mesh.a.backlash, mesh.b.backlash\), and here one is needed"),
        (3, "must be a text"),
    ],
)
def test_a_path_that_leads_nowhere_is_refused(model: Model, path: Any, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        _ = model[path]


@pytest.mark.parametrize(
    ("pattern", "words", "unit"),
    [
        ("inertia.*.J", "moment of inertia of all inertias", "kg m²"),
        ("inertia.*.drag_torque", "drag torque of 3 inertias", "N m"),
        ("inertia.gear*.drag_torque", "drag torque of inertias gear*", "N m"),
        ("*backlash*", "backlash of all meshes", "m"),
        ("mesh.a*.backlash", "backlash of mesh a", "m"),
        ("torque.*.amplitude", "torque amplitude of all harmonics", "N m"),
        ("torque.0.*.amplitude", "torque amplitude of 2 harmonics", "N m"),
        ("coupling.damper.stages.*.stiffness", "stiffness of stage * of coupling damper", "N m/rad"),
        ("*.stiffness", "stiffness, 4 values", ""),
        ("excitation.speed", "speed", "rad/s"),
    ],
)
def test_labels_say_what_is_true(model: Model, pattern: str, words: str, unit: str) -> None:
    """ "All" only where all have the value; a unit only where it is the unit of all; of factors none."""
    assert path_label(pattern, model) == (words, unit)
    assert path_label(pattern, model, by_factor=True) == (f"{words}, times", "")


def test_values_at_patterns_are_read_as_the_model_does(model: Model) -> None:
    assert in_si("mesh.*.backlash", "0.3 mm", model) == pytest.approx(3e-4, rel=1e-15)
    assert in_si("mesh.b.backlash", gr.factor(2), model) == 4e-4
    assert change_in_si("mesh.*.backlash", "10 um", model, "positive", "deviation") == pytest.approx(1e-5, rel=1e-15)
    assert change_in_si("mesh.b.backlash", gr.factor(0.1), model, "positive", "deviation") == pytest.approx(2e-5)
    with pytest.raises(ModelError, match="here one is needed"):
        in_si("mesh.*.backlash", gr.factor(2), model)


def test_what_is_varied_knows_its_own_value(model: Model) -> None:
    assert Varied("mesh.*.backlash", by_factor=True).own(model) == 1.0
    assert Varied("mesh.*.stiffness").own(model) == 3e8
    assert Varied("mesh.*.backlash").own(model) is None
    assert Varied("mesh.*.backlash", by_factor=True).spread([1.0, 2.0], model) == {
        "mesh.a.backlash": (1e-4, 2e-4),
        "mesh.b.backlash": (2e-4, 4e-4),
    }
