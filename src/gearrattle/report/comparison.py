"""The comparison as one page: the recommendation first, then the numbers and figures it follows from.

``fill_comparison`` writes compare.html, compare.json and figures/ into a folder. The page has no script and loads
nothing.

Takes a Comparison and, if there is one, a WorkPrecision.
"""

from __future__ import annotations

from pathlib import Path

from gearrattle.comparison.peers import MANY
from gearrattle.comparison.precision import WorkPrecision
from gearrattle.comparison.rows import Comparison
from gearrattle.plots.comparison import growth_of_errors, work_precision_chart
from gearrattle.report.comparison_tables import (
    coherence_table,
    cost_table,
    stability_table,
    statistics_tables,
    transmissibility_table,
    truth_table,
    verdict_table,
)
from gearrattle.report.page import Page, Section, fill_page
from gearrattle.report.saved import write_json
from gearrattle.wording import counted


def fill_comparison(comparison: Comparison, precision: WorkPrecision | None, folder: Path) -> None:
    """Write all files of a comparison into an existing folder."""
    fill_page(_page(comparison, precision), folder, "compare.html")
    content = {**comparison.to_dict(), "work_precision": None if precision is None else precision.to_dict()}
    write_json(content, folder / "compare.json", "comparison summary")


def _page(comparison: Comparison, precision: WorkPrecision | None) -> Page:
    labels = [row.label for row in comparison.rows[1:-1]]
    charts = [growth_of_errors(comparison)]
    if precision is not None:
        charts.append(work_precision_chart(precision, labels))
    recommendation = Section(
        "recommendation",
        "Recommendation",
        comparison.recommendation,
        (_setting(comparison),),
        tables=(verdict_table(comparison), cost_table(comparison), truth_table(comparison)),
    )
    figures = [Section(chart.key, chart.title, charts=(chart,)) for chart in charts]
    return Page(
        "comparison",
        comparison.model or "driveline",
        (recommendation, *figures, *_sections(comparison)),
        has_legends=False,
    )


def _setting(comparison: Comparison) -> str:
    horizon = comparison.horizon / comparison.period
    until = counted(horizon, "cycle") if horizon < comparison.cycles else "the end"
    return (
        f"{counted(comparison.cycles, 'cycle')}, {comparison.discard} of them discarded, "
        f"{counted(comparison.samples_per_cycle, 'sample')} a "
        f"cycle; tolerance {comparison.tolerance:.2g} where steps are chosen; reference: {comparison.reference}. "
        f"Predictable to {until}. No contender may take longer than {comparison.budget:g} s."
    )


def on_statistics(comparison: Comparison, *, found: bool) -> str:
    """What is known of statistics, and of how many contenders; nothing is said to agree that was not compared."""
    told = [row.statistics for row in comparison.rows[1:-1] if row.statistics is not None]
    motions = max((each.motions for each in told), default=0)
    if not any(each.decided for each in told):
        why = (
            f"time allowed for {motions} exact motions of {MANY}"
            if motions
            else "the runs are too short, or none ended"
        )
        return f"Nothing can be said of statistics: {why}."
    if found:
        return (
            "Beyond the predictability horizon two right motions differ sample by sample, but not in their statistics. "
            f"{motions} exact motions begun within a thousandth of a half-gap show what a right one may come to; these "
            "lie outside:"
        )
    return f"No statistic that was compared lies outside those of {motions} exact motions begun nearby."


def _sections(comparison: Comparison) -> list[Section]:
    different = tuple(statistics_tables(comparison))
    stability = stability_table(comparison)
    words_on_steps = (
        "Fixed steps can lie outside the method's stability region; chosen steps are kept inside by their error test."
    )
    return [
        *([Section("stability", "Stability", words=(words_on_steps,), tables=(stability,))] if stability.rows else []),
        Section(
            "statistics",
            "Statistics",
            words=(on_statistics(comparison, found=bool(different)),),
            tables=different,
        ),
        Section(
            "transmissibility",
            "Transmissibility",
            words=("How accuracy falls off away from the driving point.",),
            tables=(transmissibility_table(comparison),),
        ),
        Section(
            "coherence",
            "Coherence",
            words=(
                "The 1995 paper's index of agreement, with the coherence that chance gives and the ceiling that even "
                "the exact motion from nearby reaches.",
            ),
            tables=(coherence_table(comparison),),
        ),
    ]
