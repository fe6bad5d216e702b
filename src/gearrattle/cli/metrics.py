"""``gearrattle metrics``: rattle metrics of a saved motion."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from gearrattle.cli.options import Json


def metrics(
    run: Path,
    /,
    *,
    name: Annotated[tuple[str, ...], Parameter(negative=())] = (),
    base_level: float | None = None,
    kappa: float | None = None,
    json: Json = False,
) -> None:
    """Measure a motion saved by "simulate" or "run" by every rattle metric.

    Parameters
    ----------
    run
        Saved motion (netCDF-4, .nc).
    name
        A metric; may be given several times. Default: all.
    base_level
        Level of the gearbox without rattle [dB], for the rattle level.
    kappa
        What makes a level of the intensity of impacts [1/N].
    """
    import gearrattle
    from gearrattle.calls.measure import metrics as measured
    from gearrattle.cli.columns import columns, json_text
    from gearrattle.errors import ModelError, Problem
    from gearrattle.report.summary import plain

    if run.suffix == ".toml":
        remedy = f"gearrattle simulate {run} -o run.nc saves one"
        raise ModelError(Problem(str(run), "a model file", "a saved motion (.nc) is needed", remedy))
    if run.is_dir():
        rule = "metrics are of one saved motion (.nc): samples of a stream are kept in chunks"
        raise ModelError(Problem(str(run), "a folder", rule, f"gearrattle criteria {run} judges a stream"))
    table = measured(gearrattle.open_run(run), names=name or None, base_level=base_level, kappa=kappa)
    if json:
        print(json_text({"metrics": plain(table.to_dict("records")), "notes": table.attrs["notes"]}))
        return
    there = table[table.subject != ""]
    rows = [
        (row["metric"], row["subject"], row["quantity"], f"{row['value']:.6g} {row['unit']}".removesuffix(" 1"))
        for row in there.to_dict("records")
    ]
    if rows:
        print(columns(("metric", "subject", "quantity", "value"), rows))
    for note in dict.fromkeys([*table.attrs["notes"], *(note for note in table.note if note)]):
        print(f"note: {note}", file=sys.stderr)
