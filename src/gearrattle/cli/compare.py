"""``gearrattle compare``: algorithms side by side, judged by the exact solution."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from gearrattle.cli.options import Json, number_or_text

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.comparison.precision import WorkPrecision
    from gearrattle.comparison.rows import Comparison


def compare(
    model: Path,
    /,
    *,
    algorithms: Annotated[str, Parameter(name=["--algorithms", "-a"])] = "",
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    reference: str = "exact",
    cycles: int | None = None,
    discard: int | None = None,
    samples_per_cycle: int | None = None,
    tolerance: float = 1e-6,
    step: str | None = None,
    initial: Literal["static", "zero"] | None = None,
    budget: float = 60.0,
    work_precision: Annotated[bool, Parameter(negative="--no-work-precision")] = True,
    json: Json = False,
) -> None:
    """Compare algorithms on a model: cost, true error, missed and invented impacts, statistics, advice.

    With -o, writes compare.html, compare.json and figures/ into a folder, all or nothing.

    Parameters
    ----------
    model
        Model file (TOML).
    algorithms
        Names, separated by commas; default: the seven of the 1995 paper. "all" for every one there is.
    output
        Folder for the page; default: the table on the terminal only.
    reference
        The judge.
    cycles
        Length of the runs, in common periods.
    discard
        Cycles left out of the statistics as start-up.
    samples_per_cycle
        Output samples a cycle.
    tolerance
        Of the algorithms that choose their steps.
    step
        Of the algorithms of fixed step: seconds, or e.g. "20 us".
    initial
        Where the runs start.
    budget
        Longest time for each contender [s].
    work_precision
        Whether the page shows error against work over a range of tolerances; takes longer.
    """
    import gearrattle
    from gearrattle.cli.background import watched
    from gearrattle.cli.columns import json_text
    from gearrattle.comparison.compare import side_by_side
    from gearrattle.comparison.contest import PAPER
    from gearrattle.comparison.precision import work_precision as precision_of
    from gearrattle.report.comparison import fill_comparison
    from gearrattle.report.staging import Staging
    from gearrattle.solvers import SOLVERS

    driveline = gearrattle.load(model)
    names = [name.strip() for name in algorithms.split(",") if name.strip()] or list(PAPER)
    if names == ["all"]:
        names = [name for name in SOLVERS if name != "exact"]

    def work(watch: Watch) -> tuple[Comparison, WorkPrecision | None]:
        found = side_by_side(
            driveline, names, reference=reference, cycles=cycles, discard=discard,
            samples_per_cycle=samples_per_cycle, tolerance=tolerance, step=number_or_text(step), initial=initial,
            budget=budget, progress=watch,
        )  # fmt: skip
        if staging is None:
            return found, None
        curves = None
        if work_precision:
            watch.enter("work and precision")
            curves = precision_of(driveline, names, budget=min(budget, 10.0), progress=watch)
        watch.enter("writing the page")
        fill_comparison(found, curves, staging.path)
        return found, curves

    staging: Staging | None = None
    if output is None:
        comparison, _ = watched(work)
    else:
        with Staging(output) as staging:
            comparison, _ = watched(work)
            staging.commit()
    if json:
        print(json_text(comparison.to_dict()))
    else:
        print(_table(comparison))
        print(comparison.recommendation)
    if output is not None:
        print(f"page: {output / 'compare.html'}", file=sys.stderr if json else sys.stdout)


def _table(comparison: Comparison) -> str:
    from gearrattle.cli.columns import columns

    head = ("algorithm", "steps", "calls", "time, s", "error", "missed", "invented", "statistics off", "outcome")
    rows = []
    for row in comparison.rows:
        if row.cost is None or row.error is None or row.impacts is None:
            rows.append((row.label, *["-"] * 7, row.status))
            continue
        impacts, off = row.impacts.total, "-"
        if row.statistics is not None:
            off = f"{row.statistics.different}/{len(row.statistics.items)}"
        unstable = row.growth is not None and row.growth > 1.0 + 1e-9
        rows.append(
            (row.label, f"{row.cost.steps}", f"{row.cost.function_calls}", f"{row.cost.wall_time:.3g}",
             f"{row.error.worst:.1e}", f"{impacts.missed}", f"{impacts.invented}", off,
             "unstable step" if unstable else row.status)
        )  # fmt: skip
    return columns(head, rows)
