"""The report as one page that needs nothing else: no network, no folder beside it.

Every figure is in the page twice: as ink (SVG), which is shown without JavaScript and printed, and as data that
plotly.js, inlined once, turns into an interactive plot when it scrolls into view. The page forbids itself to load
anything from elsewhere.

Takes Findings and their drawn charts; gives HTML.
"""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from markupsafe import Markup, escape

from gearrattle.model import Model
from gearrattle.pipeline import Findings
from gearrattle.plots.chart import Chart
from gearrattle.plots.sketch import sketch
from gearrattle.report.advice_tables import scores_sentence, scores_table
from gearrattle.report.energy_table import energy_table
from gearrattle.report.linear_tables import modes_tables, rest_table
from gearrattle.report.live_figures import figure_of, page_script, plotly_script
from gearrattle.report.metric_tables import metric_tables
from gearrattle.report.model_tables import cost_table, model_tables, versions_table
from gearrattle.report.provenance import now, versions
from gearrattle.report.summary import notes
from gearrattle.report.templates import templates
from gearrattle.report.trust import trust
from gearrattle.report.verdict_tables import criteria_tables, parts_table, tiles
from gearrattle.wording import counted

_HERE = Path(__file__).parent
_LONGEST_TEXT = 200_000

_HEADLINES = {
    "quiet": "Quiet",
    "single-sided": "Single-sided rattle",
    "double-sided": "Double-sided rattle",
}


def page(findings: Findings, drawn: list[tuple[Chart, bytes]]) -> str:
    """Build the report.

    Args:
        findings: what the pipeline found.
        drawn: every chart with its SVG, in reading order.

    Returns:
        A complete HTML document.
    """
    figures = [figure_of(chart, svg) for chart, svg in drawn]
    sections = [list(group) for _, group in groupby(figures, key=lambda figure: figure.chart.group or figure.chart.key)]
    environment = templates()
    return environment.get_template("page.html.j2").render(
        findings=findings,
        counted=counted,
        headline=_HEADLINES[findings.verdict.verdict],
        tiles=tiles(findings),
        parts=parts_table(findings),
        scored=scores_sentence(findings),
        scores=scores_table(findings),
        sketch=Markup(sketch(findings)),
        sections=sections,
        rest=rest_table(findings),
        modes=modes_tables(findings),
        criteria=criteria_tables(findings),
        metrics=metric_tables(findings),
        model_tables=model_tables(findings),
        model_text=escape(_model_text(findings.run.model)),  # to be copied as it is
        cost=cost_table(findings),
        energy=energy_table(findings),
        versions=versions_table(),
        trust=trust(findings),
        notes=notes(findings),
        created=now(),
        version=versions().get("gearrattle", ""),
        style=Markup((_HERE / "page.css").read_text(encoding="utf-8")),
        script=page_script(),
        plotly=plotly_script(),
    )


def _model_text(model: Model) -> str:
    """Return the model file; the points of a long record are only named."""
    text = model.to_toml()
    return text if len(text) <= _LONGEST_TEXT else model.to_stored()[0]
