"""Rattle metrics as a result: one row per value, and the figure of all of them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from gearrattle.json_types import json_value
from gearrattle.quantities.quantity import Row
from gearrattle.report.metric_tables import metric_tables
from gearrattle.report.page import Section, figure_sections, notes_section
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.metric_figures import metrics_chart
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import records_dataset
from gearrattle.report.tables import Table
from gearrattle.wording import counted

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


class MetricsPage(Presentation["pd.DataFrame"]):
    """Presentation of the metrics of a run or a recording."""

    kind = "metrics"
    is_data = True

    def __init__(self, result: pd.DataFrame | xr.Dataset) -> None:
        """Present a table of metrics, or the Dataset that it was saved as."""
        import pandas as pd

        table = result if isinstance(result, pd.DataFrame) else _table(result)
        super().__init__(table)
        records = [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]
        self.rows = [Row(record.pop("metric"), formula="", **record) for record in records]

    @property
    def title(self) -> str:
        return "Rattle metrics"

    @property
    def sentence(self) -> str:
        measured = [row for row in self.rows if row.subject]
        metrics = len({row.name for row in measured})
        lacking = len({row.name for row in self.rows if not row.subject})
        also = f"; {counted(lacking, 'metric')} could not be measured" if lacking else ""
        return f"{counted(len(measured), 'value')} of {counted(metrics, 'metric')}{also}."

    @property
    def notes(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys([*super().notes, *(row.note for row in self.rows if row.note)]))

    def sections(self) -> tuple[Section, ...]:
        figures = figure_sections(self.charts())
        tables = Section("metrics", "Metrics", tables=tuple(metric_tables(self.rows)))
        return Section("summary", "Summary", self.sentence), *figures, tables, *notes_section(self.notes)

    def charts(self) -> list[Chart]:
        chart = metrics_chart(self.rows)
        return [] if chart is None else [chart]

    def answer(self) -> tuple[Table, ...]:
        rows = [
            (
                row.name,
                row.subject,
                row.quantity,
                f"{row.value:.6g} {row.unit}".removesuffix(" 1"),
                _error(row.error, row.value),
            )
            for row in self.rows
            if row.subject
        ]
        head = ("metric", "subject", "quantity", "value", "error of sampling")
        return (Table(head, tuple(rows), frozenset({0, 1, 2})),)

    def content(self) -> dict[str, Any]:
        return {"metrics": json_value(self.result.to_dict("records"))}

    def numbers(self) -> xr.Dataset:
        return records_dataset([row.table_row("metric") for row in self.rows], "row").assign_attrs(
            notes="\n".join(super().notes)
        )


def _table(data: xr.Dataset) -> pd.DataFrame:
    """Return the table that a Dataset was made from."""
    table = data.to_dataframe().reset_index(drop=True)
    table.attrs = {"notes": str(data.attrs["notes"]).splitlines()}
    return table


def _error(error: float, value: float) -> str:
    """Return an estimated error in words: empty for an exact value, a question mark without an estimate."""
    if math.isnan(value):
        return ""
    return "none" if error == 0.0 else "?" if math.isnan(error) else f"± {error:.2g}"
