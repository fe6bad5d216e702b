"""``criteria``: a run in, a verdict out."""

from __future__ import annotations

import os
from collections.abc import Iterable

from gearrattle.quantities import CRITERIA, Verdict, judge, verdict_of
from gearrattle.quantities.chunks import add_chunks
from gearrattle.results import Run, check_run


def criteria(run: Run | Iterable[Run]) -> Verdict:
    """Judge a run by every criterion: does it rattle, where, how badly.

    Parameters
    ----------
    run
        from ``simulate`` or ``open_run``; or the chunks of one long motion, in order, from ``stream`` or
        ``open_stream``: they are judged as one motion, and none of them is kept.

    Raises
    ------
    ModelError
        if no cycle remains after the discarded ones, or if chunks do not follow each other.

    Examples
    --------
    >>> verdict = gr.criteria(gr.simulate(gr.example("case3"), cycles=40, discard=20))
    >>> print(verdict.verdict)
    double-sided
    >>> [(part.name, part.regime) for part in verdict.parts]
    [('gear', 'double-sided'), ('spline', 'single-sided'), ('clutch', 'single-sided')]
    """
    if isinstance(run, Run):
        return judge(run.trajectory, units=run.model.units)
    if isinstance(run, str | os.PathLike) or not isinstance(run, Iterable):
        check_run(run)
    sums, _, model = add_chunks(run, CRITERIA, "judged")
    return verdict_of(sums, units=model.units)
