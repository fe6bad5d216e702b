"""Bodies with a mass, their bearings and meshes: what elements they make, and the faults that are told."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.model.components.bearing import OFF

HELD = {"on": "a", "stiffness": 1e8}


def tables(**changes: Any) -> dict[str, Any]:
    """Two gears, the first of them on a bearing; None takes a table out."""
    mesh = {"name": "gear", "between": ["a", "b"], "radii": [0.05, 0.03], "stiffness": 1e8, "pressure_angle": 0.35}
    plain: dict[str, Any] = {
        "schema": 1,
        "inertia": [{"name": "a", "J": 0.01, "mass": 0.8}, {"name": "b", "J": 0.02}],
        "mesh": [mesh],
        "bearing": [{"name": "front", **HELD}],
        "excitation": {"speed": 100.0},
    }
    return {key: value for key, value in {**plain, **changes}.items() if value is not None}


def of_mesh(**changes: Any) -> list[dict[str, Any]]:
    (mesh,) = tables()["mesh"]
    return [{key: value for key, value in {**mesh, **changes}.items() if value is not None}]


def names(model: gr.Model) -> list[str]:
    return [element.name for element in model.elements]


@pytest.mark.parametrize(
    ("changes", "location", "rule", "remedy"),
    [
        ({"bearing": None}, "inertia.a.mass", "no bearing holds this one", "add a [[bearing]]"),
        (
            {"inertia": [{"name": "a", "J": 0.01}, {"name": "b", "J": 0.02}], "mesh": None},
            "bearing.front.on",
            "a bearing holds a body with a mass",
            "give the inertia a mass",
        ),
        ({"mesh": of_mesh(pressure_angle=None)}, "mesh.gear.pressure_angle", "a moves sideways", "20 deg"),
        (
            {"inertia": [{"name": "a", "J": 0.01}, {"name": "b", "J": 0.02}], "bearing": None},
            "mesh.gear.pressure_angle",
            "none of its gears has a mass",
            "leave pressure_angle out",
        ),
        ({"mesh": of_mesh(pressure_angle="90 deg")}, "mesh.gear.pressure_angle", "must be below 90 deg", "20 deg"),
        ({"bearing": [{"name": "f", **HELD, "faces": 7, "clearance": 1e-5}]}, "bearing.f.faces", "must be even", "8"),
        ({"bearing": [{"name": "f", **HELD, "faces": 8}]}, "bearing.f.faces", "ring with clearance", "20 um"),
        (
            {"bearing": [{"name": "f", **HELD, "faces": 8, "clearance": 1e-5, "direction": 0.1}]},
            "bearing.f.faces",
            "faces and direction exclude each other",
            "remove one",
        ),
        ({"bearing": [{"name": "f", **HELD, "on": "ground"}]}, "bearing.f.on", "a bearing holds an inertia", ""),
        ({"bearing": [{"name": "f", **HELD, "stiffness": 0}]}, "bearing.f.stiffness", "greater than zero", ""),
        (
            {"bearing": [{"name": "f", **HELD, "around": "b"}]},
            "bearing.f.around",
            "a bearing lies around a body with a mass",
            "give the inertia a mass",
        ),
        ({"bearing": [{"name": "f", **HELD, "around": "a"}]}, "bearing.f.around", "two different inertias", ""),
        ({"bearing": [{"name": "f", **HELD, "around": "c"}]}, "bearing.f.around", "no inertia has this name", ""),
        (
            {
                "inertia": [{"name": name, "J": 0.01, "mass": 0.8} for name in "ab"],
                "bearing": [{"name": "f", **HELD, "around": "b"}, {"name": "g", **HELD, "on": "b", "around": "a"}],
            },
            "inertia.b.mass",
            "no bearings lead from this one to the housing",
            "add a [[bearing]] without around",
        ),
        (
            {"inertia": [{"name": "a", "J": 0.01}], "mesh": None, "bearing": None, "gravity": {}},
            "gravity",
            "none has one",
            "leave [gravity] out",
        ),
        ({"gravity": {"acceleration": 0.0}}, "gravity.acceleration", "greater than zero", ""),
        ({"gravity": {"direction": "9.81 m/s^2"}}, "gravity.direction", "must be an angle", "5 deg"),
        ({"gravity": {}, "units": "dimensionless"}, "gravity.acceleration", "no number of a dimensionless", "state it"),
        (
            {"simulation": {"initial": {"angle": [0, 0], "velocity": [0, 0], "displacement": [0]}}},
            "simulation.initial.displacement",
            "one entry for each of the 2 directions",
            "",
        ),
    ],
)
def test_faults_are_told_with_their_remedy(changes: dict[str, Any], location: str, rule: str, remedy: str) -> None:
    with pytest.raises(gr.ModelError) as caught:
        gr.Model.from_tables(tables(**changes))
    said = [(p.place, p.rule, p.remedy) for p in caught.value.problems]
    assert any(location == where and rule in what and remedy in how for where, what, how in said), said


def planetary(**changes: Any) -> dict[str, Any]:
    """A sun with a mass between three planets on a carrier that stands still; None takes a key out."""
    masses = changes.pop("masses", {"a": 0.8})
    plain = {
        "name": "set",
        "sun": "a",
        "ring": "b",
        "carrier": "ground",
        "planets": ["p1", "p2", "p3"],
        "radii": {"sun": 0.03, "planet": 0.02, "ring": 0.07},
        "stiffness": {"sun": 1e7, "ring": 1e7},
        "pressure_angle": 0.35,
    }
    bodies = [{"name": name, "J": 0.01} for name in ("a", "b", "c", "p1", "p2", "p3")]
    bodies = [{**body, **({"mass": masses[body["name"]]} if body["name"] in masses else {})} for body in bodies]
    row = {key: value for key, value in {**plain, **changes}.items() if value is not None}
    return tables(inertia=bodies, planetary=[row], mesh=None, bearing=None)


@pytest.mark.parametrize(
    ("changes", "location", "rule"),
    [
        ({"carrier": "c"}, "planetary.set.sun", "forces of Coriolis act"),
        ({"masses": {"p2": 0.1}, "pressure_angle": None}, "planetary.set.planets.1", "the sun alone may move sideways"),
        ({"masses": {"b": 0.1}, "pressure_angle": None}, "planetary.set.ring", "the sun alone may move sideways"),
        ({"pressure_angle": None}, "planetary.set.pressure_angle", "need the directions of their lines of action"),
        ({"pressure_angle": "91 deg"}, "planetary.set.pressure_angle", "below 90 deg"),
        ({"masses": {}}, "planetary.set.pressure_angle", "it has no mass"),
        ({"planet_positions": [0.0, 1.0]}, "planetary.set.planet_positions", "one angle for each of the 3 planets"),
        ({"planets": ["p1", "p2"]}, "inertia.a.mass", "no bearing holds this one"),
    ],
)
def test_a_set_says_which_of_its_bodies_may_move_sideways(changes: dict[str, Any], location: str, rule: str) -> None:
    with pytest.raises(gr.ModelError) as caught:
        gr.Model.from_tables(planetary(**changes))
    said = [(problem.place, problem.rule) for problem in caught.value.problems]
    assert any(location in (where, where.replace(".0.", ".set.")) and rule in what for where, what in said), said


def test_a_floating_sun_has_flanks() -> None:
    plain = gr.Model.from_tables(planetary())
    assert names(plain)[:2] == ["set-sun-p1", "set-ring-p1"]
    flanks = gr.Model.from_tables(planetary(backlash={"sun": 1e-4, "ring": 0.0}))
    assert names(flanks)[:3] == ["set-sun-p1-drive", "set-sun-p1-coast", "set-ring-p1"]
    assert list(assemble(flanks).layout.direction_names) == ["a.x", "a.y"]


def test_elements_have_the_names_that_the_manual_gives() -> None:
    assert names(gr.Model.from_tables(tables())) == ["gear", "front-x", "front-y"]
    flanks = tables(mesh=of_mesh(backlash=1e-4), bearing=[{"name": "front", **HELD, "direction": 0.3}])
    assert names(gr.Model.from_tables(flanks)) == ["gear-drive", "gear-coast", "front"]
    ring = tables(bearing=[{"name": "front", **HELD, "clearance": "10 um"}])
    assert names(gr.Model.from_tables(ring)) == ["gear", *(f"front-{i}" for i in range(8))]


def test_directions_follow_the_bearings() -> None:
    """One direction if all bearings on a body hold the same one, else x and y."""
    one = {"name": "one", **HELD, "direction": 0.3}
    same, other = ({"name": "two", **HELD, "direction": angle} for angle in (0.3, 1.3))
    for bearings, expected in (([one], ["a.u"]), ([one, same], ["a.u"]), ([one, other], ["a.x", "a.y"])):
        layout = assemble(gr.Model.from_tables(tables(bearing=bearings))).layout
        assert list(layout.direction_names) == expected
    rows = assemble(gr.Model.from_tables(tables(bearing=[one, other]))).layout.direction_rows
    assert rows[1:] == pytest.approx(np.array([[cos(0.3), sin(0.3)], [cos(1.3), sin(1.3)]]), abs=1e-15)


def test_a_bearing_around_a_body_moves_with_it_and_says_ground_for_the_housing() -> None:
    needles = {"name": "needles", "on": "b", "around": "a", "stiffness": 1e8, "direction": 0.3}
    masses = [{"name": name, "J": 0.01, "mass": 0.8} for name in "ab"]
    front = {"name": "front", **HELD, "around": "ground"}
    layout = assemble(gr.Model.from_tables(tables(inertia=masses, bearing=[front, needles]))).layout
    assert list(layout.direction_names) == ["a.x", "a.y", "b.u"]
    assert layout.direction_rows[-1] == pytest.approx([-cos(0.3), -sin(0.3), 1.0], abs=1e-15)
    assert layout.casing_rows @ np.arange(1.0, 5.0) == pytest.approx([2.0, 3.0])


def test_two_names_of_elements_may_not_be_the_same() -> None:
    clash = tables(bearing=[{"name": "front", **HELD}, {"name": "front-x", **HELD}])
    with pytest.raises(gr.ModelError, match="must be unique over"):
        gr.Model.from_tables(clash)


@pytest.mark.parametrize("faces", [4, 6, 8, 10, 12, 16, 32])
def test_a_ring_of_faces_is_as_far_from_a_circle_as_is_said(faces: int) -> None:
    """Up to |u| = 4 C its force differs from k (|u| - C) by what the note says; opposite a face it begins with k."""
    gap, stiffness = 1e-5, 1e8
    bearing = {"name": "front", "on": "a", "stiffness": stiffness, "clearance": gap, "faces": faces}
    model = gr.Model.from_tables(tables(bearing=[bearing]))
    driveline = assemble(model)
    laws = driveline.system.laws[1:]
    rows = driveline.layout.direction_rows[1:]
    worst = 0.0
    for reach in np.linspace(1.0, 4.0, 91):
        for angle in np.linspace(0.0, pi / faces, 9):
            outward = np.array([cos(angle), sin(angle)])
            force = rows.T @ [law.elastic(float(d)) for law, d in zip(laws, rows @ outward * reach * gap, strict=True)]
            off = force - stiffness * gap * (reach - 1.0) * outward
            worst = max(worst, float(np.linalg.norm(off)) / (stiffness * gap))
    said = next(share for fewest, share in OFF if faces >= fewest)
    assert 0.5 * said < worst <= said
    assert any(f"at most {said:g} k C" in note for note in model.components["bearing.front"].notes())
    assert laws[0].elastic(1.01 * gap) == pytest.approx(0.01 * gap * stiffness, rel=1e-9)
    assert laws[0].elastic(gap) == 0.0


def test_deep_inside_a_ring_pushes_as_a_circle_on_the_mean() -> None:
    """The sum of N/4 faces (n . u) n is u: the slope at the far end is k, whatever the number of faces."""
    for faces in (4, 6, 8, 16, 32):
        bearing = {"name": "front", **HELD, "clearance": 1e-5, "faces": faces}
        driveline = assemble(gr.Model.from_tables(tables(bearing=[bearing])))
        rows = driveline.layout.direction_rows[1:]
        slopes = np.array([law.stiffness[-1] for law in driveline.system.laws[1:]])
        assert (rows.T * slopes) @ rows == pytest.approx(HELD["stiffness"] * np.eye(2), abs=1.0)
