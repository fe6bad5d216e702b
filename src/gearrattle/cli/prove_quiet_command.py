"""``gearrattle prove-quiet``: where in a box of tolerances a quiet motion is proven."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import gearrattle
from gearrattle.cli.assignments import words
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
)
from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.studies.quiet import QuietProof


def prove_quiet(
    model: ModelFile,
    ranges: Path | None = None,
    /,
    *,
    range_: Annotated[Words, Parameter(name="--range")] = (),
    within: str | None = None,
    boxes: Whole | None = None,
    resolution: float | None = None,
    changes: Changes = (),
    output: Output = None,
    json: Json = False,
) -> None:
    """Prove where in a box of tolerances a quiet motion exists and is stable; nothing is integrated.

    Parameters
    ----------
    ranges
        File of ranges (TOML): a table [range] with pairs by path; within, boxes and resolution as below.
    range_
        PATH=LOW:HIGH instead, or beside the file: such as "mesh.m1.backlash=50:80 um". May be repeated.
    within
        Time that the search may take: seconds, or e.g. "2 min". Default: no limit.
    boxes
        Boxes that are looked at, at most. Default: 20000.
    resolution
        Share of the volume that may stay undecided. Default: 0.005.
    """
    from gearrattle.studies.quiet.quiet_file import read_ranges

    driveline = changed_model(model, changes)
    file = None if ranges is None else read_ranges(ranges)
    box: dict[str, Any] = {} if file is None else dict(file.ranges)
    typed = {path: list(ends_in(text, f"--range {path}")) for path, text in words("--range", range_).items()}
    if twice := [path for path in typed if path in box]:
        raise ModelError(Problem("--range", twice[0], "has a range in the file already", "leave one of them out"))
    if not box and not typed:
        remedy = '--range "mesh.m1.backlash=50:80 um", or a file with a table [range]'
        raise ModelError(Problem("--range", "none", "a box needs one range at least", remedy))
    box |= typed
    named = {"within": number_or_text(within), "boxes": boxes, "resolution": resolution}
    options = {key: value for key, value in named.items() if value is not None}
    arguments = {**(file.options if file else {}), **options}

    def work(watch: Watch) -> QuietProof:
        watch.enter("dividing the box")
        with file.located() if file else nullcontext(), named_as({key: f"--{key}" for key in options}):
            return gearrattle.prove_quiet(driveline, box, progress=watch, **arguments)

    inputs = [model, *([ranges] if ranges else [])]
    emit("proof of quiet", work, output, json=json, inputs=inputs, keeps_known=True)
