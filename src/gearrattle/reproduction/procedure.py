"""Reproduction of all statements of the paper that can be checked, in the order of its sections.

Every section states the runs that it needs. All runs are made first, once, and then evaluated by the sections.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from gearrattle.reproduction import (
    algorithm_claims,
    bulirsch_stoer,
    efficiency_by_order,
    figure3,
    figure4,
    figure7,
    mean_load,
    paper_coherence,
    paper_lumping,
    paper_stiffness,
    table1,
    table5,
    tables_3_4,
    unstable_step,
)
from gearrattle.reproduction.measurements import Progress, Scope, Setup, measure, seconds_of
from gearrattle.reproduction.reproduction_record import Reproduction

_A_LOAD = 0.02, 0.02
"""Approximate time for a load of Fig. 3 and of Fig. 4 [s]; as in ``measurements``, only ratios matter."""
_STEPS = 6.0
_READING = 10.0
"""Approximate times for the fixed steps of Tables 3 and 4, and for evaluating the runs [s]."""
_READ = (unstable_step, bulirsch_stoer, paper_coherence, mean_load, figure7, algorithm_claims, efficiency_by_order)


def reproduce(quick: bool = False, progress: Progress | None = None) -> Reproduction:
    """Run what the paper ran, and compare. ``quick`` shortens the runs to about a tenth: samples, not results.
    ``progress`` is called with the finished share, 0 to 1, and what it raises ends everything; an algorithm that
    fails is a result, not an error.
    """
    begin = time.perf_counter()
    scope = Scope(quick)
    setups = tuple(dict.fromkeys(setup for part in (tables_3_4, *_READ) for setup in part.needs(scope)))
    share = _shares(scope, setups, progress)
    measurements = measure(scope, setups, share("runs"))
    figures = [
        part.section(scope, _ticks(share(name), part.runs(scope)))
        for name, part in (("figure 3", figure3), ("figure 4", figure4))
    ]
    sections = [table1.section(), paper_lumping.section(), *figures, paper_stiffness.section()]
    sections.append(tables_3_4.section(measurements, share("steps")))
    report_progress = share("reading")
    for done, part in enumerate(_READ, start=1):
        sections.append(part.section(measurements))
        report_progress(done / len(_READ))
    sections.append(table5.section())
    return Reproduction(tuple(sections), quick, time.perf_counter() - begin)


def _shares(scope: Scope, setups: tuple[Setup, ...], progress: Progress | None) -> Callable[[str], Progress]:
    """Return what turns the finished share of a part into that of everything, by how long the parts take."""
    seconds = {
        "runs": sum(map(seconds_of, setups)),
        "figure 3": _A_LOAD[0] * figure3.runs(scope),
        "figure 4": _A_LOAD[1] * figure4.runs(scope),
        "steps": _STEPS * (0.1 if scope.quick else 1.0),
        "reading": _READING * (0.3 if scope.quick else 1.0),
    }
    total = sum(seconds.values())
    names = list(seconds)

    def part(name: str) -> Progress:
        before = sum(seconds[name] for name in names[: names.index(name)])

        def report_share(share: float) -> None:
            if progress is not None:
                progress(min(1.0, (before + share * seconds[name]) / total))

        return report_share

    return part


def _ticks(progress: Progress, runs: int) -> Callable[[], None]:
    """Return what is called before every one of so many runs."""
    done = -1

    def tick() -> None:
        nonlocal done
        done += 1
        progress(min(1.0, done / runs))

    return tick
