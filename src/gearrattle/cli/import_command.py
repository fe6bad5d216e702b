"""``gearrattle import``: a model file of a driveline that another tool describes."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.shared_options import Json, OutputPath, Whole, number_or_text
from gearrattle.errors import ModelError, Problem
from gearrattle.json_types import json_text


def import_(
    source: Path,
    /,
    *,
    output: OutputPath = None,
    format_: Annotated[str, Parameter(name="--format", show_default=False)] = "",
    speed: str | None = None,
    split: Whole = 1,
    partial: Annotated[bool, Parameter(show_default=False)] = False,
    json: Json = False,
) -> None:
    """Read a driveline of openTorsion, ROSS or Modelica, and write it as a model file.

    Notes, and what was left out, are printed on stderr, and begin the model file.

    Parameters
    ----------
    source
        File: .json of openTorsion; .toml or .json of ROSS; .mo of Modelica.
    output
        Model file (.toml). Default: the model is printed.
    format_
        "opentorsion", "ross" or "modelica". Default: told by the content.
    speed
        Reference speed, e.g. "1500 rpm". Default: that of the source, if it states one, otherwise 1 rad/s.
    split
        Parts of every shaft that has an inertia of its own.
    partial
        Leave out, and list, what is not understood or no part of a model. Default: it is refused.
    """
    if output is not None and output.exists() and output.samefile(source):
        raise ModelError(Problem("-o", f'"{output}"', "is the input file", "name another"))
    imported = gearrattle.import_model(source, format_, speed=number_or_text(speed), split=split, partial=partial)
    written = None if output is None else imported.save(output)
    for line in (*imported.notes, *(f"left out: {problem}" for problem in imported.left_out)):
        print(f"note: {line}", file=sys.stderr)
    if json:
        model = None if output is not None else imported.model.to_toml()
        print(json_text({**imported.to_dict(), "model": model, "output": None if written is None else str(written)}))
        return
    print(imported.to_toml() if written is None else f"saved: {written}")
