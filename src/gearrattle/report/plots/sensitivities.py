"""Sensitivities from samples drawn for them: Sobol' indices with their intervals, and one value at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.plots.axis_names import measure_of
from gearrattle.report.plots.chart import Cells, Chart, Key, Label, Line, Panel, Rule
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.palette import ACCENT, CENTRE, COAST, DRIVE, INK
from gearrattle.report.plots.study_sweep_figures import subjects_of
from gearrattle.studies.dataset_layout import axes_in, outputs_in, sampling_of, scattered
from gearrattle.studies.designs import ONE_AT_A_TIME, PAIRS, SALTELLI
from gearrattle.studies.plan import SAMPLE
from gearrattle.studies.sensitivity import sensitivities
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

_MOST_PANELS = 8
_MOST_VALUES = 12
_ROW = 30
_NAMES = 0.75  # share of the bars' width that names take, left of them
FIRST = ACCENT
TOTAL = "#8fb8d6"


def sobol_bars(data: xr.Dataset) -> Chart | None:
    """Draw Sobol' indices of first and total order with their intervals, one panel per output and subject that vary."""
    if sampling_of(data) not in (SALTELLI, PAIRS) or not _alone(data):
        return None
    panels = [panel for name in outputs_in(data) for panel in sobol_panels(sensitivities(data, name), data)]
    return sobol_chart(panels, len(scattered(data)))


def sobol_panels(dataset: xr.Dataset, measured: xr.Dataset) -> list[Panel]:
    """Draw the indices of one output, one panel per subject that varies.

    ``measured`` holds the values that scatter, with their words and units.
    """
    parts = [(title, one) for title, _, one in _by_subject(dataset) if np.isfinite(one["total_order"].values).any()]
    return [_indices(title, one, measured) for title, one in parts]


def sobol_chart(panels: list[Panel], values: int) -> Chart | None:
    """Return the chart of ``sobol_panels``, whose bars are so many values; None without panels."""
    legend = (Key("first order: alone", FIRST), Key("total order: with interactions", TOTAL))
    caption = (
        "Shares of each output's variance that a value explains: alone, and with all interactions it is in. "
        "Lines are 95 % intervals (bootstrap over the base points); few base points may give shares outside 0 to 100 %."
    )
    return _chart(("indices", "Sobol' indices", caption), panels, values, legend)


def swing_bars(data: xr.Dataset) -> Chart | None:
    """Draw what each output is with every value at its lower and its upper end, the widest on top."""
    if sampling_of(data) != ONE_AT_A_TIME or not _alone(data):
        return None
    panels = [panel for name in outputs_in(data) for panel in swing_panels(sensitivities(data, name), data)]
    return swing_chart(panels, len(scattered(data)))


def swing_panels(dataset: xr.Dataset, measured: xr.Dataset) -> list[Panel]:
    """Draw what one output is at both ends of every value, one panel per subject that varies; arguments as above."""
    return [
        _swings(title, unit, one, measured)
        for title, unit, one in _by_subject(dataset)
        if np.nanmax(one["swing"].values, initial=0.0) > 0.0 and np.isfinite(float(one["base"]))
    ]


def swing_chart(panels: list[Panel], values: int) -> Chart | None:
    """Return the chart of ``swing_panels``, whose bars are so many values; None without panels."""
    legend = (Key("value at its lower end", COAST), Key("value at its upper end", DRIVE))
    caption = (
        "Each output with one value at its lower and at its upper end, all others the model's own; the line is the "
        "model itself. Interactions are not seen."
    )
    return _chart(("tornado", "One value at a time", caption), panels, values, legend)


def _by_subject(dataset: xr.Dataset) -> list[tuple[str, str, xr.Dataset]]:
    """Title, unit and sensitivities of every subject."""
    subject = str(dataset.attrs["subject"])
    output = str(dataset.attrs["output"])
    names = [name for name, _ in subjects_of(dataset["output_unit"], subject)]
    parts = [
        (f"{name}: {output}" if name else output, dataset.sel({subject: name}) if name else dataset) for name in names
    ]
    return [(title, str(one["output_unit"].item()), one) for title, one in parts]


def _chart(words: tuple[str, str, str], panels: list[Panel], count: int, legend: tuple[Key, ...]) -> Chart | None:
    """A chart of bars by key, title and caption; ``count`` values have a row each."""
    if not panels:
        return None
    left = len(panels) - _MOST_PANELS
    more = f" {left} more are not drawn." if left > 0 else ""
    (key, title, caption) = words
    height = _ROW * min(count, _MOST_VALUES) + 12
    shown = tuple(panels[:_MOST_PANELS])
    return Chart(key, title, caption + more, shown, panel_height=height, share_x=False, legend=legend)


