"""Check of a model text, as by ``gearrattle check``, with the field and line of every problem."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from gearrattle.analysis.statics import equilibrium
from gearrattle.assembly import decay_notes, drag_notes, record_notes
from gearrattle.errors import ConvergenceError, ModelError, Problem, shown_problems
from gearrattle.files import allowed_root
from gearrattle.model import Model
from gearrattle.model.model_file import read_tables
from gearrattle.model.path_labels import path_words, si_unit
from gearrattle.model.paths import path_names, value_at
from gearrattle.model.plausibility import plausibility_notes
from gearrattle.model.toml_line_numbers import headers
from gearrattle.workbench.drawing import drawing
from gearrattle.workbench.job_inputs import NAME
from gearrattle.workbench.value_groups import groups_of
from gearrattle.workbench.workspace_folder import Folder


def checked(text: str, folder: Folder | None = None, file: str = "") -> dict[str, Any]:
    """Check the text of a model file, which may be incomplete.

    Data files in it are relative to ``file``, a name in the workspace folder. A name outside the folder is a
    ModelError.

    Returns
    -------
    dict
        ``problems`` with ``path`` and ``line``, ``notes``, ``drawing`` and ``tables`` (None where the text is no TOML),
        ``headers`` with ``path`` and ``line``, ``title``, ``units`` of plain numbers and ``labels`` of all values by
        path (none where something is wrong), and ``groups``: patterns of values that one factor changes together, each
        with its words.
    """
    # text to tables
    name = file or NAME
    path = name if folder is None else str(folder.path(name))
    with allowed_root(None if folder is None else folder.root):
        try:
            tables, positions = read_tables(text, path)
        except ModelError as error:
            return _answer(error.problems, path, name)
        # tables to a model, its notes and groups
        problems: Sequence[Problem] = ()
        notes: Sequence[str] = ()
        groups: Mapping[str, str] = {}
        try:
            model = Model.from_tables(tables, positions)
            groups = groups_of(model)
            notes = (
                *plausibility_notes(model),
                *decay_notes(model),
                *drag_notes(model),
                *record_notes(model),
                *equilibrium(model).notes,
            )
        except ModelError as error:
            problems = error.problems
        except ConvergenceError as error:
            problems = [Problem("model", "", error.message, error.remedy)]
    # answer for the page
    return _answer(problems, path, name) | {
        "notes": list(notes),
        "drawing": drawing(tables),
        "tables": tables,
        "headers": [{"path": list(header.path), "line": header.line} for header in headers(text)],
        "title": tables["name"] if isinstance(tables.get("name"), str) else "",
        "units": {} if problems else units_of(tables),
        "labels": {} if problems else {path: path_words(path, tables) for path in path_names(tables)},
        "groups": {} if problems else groups,
    }


def units_of(tables: Mapping[str, Any]) -> dict[str, str]:
    """Return the SI unit of every plain number in the tables of a model that has one, by path.

    Examples
    --------
    >>> from gearrattle.workbench.checking import units_of
    >>> units_of({"inertia": [{"name": "hub", "J": 0.1, "drag": "0.2 N*m*s/rad"}], "simulation": {"cycles": 20}})
    {'inertia.hub.J': 'kg m²'}
    """
    if tables.get("units") == "dimensionless":
        return {}
    numbers = [path for path in path_names(tables) if type(value_at(tables, path)) in (int, float)]
    return {path: unit for path in numbers if (unit := si_unit(path))}


def _answer(problems: Sequence[Problem], path: str, name: str) -> dict[str, Any]:
    entries = [_problem(problem, path, name) for problem in shown_problems(problems)]
    nothing: dict[str, Any] = {"notes": [], "drawing": None, "tables": None, "headers": [], "title": ""}
    return {"problems": entries, **nothing, "units": {}, "labels": {}, "groups": {}}


def _problem(problem: Problem, path: str, name: str) -> dict[str, Any]:
    """Return a problem with the path of its field and its line in the text."""
    line = re.match(rf"{re.escape(path)}:(\d+)", problem.place)
    return {
        **problem.to_dict(),
        "place": problem.place.replace(path, name, 1),
        "path": list(problem.location),
        "line": int(line[1]) if line else None,
    }


def plain(tables: Mapping[str, Any]) -> Any:
    """Return tables in the types that JSON has: dates as text, infinite numbers and NaN as text."""
    if isinstance(tables, Mapping):
        return {key: plain(value) for key, value in tables.items()}
    if isinstance(tables, list):
        return [plain(value) for value in tables]
    is_json = (
        tables is None or isinstance(tables, bool | str) or (isinstance(tables, int | float) and abs(tables) < 1e308)
    )
    return tables if is_json else str(tables)
