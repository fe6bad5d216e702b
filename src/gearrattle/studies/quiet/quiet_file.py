"""Files with the ranges of a proof of quiet.

schema = 1
within = "60 s"                                # boxes and resolution as well: arguments of ``prove_quiet``

[range]
"mesh.m1.backlash" = ["50 um", "80 um"]
"excitation.speed" = ["700 rpm", "900 rpm"]

[range."drag of all"]                          # paths that vary together
"inertia.gear1.drag_torque" = [0.3, 0.9]
"inertia.gear2.drag_torque" = [0.2, 0.6]
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model.model_file import read_tables, read_text
from gearrattle.model.pydantic_problems import Positions, place
from gearrattle.model.table import did_you_mean, shown
from gearrattle.model.value_kinds import SCHEMA_VERSION
from gearrattle.studies.study_file import placed

_OPTIONS = ("within", "boxes", "resolution")
_KEYS = ("schema", "name", "range", *_OPTIONS)


@dataclass(frozen=True)
class QuietFile:
    """Content of a file of ranges."""

    ranges: dict[str, Any]
    options: dict[str, Any]
    positions: Positions

    @contextmanager
    def located(self) -> Iterator[None]:
        """Add file and line to a ModelError that is raised inside."""
        try:
            yield
        except ModelError as error:
            raise ModelError(placed(problem, self.positions) for problem in error.problems) from None


def read_ranges(path: str | os.PathLike[str]) -> QuietFile:
    """Read the ranges of a proof of quiet: TOML, UTF-8, at most 1 MB; ModelError for what is no such file."""
    name = os.fspath(path)
    tables, positions = read_tables(read_text(name, "file of ranges"), name, "file of ranges")
    problems = []
    for key in tables:
        if key not in _KEYS:
            rule = f"a file of ranges has {', '.join(_KEYS)}"
            problems.append(Problem(place((key,), {}, positions), "", rule, did_you_mean(key, _KEYS)))
    if tables.get("schema") != SCHEMA_VERSION:
        rule = f"is missing: schema = {SCHEMA_VERSION} names the version of the format"
        problems.append(Problem(place(("schema",), {}, positions), "", rule))
    ranges = tables.get("range")
    if not isinstance(ranges, Mapping) or not ranges:
        rule = "must be a table of pairs by path of the model"
        remedy = '[range] with "mesh.m1.backlash" = ["50 um", "80 um"]'
        problems.append(Problem(place(("range",), {}, positions), shown(ranges) if ranges else "", rule, remedy))
    if problems:
        raise ModelError(problems)
    options = {key: tables[key] for key in _OPTIONS if key in tables}
    return QuietFile(dict(ranges or {}), options, positions)
