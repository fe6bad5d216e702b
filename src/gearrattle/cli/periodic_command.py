"""``gearrattle periodic``: a motion that repeats, stable or not; or all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import gearrattle
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, ModelFile, OutputPath, Whole, named_as, seconds_of
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model.value_kinds import checked

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.model import Model
    from gearrattle.orbits import Orbit, PeriodicMotions
    from gearrattle.orbits.settled_motion import SettledMotion


def periodic(
    model: ModelFile,
    /,
    *,
    cycles: Whole | None = None,
    start: Literal["steady", "static", "zero", "linear"] | None = None,
    every: bool = False,
    within: str | None = None,
    output: OutputPath = None,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Find a motion that repeats: its stability, its impacts in their order, the verdict on it.

    Parameters
    ----------
    cycles
        Periods T of all orders after which the motion repeats. Default: 1; where none is found, as many as a simulation
        settles in.
    start
        Where Newton's method begins; linear: at the motion that grows out of the rest as all harmonics grow. Default:
        where a simulation has settled.
    every
        Look for all motions that repeat after so many periods, unstable ones too, and list them.
    within
        Time that the search may take: seconds, or e.g. "5 min"; "none" for no limit. Default: 60 s. Where no motion
        that repeats is found in half of it, an exact run says what the driveline does instead; with --every the motions
        known by then are listed, also after Ctrl-C.
    output
        Folder for the page; or a file for the numbers, ending in .nc or .csv, or, of one motion, for the model with its
        simulation beginning on it, ending in .toml. Default: the tables on the terminal only.
    """
    driveline = changed_model(model, changes)
    if every and start is not None:
        raise ModelError(Problem("--start", f'"{start}"', "plays no part with --every", "leave one of them out"))
    seconds = seconds_of(within)

    def work(watch: Watch) -> Orbit | PeriodicMotions | SettledMotion:
        watch.enter("looking for motions that repeat" if every else "looking for a motion that repeats")
        if not every:
            return _motion(driveline, cycles, start, seconds, watch)
        from gearrattle.orbits import PeriodicMotions

        number = 1 if cycles is None else cycles
        with named_as({"within": "--within"}):
            orbits = gearrattle.periodic(driveline, number, every=True, within=seconds, progress=watch)
        return PeriodicMotions(driveline, tuple(orbits))

    kind = "periodic motions" if every else "periodic motion"
    emit(kind, work, output, json=json, inputs=[model], keeps_known=every)


def _motion(
    driveline: Model, cycles: int | None, start: str | None, seconds: float | str, watch: Watch
) -> Orbit | SettledMotion:
    """Return the motion that repeats; where none is found and none was asked for, what an exact run shows."""
    from gearrattle.orbits.settled_motion import settled_motion
    from gearrattle.orbits.settling_limits import WITHIN

    with named_as({"within": "--within"}):
        half = 0.5 * checked(WITHIN, seconds, "within", dimensionless=False)
        try:
            return gearrattle.periodic(driveline, 1 if cycles is None else cycles, start, within=half)
        except ConvergenceError as error:
            if cycles is not None or start is not None:
                raise
            watch.enter("following the motion")
            return settled_motion(driveline, within=half, why=error.message)
