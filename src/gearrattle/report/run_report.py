"""The report of a run: the verdict first, then figures, modes, criteria, metrics, the model and what it cost.

Takes Findings; gives a Page.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

from markupsafe import Markup

from gearrattle.model import Model
from gearrattle.pipeline import Findings
from gearrattle.plots.sketch import sketch
from gearrattle.report.advice_tables import scores_sentence, scores_table
from gearrattle.report.drawn import charts_of
from gearrattle.report.energy_table import energy_table
from gearrattle.report.linear_tables import modes_tables, rest_table
from gearrattle.report.metric_tables import metric_tables
from gearrattle.report.model_tables import cost_table, model_tables, versions_table
from gearrattle.report.page import Page, Section
from gearrattle.report.summary import notes
from gearrattle.report.trust import trust
from gearrattle.report.verdict_tables import criteria_tables, parts_table, tiles

_LONGEST_TEXT = 200_000

_HEADLINES = {
    "quiet": "Quiet",
    "single-sided": "Single-sided rattle",
    "double-sided": "Double-sided rattle",
}


def run_report(findings: Findings) -> Page:
    """Return the report of a run."""
    values = {
        "findings": findings,
        "headline": _HEADLINES[findings.verdict.verdict],
        "tiles": tiles(findings),
        "parts": parts_table(findings),
        "scores": replace(scores_table(findings), title=scores_sentence(findings)),
        "sketch": Markup(sketch(findings)),
        "trust": trust(findings),
        "notes": notes(findings),
    }
    return Page(
        "report",
        findings.model.name or "Driveline",
        _sections(findings),
        is_interactive=True,
        template="run_report.html.j2",
        values=values,
        has_legends=False,
    )


def _sections(findings: Findings) -> tuple[Section, ...]:
    groups = groupby(charts_of(findings), key=lambda chart: chart.group or chart.key)
    energy = energy_table(findings)
    computation = (cost_table(findings), *([energy] if energy else []), versions_table())
    modes = (rest_table(findings), *modes_tables(findings))
    model_file = ("The model file, with the settings of this run", _model_text(findings.run.model))
    figures = [(key, tuple(charts)) for key, charts in groups]
    return (
        *(Section(key, charts[0].title, charts=charts) for key, charts in figures),
        Section("linear", "Modes", tables=modes, in_columns=True),
        Section("criteria", "Criteria", tables=tuple(criteria_tables(findings)), folds=True),
        Section("metrics", "Metrics", tables=tuple(metric_tables(findings)), folds=True),
        Section("model", "Model", tables=tuple(model_tables(findings)), text=model_file),
        Section("computation", "Computation", tables=computation, in_columns=True),
    )


def _model_text(model: Model) -> str:
    """Return the model file; the points of a long record are only named."""
    text = model.to_toml()
    return text if len(text) <= _LONGEST_TEXT else model.to_stored()[0]
