"""Samples of a study: probabilities of rattle, the spread of outputs, and rank regression coefficients (tornado)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.plots.axis_names import measure_of
from gearrattle.report.plots.chart import Bars, Cells, Chart, Key, Label, Panel, Rule
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.palette import ACCENT, CENTRE, COAST, DRIVE, INK, REGIMES
from gearrattle.report.plots.row_charts import interval_lines
from gearrattle.report.plots.study_sweep_figures import subjects_of
from gearrattle.studies.dataset_layout import (
    axes_in,
    chosen_codes,
    has_probabilities,
    numbers_of,
    outputs_in,
    sampling_of,
    scattered,
    subject_of,
    units_of,
    values_of,
    words_of,
)
from gearrattle.studies.designs import PAIRS, SALTELLI
from gearrattle.studies.probability import rattle_probability
from gearrattle.studies.sensitivity import sensitivities
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

_MOST_PANELS = 8
_MOST_VALUES = 12
_ROW = 24
_NAMES = 1.9  # room for names left of the bars, in units of a correlation


def probability_bars(data: xr.Dataset) -> Chart | None:
    """Draw the share of samples in which a part rattles, one row per part, with its interval."""
    output = chosen_codes(data)
    return bars_of_probability(rattle_probability(data, output)) if _alone(data) and output else None


def bars_of_probability(dataset: xr.Dataset) -> Chart | None:
    """Draw what ``rattle_probability`` found over samples alone; None without a part that can separate."""
    output = str(dataset.attrs["output"])
    subject = str(dataset.attrs["subject"])
    share, low, high = (np.atleast_1d(dataset[name].values) for name in ("probability", "low", "high"))
    names = [str(name) for name in dataset[subject].values] if subject else [output]
    if not names:
        return None
    rows = np.arange(len(names), dtype=np.float64)[::-1]
    bars = Cells(np.zeros(len(rows)), np.nan_to_num(share), rows - 0.3, rows + 0.3, "share", REGIMES["double-sided"])
    whiskers = interval_lines(low, high, rows, "95 % interval")
    panel = Panel(
        "Share of samples that rattle",
        "",
        cells=(bars,),
        lines=(whiskers,),
        x_range=(0.0, 1.0),
        y_range=(-0.6, len(rows) - 0.4),
        x_ticks=tuple((v / 5, f"{20 * v} %") for v in range(6)),
        y_ticks=tuple((float(row), name[:10]) for row, name in zip(rows, names, strict=True)),
    )
    caption = "Share of samples in which a part rattles; the line is Wilson's 95 % interval."
    return Chart("probability", "Probability of rattle", caption, (panel,), panel_height=30 * len(names) + 10)


def histograms(data: xr.Dataset) -> Chart | None:
    """Draw how every output of numbers scatters, one panel per output and subject; those that do not are left out."""
    if not _alone(data):
        return None
    panels = []
    for name in (name for name in outputs_in(data) if not words_of(data[name])):
        units = units_of(data, name)
        for subject, values in subjects_of(numbers_of(values_of(data, name)), subject_of(data, name)):
            there = values.values[np.isfinite(values.values)]
            if there.size > 1 and np.ptp(there) > 0.0:
                count, edges = np.histogram(there, bins=_bins(there))
                bars = Bars(edges, 100.0 * count / there.size, "share of samples", ACCENT)
                level = f"{name}, {units[subject]}" if units[subject] else name
                panels.append(Panel(subject or name, "% of samples", level, bars=(bars,)))
    if not panels:
        return None
    shown = tuple(panels[:_MOST_PANELS])
    caption = f"Share of samples by value.{_not_drawn(len(panels))}"
    return Chart(
        "histograms",
        "Scatter of the outputs",
        caption,
        shown,
        columns=min(2, len(shown)),
        panel_height=170,
        share_x=False,
    )


def tornado(data: xr.Dataset) -> Chart | None:
    """Draw rank regression coefficients, the largest on top, one panel per output and subject that vary.

    None for Saltelli's samples, whose indices tell more.
    """
    if not _alone(data) or sampling_of(data) in (SALTELLI, PAIRS):
        return None
    panels = []
    for name in outputs_in(data):
        panels += tornado_panels(sensitivities(data, name), data)
    return tornado_chart(panels, len(scattered(data)))


def tornado_panels(dataset: xr.Dataset, measured: xr.Dataset) -> list[Panel]:
    """Draw rank regression coefficients of one output, one panel per subject that varies.

    ``measured`` holds the values that scatter, with their words and units.
    """
    subject = str(dataset.attrs["subject"])
    output = str(dataset.attrs["output"])
    panels = []
    for part, coefficients in subjects_of(dataset["rank_regression"], subject):
        one = dataset.sel({subject: part}) if subject else dataset
        if np.isfinite(coefficients.values).any():
            panels.append(_tornado(f"{part}: {output}" if part else output, one, measured))
    return panels


def tornado_chart(panels: list[Panel], values: int) -> Chart | None:
    """Return the chart of ``tornado_panels``, whose bars are so many values; None without panels."""
    if not panels:
        return None
    count = min(values, _MOST_VALUES)
    caption = (
        "How each output follows the values that scatter: coefficients of the standardised ranks, the strongest on "
        "top; S is the share of the variance that a value alone explains. Between the dashed lines lies what chance "
        f"gives 19 times out of 20.{_not_drawn(len(panels))}"
    )
    legend = (Key("grows with it", DRIVE), Key("falls with it", COAST))
    shown = tuple(panels[:_MOST_PANELS])
    return Chart(
        "tornado",
        "What the outputs follow",
        caption,
        shown,
        panel_height=_ROW * count + 12,
        share_x=False,
        legend=legend,
    )


def _tornado(title: str, dataset: xr.Dataset, data: xr.Dataset) -> Panel:
    """Bars of one output, the strongest on top, named on the left."""
    # values with the largest rank regression coefficients, the largest on top
    coefficients = dataset["rank_regression"].values
    order = np.argsort(-np.abs(np.nan_to_num(coefficients)), kind="stable")[:_MOST_VALUES]
    strengths = np.nan_to_num(coefficients[order])
    shares = dataset["first_order"].values[order]
    names = [measure_of(data, str(name)).words for name in dataset["value"].values[order]]
    rows = np.arange(len(order), dtype=np.float64)[::-1]
    # bars by sign
    cells = []
    for side, colour, name in ((strengths > 0.0, DRIVE, "grows"), (strengths < 0.0, COAST, "falls")):
        ends = np.minimum(strengths[side], 0.0), np.maximum(strengths[side], 0.0)
        cells.append(Cells(*ends, rows[side] - 0.32, rows[side] + 0.32, name, colour))
    # names on the left, first-order shares on the right
    labels = [Label(-1.0 - _NAMES, row, name, INK) for row, name in zip(rows.tolist(), names, strict=True)]
    bar_labels = (f"S {numeral(max(0.0, float(share)), 2)}" if np.isfinite(share) else "" for share in shares)
    labels += [Label(1.06, row, word) for row, word in zip(rows.tolist(), bar_labels, strict=True)]
    # rules where chance alone may reach
    chance = float(dataset["chance_correlation"])
    rules = [Rule(at, "x", CENTRE, dashed=at != 0.0) for at in (-chance, 0.0, chance)]
    return Panel(
        title,
        cells=tuple(cells),
        labels=tuple(labels),
        rules=tuple(rules),
        x_range=(-1.0 - _NAMES, 1.3),
        y_range=(-0.6, len(rows) - 0.4),
        x_ticks=tuple((v / 2, numeral(v / 2)) for v in range(-2, 3)),
        y_ticks=((-9.0, ""),),
    )


def _alone(data: xr.Dataset) -> bool:
    return has_probabilities(data) and not axes_in(data)


def _bins(values: Array) -> int:
    return int(min(30, max(6, round(float(np.sqrt(values.size))))))


def _not_drawn(count: int) -> str:
    left = count - _MOST_PANELS
    return f" {left} more are not drawn." if left > 0 else ""
