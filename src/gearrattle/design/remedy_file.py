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
