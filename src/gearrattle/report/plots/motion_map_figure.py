"""The map of motions over two values: a colour a cell, and the curves of events that bound the cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gearrattle.engine.periodic.events.event_record import FOLD
from gearrattle.orbits.family_ends import EDGE
from gearrattle.orbits.motion_map import BESIDE, MISSING, MUST, NOT_COUNTED, NOTHING_STABLE, QUIET, WORDS, MotionMap
from gearrattle.orbits.two_parameters.special_points import SpecialPoint
from gearrattle.report.plots.axis_names import Measure
from gearrattle.report.plots.branches_figure import measure_over
from gearrattle.report.plots.chart import Cells, Chart, Dash, Key, Line, Panel
from gearrattle.report.plots.palette import INK
from gearrattle.report.plots.study_maps import NOTHING, cells_of

COLOURS_OF_CODES = {
    QUIET: "#dfe7ee",
    BESIDE: "#f0c36d",
    MUST: "#cf6679",
    NOTHING_STABLE: "#9d8cc4",
    MISSING: "#8fd0c4",
    NOT_COUNTED: "#f4f6f8",
}
"""Colour of what a cell says, always shown with its words."""
_DASHES: dict[str, Dash] = {FOLD: "solid", EDGE: "dotted"}
SPECIAL = {
    "cusp": Key("cusp: two folds meet", INK, "star"),
    "turning point": Key("turning point: two events of one kind meet", INK, "circle"),
    "fold meets grazing": Key("a fold meets a grazing", INK, "diamond"),
}
"""How special points are drawn."""


def measures_of(motions: MotionMap) -> tuple[Measure, Measure]:
    """Return what the first and the second value are called, and their units."""
    first = measure_over(motions.model, motions.path, motions.range)
    return first, measure_over(motions.model, motions.second, motions.second_range)


def special_lines(points: Sequence[SpecialPoint], across: Measure, up: Measure) -> list[Line]:
    """Draw the special points of curves."""
    lines = []
    for kind, key in SPECIAL.items():
        at = [point for point in points if point.kind == kind]
        x, y = (np.array([getattr(point, name) for point in at]) for name in ("value", "second"))
        if at:
            lines.append(Line(x * across.factor, y * up.factor, kind, key.colour, "points", 11.0, shape=key.shape))
    return lines


def special_keys(points: Sequence[SpecialPoint]) -> list[Key]:
    """Return what the legend says of the special points of curves."""
    return [key for kind, key in SPECIAL.items() if any(point.kind == kind for point in points)]


def map_chart(motions: MotionMap) -> Chart:
    """Draw the cells, and the curves over them."""
    # cells by code
    across, up = measures_of(motions)
    x_range = _scaled(motions.range, across.factor)
    y_range = _scaled(motions.second_range, up.factor)
    codes = motions.data["code"].values.astype(np.int64)
    keys = tuple(Key(words, COLOURS_OF_CODES[code]) for code, words in WORDS.items())
    cells = tuple(_placed(part, codes.shape, x_range, y_range) for part in cells_of(codes, (*keys, NOTHING)))
    # borders and special points
    lines = [
        Line(
            border.value * across.factor,
            border.second * up.factor,
            f"{border.kind} {border.clearance}".strip(),
            INK,
            width=1.8,
            dash=_DASHES.get(border.kind, "dashed"),
        )
        for border in motions.borders
    ]
    lines += special_lines(motions.special_points, across, up)
    panel = Panel(
        up.words,
        up.unit,
        across.title,
        tuple(lines),
        cells=cells,
        x_range=x_range,
        y_range=y_range,
    )
    # legend of the codes and curves that occur
    present = {part.name for part in cells}
    curves = [
        Key(kind, INK, dash=_DASHES.get(kind, "dashed")) for kind in dict.fromkeys(b.kind for b in motions.borders)
    ]
    legend = (*(key for key in keys if key.name in present), *curves, *special_keys(motions.special_points))
    rows, columns = codes.shape
    caption = (
        f"{across.words.capitalize()} across, {up.words} up, {columns} x {rows} cells. In the middle of every cell all "
        "motions of the branches were judged; lines: where the motions of the branch at the model's own "
        f"{up.words} fold or graze, or a family of them ends."
    )
    return Chart("motion-map", "Map of motions", caption, (panel,), panel_height=380, legend=legend)


def _scaled(ends: tuple[float, float], factor: float) -> tuple[float, float]:
    return ends[0] * factor, ends[1] * factor


def _placed(cells: Cells, shape: tuple[int, ...], x_range: tuple[float, float], y_range: tuple[float, float]) -> Cells:
    """Cells counted from -0.5 on, at their values."""
    rows, columns = shape
    width = (x_range[1] - x_range[0]) / columns
    height = (y_range[1] - y_range[0]) / rows
    left, right = (x_range[0] + (edge + 0.5) * width for edge in (cells.left, cells.right))
    low, high = (y_range[0] + (edge + 0.5) * height for edge in (cells.low, cells.high))
    return replace(cells, left=left, right=right, low=low, high=high)
