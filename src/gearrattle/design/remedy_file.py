"""Remedy files: TOML with the allowed changes, and the target.

target = "quiet"
speeds = ["760 rpm", "800 rpm"]

[candidates]
"inertia.*.drag_torque" = { factor = { from = 1, to = 4 }, cost = 2.0 }
"mesh.m1.backlash" = { from = "0.08 mm", to = "0.14 mm" }
"""

from __future__ import annotations

import os
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model.model_file import read_tables, read_text
from gearrattle.model.pydantic_problems import place
from gearrattle.model.table import did_you_mean

_KEYS = ("candidates", "target", "speeds")


def remedy_schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a remedy file; its values are checked where they are used."""
    bound = {
        "type": ["number", "string"],
        "description": "An end of the range: a number in SI, or a text with a unit.",
    }
    spacing = {"enum": ["linear", "log"], "description": "How steps divide the range."}
    pair = {"type": "array", "minItems": 2, "maxItems": 2}
    ends = {"from": bound, "to": bound, "spacing": spacing}
    factors = "Factors on what the model says, in place of values."
    cost = "Of the whole way to the end of the range that is farther; a smaller change costs less in proportion."
    change = {
        **ends,
        "factor": {"anyOf": [_closed(ends), pair], "description": factors},
        "cost": {"type": "number", "minimum": 0, "default": 1.0, "description": cost},
    }
    keys = {
        "target": {"type": "string", "description": 'The condition: "quiet", or an output and its limit.'},
        "speeds": {
            "type": "array",
            "items": {"type": ["number", "string"]},
            "description": "Speeds at which it holds.",
        },
        "candidates": {
            "type": "object",
            "additionalProperties": {"anyOf": [_closed(change), pair]},
            "description": "What may be changed, by path of the model.",
        },
    }
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "gearrattle remedy file"}
    return {**head, **_closed(keys), "required": ["candidates"]}


def _closed(keys: dict[str, Any]) -> dict[str, Any]:
    """Return the JSON Schema of a table with these keys and no other."""
    return {"type": "object", "properties": keys, "additionalProperties": False}


def read_remedies(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a remedy file.

    ModelError: it is no TOML, or has unknown keys. The values are checked where they are used.
    """
    name = os.fspath(path)
    tables, positions = read_tables(read_text(name, "remedy file"), name, "remedy file")
    unknown = [key for key in tables if key not in _KEYS]
    if unknown:
        rule = f"a remedy file has {', '.join(_KEYS)}"
        raise ModelError([Problem(place((key,), {}, positions), "", rule, did_you_mean(key, _KEYS)) for key in unknown])
    return dict(tables)
