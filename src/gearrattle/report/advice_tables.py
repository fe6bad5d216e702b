"""The advice given before the run, and its forecasts compared with the run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from gearrattle.report.plots.numerals import numeral
from gearrattle.report.tables import Table

if TYPE_CHECKING:
    from gearrattle.advice import Forecast
    from gearrattle.pipeline import Findings


def scores_sentence(findings: Findings) -> str:
    """Return how many forecasts came true, by route."""
    routes = dict.fromkeys(score.forecast.by for score in findings.scores)
    scores = []
    for route in routes:
        mine = [score.right for score in findings.scores if score.forecast.by == route]
        scores.append(f"{sum(mine)} of {len(mine)} by {route}")
    return f"Forecasts that came true: {', '.join(scores)}." if scores else ""


def scores_table(findings: Findings) -> Table:
    """Return every forecast with the value in the run."""
    rows = tuple(
        (
            s.forecast.quantity,
            s.forecast.subject,
            s.forecast.by,
            value_words(s.forecast, s.forecast.value),
            value_words(s.forecast, s.happened),
            "right" if s.right else "wrong",
            s.rule,
        )
        for s in findings.scores
    )
    head = ("quantity", "of", "by", "forecast", "happened", "", "right if")
    return Table(head, rows, frozenset({0, 1, 2, 5, 6}))


def value_words(forecast: Forecast, value: float | str) -> str:
    """Write the value of a forecast, or the value in the run, with the unit of the forecast."""
    if isinstance(value, str):
        return value
    if math.isinf(value):
        return "to the end"
    return f"{numeral(value, 3)} {forecast.unit}".removesuffix(" 1").strip()
