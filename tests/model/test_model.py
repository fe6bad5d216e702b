"""The model's nouns: pieces of a law, defaults, changes by path, and the way back to a file."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from tests.model.test_broken_files import SOUND

from gearrattle.errors import ModelError
from gearrattle.model import DEFAULTS, Coupling, Initial, Model, Piece, loads
from gearrattle.model.value_kinds import LARGEST, SMALLEST


@pytest.fixture(scope="module")
def model() -> Model:
    return loads(SOUND)


def test_everything_is_in_si(model: Model) -> None:
    assert [inertia.J for inertia in model.inertias] == [0.3, 4.5e-4]
    assert model.inertias[0].drag == 1.5e-4
    assert model.inertias[1].drag_torque == 0.1
    assert model.meshes[0].radii == (0.05, 0.05)
    assert model.meshes[0].backlash == 1e-4
    assert model.meshes[0].transmission_error[0].amplitude == 5e-6
    assert model.torques[0].harmonics[1].phase == 0.5235987755982989  # pi/6, rounded once
    assert model.excitation.omega == 50.0 * math.pi
    assert model.simulation.step == 2e-5


def test_clearance_form_has_two_pieces(model: Model) -> None:
    clutch = model.couplings[0]
    assert clutch.drive_pieces == (Piece(150.0, 0.0, 0.16), Piece(1500.0, 0.225, None))
    assert clutch.coast_pieces == clutch.drive_pieces
    assert clutch.stages is None


def test_stages_are_pieces_and_coast_mirrors_drive(model: Model) -> None:
    damper = model.couplings[1]
    ends = [piece.until for piece in damper.drive_pieces]
    assert ends == [math.radians(4.0), math.radians(12.0), None]
    assert [piece.stiffness for piece in damper.drive_pieces] == [30.0, 600.0, 5000.0]
    assert damper.coast_pieces == damper.drive_pieces
    assert damper.stiffness is None


def test_coast_stages_stand_apart() -> None:
    stages = [{"stiffness": 1.0, "until": 0.1}, {"stiffness": 2.0}]
    coupling = Coupling.model_validate(
        {"name": "c", "between": ["a", "b"], "stages": stages, "coast_stages": [{"stiffness": 3.0, "damping": 0.5}]}
    )
    assert coupling.drive_pieces == (Piece(1.0, 0.0, 0.1), Piece(2.0, 0.0, None))
    assert coupling.coast_pieces == (Piece(3.0, 0.5, None),)


def test_no_clearance_is_linear(model: Model) -> None:
    changed = model.with_({"coupling.clutch.clearance": 0.0, "mesh.gear.backlash": None})
    assert changed.couplings[0].drive_pieces == (Piece(1500.0, 0.225, None),)
    assert changed.meshes[0].drive_pieces == (Piece(7.2e8, 4500.0, None),)


def test_backlash_is_twice_the_half_gap(model: Model) -> None:
    assert model.meshes[0].drive_pieces == (Piece(0.0, 0.0, 5e-5), Piece(7.2e8, 4500.0, None))


def test_silence_of_the_file_is_none(model: Model) -> None:
    simulation = model.simulation
    assert (simulation.algorithm, simulation.cycles, simulation.discard) == ("exact", 20, 10)
    assert simulation.initial is None
    assert simulation.samples_per_cycle is None
    assert simulation.tolerance is None
    assert (DEFAULTS.cycles, DEFAULTS.discard, DEFAULTS.samples_per_cycle) == (200, 100, 512)


def test_frequency_is_in_hertz_or_omega_itself() -> None:
    text = 'schema = 1\n[[inertia]]\nname = "a"\nJ = 1\n[excitation]\nfrequency = 25\n'
    assert loads(text).excitation.omega == 50.0 * math.pi
    dimensionless = loads('units = "dimensionless"\n' + text)
    assert dimensionless.excitation.omega == 25.0
    assert dimensionless.with_({"excitation.speed": 3.0}).excitation.omega == 3.0
    assert loads(dimensionless.to_toml()) == dimensionless


def test_models_do_not_change(model: Model) -> None:
    with pytest.raises(ValidationError):
        model.inertias[0].J = 1.0
    assert hash(model) == hash(loads(SOUND))


def test_with_changes_named_and_indexed_values(model: Model) -> None:
    changed = model.with_(
        {
            "mesh.gear.backlash": "0.2 mm",
            "torque.0.mean": 5,
            "torque.0.harmonics.1.amplitude": np.float64(7.0),
            "coupling.damper.stages.1.stiffness": 700.0,
            "inertia.hub.drag": np.float32(0.5),
            "simulation.cycles": np.int64(40),
            "simulation.initial": {"angle": ["1 deg", 0], "velocity": np.zeros(2).tolist()},
            "excitation.frequency": "50 Hz",
        }
    )
    assert changed.meshes[0].backlash == 2e-4
    assert changed.torques[0].mean == 5.0
    assert changed.torques[0].harmonics[1].amplitude == 7.0
    assert changed.couplings[1].drive_pieces[1].stiffness == 700.0
    assert changed.inertias[1].drag == 0.5
    assert changed.simulation.cycles == 40
    assert changed.simulation.initial == Initial(angle=(math.radians(1.0), 0.0), velocity=(0.0, 0.0))
    assert changed.excitation.speed is None
    assert changed.excitation.omega == pytest.approx(100.0 * math.pi, rel=1e-15)
    assert model == loads(SOUND)


def test_every_path_name_can_be_set(model: Model) -> None:
    plain = model.to_tables()
    names = model.paths()
    assert "coupling.damper.stages.1.until" in names
    assert "mesh.gear.transmission_error.0.amplitude" in names
    assert len(names) == len(set(names))
    assert plain["mesh"][0]["backlash"] == 1e-4
    assert model.with_({"mesh.gear.radii": [0.1, 0.05], "name": "other"}).name == "other"


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("coupling.cluch.stiffness", 1.0, 'did you mean "clutch"'),
        ("coupling.clutch.stifness", 1.0, 'did you mean "stiffness"'),
        ("couplings.clutch.stiffness", 1.0, 'did you mean "coupling"'),
        ("torque.1.mean", 1.0, "index from 0 to 0"),
        ("torque.flywheel.mean", 1.0, "index from 0 to 0"),
        ("coupling.damper.stages.3.stiffness", 1.0, "index from 0 to 2"),
        ("coupling.clutch.stiffness.x", 1.0, "single value"),
        ("mesh.gear.backlash", "0.2 deg", "length"),
        ("mesh.gear.backlash", -1.0, "negative"),
        ("mesh.gear.backlash", float("nan"), "finite"),
        ("inertia.hub.name", "flywheel", "unique"),
        ("inertia.hub.J", None, "required"),
        ("excitation.speed", None, "speed or frequency"),
        ("simulation.cycles", 5, "less than cycles (5)"),
        ("", 1.0, "unknown key"),
        ("coupling", 1.0, "array"),
    ],
)
def test_with_refuses(model: Model, path: str, value: Any, words: str) -> None:
    with pytest.raises(ModelError) as caught:
        model.with_({path: value})
    assert words in str(caught.value)


def test_from_tables_names_the_key_without_a_file() -> None:
    with pytest.raises(ModelError) as caught:
        Model.from_tables({"schema": 1, "inertia": [{"name": "a", "J": -1}], "excitation": {"speed": 1}})
    assert caught.value.problems[0].place == "inertia.a.J"


def test_initial_state_is_read() -> None:
    start = 'initial = { angle = ["1 deg", 0.5], velocity = ["60 rpm", 2] }\ncycles'
    initial = loads(SOUND.replace("cycles", start, 1)).simulation.initial
    assert isinstance(initial, Initial)
    assert initial.angle == (math.radians(1.0), 0.5)
    assert initial.velocity == (2.0 * math.pi, 2.0)


finite = st.floats(-LARGEST, LARGEST)
positive = st.floats(SMALLEST, LARGEST)
non_negative = st.floats(0.0, LARGEST)
sine = st.fixed_dictionaries({"order": positive, "amplitude": finite}, optional={"phase": finite})
sines = st.lists(sine, max_size=2)


@st.composite
def tables(draw: Any) -> dict[str, Any]:
    """Draw the tables of a sound model."""
    names = draw(st.lists(st.from_regex(r"[A-Za-z0-9_-]{1,6}", fullmatch=True), min_size=2, max_size=4, unique=True))
    names = [name for name in names if name != "ground"] or ["a"]
    other = "ground" if len(names) == 1 else names[1]
    ends = sorted(draw(st.lists(positive, max_size=3, unique=True)))
    stages = [{"stiffness": draw(non_negative), "until": end} for end in ends] + [{"stiffness": draw(non_negative)}]
    linear = {"stiffness": draw(non_negative), "clearance": draw(non_negative), "damping_ratio": draw(non_negative)}
    form = draw(st.sampled_from([linear, {"stages": stages}, {"stages": stages, "coast_stages": stages}]))
    start = {"angle": [draw(finite) for _ in names], "velocity": [draw(finite) for _ in names]}
    content: dict[str, Any] = {
        "schema": 1,
        "name": draw(st.text(st.characters(exclude_categories=["Cs"]), max_size=20)),
        "units": draw(st.sampled_from(["SI", "dimensionless"])),
        "inertia": [{"name": name, "J": draw(positive), "drag": draw(non_negative)} for name in names],
        "coupling": [{"name": "c", "between": [names[0], other], **form, "preload": draw(finite)}],
        "excitation": {draw(st.sampled_from(["speed", "frequency"])): draw(positive)},
        "torque": [{"on": names[0], "mean": draw(finite), "harmonics": draw(sines)}],
        "simulation": {"initial": draw(st.sampled_from(["steady", "static", "zero", start])), "cycles": 3},
    }
    if other != "ground":
        mesh = {"name": "m", "between": [names[0], other], "radii": [draw(positive), draw(positive)], "stiffness": 1.0}
        content["mesh"] = [{**mesh, "transmission_error": draw(sines)}]
    return content


@settings(deadline=None)
@given(tables())
def test_to_toml_round_trips_exactly(content: dict[str, Any]) -> None:
    model = Model.from_tables(content)
    again = loads(model.to_toml())
    assert again == model
    assert again.to_toml() == model.to_toml()
    assert model.with_({}) == model
