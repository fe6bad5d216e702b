"""``gearrattle periodic``: a motion that repeats, stable or not; or all of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.emit import emit
from gearrattle.cli.options import Json, Whole

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.orbits import Orbit, PeriodicMotions


def periodic(
    model: Path,
    /,
    *,
    cycles: Whole = 1,
    start: Literal["static", "zero", "linear"] | None = None,
    every: Annotated[bool, Parameter(negative="")] = False,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    json: Json = False,
) -> None:
    """Find a motion that repeats: its stability, its impacts in their order, the verdict on it.

    With -o, writes report.html, summary.json, results.nc and figures/ into a folder, all or nothing; or one file.

    Parameters
    ----------
    model
        Model file (TOML).
    cycles
        Periods T of all orders after which the motion repeats.
    start
        Where Newton's method begins; linear: at the motion that grows out of the rest as all harmonics grow. Default:
        where a simulation has settled.
    every
        Look for all motions that repeat after so many periods, unstable ones too, and list them.
    output
        Folder for the page; or a file for the numbers, ending in .nc or .csv, or, of one motion, for the model with its
        simulation beginning on it, ending in .toml. Default: the tables on the terminal only.
    """
    driveline = gearrattle.load(model)
    if every and start is not None:
        from gearrattle.errors import ModelError, Problem

        raise ModelError(Problem("--start", f'"{start}"', "plays no part with --every", "leave one of them out"))

    def work(watch: Watch) -> Orbit | PeriodicMotions:
        watch.enter("looking for motions that repeat" if every else "looking for a motion that repeats")
        if not every:
            return gearrattle.periodic(driveline, cycles, start)
        from gearrattle.orbits import PeriodicMotions

        return PeriodicMotions(driveline, tuple(gearrattle.periodic(driveline, cycles, every=True, progress=watch)))

    emit("periodic motions" if every else "periodic motion", work, output, json=json, inputs=[model])
