"""Bifurcation diagrams: points of the Poincare section over the swept value, for increasing and decreasing values.

Below the points are the largest Lyapunov exponent and one strip of regimes per direction. The panels are shaded at
values where both directions end in different motions.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.plots.axis_names import edges_of, measure_of, positions, title_of, words_of_axis
from gearrattle.report.plots.chart import Band, Cells, Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.palette import CENTRE, COAST, DRIVE, STATES
from gearrattle.studies.coexistence import swept
from gearrattle.studies.dataset_layout import headlines_in
from gearrattle.studies.poincare_sections import EXPONENT
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

WAYS = {"up": Key("going up", DRIVE), "down": Key("going down", COAST)}
TWO = Key("two motions", "#c9a227")
_MOST_PANELS = 6
_MOST_POINTS = 12_000


def diagram(data: xr.Dataset, key: str = "bifurcation", held: str = "") -> Chart:
    """Draw the sweeps of one combination of further axes, whose values ``held`` says in words.

    ``data`` is over direction and the swept value alone.
    """
    # the swept value, and bands where both directions end in different motions
    axis = swept(data)
    x, log, ticks = positions(data, axis)
    bands = _bands(data, x, log)
    # points of the section, one panel per quantity
    names = [str(name) for name in np.atleast_1d(data.attrs["section"])][:_MOST_PANELS]
    frame = Panel("", x_title=title_of(data, axis), x_range=_ends(x, log), x_log=log, x_ticks=ticks)
    frame = replace(frame, bands=bands)
    measures = [measure_of(data, name) for name in names]
    panels = [
        replace(frame, title=measure.words, unit=measure.unit, lines=_points(data, name, x, measure.factor))
        for name, measure in zip(names, measures, strict=True)
    ]
    # the largest Lyapunov exponent
    lines = tuple(
        Line(x, data[EXPONENT].isel(direction=i).values, WAYS[str(way)].name, WAYS[str(way)].colour, width=1.4)
        for i, way in enumerate(data["direction"].values)
    )
    rule = Rule(0.0, "y", CENTRE)
    units = str(data[EXPONENT].attrs.get("units", "")).removesuffix("1")
    panels.append(replace(frame, title="Largest Lyapunov exponent", unit=units, lines=lines, rules=(rule,)))
    # regimes, a strip a direction
    strip, words = _strip(data, frame, x, log)
    panels += strip
    # legend and caption
    there = [str(way) for way in data["direction"].values]
    legend = (*(WAYS[way] for way in there), *([TWO] if bands else []), *(Key(word, STATES[word]) for word in words))
    over = f"{words_of_axis(data, axis)}{f'; {held}' if held else ''}"
    caption = (
        f"The motion seen once a period, over {over}. An n-periodic motion is n points, a chaotic one a cloud; chaos "
        "has a positive exponent. Each value begins with the state in which the one before it ended"
        + ("; shaded: both directions end in different motions." if bands else ".")
    )
    return Chart(
        key,
        "Bifurcation diagram" + (f", {held}" if held else ""),
        caption,
        tuple(panels),
        panel_height=190,
        legend=legend,
    )


def _points(data: xr.Dataset, name: str, x: Array, factor: float) -> tuple[Line, ...]:
    """The points of one quantity times a factor, each orbit once; the upward sweep is drawn first, below."""
    lines = []
    for i, way in enumerate(data["direction"].values):
        one = data.isel(direction=i)
        values = factor * one[name].transpose(..., "cycle").values
        period = np.nan_to_num(one["period"].values, nan=values.shape[1]).astype(np.int64)
        most = max(1, _MOST_POINTS // max(1, len(x)))
        across = [np.full(min(n, most), at) for at, n in zip(x, period, strict=True)]
        ordinates = [row[-min(n, most) :] for row, n in zip(values, period, strict=True)]
        size = 3.4 if str(way) == "up" else 2.0
        lines.append(
            Line(
                np.concatenate(across),
                np.concatenate(ordinates),
                WAYS[str(way)].name,
                WAYS[str(way)].colour,
                "points",
                size,
            )
        )
    return tuple(lines)


def _ends(x: Array, log: bool) -> tuple[float, float]:
    edges = edges_of(x, log)
    return float(edges[0]), float(edges[-1])


def _bands(data: xr.Dataset, x: Array, log: bool) -> tuple[Band, ...]:
    """Return ranges where both directions end in different motions, neighbours as one."""
    if "motions" not in data:
        return ()
    edges = edges_of(x, log)
    differ = np.concatenate([[False], data["motions"].values == 1, [False]])
    begins = np.flatnonzero(differ[1:] & ~differ[:-1])
    ends = np.flatnonzero(differ[:-1] & ~differ[1:])
    return tuple(
        Band(float(edges[a]), float(edges[b]), TWO.colour, "x", 0.16) for a, b in zip(begins, ends, strict=True)
    )


def _strip(data: xr.Dataset, frame: Panel, x: Array, log: bool) -> tuple[list[Panel], tuple[str, ...]]:
    """One row of verdicts per direction, and the words that occur; no panel without verdicts."""
    if "verdict" not in data:
        return [], ()
    headlines = headlines_in(data)
    edges = edges_of(x, log)
    cells = []
    used = []
    rows = len(data["direction"])
    for word, colour in STATES.items():
        parts = [(i, rows - 1.0 - row) for row in range(rows) for i in np.flatnonzero(headlines[row] == word).tolist()]
        if parts:
            at = np.array([i for i, _ in parts])
            height = np.array([y for _, y in parts])
            cells.append(Cells(edges[at], edges[at + 1], height - 0.4, height + 0.4, word, colour))
            used.append(word)
    ticks = tuple((rows - 1.0 - i, str(way)) for i, way in enumerate(data["direction"].values))
    panel = replace(frame, title="Verdict", cells=tuple(cells), y_range=(-0.6, rows - 0.4), y_ticks=ticks)
    return [panel], tuple(used)
