"""A value is judged after its unit is read: as a number and as a text with a unit it gets the same answer."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.model import json_schema, units
from gearrattle.model.table import shown
from gearrattle.model.units import Dimension, UnitError

Path = tuple[int | str, ...]
SCHEMA = json_schema()
DIMENSIONS = {d.example: d for d in vars(units).values() if isinstance(d, Dimension)}
SINES = [{"order": 2, "amplitude": 0.001, "phase": 0.1}]
OVER_SPEED = {"speed": [50.0, 200.0], "value": [1.0, 2.0]}
STAGES = [
    {"stiffness": 100.0, "until": 0.1, "damping": 0.1, "hysteresis": 1.0},
    {"stiffness": 200.0, "until": 0.2, "damping": 0.1, "hysteresis": 2.0, "stick_stiffness": 900.0},
    {"stiffness": 300.0, "hysteresis": 3.0},
]
POINTS = {"time": [0.0, 0.1, 0.2, 0.3], "value": [1.0, 2.0, 3.0, 1.0], "start": 0.0}
AB = {"name": "one", "between": ["a", "b"]}
SIDES = {"sun": 1e-4, "ring": 1e-4}
PRESSURE = {"angle": [0.0, 4.0, 8.0, 12.0], "value": [1e5, 6e5, 2e5, 1e5]}
ENGINE = {"cylinders": 2, "bore": 0.08, "stroke": 0.09, "rod": 0.15, "mass": 0.5, "pressure": PRESSURE}
PARTS: dict[str, dict[str, Any]] = {
    "bodies": {
        "inertia": [{"name": "a", "J": 0.01, "drag": 0.1, "drag_torque": OVER_SPEED}, {"name": "b", "J": 0.02}],
        "coupling": [{**AB, "stiffness": 100.0}],
        "simulation": {"step": 1e-5, "initial": {"angle": [0.1, 0.2], "velocity": [1.0, 2.0]}},
        "excitation": {"frequency": 20.0, "duration": 1.0},
        "torque": [
            {"on": "b", "ramps": [{"at": 0.1, "over": 0.2, "to": 3.0}]},
            {
                "on": "a",
                "mean": OVER_SPEED,
                "harmonics": [{"order": 1, "amplitude": OVER_SPEED, "phase": 0.1}],
                "signal": {**POINTS, "static": 1.0},
            },
        ],
    },
    "clipped": {
        "inertia": [{"name": "a", "J": 0.01, "drag_torque": 0.5}, {"name": "b", "J": 0.02}],
        "coupling": [
            {**AB, "stiffness": 100.0, "damping": 0.1, "clearance": 0.1, "contact_damping": "clipped", "preload": 1.0}
        ],
        "torque": [{"on": "a", "mean": 1.0, "harmonics": SINES}],
    },
    "staged": {"coupling": [{**AB, "stages": STAGES, "coast_stages": STAGES}]},
    "staged over speed": {"coupling": [{**AB, "stages": [{"stiffness": 100.0, "hysteresis": OVER_SPEED}]}]},
    "rubbing": {
        "coupling": [{**AB, "stiffness": 100.0, "hysteresis": 1.0, "hooke": {"angle": 0.1, "phase": 0.2}}],
        "motion": [{"on": "a", "speed": POINTS, "about": 100.0}],
    },
    "rubbing over speed": {
        "coupling": [{**AB, "stiffness": 100.0, "hysteresis": OVER_SPEED, "stick_stiffness": 50.0}],
        "motion": [{"on": "a", "angle": POINTS}],
    },
    "swept": {
        "coupling": [{**AB, "stiffness": 100.0, "kinematic_error": SINES}],
        "excitation": {"sweep": {"from": 60.0, "to": 100.0, "over": 1.0}},
        "motion": [{"on": "a", "harmonics": SINES}],
    },
    "engine": {"torque": [{"on": "b", "engine": {**ENGINE, "crankcase": 1e5, "firing": [0.0, 6.0]}}]},
    "geared": {
        "mesh": [
            {
                **AB,
                "radii": [0.05, 0.03],
                "stiffness": 1e7,
                "damping": 10.0,
                "backlash": 1e-4,
                "contact_damping": "clipped",
                "transmission_error": SINES,
            },
            {**AB, "name": "two", "radii": [0.05, 0.03], "stiffness": 1e7, "alternation": None},
        ],
    },
    "judged": {
        "coupling": [{**AB, "stiffness": 100.0, "clearance": 0.1}],
        "criteria": {
            "negligible": {"impact_energy": 1e-6, "approach_speed": 1e-3, "angular_approach_speed": 0.1},
        },
    },
    "dragged": {
        "oil": {
            "viscosity": [{"temperature": 40.0, "kinematic": 5e-5}, {"temperature": 100.0, "kinematic": 1e-5}],
            "density": 870.0,
            "temperature": 60.0,
        },
        "inertia": [
            {
                "name": "a",
                "J": 0.01,
                "drag_parts": [
                    {"kind": "needle-bearing", "on": "b", "relative_speed": 10.0, "mean_diameter": 0.04, "load": 5.0},
                    {"kind": "rolling-bearing", "bore": 0.03, "outer_diameter": 0.06, "relative_speed": 10.0},
                    {
                        "kind": "skf-bearing",
                        "series": "62",
                        "relative_speed": 10.0,
                        "bore": 0.03,
                        "outer_diameter": 0.062,
                        "radial_load": 500.0,
                        "axial_load": 100.0,
                        "static_rating": 11200.0,
                    },
                    {
                        "kind": "churning",
                        "relative_speed": 10.0,
                        "depth": 0.03,
                        "oil_volume": 1.5e-3,
                        "pitch_diameter": 0.12,
                        "face_width": 0.02,
                        "teeth": 40,
                        "tooth_height": 0.007,
                        "pressure_angle": 0.35,
                        "helix_angle": 0.2,
                    },
                    {
                        "kind": "synchroniser",
                        "relative_speed": 10.0,
                        "mean_radius": 0.03,
                        "length": 0.008,
                        "gap": 1e-4,
                        "cone_angle": 0.11,
                    },
                    {
                        "kind": "clutch-pack",
                        "relative_speed": 10.0,
                        "faces": 4,
                        "outer_radius": 0.06,
                        "inner_radius": 0.05,
                        "gap": 1e-4,
                    },
                    {"kind": "shaft-seal", "relative_speed": 10.0, "shaft_diameter": 0.03},
                    {
                        "kind": "measured",
                        "relative_speed": 10.0,
                        "speed": [5.0, 20.0],
                        "temperature": [20.0, 80.0],
                        "torque": [[0.1, 0.2], [0.1, 0.2]],
                    },
                    {"kind": "constant", "relative_speed": 10.0, "torque": OVER_SPEED, "slope": 0.001},
                    {"kind": "constant", "relative_speed": 10.0, "torque": 0.1},
                ],
            },
            {"name": "b", "J": 0.02},
        ],
        "coupling": [{**AB, "stiffness": 100.0}],
    },
    "planetary": {
        "inertia": [{"name": name, "J": 0.01} for name in "abcde"],
        "planetary": [
            {
                "name": "one",
                "sun": "a",
                "ring": "b",
                "carrier": "c",
                "planets": ["d", "e"],
                "radii": {"sun": 0.03, "planet": 0.02, "ring": 0.07},
                "stiffness": {"sun": 1e7, "ring": 1e7},
                "damping": {"sun": 10.0, "ring": 10.0},
                "backlash": SIDES,
                "contact_damping": "clipped",
                "transmission_error": {"sun": SINES, "ring": SINES},
                "mesh_phase": {"sun": [0.0, 1.0], "ring": [0.0, 1.0]},
                "planet_mass": 0.3,
                "centre_distance": 0.05,
            }
        ],
    },
}
PARTS["floating"] = {
    "inertia": [{"name": "a", "J": 0.01, "mass": 0.5}, *({"name": name, "J": 0.01} for name in "bdef")],
    "planetary": [
        {
            **{key: value for key, value in PARTS["planetary"]["planetary"][0].items() if key != "mesh_phase"},
            "carrier": "ground",
            "pressure_angle": 0.35,
            "planet_positions": [0.1, 2.2, 4.3],
            "planets": ["d", "e", "f"],
        }
    ],
}
PARTS["sideways"] = {
    "inertia": [{"name": name, "J": 0.01, "mass": 0.5} for name in "ab"],
    "gravity": {"direction": -1.2, "acceleration": 9.81},
    "mesh": [{**AB, "radii": [0.05, 0.03], "stiffness": 1e7, "pressure_angle": 0.35, "centre_line": 0.1}],
    "bearing": [
        {"name": "two", "on": "a", "stiffness": 1e7, "damping": 10.0, "clearance": 1e-5},
        {"name": "three", "on": "b", "stiffness": 1e7, "direction": 0.2},
    ],
    "simulation": {
        "initial": {
            "angle": [0.1, 0.2],
            "velocity": [1.0, 2.0],
            "displacement": [1e-5, 0.0, 1e-5],
            "displacement_velocity": [0.1, 0.0, 0.1],
        }
    },
}
PARTS["geared"]["mesh"][1]["alternation"] = {"order": 20, "share": 0.5, "fewer": 0.7, "phase": 0.1}
"""Small models that together hold every quantity of the file format; numbers in SI."""

NUMBERS = ("0", "-0.0", "1", "-1", "1e-3", "1e31", "-1e31", "1e-31", "1e-401", "1e401", "-1e401", "nan", "inf", "-inf")
"""Zero, signs, and what is too small, too large or no number at all; before the unit of a text."""


def tables(part: str) -> dict[str, Any]:
    plain = {
        "schema": 1,
        "inertia": [{"name": "a", "J": 0.01}, {"name": "b", "J": 0.02}],
        "excitation": {"speed": 100.0},
    }
    return copy.deepcopy({**plain, **PARTS[part]})


def alternatives(node: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield a node of the schema and all that it may be in its place."""
    if "$ref" in node:
        yield from alternatives(SCHEMA["$defs"][node["$ref"].rpartition("/")[2]])
        return
    yield node
    for member in node.get("anyOf", ()):
        yield from alternatives(member)


