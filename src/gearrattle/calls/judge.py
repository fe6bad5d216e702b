"""``criteria``: a run in, a verdict out."""

from __future__ import annotations

from gearrattle.criteria import Verdict, judge
from gearrattle.results import Run


def criteria(run: Run) -> Verdict:
    """Judge a run by every criterion: does it rattle, where, how badly.

    Args:
        run: from ``simulate`` or ``open_run``.
    """
    return judge(run.trajectory, units=run.model.units)
