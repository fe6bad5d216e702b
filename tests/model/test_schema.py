"""The JSON Schema follows the classes: what the loader takes and refuses, the schema takes and refuses."""

from __future__ import annotations

import json
from typing import Any

from gearrattle.model import ALGORITHMS, json_schema
from gearrattle.model.components import COMPONENTS


def _properties(name: str) -> dict[str, Any]:
    actual: dict[str, Any] = json_schema()["$defs"][name]["properties"]
    return actual


def test_is_plain_json_with_the_keys_of_the_file() -> None:
    schema = json_schema()
    assert json.loads(json.dumps(schema)) == schema
    assert schema["$schema"].startswith("https://json-schema.org/")
    keys = [
        "schema",
        "name",
        "units",
        "inertia",
        *COMPONENTS,
        "gravity",
        "oil",
        "excitation",
        "torque",
        "motion",
        "simulation",
        "criteria",
    ]
    assert list(schema["properties"]) == keys
    assert schema["required"] == ["schema", "inertia", "excitation"]


def test_every_table_is_closed() -> None:
    schema = json_schema()
    tables = [schema, *schema["$defs"].values()]
    assert {component.__name__ for component in COMPONENTS.values()} < schema["$defs"].keys()
    assert all(table["additionalProperties"] is False for table in tables)


def test_quantities_are_numbers_or_strings_with_a_unit() -> None:
    inertia = _properties("Inertia")
    number, text = inertia["J"]["anyOf"]
    assert number == {"type": "number", "minimum": 1e-30, "maximum": 1e30}
    assert text["type"] == "string"
    assert "kg*m^2" in inertia["J"]["description"] or "kg m^2" in inertia["J"]["description"]


def test_words_are_listed() -> None:
    simulation = json.dumps(_properties("Simulation"))
    assert all(f'"{name}"' in simulation for name in (*ALGORITHMS, "steady", "static", "zero"))
    assert json_schema()["properties"]["units"]["enum"] == ["SI", "dimensionless"]


def test_pairs_have_two_entries() -> None:
    for key in ("between", "radii"):
        pair = _properties("Mesh")[key]
        assert (pair["minItems"], pair["maxItems"]) == (2, 2)


def test_nothing_is_null() -> None:
    assert "null" not in json.dumps(json_schema())


def test_names_are_those_of_bare_toml_keys() -> None:
    assert _properties("Inertia")["name"]["pattern"] == "^[A-Za-z0-9_-]+$"
    assert _properties("Inertia")["name"]["not"] == {"enum": ["ground"]}
