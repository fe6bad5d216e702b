"""``gearrattle continue``: motions that repeat, followed over a value of the model, stable or not."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.emit import emit
from gearrattle.cli.options import Json, Whole, number_or_text
from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.model import Model
    from gearrattle.orbits import Branch, MotionMap, RunUpJumps


def continue_(
    model: Path,
    /,
    *,
    path: str,
    over: Annotated[str, Parameter(name="--range")],
    cycles: Whole = 1,
    start: Literal["static", "zero", "linear"] | None = None,
    step_limit: str | None = None,
    isolated: Annotated[bool, Parameter(negative="")] = False,
    second: str | None = None,
    second_range: str | None = None,
    across: Whole = 32,
    up: Whole = 20,
    rate: str | None = None,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    json: Json = False,
) -> None:
    """Follow motions that repeat over a value of the model, through folds, and locate what happens on the way.

    With -o, writes report.html, summary.json, results.nc and figures/ into a folder, all or nothing; or one file.

    Parameters
    ----------
    model
        Model file (TOML).
    path
        Of the value, such as excitation.speed or mesh.gear.backlash.
    over
        Its two ends, e.g. "300:2000 rpm"; numbers without a unit are in SI. The branch begins at the first.
    cycles
        Periods T of all orders after which the motions repeat.
    start
        Where the search for the first motion begins, as of periodic. Default: where a simulation has settled.
    step_limit
        Largest change of the value between two points, e.g. "10 rpm".
    isolated
        Look for branches as well that are not connected to the first.
    second
        Path of a second value, such as torque.0.mean: a map over both values says where rattle must be, where it exists
        beside a quiet motion, and where none is found.
    second_range
        Its two ends, e.g. "0:20 N*m"; the model's own value lies between them.
    across
        Number of cells of the map over the first value.
    up
        Number of cells of the map over the second value.
    rate
        Of a run-up and a run-down over a range of the speed, e.g. "100 rpm/s": they are simulated, and their jumps are
        listed beside the folds of the branch.
    output
        Folder for the page; or a file for the numbers, ending in .nc or .csv. Default: the tables on the terminal only.
    """
    from gearrattle.orbits.ends import ends_of

    driveline = gearrattle.load(model)
    ends = _ends(over)
    if (second is None) != (second_range is None):
        raise ModelError(Problem("--second", "", "--second and --second-range belong together", "give both or none"))
    if second is not None and rate is not None:
        raise ModelError(Problem("--rate", f'"{rate}"', "is no part of a map", "leave out --second or --rate"))
    second_ends = None if second_range is None else _ends(second_range, "--second-range")
    ends_of(driveline, path, ends)  # before a limit of the same kind
    limit = None if step_limit is None else _limit(step_limit, path, driveline)

    def work(watch: Watch) -> Branch | MotionMap | RunUpJumps:
        watch.enter("following motions")
        branch = gearrattle.continuation(
            driveline, path, ends, start=start, cycles=cycles, step_limit=limit, isolated=isolated, progress=watch
        )
        if second is not None and second_ends is not None:
            watch.enter("following motions over both values")
            return branch.map(second, second_ends, across=across, up=up, isolated=isolated, progress=watch)
        if rate is not None:
            watch.enter("simulating a run-up and a run-down")
            return branch.run_up(number_or_text(rate) or 0.0, progress=watch)
        watch.enter("measuring motions")
        return branch

    kind = "map of motions" if second is not None else "branches" if rate is None else "jumps of run-ups"
    emit(kind, work, output, json=json, inputs=[model])


def _ends(text: str, option: str = "--range") -> tuple[float | str, float | str]:
    """Return the two ends of a range; a unit behind the second is that of the first, too."""
    first, colon, second = (part.strip() for part in text.partition(":"))
    if not (first and colon and second):
        raise ModelError(Problem(option, f'"{text}"', 'must be two values, such as "300:2000 rpm"'))
    low, high = number_or_text(first), number_or_text(second)
    if isinstance(low, float) and isinstance(high, str) and " " in high:
        return f"{first} {high.split(maxsplit=1)[1]}", high
    assert low is not None
    assert high is not None
    return low, high


def _limit(text: str, path: str, model: Model) -> float:
    """Return the largest change [SI]."""
    from gearrattle.model.path_values import in_si

    try:
        value = in_si(path, number_or_text(text), model)
    except ModelError:
        value = None
    if not isinstance(value, int | float) or not value > 0.0:
        rule = f"must be a change of {path} greater than zero"
        raise ModelError(Problem("--step-limit", f'"{text}"', rule, "a number in SI, or one with a unit"))
    return float(value)
