"""``gearrattle metrics``: rattle metrics of a saved motion, or of a measured file."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from gearrattle.cli.options import Json
from gearrattle.cli.sources import heard

if TYPE_CHECKING:
    import pandas as pd


def metrics(
    source: Path,
    /,
    *,
    model: Path | None = None,
    name: Annotated[tuple[str, ...], Parameter(negative=())] = (),
    order: Annotated[tuple[float, ...], Parameter(negative=())] = (),
    base_level: float | None = None,
    kappa: float | None = None,
    json: Json = False,
) -> None:
    """Measure a saved motion, or signals of a rig, by every rattle metric.

    Parameters
    ----------
    source
        Motion saved by "simulate" or "run" (.nc), or the folder of a "stream"; or a measured file, or a mapping of one
        (.toml).
    model
        Model file of the driveline of a measured file: inertias, radii, drag torques, orders, speed.
    name
        A metric; may be given several times. Default: all.
    order
        An order of the engine's torque; may be given several times. Default: those of the model.
    base_level
        Level of the gearbox without rattle [dB], for the rattle level.
    kappa
        What makes a level of the intensity of impacts [1/N].
    """
    import gearrattle
    from gearrattle.calls.measure import metrics as measured

    driveline = None if model is None else gearrattle.load(model)
    motion = gearrattle.open_stream(source) if source.is_dir() else heard(source)
    _tell(
        measured(motion, driveline, name or None, orders=order or None, base_level=base_level, kappa=kappa),
        json=json,
    )


def _tell(table: pd.DataFrame, *, json: bool) -> None:
    from gearrattle.cli.columns import columns
    from gearrattle.json_types import json_text, json_value

    if json:
        print(json_text({"metrics": json_value(table.to_dict("records")), "notes": table.attrs["notes"]}))
        return
    rows = [
        (
            row["metric"],
            row["subject"],
            row["quantity"],
            f"{row['value']:.6g} {row['unit']}".removesuffix(" 1"),
            _error(row["error"], row["value"]),
        )
        for row in table[table.subject != ""].to_dict("records")
    ]
    if rows:
        print(columns(("metric", "subject", "quantity", "value", "error of sampling"), rows))
    for note in dict.fromkeys([*table.attrs["notes"], *(note for note in table.note if note)]):
        print(f"note: {note}", file=sys.stderr)


def _error(error: float, value: float) -> str:
    """Return an estimated error in words: none for what is exact, a question mark for what has no estimate."""
    if math.isnan(value):
        return ""
    return "none" if error == 0.0 else "?" if math.isnan(error) else f"± {error:.2g}"
