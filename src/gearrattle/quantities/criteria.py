"""``criteria``: a run in, a verdict out."""

from __future__ import annotations

import os
from collections.abc import Iterable

from gearrattle.errors import ModelError, Problem
from gearrattle.quantities import Gathered, Verdict, gather, judge, tell
from gearrattle.results import Run, check_run
from gearrattle.wording import counted


def criteria(run: Run | Iterable[Run]) -> Verdict:
    """Judge a run by every criterion: does it rattle, where, how badly.

    Args:
        run: from ``simulate`` or ``open_run``; or the chunks of one long motion, in order, from ``stream`` or
            ``open_stream``: they are judged as one motion, and none of them is kept.

    Raises:
        ModelError: if no cycle remains after the discarded ones, or if chunks do not follow each other.
    """
    if isinstance(run, Run):
        return judge(run.trajectory, units=run.model.units)
    if isinstance(run, str | os.PathLike) or not isinstance(run, Iterable):
        check_run(run)
    gathered: Gathered | None = None
    units, end = "SI", None
    for each in run:
        chunk = each.trajectory
        if end not in (None, chunk.first_cycle):
            rule = f"must follow the chunk before, which ends at cycle {end}"
            raise ModelError(Problem("chunk", f"one that begins at cycle {chunk.first_cycle}", rule))
        units, end = each.model.units, chunk.first_cycle + chunk.cycles
        if chunk.discard < chunk.cycles:
            gathered = gather(chunk, gathered)
    if gathered is None:
        raise ModelError(
            Problem("discard", f"all of {counted(end or 0, 'cycle')}", "at least one cycle must remain to be judged")
        )
    return tell(gathered, units=units)
