"""``gearrattle compare``: algorithms side by side, judged by the exact solution."""

from __future__ import annotations

import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from gearrattle.cli.options import Json, Whole, number_or_text

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.comparison.rows import Comparison
    from gearrattle.model import Model


@Parameter(name="*")
@dataclass(frozen=True)
class Contest:
    """Settings of a comparison; what is not given here is taken from the model file, then from the defaults."""

    reference: Annotated[str, Parameter(help="The judge.")] = "exact"
    cycles: Annotated[Whole | None, Parameter(help="Length of the runs, in common periods.")] = None
    discard: Annotated[Whole | None, Parameter(help="Cycles left out of the statistics as start-up.")] = None
    samples_per_cycle: Annotated[Whole | None, Parameter(help="Output samples a cycle.")] = None
    tolerance: Annotated[float, Parameter(help="Of the algorithms that choose their steps.")] = 1e-6
    step: Annotated[str | None, Parameter(help='Of those of fixed step: seconds, or e.g. "20 us".')] = None
    initial: Annotated[Literal["static", "zero"] | None, Parameter(help="Where the runs start.")] = None
    budget: Annotated[float, Parameter(help="Longest time for each contender [s].")] = 60.0

    def arguments(self) -> dict[str, Any]:
        """Return the settings as keyword arguments of ``side_by_side``."""
        return {**asdict(self), "step": number_or_text(self.step)}


_DEFAULTS = Contest()


def compare(
    model: Path,
    /,
    *,
    algorithms: Annotated[str, Parameter(name=["--algorithms", "-a"])] = "",
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    contest: Contest = _DEFAULTS,
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
    work_precision
        Whether the page shows error against work over a range of tolerances; takes longer.
    """
    import gearrattle
    from gearrattle.cli.background import watched
    from gearrattle.cli.page_folder import page_folder
    from gearrattle.json_types import json_text

    driveline, names = gearrattle.load(model), _names(algorithms)
    page = contest, work_precision
    if output is None:
        comparison = watched(lambda watch: _work(watch, driveline, names, page, None))
    else:
        with page_folder(output) as staging:
            comparison = watched(lambda watch: _work(watch, driveline, names, page, staging.path))
            staging.commit()
    if json:
        print(json_text(comparison.to_dict()))
    else:
        print(comparison.recommendation)
        print(_table(comparison))
    if output is not None:
        print(f"page: {output / 'compare.html'}", file=sys.stderr if json else sys.stdout)


def _names(algorithms: str) -> list[str]:
    from gearrattle.comparison.contest import PAPER
    from gearrattle.solvers import SOLVERS

    names = [name.strip() for name in algorithms.split(",") if name.strip()] or list(PAPER)
    return [name for name in SOLVERS if name != "exact"] if names == ["all"] else names


def _work(
    watch: Watch, driveline: Model, names: list[str], page: tuple[Contest, bool], folder: Path | None
) -> Comparison:
    """Compare; with a folder to write into, make the page as well."""
    from gearrattle.comparison.compare import side_by_side
    from gearrattle.comparison.precision import work_precision
    from gearrattle.report.comparison import fill_comparison

    contest, wanted = page
    found = side_by_side(driveline, names, **contest.arguments(), progress=watch)
    if folder is None:
        return found
    curves = None
    if wanted:
        watch.enter("work and precision")
        curves = work_precision(
            driveline, names, budget=min(contest.budget, 10.0), progress=watch, initial=contest.initial
        )
    watch.enter("writing the page")
    fill_comparison(found, curves, folder)
    return found


def _table(comparison: Comparison) -> str:
    from gearrattle.cli.columns import columns

    head = ("algorithm", "steps", "calls", "time, s", "error", "missed", "invented", "statistics off", "verdict")
    rows = []
    for row in comparison.rows:
        verdict = ": ".join(part for part in (row.verdict, ", ".join(row.reasons)) if part) or row.status
        if row.cost is None or row.error is None or row.impacts is None:
            rows.append((row.label, *["-"] * 7, verdict))
            continue
        impacts, off = row.impacts.total, "-"
        if row.statistics is not None and row.statistics.decided:
            off = f"{row.statistics.different}/{row.statistics.decided}"
        rows.append(
            (row.label, f"{row.cost.steps}", f"{row.cost.function_calls}", f"{row.cost.wall_time:.3g}",
             f"{row.error.worst:.1e}", f"{impacts.missed}", f"{impacts.invented}", off, verdict)
        )  # fmt: skip
    return columns(head, rows)
