"""``gearrattle scale``: the model without dimensions, and what scaling does to its conditioning."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from gearrattle.cli.options import Json


def scale(
    model: Path,
    /,
    *,
    contact_ratio: Annotated[Sequence[str], Parameter(negative="")] = (),
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    json: Json = False,
) -> None:
    """Print the dimensionless coefficients and the condition numbers; write the dimensionless model if told to.

    Parameters
    ----------
    model
        Model file (TOML), in SI.
    contact_ratio
        NAME=RATIO: for the condition numbers, the element's stiffness counts with this ratio, 0 to 1. May be repeated.
    output
        File for the dimensionless model (TOML).
    """
    import gearrattle
    from gearrattle.cli.assignments import numbers
    from gearrattle.cli.columns import columns
    from gearrattle.errors import ModelError, Problem
    from gearrattle.json_types import json_text, json_value
    from gearrattle.model.file import text_of
    from gearrattle.writing import Staging

    driveline = gearrattle.load(model)
    scaled = gearrattle.nondimensionalize(driveline)
    stiff = gearrattle.stiffness(driveline, contact_ratio=numbers("--contact-ratio", contact_ratio))
    if output is not None:
        if output.is_dir():
            raise ModelError(Problem("-o", f'"{output}"', "is a folder; a file is needed"))
        with Staging(output.parent) as staging:
            (staging.path / output.name).write_text(text_of(scaled.model), encoding="utf-8")
            staging.commit()
        print(f"wrote {output}", file=sys.stderr)
    if json:
        found = {
            "scales": asdict(scaled.scales),
            "coefficients": scaled.coefficients,
            "r_lambda": stiff.r_lambda,
            "condition": stiff.condition,
        }
        print(json_text(json_value(found)))
        return
    units = {"frequency": "rad/s", "angle": "rad", "radius": "m", "inertia": "kg m^2"}
    print(columns(("unit", ""), [(k, f"{v:.6g} {units[k]}") for k, v in asdict(scaled.scales).items()]))
    print("\n" + columns(("coefficient", ""), [(k, f"{v:.6g}") for k, v in scaled.coefficients.items()]))
    rows = [(name, f"{value:.4g}", f"{stiff.r_lambda:.4g}") for name, value in stiff.condition.items()]
    print("\n" + columns(("formulation", "condition number", "R_lambda"), rows))
    print("\nR_lambda is the same in all: changes of coordinates and units are similarity transforms.")
