"""The comparison as one page: the recommendation first, then the numbers and figures it follows from.

``fill_comparison`` writes compare.html, compare.json and figures/ into a folder. The page has no script and loads
nothing.

Takes a Comparison and, if there is one, a WorkPrecision.
"""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

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
from gearrattle.report.ink import fill_figures
from gearrattle.report.provenance import now, versions
from gearrattle.report.saved import write_json
from gearrattle.report.tables import Table
from gearrattle.report.templates import templates
from gearrattle.wording import counted

_HERE = Path(__file__).parent


@dataclass(frozen=True)
class Section:
    """A part of the page: heading, a sentence, tables."""

    key: str
    title: str
    words: str
    tables: tuple[Table, ...]


def fill_comparison(comparison: Comparison, precision: WorkPrecision | None, folder: Path) -> None:
    """Write all files of a comparison into an existing folder."""
    labels = [row.label for row in comparison.rows[1:-1]]
    charts = [growth_of_errors(comparison)]
    if precision is not None:
        charts.append(work_precision_chart(precision, labels))
    drawn = fill_figures(charts, folder, legend=False)
    environment = templates()
    page = environment.get_template("compare.html.j2").render(
        title=comparison.model or "driveline",
        recommendation=comparison.recommendation,
        setting=_setting(comparison),
        verdicts=verdict_table(comparison),
        cost=cost_table(comparison),
        truth=truth_table(comparison),
        figures=[(chart, f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}") for chart, svg in drawn],
        sections=_sections(comparison),
        created=now(),
        version=versions().get("gearrattle", ""),
        style=Markup((_HERE / "page.css").read_text(encoding="utf-8")),
    )
    (folder / "compare.html").write_text(page, encoding="utf-8")
    content = {**comparison.to_dict(), "work_precision": None if precision is None else precision.to_dict()}
    write_json(content, folder / "compare.json", "comparison summary")


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
        *([Section("stability", "Stability", words_on_steps, (stability,))] if stability.rows else []),
        Section("statistics", "Statistics", on_statistics(comparison, found=bool(different)), different),
        Section(
            "transmissibility", "Transmissibility",
            "How accuracy falls off away from the driving point.", (transmissibility_table(comparison),),
        ),
        Section(
            "coherence", "Coherence",
            "The 1995 paper's index of agreement, with the coherence that chance gives and the ceiling that even the "
            "exact motion from nearby reaches.", (coherence_table(comparison),),
        ),
    ]  # fmt: skip
