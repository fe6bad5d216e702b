"""``gearrattle continue``: periodic motions, stable and unstable, followed over a value of the model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.assignments import value_in, words
from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import (
    Changes,
    Json,
    ModelFile,
    Output,
    Whole,
    Words,
    ends_in,
    named_as,
    number_or_text,
    refuse_beside,
    refuse_unless,
    seconds_of,
)
from gearrattle.errors import ModelError, Problem
from gearrattle.model.value_kinds import Count, argument_problems

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.cli.background import Watch
    from gearrattle.model import Model
    from gearrattle.model.factors import Written
    from gearrattle.orbits import Branch, MotionMap, RunUpJumps
    from gearrattle.report.branches_page import BranchesPage

    Ends = tuple[Written, Written]

_OF_BRANCH = {name: f"--{name}" for name in ("path", "range", "cycles", "rate", "within", "narrow")}
_OF_SECOND = {"event": "--boundary", "second": "--second", "range": "--second-range"}


def continue_(
    model: ModelFile,
    /,
    *,
    path: str,
    over: Annotated[str, Parameter(name="--range", allow_leading_hyphen=True)],
    cycles: Whole = 1,
    start: Literal["steady", "static", "zero", "linear"] | None = None,
    step_limit: str | None = None,
    isolated: bool = False,
    within: str | None = None,
    narrow: float = 1e-3,
    second: str | None = None,
    second_range: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    across: Whole | None = None,
    up: Whole | None = None,
    boundary: Whole | None = None,
    scatter: Words = (),
    rate: str | None = None,
    output: Output = None,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Follow motions that repeat over a value of the model, through folds, and locate what happens on the way.

    Parameters
    ----------
    path
        Of the value, such as excitation.speed or mesh.gear.backlash.
    over
        Its two ends, e.g. "300:2000 rpm", or "x0.5:x2" times the model's own; numbers without a unit are in SI. The
        branch begins at the first.
    cycles
        Periods T of all orders after which the motions repeat.
    start
        Where the search for the first motion begins, as of periodic. Default: where a simulation has settled.
    step_limit
        Largest change of the value between two points, e.g. "10 rpm"; with a unit where the range has one.
    isolated
        Look for branches as well that are not connected to the first.
    within
        Time that the answer may take: seconds, or e.g. "5 min"; "none" for no limit. What branches do not show in it
        exact runs up and down the range do. Default: 60 s; with --second and --rate none.
    narrow
        Share of the range: events nearer to each other are told as one family, narrower ranges of unstable motions
        not at all.
    second
        Path of a second value, such as torque.0.mean: a map over both values says where rattle must be, where it exists
        beside a quiet motion, and where none is found.
    second_range
        Its two ends, e.g. "0:20 N*m"; the model's own value lies between them.
    across
        Number of cells of the map over the first value. Default: 32.
    up
        Number of cells of the map over the second value. Default: 20.
    boundary
        Row of an event in the table of events, from 0, with the same range: in place of the map the curve of this event
        over both values. It may leave the range.
    scatter
        PATH=DEVIATION, a standard deviation of a value of the model, e.g. torque.0.mean="0.5 N*m", or x0.05 for a
        twentieth of it: every event gets the standard deviation that all of them give it. At a PATH with * all that
        match scatter, each by itself. May be repeated.
    rate
        Of a run-up and a run-down over a range of the speed, e.g. "100 rpm/s": they are simulated, and their jumps are
        listed beside those of the branch.
    """
    # read and check the options
    driveline = changed_model(model, changes)
    ends = ends_in(over)
    _check_combination(
        second=(second, second_range), cells=(across, up), boundary=boundary, scatter=scatter or None, rate=rate
    )
    second_ends = None if second_range is None else ends_in(second_range, "--second-range")
    refuse_beside("--second" if second is not None else "--rate", {"--within": within if second or rate else None})
    seconds = None if second or rate else seconds_of(within)
    deviations = {name: value_in(text) for name, text in words("--scatter", scatter).items()}
    speed_rate = None if rate is None else number_or_text(rate) or 0.0
    _check_values(driveline, (path, ends), (second, second_ends), deviations, speed_rate)
    limit = None if step_limit is None else _limit(step_limit, path, ends, driveline)

    def work(watch: Watch) -> Branch | MotionMap | RunUpJumps | xr.Dataset | BranchesPage:
        watch.enter("following motions")
        # follow the branch from the first motion
        with named_as(_OF_BRANCH):
            branch = gearrattle.continuation(
                driveline,
                path,
                ends,
                start=start,
                cycles=cycles,
                step_limit=limit,
                isolated=isolated,
                narrow=narrow,
                within=seconds,
                progress=watch,
            )
        # map over a second value, or the boundary of an event
        if second is not None and second_ends is not None:
            watch.enter("following motions over both values")
            with named_as(_OF_SECOND):
                if boundary is not None:
                    return branch.boundary(boundary, second, second_ends, progress=watch)
                cells = {name: count for name, count in (("across", across), ("up", up)) if count is not None}
                return branch.map(second, second_ends, **cells, isolated=isolated, progress=watch)
        # run-up and run-down, or scatter of events
        if speed_rate is not None:
            watch.enter("simulating a run-up and a run-down")
            return branch.run_up(speed_rate, progress=watch)
        if deviations:
            return _scattered(branch, deviations, watch)
        watch.phase = "measuring motions"  # of a branch that may be all that is known after Ctrl-C
        return branch

    # compute, save and print
    kind = "branches" if rate is None else "jumps of run-ups"
    if second is not None:
        kind = "map of motions" if boundary is None else "event boundary"
    emit(kind, work, output, json=json, inputs=[model], keeps_known=kind == "branches")


