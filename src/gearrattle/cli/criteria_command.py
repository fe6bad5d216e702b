"""``gearrattle criteria``: the verdict on a saved motion."""

from __future__ import annotations

from pathlib import Path

import gearrattle
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Json, Negligible, Output, negligible_of
from gearrattle.errors import ModelError, Problem


def criteria(run: Path, /, *, negligible: Negligible = (), output: Output = None, json: Json = False) -> None:
    """Judge a motion saved by "simulate", "run" or "stream": does it rattle, where, how badly?

    Parameters
    ----------
    run
        Saved motion (netCDF-4, .nc), or the folder of a "stream".
    """
    from gearrattle.quantities.criteria import criteria as judged

    if run.suffix == ".toml":
        remedy = f"gearrattle run {run} simulates and judges a model"
        raise ModelError(Problem(str(run), "a model file", "a saved motion (.nc) is needed", remedy))
    limits = negligible_of(negligible)
    motion = gearrattle.open_stream(run) if run.is_dir() else gearrattle.open_run(run)
    emit("verdict", lambda _: judged(motion, negligible=limits), output, json=json, inputs=[run])
