"""Everything of the paper that can be examined here, in the order of its sections.

Each section says which runs it needs; all are made first, once, and the sections are then read off them.

Takes nothing but how much time there is; gives a Reproduction.
"""

from __future__ import annotations

import time

from gearrattle.reproduction import (
    bulirsch_stoer,
    claims,
    coherence,
    figure3,
    figure4,
    figure7,
    load,
    stiffness,
    table1,
    table5,
    tables_3_4,
    unstable_step,
    work,
)
from gearrattle.reproduction.bench import Progress, Scope, measure
from gearrattle.reproduction.record import Reproduction

_MEASURED = (tables_3_4, unstable_step, bulirsch_stoer, coherence, load, figure7, claims, work)


def reproduce(quick: bool = False, progress: Progress | None = None) -> Reproduction:
    """Run what the paper ran, and compare.

    Args:
        quick: whether to shorten the runs to about a tenth; the figures are then samples, not results.
        progress: called with the finished share, 0 to 1; what it raises ends everything.

    Raises:
        ModelError, ConvergenceError: never for an algorithm that fails, which is a result.
    """
    begin = time.perf_counter()
    scope = Scope(quick)
    bench = measure(scope, [setup for part in _MEASURED for setup in part.needs(scope)], progress)

    def tick() -> None:
        if progress is not None:
            progress(1.0)

    sections = [table1.section(), figure3.section(scope, tick), figure4.section(scope, tick), stiffness.section()]
    for part in _MEASURED:
        sections.append(part.section(bench))
        tick()
    sections.append(table5.section())
    return Reproduction(tuple(sections), quick, time.perf_counter() - begin)
