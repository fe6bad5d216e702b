"""Sweeps of a study: outputs and probabilities over one axis, one line per subject.

If other values scatter, the median is drawn, with thin lines for the 5 and 95 % quantiles.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.plots.axis_names import positions, title_of, words_of_axis
from gearrattle.report.plots.chart import Chart, Key, Line, Panel
from gearrattle.report.plots.palette import COLOURS
from gearrattle.studies.dataset_layout import (
    axes_in,
    chosen_codes,
    numbers_of,
    outputs_in,
    subject_of,
    units_of,
    values_of,
    words_of,
)
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.probability import rattle_probability
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

_MOST_LINES = 8
_MOST_PANELS = 8
_ROOM = 0.06


def output_sweep(data: xr.Dataset) -> Chart | None:
    """Draw every output of numbers over the one axis; None for more axes or none."""
    # outputs that are numbers, over one axis
    names = [name for name in outputs_in(data) if not words_of(data[name])][:_MOST_PANELS]
    if len(axes_in(data)) != 1 or not names:
        return None
    (axis,) = axes_in(data)
    panels: list[Panel] = []
    legend: dict[str, Key] = {}
    # curves of every subject, in a panel for every unit
    for name in names:
        by_unit: dict[str, list[Line]] = {}
        units = units_of(data, name)
        for subject, subject_values in subjects_of(numbers_of(values_of(data, name)), subject_of(data, name)):
            key = legend.setdefault(subject or name, Key(subject or name, COLOURS[len(legend) % len(COLOURS)]))
            by_unit.setdefault(units[subject], []).extend(
                Line(np.zeros(0), curve, key.name, key.colour, width=width)
                for curve, width in _curves(subject_values, axis)
            )
        panels += [_panel(data, axis, (name, unit), lines) for unit, lines in by_unit.items()]
    # caption and legend
    over = " Thick: the median over the samples; thin: 5 and 95 %." if SAMPLE in data.dims else ""
    caption = f"Outputs over {words_of_axis(data, axis)}.{over}"
    return Chart(
        "sweep",
        "Outputs",
        caption,
        tuple(panels),
        columns=min(2, len(panels)),
        panel_height=200,
        share_x=False,
        legend=tuple(legend.values()),
    )


def probability_sweep(data: xr.Dataset) -> Chart | None:
    """Draw the share of samples that rattle over the one axis, with its interval; None without samples or codes."""
    output = chosen_codes(data)
    if len(axes_in(data)) != 1 or SAMPLE not in data.dims or not output:
        return None
    (axis,) = axes_in(data)
    probability = rattle_probability(data, output)
    subject = subject_of(data, output)
    if subject and not probability.sizes[subject]:
        return None
    lines: list[Line] = []
    legend = []
    for i, (name, _) in enumerate(subjects_of(probability["probability"], subject)):
        key = Key(name or output, COLOURS[i % len(COLOURS)])
        legend.append(key)
        for quantity, width in (("probability", 2.0), ("low", 0.8), ("high", 0.8)):
            curve = dict(subjects_of(probability[quantity], subject))[name].values
            lines.append(Line(np.zeros(0), curve, key.name, key.colour, width=width))
    panel = replace(_panel(data, axis, ("Share of samples that rattle", ""), lines), y_range=(-0.03, 1.03))
    over = words_of_axis(data, axis)
    caption = f"Thick: share of samples in which a part rattles over {over}; thin: Wilson's 95 % interval."
    return Chart("probability", "Probability of rattle", caption, (panel,), panel_height=240, legend=tuple(legend))


def subjects_of(values: xr.DataArray, subject: str) -> list[tuple[str, xr.DataArray]]:
    """Return an output for every subject, the first few of them; one without a name if it has none."""
    if not subject:
        return [("", values)]
    return [(str(name), values.sel({subject: name})) for name in values[subject].values[:_MOST_LINES]]


def _curves(values: xr.DataArray, axis: str) -> list[tuple[Array, float]]:
    """Curves over the axis, and how thick they are."""
    if SAMPLE not in values.dims:
        return [(np.asarray(values.values), 1.6)]
    samples = values.transpose(axis, SAMPLE).values
    quantiles = [np.array([_quantile(row, share) for row in samples]) for share in (0.5, 0.05, 0.95)]
    return list(zip(quantiles, (2.0, 0.8, 0.8), strict=True))


def _quantile(row: Array, share: float) -> float:
    there = row[np.isfinite(row)]
    return float(np.quantile(there, share)) if there.size else float("nan")


def _panel(data: xr.Dataset, axis: str, title: tuple[str, str], curves: list[Line]) -> Panel:
    """Curves at the axis' positions, with their points where there are few."""
    # lines between numbers; values that are words have points
    x, log, ticks = positions(data, axis)
    joined = np.asarray(data[axis].values).dtype.kind in "iuf"  # nothing lies between two words
    lines = [
        Line(x, c.y, c.name, c.colour, "line" if joined else "points", c.width if joined else 3.0 * c.width)
        for c in curves
    ]
    # points on thick lines of few values
    if x.size <= 40:
        lines += [
            Line(x, line.y, line.name, line.colour, "points", 5.0) for line in lines if joined and line.width > 1.0
        ]
    # limits
    finite = np.concatenate([line.y[np.isfinite(line.y)] for line in lines] or [np.zeros(0)])
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    room = _ROOM * (high - low) or 0.5 * (abs(high) or 1.0)
    name, unit = title
    margin = 0.02 * (float(x[-1] - x[0]) or 1.0)
    ends = (float(x[0]) * 0.97, float(x[-1]) * 1.03) if log else (float(x[0]) - margin, float(x[-1]) + margin)
    return Panel(
        name[:1].upper() + name[1:],
        unit,
        title_of(data, axis),
        tuple(lines),
        x_range=ends,
        y_range=(low - room, high + room),
        x_log=log,
        x_ticks=ticks,
    )
