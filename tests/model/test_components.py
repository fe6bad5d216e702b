"""The shelf of components: what each of them must satisfy, and the faults that each refuses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import rows_of
from gearrattle.model.components import COMPONENTS

BODIES = ("a", "b", "c", "d", "e")
EXAMPLES: dict[str, dict[str, Any]] = {
    "coupling": {"name": "one", "between": ["a", "b"], "stiffness": 100.0},
    "mesh": {"name": "one", "between": ["a", "b"], "radii": [0.05, 0.03], "stiffness": 1e7, "backlash": 1e-4},
    "planetary": {
        "name": "one",
        "sun": "a",
        "ring": "b",
        "carrier": "c",
        "planets": ["d", "e"],
        "radii": {"sun": 0.03, "planet": 0.02, "ring": 0.07},
        "stiffness": {"sun": 1e7, "ring": 1e7},
    },
    "bearing": {"name": "one", "on": "a", "stiffness": 1e7, "clearance": 1e-5},
}


def tables(kind: str, units: str = "SI", **changes: Any) -> dict[str, Any]:
    """Return a model with one component, some of its keys changed; None takes a key out."""
    component = {key: value for key, value in {**EXAMPLES[kind], **changes}.items() if value is not None}
    heavy = {"mass": 0.5} if kind == "bearing" else {}
    inertias: list[dict[str, Any]] = [{"name": name, "J": 0.01} for name in BODIES]
    inertias[0] |= heavy
    return {"schema": 1, "units": units, "inertia": inertias, kind: [component], "excitation": {"speed": 100.0}}


def problems(kind: str, **changes: Any) -> list[str]:
    with pytest.raises(gr.ModelError) as caught:
        gr.Model.from_tables(tables(kind, **changes))
    return [f"{problem.place}: {problem.rule}" for problem in caught.value.problems]


def test_every_component_has_an_example() -> None:
    assert EXAMPLES.keys() == COMPONENTS.keys()


@pytest.mark.parametrize("kind", EXAMPLES)
def test_elements_are_named_as_announced_and_know_their_table(kind: str) -> None:
    model = gr.Model.from_tables(tables(kind))
    announced = [name for _, name in COMPONENTS[kind].element_names(EXAMPLES[kind])]
    assert {element.name for element in model.elements} <= set(announced)
    assert {element.path for element in model.elements} == {f"{kind}.one"}
    named = {str(body.name) for body in COMPONENTS[kind].bodies(EXAMPLES[kind])}
    arms = {body for element in model.elements for body, _ in element.arms}
    assert arms | {push.body for element in model.elements for push in element.pushes} == named


@pytest.mark.parametrize("kind", EXAMPLES)
def test_the_law_by_leaves_is_the_law_by_pieces(kind: str) -> None:
    """Columns of variants are read by ``sides``; it must say what the element says."""
    model = gr.Model.from_tables(tables(kind))
    for element in model.elements:
        drive, coast = model.components[element.path].sides(lambda _, value: value, element)
        assert [tuple(piece) for piece in drive] == [piece[:3] for piece in element.drive]
        assert [tuple(piece) for piece in coast] == [piece[:3] for piece in element.coast]


@pytest.mark.parametrize("kind", EXAMPLES)
def test_a_component_survives_its_own_file(kind: str) -> None:
    model = gr.Model.from_tables(tables(kind))
    assert gr.loads(model.to_toml()) == model
    assert model.with_({f"{kind}.one.name": "other"}).elements[0].name.startswith("other")


@pytest.mark.parametrize("kind", EXAMPLES)
def test_a_body_that_does_not_exist_is_named(kind: str) -> None:
    body = next(iter(COMPONENTS[kind].bodies(EXAMPLES[kind])))
    key = str(body.location[0])
    written = EXAMPLES[kind][key]
    changed = ["nowhere", *written[1:]] if isinstance(written, list) else "nowhere"
    assert any("no inertia has this name" in problem for problem in problems(kind, **{key: changed}))


def test_rows_are_the_arms() -> None:
    rows = rows_of(gr.Model.from_tables(tables("planetary")))
    expected = [[0.03, 0.0, -0.05, 0.02, 0.0], [0.0, 0.07, -0.05, -0.02, 0.0]]
    assert rows[:2] == pytest.approx(np.array(expected), abs=1e-17)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"planets": []}, "planets: a planetary set needs one planet at least"),
        ({"planets": ["d", "ground"]}, "planets.1: a planet is an inertia of its own"),
        ({"planets": ["d", "d"]}, "planets.1: a planetary set must connect different inertias"),
        ({"carrier": "a"}, "carrier: a planetary set must connect different inertias"),
        ({"mesh_phase": {"sun": [0.0]}}, "mesh_phase.sun: must have one phase for each of the 2 planets"),
        ({"planet_mass": 0.4}, "planet_mass: planet_mass needs centre_distance"),
        ({"centre_distance": 0.05}, "centre_distance: centre_distance needs planet_mass"),
        ({"radii": {"sun": 0.03, "planet": 0.02, "ring": 0.02}}, "radii.ring: the ring must be larger than a planet"),
        ({"radii": {"sun": 0.03, "planet": 0.02}}, "radii.ring: this key is required"),
        ({"contact_damping": "clipped"}, "contact_damping: clipped contact damping needs a gap"),
        ({"sun": None}, "sun: this key is required"),
    ],
)
def test_faults_of_a_planetary_set_are_told(changes: dict[str, Any], words: str) -> None:
    actual = problems("planetary", **changes)
    assert any(words in problem for problem in actual), actual


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"hooke": {"angle": "60 deg"}}, "hooke.angle: must be below 60 deg"),
        ({"hooke": {"angle": -0.1}}, "hooke.angle: "),
        ({"hooke": {"angle": 0.1, "order": 0}}, "hooke.order: "),
        ({"hooke": {"angle": 0.1}, "between": ["a", "ground"]}, "between: a Hooke joint connects two shafts that turn"),
        ({"hooke": {"angle": 0.1}, "units": "dimensionless"}, "hooke: a Hooke joint has an angle in rad"),
        ({"kinematic_error": [{"order": 1, "amplitude": "2 um"}]}, "kinematic_error.0.amplitude: "),
    ],
)
def test_faults_of_joints_are_told(changes: dict[str, Any], words: str) -> None:
    actual = problems("coupling", **changes)
    assert any(words in problem for problem in actual), actual


def test_names_are_unique_over_all_components() -> None:
    both = tables("planetary")
    both["mesh"] = [{**EXAMPLES["mesh"], "name": "one-sun-d"}]
    with pytest.raises(gr.ModelError, match="must be unique over couplings and meshes and planetary sets and bearings"):
        gr.Model.from_tables(both)


def test_a_planet_of_prescribed_motion_moves_its_meshes() -> None:
    moved = tables("planetary")
    moved["motion"] = [{"on": "d", "angle": {"time": [0.0, 0.1, 0.2, 0.3], "value": [0.0, 0.01, 0.0, 0.01]}}]
    run = gr.simulate(gr.Model.from_tables(moved), cycles=1)
    assert run.cost.energy_residual < 1e-11
