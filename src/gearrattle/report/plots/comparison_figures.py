"""Figures of a comparison: growth of errors along the motion, and work over precision.

Colours are in the order of the rows; the exact solution is drawn in black.
"""

from __future__ import annotations

import numpy as np

from gearrattle.comparison.comparison_rows import Comparison
from gearrattle.comparison.precision import Curve, WorkPrecision
from gearrattle.report.plots.chart import Band, Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.palette import CENTRE, COLOURS, INK, MUTED
from gearrattle.wording import counted

_FLOOR = 1e-16
_LOST = 1e-3  # half-gaps: when an error has grown from 1e-12 to this size, the motion is not predictable


def colours(labels: list[str]) -> dict[str, str]:
    """Return a colour for every label, the same in every figure of one comparison."""
    return {label: COLOURS[i % len(COLOURS)] for i, label in enumerate(labels)}


def growth_of_errors(comparison: Comparison) -> Chart:
    """Draw the largest error over time, of every algorithm and of the exact motion that begins 1e-12 half-gaps away.

    If the motion is not predictable to its end, the axis ends soon after the last error is saturated
    (``shown_until``), because errors do not grow further.
    """
    # errors over cycles, the exact motion begun nearby in black
    *others, away = comparison.rows[1:]
    colour = {**colours([row.label for row in others]), away.label: INK}
    lines = tuple(
        Line(row.history[0] / comparison.period, np.maximum(row.history[1], _FLOOR), row.label, colour[row.label])
        for row in comparison.rows[1:]
        if row.history is not None
    )
    # window of the comparison and horizon of predictability
    end = shown_until(comparison)
    rules = [Rule(comparison.window / comparison.period, "x", MUTED, label="window")]
    if comparison.horizon < end * comparison.period:
        rules.append(Rule(comparison.horizon / comparison.period, "x", MUTED, label="horizon"))
    # logarithmic axis from rounding to the largest error
    largest = max([1.0, *(float(np.max(line.y[np.isfinite(line.y)], initial=0.0)) for line in lines)])
    unit = next((row.error.unit for row in comparison.rows if row.error is not None), "")
    panel = Panel(
        "Largest error",
        unit,
        "cycles, t / T",
        lines,
        rules=tuple(rules),
        bands=(Band(0.1, None, CENTRE),),
        x_range=(0.0, float(end)),
        y_range=(1e-16, 10.0 * largest),
        y_log=True,
    )
    # caption and legend
    caption = (
        "How far each motion is from the exact one; shaded: wrong by more than a tenth. The exact "
        "motion begun 1e-12 half-gaps away is one of them, which no algorithm can be expected to beat. Errors are "
        "compared within the window; beyond the horizon only statistics are."
    )
    if end < comparison.cycles:
        caption += f" Of {counted(comparison.cycles, 'cycle')} the first {end:g} are shown: "
        caption += "all errors are saturated later."
    legend = tuple(Key(line.name, line.colour) for line in lines)
    return Chart("errors", "Growth of errors", caption, (panel,), panel_height=300, legend=legend)


def shown_until(comparison: Comparison) -> float:
    """Return the cycle up to which errors are drawn: 1.25 times the cycle at which the last error is saturated.

    An error is saturated when it first exceeds a tenth of its largest value. If the error of the exact motion that
    begins nearby stays below ``_LOST``, errors are drawn to the end.
    """
    histories = [row.history for row in comparison.rows[1:] if row.history is not None]
    largest = [float(np.max(worst[np.isfinite(worst)], initial=0.0)) for _, worst in histories]
    if comparison.rows[-1].history is None or largest[-1] < _LOST:
        return float(comparison.cycles)
    saturated = [
        float(time[np.argmax(worst >= 0.1 * most)])
        for (time, worst), most in zip(histories, largest, strict=True)
        if most >= _LOST
    ]
    return float(min(comparison.cycles, np.ceil(1.25 * max(comparison.horizon, *saturated) / comparison.period)))


def work_precision_chart(work_precision: WorkPrecision, labels: list[str]) -> Chart:
    """Draw error against function calls and against time; ``labels`` fix the colours."""
    colour = colours(labels)
    curves = [curve for curve in work_precision.curves if curve.points]
    legend = (*(Key(curve.algorithm, colour[curve.algorithm]) for curve in curves), Key("exact (bound)", INK))
    panels = tuple(
        _panel(work_precision, curves, colour, quantity, title)
        for quantity, title in (("function_calls", "function calls"), ("wall_time", "computing time, s"))
    )
    caption = (
        f"Largest error over the first {counted(work_precision.cycles, 'cycle')} (errors up to the window's end), for "
        "tolerances from 1e-3 to 1e-11, or steps from four times the default down. Down and to the left is better. "
        "The exact solution has nothing to choose: one point."
    )
    return Chart(
        "work-precision",
        "Work and precision",
        caption,
        panels,
        columns=2,
        panel_height=320,
        share_x=False,
        legend=legend,
    )


def _panel(
    work_precision: WorkPrecision, curves: list[Curve], colour: dict[str, str], quantity: str, title: str
) -> Panel:
    # error over work of every algorithm
    lines = []
    for curve in curves:
        x = np.array([getattr(point, quantity) for point in curve.points], dtype=float)
        y = np.maximum([point.error for point in curve.points], _FLOOR)
        lines.append(Line(x, y, curve.algorithm, colour[curve.algorithm]))
        lines.append(Line(x, y, curve.algorithm, colour[curve.algorithm], mark="points", width=5.0))
    # the bound of the exact solution: one point
    exact = (
        np.array([float(getattr(work_precision.exact, quantity))]),
        np.array([max(work_precision.exact.error, _FLOOR)]),
    )
    lines.append(Line(*exact, "exact (bound)", INK, mark="points", width=9.0))
    xs = np.concatenate([line.x for line in lines])
    ys = np.concatenate([line.y for line in lines])
    ys = ys[np.isfinite(ys)]
    return Panel(
        "Error",
        work_precision.unit,
        title,
        tuple(lines),
        x_range=_decades(xs),
        y_range=_decades(ys),
        x_log=True,
        y_log=True,
    )


def _decades(values: np.ndarray) -> tuple[float, float]:
    return float(10.0 ** np.floor(np.log10(values.min()))), float(10.0 ** np.ceil(np.log10(values.max())))
