"""Study files: a study as TOML. No code in a file is run: a function is named on the command line.

    schema = 1
    name = "backlash and load"
    model = "case3.toml"                     # beside this file
    kind = "grid"                            # one of ``kinds``; this one if the file is silent

The other keys are those of its kind.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from gearrattle.errors import ModelError, Problem
from gearrattle.model import load
from gearrattle.model.model_file import read_tables, read_text
from gearrattle.model.pydantic_problems import Positions, model_error, place, printable
from gearrattle.model.table import Location, shown
from gearrattle.model.value_kinds import is_newer_schema
from gearrattle.studies.kinds import StudySpec, kind_named
from gearrattle.studies.study_call import Study

_DEFAULT = "grid"


@dataclass(frozen=True)
class StudyFile:
    """Content of a study file.

    Attributes
    ----------
    name
        of the study; without one in the file, the file's.
    arguments
        of ``spec.prepare``, model included.
    """

    name: str
    spec: StudySpec
    arguments: dict[str, Any]
    positions: Positions = field(default_factory=Positions)

    def changed(self, changes: Mapping[str, Any]) -> StudyFile:
        """Return the study of a model with values changed; ModelError for what ``Model.with_`` refuses."""
        if not changes:
            return self
        model = self.arguments["model"]
        try:
            base = model.with_(self.arguments["fixed"]) if self.arguments.get("fixed") else model
        except ModelError as error:
            raise ModelError(placed(problem, self.positions) for problem in error.problems) from None
        return replace(self, arguments={**self.arguments, "model": base.with_(changes), "fixed": {}})

    def prepare(self, **options: Any) -> Study:
        """Prepare the study; refusals name file and line. Errors as of ``spec.prepare``."""
        try:
            return self.spec.prepare(**self.arguments, **options)
        except ModelError as error:
            raise ModelError(placed(problem, self.positions) for problem in error.problems) from None


def read_study(path: str | os.PathLike[str]) -> StudyFile:
    """Read a study file: TOML, UTF-8, at most 1 MB.

    A ModelError has everything that is wrong with its form, with places, or the model's own problems.
    """
    name = os.fspath(path)
    tables, positions = read_tables(read_text(name, "study file"), name, "study file")
    kind = kind_named(tables.get("kind", _DEFAULT), place(("kind",), {}, positions))
    try:
        spec = kind.model_validate(tables, context={"dimensionless": True})  # numbers here have no unit
    except ValidationError as error:
        only = ("schema",) if is_newer_schema(tables.get("schema")) else ()
        raise model_error(error, tables, positions, only) from None
    model = load(Path(name).parent / _model_file(spec.model, place(("model",), {}, positions)))
    try:
        arguments = spec.arguments()
    except ModelError as error:
        raise ModelError(placed(problem, positions) for problem in error.problems) from None
    return StudyFile(spec.name or Path(name).stem, spec, {"model": model, **arguments}, positions)


def placed(problem: Problem, positions: Positions) -> Problem:
    """Return a problem with file and line of the key that most of its place names; the file where it names none."""
    named = [key for key in positions.lines if _is_named(key[-1], problem.place)]
    if problem.place.startswith(positions.name):
        return problem
    if not named:
        return replace(problem, place=f"{positions.name}: {problem.place}")

    def parts_named(key: Location) -> int:
        return sum(_is_named(part, problem.place) for part in key)

    key = max(named, key=lambda key: (parts_named(key), len(str(key[-1]))))
    at = f"{positions.name}:{positions.lines[key]}: {problem.place}"
    return replace(problem, place=at)


def _is_named(key: int | str, where: str) -> bool:
    """Tell whether a problem's place names a key, not a longer word that it is a part of."""
    if not isinstance(key, str) or not key:
        return False
    return any(re.search(rf"(?<![\w-]){re.escape(text)}(?![\w-])", where) for text in (key, printable(key)))


def _model_file(path: str, where: str) -> str:
    """Return the path of a study's model, which may lie in any folder but must be a TOML file.

    ModelError: another ending, also behind a symbolic link.
    """
    if Path(path).suffix.lower() != ".toml" or Path(path).resolve().suffix.lower() != ".toml":
        raise ModelError(Problem(where, shown(path), "a study's model is a file that ends in .toml"))
    return path
