"""The report of a run: the verdict first, then figures, modes, criteria, metrics, the model and the cost."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from gearrattle.model import Model
from gearrattle.pipeline import Findings
from gearrattle.quantities.verdict import Verdict
from gearrattle.report.advice_tables import scores_sentence, scores_table
from gearrattle.report.energy_table import energy_table
from gearrattle.report.event_tables import EVENT_HEADLINES, peak_torques
from gearrattle.report.linear_tables import modes_tables, rest_table
from gearrattle.report.metric_tables import metric_tables
from gearrattle.report.model_tables import cost_table, model_tables, versions_table
from gearrattle.report.numbers import write_csv
from gearrattle.report.page import Page, Section, figure_sections, notes_section
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.run_figures import charts
from gearrattle.report.plots.sketch import sketch
from gearrattle.report.plots.verdict_figures import verdict_charts
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import number_columns, records_dataset
from gearrattle.report.reliability import trust
from gearrattle.report.summary import findings_content
from gearrattle.report.tables import Table
from gearrattle.report.verdict_tables import criteria_tables, parts_table, tiles, verdict_table

if TYPE_CHECKING:
    import xarray as xr

_LONGEST_TEXT = 200_000

HEADLINES = {
    "quiet": "Quiet",
    "touches": "Touches, no rattle",
    "single-sided": "Single-sided rattle",
    "double-sided": "Double-sided rattle",
}


def headline_words(verdict: Verdict) -> str:
    """Return the headline of a verdict for a page."""
    words = HEADLINES if verdict.event is None else EVENT_HEADLINES
    return words[verdict.headline]


class RunReport(Presentation[Findings]):
    """The whole procedure: verdict, advice, figures, modes, criteria, metrics, model and cost."""

    kind = "run"
    is_interactive = True

    @property
    def title(self) -> str:
        return self.result.model.name or "Driveline"

    @property
    def sentence(self) -> str:
        return str(self.result.verdict)

    @property
    def further(self) -> tuple[str, ...]:
        return () if self.result.cause is None else (self.result.cause.sentence,)

    @property
    def notes(self) -> tuple[str, ...]:
        return self.result.notes

    def sections(self) -> tuple[Section, ...]:
        return _sections(self.result)

    def charts(self) -> list[Chart]:
        return charts(self.result)

    def answer(self) -> tuple[Table, ...]:
        return (verdict_table(self.result.verdict), *_peaks(self.result))

    def content(self) -> dict[str, Any]:
        return findings_content(self.result)

    def numbers(self) -> xr.Dataset:
        return self.result.motion.data

    def write(self, path: Path) -> None:
        self.result.motion.write(path)

    def page(self) -> Page:
        findings = self.result
        values = {
            "findings": findings,
            "headline": headline_words(findings.verdict),
            "tiles": tiles(findings),
            "parts": parts_table(findings),
            "scores": replace(scores_table(findings), title=scores_sentence(findings)),
            "sketch": Markup(sketch(findings)),
            "trust": trust(findings),
            "notes": self.notes,
        }
        return replace(super().page(), template="run_report.html.j2", values=values)


class VerdictReport(Presentation[Verdict]):
    """The verdict alone: parts, and every value of every criterion."""

    kind = "verdict"

    @property
    def title(self) -> str:
        return "Verdict"

    @property
    def sentence(self) -> str:
        return str(self.result)

    def sections(self) -> tuple[Section, ...]:
        verdict = self.result
        summary = Section("verdict", "Verdict", self.sentence, (verdict.rule,), tables=self.answer())
        values = Section("criteria", "Criteria", tables=tuple(criteria_tables(verdict)), folds=True)
        figures = figure_sections(verdict_charts(verdict))
        return summary, *figures, values, *notes_section(self.notes)

    def answer(self) -> tuple[Table, ...]:
        return (verdict_table(self.result),)

    def content(self) -> dict[str, Any]:
        return self.result.to_dict()

    def numbers(self) -> xr.Dataset:
        return self._entries().merge(records_dataset(self.result.parts, "part", prefix="part_"))

    def write(self, path: Path) -> None:
        """Write all numbers, or as CSV a row for every entry."""
        if path.suffix == ".csv":
            write_csv(self._entries(), path)
        else:
            super().write(path)

    def _entries(self) -> xr.Dataset:
        """Return every entry: its number, or its word."""
        entries = records_dataset([row.table_row("criterion") for row in self.result.entries], "entry")
        values = [entry.value for entry in self.result.entries]
        return entries.assign(number_columns("value", "word", values, "entry"))


def _peaks(findings: Findings) -> tuple[Table, ...]:
    """The peak torques of a transient."""
    event = findings.verdict.event
    return () if event is None else (peak_torques(event),)


def _sections(findings: Findings) -> tuple[Section, ...]:
    groups = groupby(charts(findings), key=lambda chart: chart.group or chart.key)
    energy = energy_table(findings)
    computation = (cost_table(findings), *([energy] if energy else []), versions_table())
    modes = (rest_table(findings), *modes_tables(findings))
    model_file = ("The model file, with the settings of this run", _model_text(findings.motion.model))
    figures = [(key, tuple(group)) for key, group in groups]
    peaks = _peaks(findings)
    return (
        *([Section("event", "Peak torques", tables=peaks)] if peaks else []),
        *(Section(key, group[0].title, charts=group) for key, group in figures),
        Section("linear", "Modes", tables=modes, in_columns=True),
        *_measured(findings, is_event=bool(peaks)),
        Section("model", "Model", tables=tuple(model_tables(findings)), text=model_file),
        Section("computation", "Computation", tables=computation, in_columns=True),
    )


def _measured(findings: Findings, *, is_event: bool) -> list[Section]:
    """Criteria and metrics; for an event only metrics, because criteria are averages over cycles."""
    criteria = Section("criteria", "Criteria", tables=tuple(criteria_tables(findings.verdict)), folds=True)
    metrics = Section("metrics", "Metrics", tables=tuple(metric_tables(findings.metrics)), folds=True)
    return [metrics] if is_event else [criteria, metrics]


def _model_text(model: Model) -> str:
    """Return the model file; it has digests instead of the points of long records."""
    text = model.to_toml()
    return text if len(text) <= _LONGEST_TEXT else model.to_stored()[0]
