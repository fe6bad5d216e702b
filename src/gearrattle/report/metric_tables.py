"""Rattle metrics in tables, one per metric, with definition, window and source."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from gearrattle.quantities.event_metric import EventMetric
from gearrattle.quantities.quantity import Row
from gearrattle.quantities.quantity_table import METRICS
from gearrattle.report.tables import Table
from gearrattle.report.verdict_tables import errors_note, grid


def metric_tables(measured: Sequence[Row]) -> list[Table]:
    """Return one table per metric with values, and a last table with the reasons why other metrics have none."""
    metrics = {metric.name: metric for metric in (EventMetric(), *METRICS)}
    made = []
    lacking = []
    for name, group in groupby(measured, key=lambda row: row.name):
        rows = list(group)
        metric = metrics[name]
        if not rows[0].subject:
            lacking.append((metric.title, rows[0].note))
            continue
        note = (
            f"Definition: {metric.formula}. Over {metric.window}. Sampling: {metric.sampling}. Source: {metric.source}."
        )
        made.append(grid(rows, metric.title, " ".join([f"{note}{errors_note(rows)}", *_remarks(rows)])))
    if lacking:
        made.append(Table(("metric", "why not"), tuple(lacking), frozenset({0, 1}), "Not measured"))
    return made


def _remarks(rows: list[Row]) -> list[str]:
    return [f"{note[:1].upper()}{note[1:]}." for note in dict.fromkeys(row.note for row in rows if row.note)]
