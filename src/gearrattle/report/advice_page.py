"""Advice as a result: steps before simulating, their evidence, and a forecast of the run."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gearrattle.advice import Advice
from gearrattle.advice.clearance_advice import LISTED
from gearrattle.report.advice_tables import value_words
from gearrattle.report.numbers import Arrays
from gearrattle.report.page import Section
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.row_charts import Series, row_chart
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import number_columns, record_columns, texts
from gearrattle.report.tables import Table
from gearrattle.wording import counted


class AdvicePage(Presentation[Advice]):
    """Presentation of the advice before a simulation."""

    kind = "advice"

    @property
    def title(self) -> str:
        return self.result.model or "driveline"

    @property
    def sentence(self) -> str:
        topics = counted(len(self.result.lines), "piece of advice", "pieces of advice")
        return f"{topics}, and {counted(len(self.result.forecasts), 'forecast')} that a run will settle."

    def sections(self) -> tuple[Section, ...]:
        forecasts = self._forecasts()
        return (
            Section("advice", "Advice", self.sentence, tables=self.answer()),
            Section("forecasts", "Forecasts", tables=(forecasts,), charts=tuple(self.figures())),
        )

    def figures(self) -> list[Chart]:
        """Draw the mean slopes forecast."""
        slopes = {
            forecast.subject: forecast.value
            for forecast in self.result.forecasts
            if forecast.quantity == "mean slope" and not isinstance(forecast.value, str)
        }
        chart = row_chart(
            "mean_slopes",
            "Mean slopes forecast",
            "Share of its last slope that a clearance works with on average: 0 is always free, 1 always in contact.",
            list(slopes),
            [Series("", np.array(list(slopes.values())))],
            level="mean slope",
            marks=[0.0, 1.0],
        )
        return [] if chart is None else [chart]

    def answer(self) -> tuple[Table, ...]:
        rows: list[tuple[str, ...]] = []
        for line in self.result.lines:
            rows += [(line.topic, line.words), *(("", f"- {evidence}") for evidence in line.evidence)]
        lines = Table(("topic", "advice, and its evidence"), tuple(rows), frozenset({0, 1}))
        clearances = self._clearances()
        return (lines, clearances) if len(clearances.rows) > LISTED else (lines,)

    def content(self) -> dict[str, Any]:
        return self.result.to_dict()

    def numbers(self) -> Arrays:
        advice = self.result
        forecasts = record_columns(advice.forecasts, "forecast", names=("quantity", "subject", "by", "unit"))
        lines = {
            "topic": ("line", texts(line.topic for line in advice.lines)),
            "advice": ("line", texts(line.words for line in advice.lines)),
            "evidence": ("line", texts("\n".join(line.evidence) for line in advice.lines)),
            **number_columns("value", "word", [forecast.value for forecast in advice.forecasts], "forecast"),
        }
        return Arrays({**forecasts, **lines}, attributes={"model": advice.model})

    def _clearances(self) -> Table:
        """One row per clearance, if they are too many for a line: regime, mean slope, forecast of linear response."""
        columns: dict[str, dict[str, str]] = {"regime": {}, "mean slope": {}, "corners": {}}
        for forecast in self.result.forecasts:
            value = forecast.value
            shown = value if isinstance(value, str) else "–" if math.isnan(value) else numeral(value, 3)
            columns.get(forecast.quantity, {})[forecast.subject] = shown
        rows = [
            (name, regime, columns["mean slope"].get(name, "–"), columns["corners"].get(name, "–"))
            for name, regime in columns["regime"].items()
        ]
        head = ("clearance", "in the pilot", "mean slope", "corners by linear response")
        return Table(head, tuple(rows), frozenset({0, 1, 3}), "Clearances")

    def _forecasts(self) -> Table:
        rows = tuple((f.quantity, f.subject, f.by, value_words(f, f.value)) for f in self.result.forecasts)
        return Table(("quantity", "of", "by", "forecast"), rows, frozenset({0, 1, 2}))