def _indices(title: str, dataset: xr.Dataset, data: xr.Dataset) -> Panel:
    # values with the largest total-order index, the largest on top
    total = np.nan_to_num(dataset["total_order"].values)
    order = np.argsort(-total, kind="stable")[:_MOST_VALUES]
    rows = np.arange(len(order), dtype=np.float64)[::-1]
    cells = []
    lines = []
    for name, colour, at in (("total_order", TOTAL, -0.17), ("first_order", FIRST, 0.17)):
        # indices as bars with their 95 % intervals
        share = np.nan_to_num(dataset[name].values[order])
        half = np.nan_to_num(dataset[f"{name}_half_width"].values[order])
        middle = rows + at
        cells.append(Cells(np.minimum(share, 0.0), np.maximum(share, 0.0), middle - 0.15, middle + 0.15, name, colour))
        low = np.maximum(share - half, -0.15)
        high = np.minimum(share + half, 1.15)
        lines.append(Line(*_pieces(low, high, middle), "95 % interval", INK, width=1.4))
    # names on the left
    names = [measure_of(data, str(name)).words for name in dataset["value"].values[order]]
    labels = [Label(-0.17 - _NAMES, row, name, INK) for row, name in zip(rows.tolist(), names, strict=True)]
    return Panel(
        title,
        cells=tuple(cells),
        lines=tuple(lines),
        labels=tuple(labels),
        rules=(Rule(0.0, "x", CENTRE),),
        x_range=(-0.17 - _NAMES, 1.17),
        y_range=(-0.6, len(rows) - 0.4),
        x_ticks=tuple((v / 5, f"{20 * v} %") for v in range(6)),
        y_ticks=((-9.0, ""),),
    )


def _swings(title: str, unit: str, dataset: xr.Dataset, data: xr.Dataset) -> Panel:
    # values with the largest swing of the output, the largest on top
    swing = np.nan_to_num(dataset["swing"].values)
    base = float(dataset["base"])
    order = np.argsort(-swing, kind="stable")[:_MOST_VALUES]
    rows = np.arange(len(order), dtype=np.float64)[::-1]
    # bars from the base to the output at both ends of a value
    ends = {
        name: np.where(np.isfinite(values := dataset[name].values[order]), values, base) for name in ("low", "high")
    }
    same_side = (ends["low"] - base) * (ends["high"] - base) > 0.0  # one over the other: each half as high
    cells = []
    for name, colour, side in (("low", COAST, 0.5), ("high", DRIVE, -0.5)):
        middle = np.where(same_side, rows + 0.32 * side, rows)
        half = np.where(same_side, 0.15, 0.32)
        left = np.minimum(ends[name], base)
        right = np.maximum(ends[name], base)
        cells.append(Cells(left, right, middle - half, middle + half, name, colour))
    # room for names on the left
    low = min(base, *(float(values.min()) for values in ends.values()))
    high = max(base, *(float(values.max()) for values in ends.values()))
    width = high - low
    begin = low - (_NAMES + 0.03) * width
    # names of the values and their ends
    extremes = [dataset[f"{name}_value"].values[order].tolist() for name in ("low", "high")]
    measures = [measure_of(data, str(name)) for name in dataset["value"].values[order]]
    bar_labels = [
        f"{numeral(a * m.factor, 3)} to {m.with_unit(b, 3)}" for a, b, m in zip(*extremes, measures, strict=True)
    ]
    names = [measure.words for measure in measures]
    labels = [Label(begin, row, name, INK) for row, name in zip(rows.tolist(), names, strict=True)]
    labels += [Label(high + 0.03 * width, row, words) for row, words in zip(rows.tolist(), bar_labels, strict=True)]
    # axes: five ticks over the outputs
    steps = np.linspace(low, high, 5)
    return Panel(
        title,
        unit,
        cells=tuple(cells),
        labels=tuple(labels),
        rules=(Rule(base, "x", INK, dashed=False),),
        x_range=(begin, high + 0.35 * width),
        y_range=(-0.6, len(rows) - 0.4),
        x_ticks=tuple((float(at), numeral(float(at), 3)) for at in steps),
        y_ticks=((-9.0, ""),),
    )


def _alone(data: xr.Dataset) -> bool:
    return SAMPLE in data.dims and not axes_in(data) and bool(scattered(data))


def _pieces(low: Array, high: Array, rows: Array) -> tuple[Array, Array]:
    gap = np.full(len(rows), np.nan)
    return np.column_stack([low, high, gap]).ravel(), np.column_stack([rows, rows, gap]).ravel()