def dimension_of(node: dict[str, Any]) -> Dimension | None:
    """Return what a node measures; None: it is no quantity."""
    texts = [member for member in node.get("anyOf", ()) if member.get("type") == "string"]
    return next((DIMENSIONS[text["examples"][0]] for text in texts if "examples" in text), None)


def quantities(value: Any, nodes: list[dict[str, Any]], path: Path = ()) -> Iterator[tuple[Path, Dimension, int]]:
    """Yield where a quantity stands in tables, what it measures, and which node of the schema says so."""
    nodes = [option for node in nodes for option in alternatives(node)]
    if isinstance(value, dict):
        for key, entry in value.items():
            inner = [node["properties"][key] for node in nodes if key in node.get("properties", {})]
            yield from quantities(entry, inner, (*path, key))
    elif isinstance(value, list):
        for index, entry in enumerate(value):
            if index > 1 and isinstance(entry, float):  # as the others of a list of numbers
                return
            pairs = [node["prefixItems"][index] for node in nodes if index < len(node.get("prefixItems", ()))]
            inner = [*pairs, *(node["items"] for node in nodes if isinstance(node.get("items"), dict))]
            yield from quantities(entry, inner, (*path, index))
    elif isinstance(value, float):
        for node in nodes:
            if (dimension := dimension_of(node)) is not None:
                yield path, dimension, id(node)


