"""Study files: TOML that says what a study computes. Nothing in one is run: a function is named on the command line.

    schema = 1
    name = "backlash and load"
    model = "case3.toml"                     # beside this file
    outputs = ["regime", "impacts per cycle"]
    most = 2_000_000                         # cases allowed, if more than a million

    [fixed]                                  # other values of the model, by path
    "simulation.cycles" = 60

    [axis]                                   # what is varied in order, all combinations
    "mesh.gear.backlash" = { from = "0.02 mm", to = "0.2 mm", count = 10, spacing = "log" }
    load = { "torque.0.mean" = [5, 10], "inertia.gear.drag_torque" = [0.5, 1.0] }    # together

    [vary]                                   # what scatters
    "coupling.clutch.stiffness" = { distribution = "normal", mean = 1500.0, deviation = 50.0 }

    [sample]
    count = 256
    method = "sobol"
    seed = 7

Takes a path; gives the arguments of ``study``.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model import load
from gearrattle.model.file import read_tables, read_text
from gearrattle.model.problems import Positions, place
from gearrattle.model.table import did_you_mean, shown

_KEYS: Mapping[str, type] = {
    "schema": int, "name": str, "model": str, "outputs": list, "most": int, "fixed": dict, "axis": dict, "vary": dict,
    "sample": dict,
}  # fmt: skip
_SAMPLE: Mapping[str, type] = {"count": int, "method": str, "seed": int}
_WORDS = {int: "a whole number", str: "a text", list: "a list", dict: "a table"}


def read_study(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a study file.

    Args:
        path: a TOML file, UTF-8, at most 1 MB.

    Returns:
        The arguments of ``study``, model included.

    Raises:
        ModelError: everything wrong with its form, with places; or the model's own problems.
    """
    name = os.fspath(path)
    tables, positions = read_tables(read_text(name, "study file"), name, "study file")
    problems = _form(tables, _KEYS, positions)
    problems += _form(tables.get("sample", {}), _SAMPLE, positions, "sample")
    if "model" not in tables:
        problems.append(Problem(name, "", "names no model", 'add model = "..."'))
    if tables.get("schema", 1) != 1:
        problems.append(Problem(name, shown(tables["schema"]), "schema must be 1"))
    if problems:
        raise ModelError(problems)
    sample = tables.get("sample", {})
    found = {
        "model": load(Path(name).parent / tables["model"]),
        "axes": tables.get("axis", {}), "vary": tables.get("vary", {}), "fixed": tables.get("fixed", {}),
        "samples": sample.get("count", 0),
    }  # fmt: skip
    found |= {key: sample[key] for key in ("method", "seed") if key in sample}
    found |= {key: tables[key] for key in ("outputs", "most") if key in tables}
    return found


def study_name(path: str | os.PathLike[str]) -> str:
    """The name in a study file that ``read_study`` takes; without one, that of the file."""
    name = os.fspath(path)
    tables, _ = read_tables(read_text(name, "study file"), name, "study file")
    return str(tables.get("name") or Path(name).stem)


def _form(table: Any, known: Mapping[str, type], positions: Positions, under: str = "") -> list[Problem]:
    """Problems of keys that do not exist or hold the wrong kind of value."""
    if not isinstance(table, Mapping):
        return []
    found = []
    for key, value in table.items():
        at = place((under, key) if under else (key,), {}, positions)
        if key not in known:
            rule = f"there is no such key; there are {', '.join(known)}"
            found.append(Problem(at, "", rule, did_you_mean(key, known)))
        elif isinstance(value, bool) or not isinstance(value, known[key]):
            found.append(Problem(at, shown(value), f"must be {_WORDS[known[key]]}"))
    return found
