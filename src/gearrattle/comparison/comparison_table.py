"""A comparison as a table: one line per contender, one column per number."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from gearrattle.comparison.comparison_rows import Comparison, Row

if TYPE_CHECKING:
    import pandas as pd

NAN = float("nan")


def coherence(row: Row) -> float:
    """The least kappa of any inertia; NaN without one."""
    return min(
        (estimate.mean for estimate in (row.coherence or {}).values() if not math.isnan(estimate.mean)), default=NAN
    )


def _decided(row: Row, count: str) -> float:
    """A count of statistics; NaN where nothing was decided, which is not the same as no difference."""
    return getattr(row.statistics, count) if row.statistics is not None and row.statistics.decided else NAN


COLUMNS: dict[str, tuple[str, Callable[[Row], Any]]] = {
    "verdict": ("", lambda row: row.verdict),
    "because": ("", lambda row: ", ".join(row.reasons)),
    "status": ("", lambda row: row.status),
    "average_step": ("s", lambda row: NAN if row.cost is None else row.cost.average_step),
    "average_trial_step": ("s", lambda row: NAN if row.cost is None else row.cost.average_trial_step),
    "smallest_step": (
        "s",
        lambda row: NAN if row.cost is None or row.cost.smallest_step is None else (row.cost.smallest_step),
    ),
    "steps": ("1", lambda row: NAN if row.cost is None else row.cost.steps),
    "rejected_steps": ("1", lambda row: NAN if row.cost is None else row.cost.rejected_steps),
    "function_calls": ("1", lambda row: NAN if row.cost is None else row.cost.function_calls),
    "jacobian_calls": ("1", lambda row: NAN if row.cost is None else row.cost.jacobian_calls),
    "wall_time": ("s", lambda row: NAN if row.cost is None else row.cost.wall_time),
    "growth": ("1", lambda row: NAN if row.growth is None else row.growth),
    "crossings": ("1", lambda row: NAN if row.cost is None else row.cost.events),
    "error": ("half-gaps", lambda row: NAN if row.error is None else row.error.worst),
    "wrong_from": ("s", lambda row: NAN if row.error is None else float(row.error.passed[-1])),
    "crossing_time_error": ("s", lambda row: NAN if row.crossings is None else row.crossings.total.largest),
    "missed_crossings": ("1", lambda row: NAN if row.crossings is None else row.crossings.total.missed),
    "invented_crossings": ("1", lambda row: NAN if row.crossings is None else row.crossings.total.invented),
    "missed_impacts": ("1", lambda row: NAN if row.impacts is None else row.impacts.total.missed),
    "invented_impacts": ("1", lambda row: NAN if row.impacts is None else row.impacts.total.invented),
    "statistics_different": ("1", lambda row: _decided(row, "different")),
    "different_by_chance": ("1", lambda row: _decided(row, "different_by_chance")),
    "coherence": ("1", coherence),
}
"""Name -> (unit, how it is read off a row). ``error`` is the largest of any deflection inside the window (without
clearances: of any velocity, over its rms); from
``wrong_from`` on it is more than a tenth; ``growth`` above 1: a step outside the stability region; ``coherence`` is the
least kappa of any inertia."""


def table_of(comparison: Comparison) -> pd.DataFrame:
    """One line a contender, by label."""
    import pandas as pd

    lines = {name: [read(row) for row in comparison.rows] for name, (_, read) in COLUMNS.items()}
    return pd.DataFrame(lines, index=pd.Index([row.label for row in comparison.rows], name="algorithm"))
