"""Numerical stiffness as figures: the spread of the eigenvalues, and R_lambda over contact ratios."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gearrattle.analysis.stiffness import Stiffness
from gearrattle.report.plots.chart import Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.palette import ACCENT, CENTRE, COLOURS, INK
from gearrattle.trajectory import Array

_MOST_LINES = 8


def eigenvalue_chart(stiffness: Stiffness) -> Chart | None:
    """Draw the magnitudes of the eigenvalues, ascending; None without an elastic mode."""
    # magnitudes above zero, ascending
    size = np.sort(np.abs(stiffness.eigenvalues))
    size = size[size > 0.0]
    if not size.size:
        return None
    number = np.arange(1.0, size.size + 1.0)
    dots = Line(number, size, "magnitude", ACCENT, mark="points", width=7.0)
    rules = (Rule(float(size[0])), Rule(float(size[-1])))
    panel = Panel(
        "magnitude",
        "1/s" if stiffness.model.units == "SI" else "",
        "eigenvalue, ascending",
        (dots,),
        rules=rules,
        x_range=(0.5, size.size + 0.5),
        y_range=_decades(size),
        y_log=True,
        x_ticks=_whole(size.size),
    )
    caption = (
        "Magnitudes of the eigenvalues with every clearance replaced by one slope, rigid motions left out. R_lambda is "
        "the largest over the smallest: the distance between the dashed rules."
    )
    return Chart("eigenvalues", "Eigenvalues", caption, (panel,), panel_height=220)


def ratio_chart(ratios: Sequence[float], r_lambda: Mapping[str, Sequence[float]]) -> Chart | None:
    """Draw R_lambda over the contact ratio of one element after the other; None without one."""
    shown = dict(list(r_lambda.items())[:_MOST_LINES])
    if not shown or len(ratios) < 2:
        return None
    x = np.array(ratios)
    colours = [*COLOURS, INK, CENTRE]
    lines = tuple(
        Line(x, np.array(values), name, colours[i % len(colours)], width=1.6)
        for i, (name, values) in enumerate(shown.items())
    )
    panel = Panel(
        "R_lambda",
        "",
        "contact ratio",
        lines,
        x_range=(float(x.min()), float(x.max())),
        y_log=True,
        y_range=_decades(np.concatenate([line.y for line in lines])),
    )
    more = len(r_lambda) - len(shown)
    caption = "R_lambda over the contact ratio of one element, all others in contact." + (
        f" {more} more are in the table." if more > 0 else ""
    )
    legend = tuple(Key(line.name, line.colour) for line in lines)
    return Chart("r_lambda", "R_lambda over contact ratios", caption, (panel,), panel_height=260, legend=legend)


def _decades(values: Array) -> tuple[float, float]:
    low = np.floor(np.log10(values.min() / 1.2))
    high = np.ceil(np.log10(values.max() * 1.2))
    return float(10.0**low), float(10.0 ** max(high, low + 1.0))


def _whole(count: int) -> tuple[tuple[float, str], ...]:
    step = max(1, -(-count // 16))
    return tuple((float(i), str(i)) for i in range(1, count + 1, step))
