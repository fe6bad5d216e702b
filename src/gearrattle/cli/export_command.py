"""``gearrattle export``: a driveline for another tool, or for a solver of one's own."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.assignments import labels
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.shared_options import Changes, Json, ModelFile, Words
from gearrattle.errors import ModelError, Problem
from gearrattle.json_types import json_text


def export(
    model: ModelFile,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    format_: Annotated[str, Parameter(name="--format", show_default=False)] = "",
    region: Words = (),
    partial: Annotated[bool, Parameter(show_default=False)] = False,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Write a driveline for another tool, as equations for a solver of your own, or as matrices.

    Notes, and what was left out, are printed on stderr.

    Parameters
    ----------
    output
        File: .json (openTorsion), .mo (Modelica), .py (Python), .jl (Julia), .c (C), .npz or .mat (state-space
        matrices).
    format_
        "opentorsion", "modelica", "python", "julia", "c" or "state-space". Default: told by the ending.
    region
        NAME=LABEL: of the matrices, the region of an element with a clearance; 0 is the centre. May be repeated.
        Default: in contact.
    partial
        Leave out, and list, what the format cannot hold. Default: it is refused.
    """
    driveline = changed_model(model, changes)
    if output.exists() and output.samefile(model):
        raise ModelError(Problem("-o", f'"{output}"', "is the input file", "name another"))
    regions = labels("--region", region)
    written = gearrattle.export_model(driveline, output, format_, region=regions or None, partial=partial)
    for line in (*written.notes, *(f"left out: {problem}" for problem in written.left_out)):
        print(f"note: {line}", file=sys.stderr)
    print(json_text(written.to_dict()) if json else f"saved: {written.path}")