def _check_combination(
    *,
    second: tuple[str | None, str | None],
    cells: tuple[int | None, int | None],
    boundary: int | None,
    scatter: Sequence[str] | None,
    rate: str | None,
) -> None:
    """Refuse options that exclude each other (ModelError), because a command has one answer."""
    if (second[0] is None) != (second[1] is None):
        raise ModelError(Problem("--second", "", "--second and --second-range belong together", "give both or none"))
    from gearrattle.orbits.motion_map import CELLS

    of_map = {"--across": cells[0], "--up": cells[1]}
    typed = {name: (CELLS, value) for name, value in of_map.items() if value is not None}
    if problems := argument_problems({**typed, "--boundary": (Count(), boundary or 0)}):
        raise ModelError(problems)
    if second[0] is None:
        refuse_unless("--second", {**of_map, "--boundary": boundary})
    else:
        refuse_beside("--second", {"--rate": rate, "--scatter": scatter})
    if boundary is not None:
        refuse_beside("--boundary", of_map)
    if rate is not None:
        refuse_beside("--rate", {"--scatter": scatter})


def _check_values(
    driveline: Model,
    first: tuple[str, Ends],
    second: tuple[str | None, Ends | None],
    deviations: Mapping[str, Written],
    rate: float | str | None,
) -> None:
    """Refuse bad values of options (ModelError) before any motion is followed."""
    from gearrattle.orbits.gradients import second_of, tolerances_of
    from gearrattle.orbits.run_ups import rate_of
    from gearrattle.orbits.value_family import ends_of

    path, ends = first
    with named_as(_OF_BRANCH):
        in_si = ends_of(driveline, path, ends)
        if rate is not None:
            rate_of(driveline, path, in_si, rate)
    if second[0] is not None and second[1] is not None:
        with named_as(_OF_SECOND):
            second_of(driveline, path, second[0], second[1])
    with named_as({"tolerances": "--scatter"}):
        tolerances_of(driveline, path, deviations)


def _scattered(branch: Branch, deviations: Mapping[str, Written], watch: Watch) -> BranchesPage:
    """Return branches with the standard deviations of their events; NaN for those without a gradient."""
    from gearrattle.report.branches_page import BranchesPage

    watch.enter("moving events")
    of_events = []
    for event in range(len(branch.events)):
        watch(event / len(branch.events))
        try:
            of_events.append(branch.scatter(event, deviations))
        except ModelError:  # events of this kind have no gradient
            of_events.append(math.nan)
    return BranchesPage(branch, of_events)


def _limit(text: str, path: str, ends: Ends, model: Model) -> float:
    """Return the largest change [SI]."""
    from gearrattle.model.path_values import change_in_si

    limit = number_or_text(text)
    if isinstance(limit, float) and limit > 0.0 and isinstance(ends[1], str):
        raise ModelError(Problem("--step-limit", text, f'has no unit, but the range ends at "{ends[1]}"', "add it"))
    return change_in_si(path, limit, model, "positive", "--step-limit")
