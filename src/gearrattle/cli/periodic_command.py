"""``gearrattle periodic``: a motion that repeats, stable or not; or all of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, Whole, named_as, refuse_beside, refuse_unless, seconds_of
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model.value_kinds import argument_problems, checked

if TYPE_CHECKING:
    import pandas as pd

    from gearrattle.cli.background import Watch
    from gearrattle.model import Model
    from gearrattle.orbits import Orbit, PeriodicMotions
    from gearrattle.orbits.settled_motion import SettledMotion

_INSTANTS = 8


def periodic(
    model: Path,
    /,
    *,
    cycles: Whole | None = None,
    start: Literal["steady", "static", "zero", "linear"] | None = None,
    every: Annotated[bool, Parameter(negative="")] = False,
    within: str | None = None,
    tipping: str | None = None,
    instants: Whole | None = None,
    best: Annotated[bool, Parameter(negative="")] = False,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Find a motion that repeats: its stability, its impacts in their order, the verdict on it.

    With -o, writes report.html, summary.json, results.nc and figures/ into a folder, all or nothing; or one file.

    Parameters
    ----------
    model
        Model file (TOML).
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
    tipping
        An inertia: the smallest pulses of torque on it, forward and backward, that tip the motion over into another.
    instants
        Of --tipping: number of instants of the motion at which pulses act. Default: 8.
    best
        Of --tipping: also seek the instants at which the smallest pulses are smallest.
    output
        Folder for the page; or a file for the numbers, ending in .nc or .csv, or, of one motion, for the model with its
        simulation beginning on it, ending in .toml. Default: the tables on the terminal only.
    """
    driveline = changed_model(model, changes)
    # refuse options that do not go together
    if every and start is not None:
        raise ModelError(Problem("--start", f'"{start}"', "plays no part with --every", "leave one of them out"))
    if tipping is None:
        refuse_unless("--tipping", {"--instants": instants, "--best": best or None})
    else:
        from gearrattle.orbits.orbit import INSTANTS
        from gearrattle.orbits.tipping import check_pulses

        refuse_beside("--tipping", {"--every": every or None})
        with named_as({"on": "--tipping"}):
            check_pulses(driveline, tipping)
        if problems := argument_problems({"--instants": (INSTANTS, _INSTANTS if instants is None else instants)}):
            raise ModelError(problems)

    seconds = seconds_of(within)
    number = 1 if cycles is None else cycles

    def work(watch: Watch) -> Orbit | PeriodicMotions | SettledMotion | pd.DataFrame:
        watch.enter("looking for motions that repeat" if every else "looking for a motion that repeats")
        # one motion, and the pulses that tip it over
        if not every:
            if tipping is None:
                return _motion(driveline, cycles, start, seconds, watch)
            orbit = gearrattle.periodic(driveline, number, start, within=seconds)
            watch.enter("seeking pulses that tip the motion over")
            count = _INSTANTS if instants is None else instants
            return orbit.tipping(tipping, count, best=best, progress=watch)
        # all motions that repeat
        from gearrattle.orbits import PeriodicMotions

        with named_as({"within": "--within"}):
            orbits = gearrattle.periodic(driveline, number, every=True, within=seconds, progress=watch)
        return PeriodicMotions(driveline, tuple(orbits))

    # compute, save and print
    kind = "periodic motions" if every else "periodic motion" if tipping is None else "tipping pulses"
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