def answer(part: str, path: Path, value: object) -> object:
    """Return the model with one value changed, or place, rule and remedy of its problems."""
    changed = tables(part)
    node: Any = changed
    for step in path[:-1]:
        node = node[step]
    node[path[-1]] = value
    try:
        return gr.Model.from_tables(changed)
    except gr.ModelError as error:
        written = shown(value)
        return {(p.place, p.rule.replace(f" {written}:", ":"), p.remedy) for p in error.problems}


def number_of(text: str, dimension: Dimension) -> float:
    """Return the number that a text with a unit stands for, as TOML would have it."""
    try:
        return units.convert(text, dimension)
    except UnitError:
        number = float(text.split(maxsplit=1)[0])
        return math.copysign(math.inf, number) if math.isfinite(number) else number


@pytest.mark.parametrize("part", PARTS)
def test_a_number_and_a_text_with_a_unit_get_the_same_answer(part: str) -> None:
    assert isinstance(gr.Model.from_tables(tables(part)), gr.Model)
    places = {path: dimension for path, dimension, _ in quantities(tables(part), [SCHEMA])}
    for path, dimension in places.items():
        other = dimension.example.split()[1]
        for number in NUMBERS:
            for unit in (dimension.si, other):
                text = f"{number} {unit}"
                as_number = answer(part, path, number_of(text, dimension))
                assert answer(part, path, text) == as_number, (path, text)


def test_every_quantity_of_the_schema_is_asked() -> None:
    def nodes(node: Any, path: Path = ()) -> Iterator[tuple[int, Path]]:
        for key, entry in node.items() if isinstance(node, dict) else enumerate(node if isinstance(node, list) else ()):
            yield from nodes(entry, (*path, key))
        if isinstance(node, dict) and dimension_of(node) is not None:
            yield id(node), path

    asked = {node for part in PARTS for *_, node in quantities(tables(part), [SCHEMA])}
    missed = [path for node, path in nodes(SCHEMA) if node not in asked]
    assert [path for path in missed if "anyOf" not in path or path[-3:-1] != ("anyOf", 0)] == []


@pytest.mark.parametrize("whole", [int, np.int64])
def test_a_count_is_judged_whatever_counts(whole: type) -> None:
    changed = {"cycles": whole(5), "discard": whole(5)}
    with pytest.raises(gr.ModelError, match="must be less than cycles"):
        gr.example("case3").with_simulation(changed)
