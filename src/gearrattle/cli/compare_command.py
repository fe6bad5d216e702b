"""``gearrattle compare``: several algorithms compared with the exact solution."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from gearrattle.cli.command_inputs import changed_model
from gearrattle.cli.emit import emit
from gearrattle.cli.shared_options import Changes, Json, ModelFile, Output, Whole, number_or_text

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch


@Parameter(name="*")
@dataclass(frozen=True)
class Contest:
    """Settings of a comparison; missing settings are taken from the model file, then from the defaults."""

    reference: Annotated[str, Parameter(help="The judge.")] = "exact"
    cycles: Annotated[Whole | None, Parameter(help="Length of the runs, in common periods.")] = None
    discard: Annotated[Whole | None, Parameter(help="Cycles left out of the statistics as start-up.")] = None
    samples_per_cycle: Annotated[Whole | None, Parameter(help="Output samples per cycle.")] = None
    tolerance: Annotated[float, Parameter(help="Of the algorithms that choose their steps.")] = 1e-6
    step: Annotated[str | None, Parameter(help='Of those of fixed step: seconds, or e.g. "20 us".')] = None
    initial: Annotated[Literal["steady", "static", "zero"] | None, Parameter(help="Where the runs start.")] = None
    budget: Annotated[float, Parameter(help="Longest time for each contender [s].")] = 60.0

    def arguments(self) -> dict[str, Any]:
        """Return the settings as keyword arguments of ``side_by_side``."""
        return {**asdict(self), "step": number_or_text(self.step)}


_DEFAULTS = Contest()


def compare(
    model: ModelFile,
    /,
    *,
    algorithms: Annotated[str, Parameter(name=["--algorithms", "-a"])] = "",
    output: Output = None,
    contest: Contest = _DEFAULTS,
    work_precision: Annotated[bool, Parameter(negative="--no-work-precision")] = True,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Compare algorithms on a model: cost, true error, missed and invented impacts, statistics, advice.

    Parameters
    ----------
    algorithms
        Names, separated by commas; default: the seven of the 1995 paper. "all" for every one there is.
    work_precision
        Whether what -o writes has error against work over a range of tolerances; takes longer.
    """
    from gearrattle.comparison.compare import side_by_side
    from gearrattle.comparison.precision import work_precision as measured
    from gearrattle.report.comparison_page import ComparisonPage

    driveline = changed_model(model, changes)
    names = _names(algorithms)

    def work(watch: Watch) -> ComparisonPage:
        comparison = side_by_side(driveline, names, **contest.arguments(), progress=watch)
        precision = None
        if work_precision and output is not None:
            watch.enter("work and precision")
            budget = min(contest.budget, 10.0)
            precision = measured(driveline, names, budget=budget, progress=watch, initial=contest.initial)
        return ComparisonPage(comparison, precision)

    emit("comparison", work, output, json=json, inputs=[model])


def _names(algorithms: str) -> list[str]:
    from gearrattle.comparison.contender_runs import PAPER
    from gearrattle.engine.solvers import SOLVERS

    names = [name.strip() for name in algorithms.split(",") if name.strip()] or list(PAPER)
    return [name for name in SOLVERS if name != "exact"] if names == ["all"] else names
