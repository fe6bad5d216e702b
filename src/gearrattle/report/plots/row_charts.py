"""Charts of rows: a name on the left, its values as points on one x axis, the first row on top."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gearrattle.report.plots.chart import Chart, Key, Label, Line, Panel, Rule
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.palette import ACCENT, INK
from gearrattle.trajectory import Array
from gearrattle.wording import counted

MOST_ROWS = 40
ROW = 26
"""Height of a row [px]."""
_LONGEST_NAME = 44  # letters
_NAME_WIDTH = 0.014  # of a letter, as a share of the axis
_MARGIN = 0.05


@dataclass(frozen=True)
class Series:
    """Values of one kind, a row each.

    Attributes
    ----------
    values
        (N,); NaN draws nothing.
    low, high
        (N,) ends of an interval, drawn as a line; None draws none.
    """

    name: str
    values: Array
    colour: str = ACCENT
    low: Array | None = None
    high: Array | None = None


def row_chart(
    key: str,
    title: str,
    caption: str,
    names: Sequence[str],
    series: Sequence[Series],
    *,
    level: str,
    marks: Sequence[float] = (),
    log: bool = False,
) -> Chart | None:
    """Draw rows of points, the first 40 rows if there are more; None without a finite value.

    Vertical rules stand at ``marks``, which the axis reaches. On a logarithmic x axis what is not positive is left out.
    """
    # finite values of the rows that are drawn
    if log:
        series = [replace(one, values=np.where(one.values > 0.0, one.values, np.nan)) for one in series]
    shown = names[:MOST_ROWS]
    ends = [values[:MOST_ROWS] for one in series for values in (one.values, one.low, one.high) if values is not None]
    finite = np.concatenate([values[np.isfinite(values)] for values in ends]) if ends else np.zeros(0)
    if not finite.size:
        return None
    # intervals and points
    at = np.arange(len(shown), dtype=np.float64)[::-1]
    lines: list[Line] = []
    for one in series:
        if one.low is not None and one.high is not None:
            lines.append(interval_lines(one.low[:MOST_ROWS], one.high[:MOST_ROWS], at, f"interval {one.name}".strip()))
        values = one.values[:MOST_ROWS]
        there = np.isfinite(values)
        lines.append(Line(values[there], at[there], one.name or level, one.colour, mark="points", width=8.0))
    # axis, rules and names
    reach = _reach(np.concatenate([finite, marks]), log=log)
    rules = tuple(Rule(value, "x") for value in marks)
    panel = Panel("", "", level, tuple(lines), rules=rules, x_range=reach, y_range=(-0.6, len(shown) - 0.4), x_log=log)
    left_out = len(names) - len(shown)
    more = f" {counted(left_out, 'row')} more are in the table." if left_out else ""
    legend = tuple(Key(one.name, one.colour) for one in series if one.name)
    return Chart(
        key, title, caption + more, (with_names(panel, shown[::-1]),), panel_height=ROW * len(shown) + 14, legend=legend
    )


def interval_lines(low: Array, high: Array, at: Array, name: str) -> Line:
    """Level lines from low to high at the heights ``at``."""
    gap = np.full(at.size, np.nan)
    x, y = np.column_stack([low, high, gap]), np.column_stack([at, at, gap])
    return Line(x.ravel(), y.ravel(), name, INK, width=2.0)


def with_names(panel: Panel, names: Sequence[str]) -> Panel:
    """Write names at the left within a panel whose rows are 0, 1, ...; its x axis is widened for them."""
    assert panel.x_range is not None
    low, high = panel.x_range
    names = [name[-_LONGEST_NAME:] for name in names]
    share = _NAME_WIDTH * (max(map(len, names), default=0) + 2)
    if panel.x_log:
        left = low * (high / low) ** -share
        powers = range(int(np.ceil(np.log10(low) - 1e-9)), int(np.floor(np.log10(high) + 1e-9)) + 1)
        steps = [10.0**power for power in powers[:: max(1, -(-len(powers) // 5))]]
    else:
        left = low - share * (high - low)
        steps = _round(low, high)
    labels = tuple(Label(left, float(k), name, INK) for k, name in enumerate(names))
    ticks = tuple((value, numeral(value, 3)) for value in steps)
    return replace(panel, labels=labels, x_range=(left, high), x_ticks=ticks, y_ticks=((-9.0, ""),))


def _reach(values: Array, *, log: bool) -> tuple[float, float]:
    """Limits with a margin; whole decades of a logarithmic axis."""
    low = float(values.min())
    high = float(values.max())
    if log:
        bottom = np.floor(np.log10(low))
        top = np.ceil(np.log10(high))
        return float(10.0**bottom), float(10.0 ** max(top, bottom + 1.0))
    margin = _MARGIN * (high - low) or 0.5 * abs(high) or 1.0
    return low - margin, high + margin


def _round(low: float, high: float) -> list[float]:
    """Round values within a range, three to seven."""
    power = 10.0 ** np.floor(np.log10(high - low))
    for step in (5.0 * power, 2.0 * power, power, 0.5 * power, 0.2 * power, 0.1 * power):
        values = step * np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1)
        if values.size >= 3:
            return [float(f"{value:.12g}") for value in values]
    return []
