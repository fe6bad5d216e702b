"""Charts as static SVG: the same figures for paper, slides and readers without JavaScript.

SVG of our own drawing, text kept as text. A panel is a nested ``<svg>``, which clips what lies beyond its axes.
"""

from __future__ import annotations

import math
from html import escape

import numpy as np
from numpy.typing import NDArray

from gearrattle.report.plots.chart import Band, Bars, Cells, Chart, Key, Label, Line, Panel, Rule
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.palette import FAINT, INK, MUTED, NO_VALUE, PAPER
from gearrattle.report.plots.raster import raster
from gearrattle.report.plots.shapes import DASHES, SHAPES
from gearrattle.report.plots.svg_axes import Axis, limits, widened
from gearrattle.trajectory import Array

_FONT = "'Helvetica Neue', Helvetica, 'Liberation Sans', Arial, sans-serif"
_WIDTH = 880
_HATCH = 6.0  # px across between two strokes of hatching
_TOP = 26
_BOTTOM = 46
_LEFT = 62
_RIGHT = 16
_TITLE_GAP = 32
_AXIS_GAP = 40
_COLUMN_GAP = 74


def draw(chart: Chart, *, legend: bool = False) -> bytes:
    """Draw a chart as an SVG file; the same chart gives the same bytes.

    The legend is drawn above it if asked for; a page has its own.
    """
    gap = _TITLE_GAP + (0 if chart.share_x else _AXIS_GAP)
    keys, above = _legend(chart.legend) if legend else ("", 0)
    height = above + _TOP + _BOTTOM + chart.rows * chart.panel_height + (chart.rows - 1) * gap
    width = (_WIDTH - _LEFT - _RIGHT - _COLUMN_GAP * (chart.columns - 1)) / chart.columns
    drawn = []
    for index, panel in enumerate(chart.panels):
        row, column = divmod(index, chart.columns)
        left = _LEFT + column * (width + _COLUMN_GAP)
        top = above + _TOP + row * (chart.panel_height + gap)
        labelled = chart.is_bottom(index) or not chart.share_x
        drawn.append(_panel(panel, left, top, width, chart.panel_height, labelled=labelled))
    document = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" width="{_WIDTH}" height="{height}" '
        f'font-family="{_FONT}" font-size="12" fill="{MUTED}"><title>{escape(chart.title)}</title>'
        f"<desc>{escape(chart.caption)}</desc>{keys}{''.join(drawn)}</svg>\n"
    )
    return document.encode("utf-8")


def _legend(keys: tuple[Key, ...]) -> tuple[str, int]:
    """Swatches and words, row by row, and the height they take."""
    drawn = []
    x = float(_LEFT)
    row = 0
    for key in keys:
        width = 26.0 + 6.6 * len(key.name)
        if x + width > _WIDTH - _RIGHT and x > _LEFT:
            x = float(_LEFT)
            row = row + 1
        drawn.append(_swatch(key, x, 20 * row + 6))
        drawn.append(_text(x + 15.0, 20.0 * row + 15.0, key.name, "start"))
        x += width
    return "".join(drawn), 20 * (row + 1) if keys else 0


def _swatch(key: Key, x: float, y: float) -> str:
    """The shape or dash that an entry explains, or a square of its colour."""
    if key.shape:
        return _shape(key.shape, x + 5.0, y + 5.0, 4.5, key.colour)
    if key.dash:
        dash = f' stroke-dasharray="{DASHES[key.dash]}"' if key.dash in DASHES else ""
        return f'<path d="M{x - 5:.1f} {y + 5}h17" stroke="{key.colour}" stroke-width="1.6"{dash}/>'
    if key.colour == NO_VALUE:
        return f'<path d="{_hatching(x, x + 10.0, y, y + 10.0)}" stroke="{NO_VALUE}"/>'
    return f'<rect x="{x:.1f}" y="{y}" width="10" height="10" fill="{key.colour}"/>'


def _panel(panel: Panel, left: float, top: float, width: float, height: float, *, labelled: bool) -> str:
    """Draw one panel with its axes, everything in it clipped."""
    # limits, scales and ticks
    x_limits, y_limits = widened(panel, width / height) if panel.equal_scales else limits(panel)
    x, y = Axis(*x_limits, 0.0, width, panel.x_log), Axis(*y_limits, height, 0.0, panel.y_log)
    x_ticks = panel.x_ticks or tuple((v, numeral(v, 6)) for v in x.ticks())
    y_ticks = panel.y_ticks or tuple((v, numeral(v)) for v in y.ticks())
    # the marks within the axes, from the heat up to the labels
    inside = [raster(panel.heat, x, y)] if panel.heat else []
    inside += [_band(band, x, y) for band in panel.bands]
    if not panel.heat:
        inside += [f'<path d="M0 {y.at(np.array(v)):.1f}h{width:.1f}" stroke="{FAINT}"/>' for v, _ in y_ticks]
    inside += [_cells(cells, x, y) for cells in panel.cells]
    inside += [_rule(rule, x, y) for rule in panel.rules]
    inside += [_bars(bars, x, y) for bars in panel.bars]
    inside += [_line(line, x, y) for line in panel.lines]
    inside += [_label(label, x, y) for label in panel.labels]
    if panel.note:
        inside.append(
            f'<text x="{width / 2:.1f}" y="{height / 2:.1f}" text-anchor="middle">{escape(panel.note)}</text>'
        )
    # title, tick labels and axis titles around them
    unit = f' <tspan fill="{MUTED}" font-weight="400" dx="4">{escape(panel.unit)}</tspan>' if panel.unit else ""
    around = [
        f'<path d="M0 {height + 0.5}h{width:.1f}" stroke="{FAINT}" fill="none"/>',
        f'<text y="-7" fill="{INK}" font-weight="600">{escape(panel.title)}{unit}</text>',
    ]
    around += [_text(-7, float(y.at(np.array(v))) + 4, word, "end", 11) for v, word in y_ticks]
    if labelled:
        around += [_text(float(x.at(np.array(v))), height + 16, word, "middle", 11) for v, word in x_ticks]
        around.append(_text(width / 2, height + 35, panel.x_title))
    return (
        f'<g transform="translate({left:.1f} {top})">'
        f'<svg width="{width:.1f}" height="{height}" overflow="hidden">{"".join(inside)}</svg>{"".join(around)}</g>'
    )


def _text(x: float, y: float, words: str, anchor: str = "middle", size: int = 12) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}">{escape(words)}</text>'


def _band(band: Band, x: Axis, y: Axis) -> str:
    axis = x if band.along == "x" else y
    ends = (axis.low if band.low is None else band.low, axis.high if band.high is None else band.high)
    a, b = sorted(axis.at(np.array(ends)).tolist())
    width = abs(x.end - x.start)
    height = abs(y.end - y.start)
    geometry = (
        f'x="{a:.1f}" width="{b - a:.1f}" height="{height}"'
        if band.along == "x"
        else (f'y="{a:.1f}" height="{b - a:.1f}" width="{width:.1f}"')
    )
    return f'<rect {geometry} fill="{band.colour}" fill-opacity="{band.opacity:g}"/>'


def _rule(rule: Rule, x: Axis, y: Axis) -> str:
    across = rule.along == "x"
    at = float((x if across else y).at(np.array(rule.at)))
    path = f"M{at:.1f} 0V{y.start:.1f}" if across else f"M0 {at:.1f}H{x.end:.1f}"
    dash = ' stroke-dasharray="2 2"' if rule.dashed else ""
    drawn = f'<path d="{path}" stroke="{rule.colour}"{dash}/>'
    if rule.label:
        geometry = f'x="{at + 3:.1f}" y="10"' if across else f'x="{x.end - 3:.1f}" y="{at + 11:.1f}" text-anchor="end"'
        drawn += f'<text {geometry} font-size="10.5" fill="{rule.colour}">{escape(rule.label)}</text>'
    return drawn


def _label(label: Label, x: Axis, y: Axis) -> str:
    left = float(x.at(np.array(label.x)))
    base = float(y.at(np.array(label.y)))
    places = {
        "above": f'x="{left - 3.0:.1f}" y="{base - 4.0:.1f}" text-anchor="end"',
        "right": f'x="{left + 5.0:.1f}" y="{base + 3.5:.1f}"',
        "at": f'x="{left:.1f}" y="{base + 3.5:.1f}" text-anchor="middle"',
    }
    halo = f'stroke="{PAPER}" stroke-width="3" stroke-linejoin="round" paint-order="stroke"'
    rim = f" {halo}" if label.side != "at" else ""
    return f'<text {places[label.side]} font-size="10.5" fill="{label.colour}"{rim}>{escape(label.words)}</text>'


def _line(line: Line, x: Axis, y: Axis) -> str:
    shown = np.isfinite(line.x) & np.isfinite(line.y)
    px = x.at(line.x)
    py = y.at(line.y)
    style = f'fill="none" stroke="{line.colour}" stroke-width="{line.width:g}" stroke-opacity="{line.opacity:g}"'
    if line.mark == "points" and line.shape:
        placed = zip(px[shown].tolist(), py[shown].tolist(), strict=True)
        return "".join(_shape(line.shape, a, b, 0.5 * line.width, line.colour) for a, b in placed)
    if line.mark == "points":
        dots = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(px[shown].tolist(), py[shown].tolist(), strict=True))
        return f'<path d="{dots}" {style} stroke-linecap="round"/>'
    dash = f' stroke-dasharray="{DASHES[line.dash]}"' if line.dash in DASHES else ""
    return f'<path d="{_joined(px, py, shown)}" {style}{dash} stroke-linejoin="round"/>'


def _shape(shape: str, x: float, y: float, radius: float, colour: str) -> str:
    """A mark at a point, with a rim of paper about areas, so that neighbours can be distinguished."""
    drawn = SHAPES[shape]
    ink = f'fill="none" stroke="{colour}"' if drawn.is_open else f'fill="{colour}" stroke="{PAPER}"'
    width = (1.6 if drawn.is_open else 0.8) / radius
    moved = f'transform="translate({x:.1f} {y:.1f}) scale({radius:g})"'
    return f'<path {moved} d="{drawn.path}" {ink} stroke-width="{width:.3g}"/>'


def _joined(px: Array, py: Array, shown: NDArray[np.bool_]) -> str:
    """Return a path through the points, with the pen lifted where a point is missing."""
    pen = np.where(np.concatenate([[False], shown])[:-1], "L", "M")
    rows = zip(pen.tolist(), px.tolist(), py.tolist(), shown.tolist(), strict=True)
    return "".join(f"{p}{a:.1f} {b:.1f}" for p, a, b, there in rows if there)


def _bars(bars: Bars, x: Axis, y: Axis) -> str:
    base = np.zeros(bars.heights.size) if bars.base is None else bars.base
    left = x.at(bars.edges[:-1])
    right = x.at(bars.edges[1:])
    bottom = y.at(base)
    top = y.at(base + bars.heights)
    drawn = "".join(
        f"M{a + 0.4:.1f} {low:.1f}V{high:.1f}H{b - 0.4:.1f}V{low:.1f}Z"
        for a, b, low, high in zip(left.tolist(), right.tolist(), bottom.tolist(), top.tolist(), strict=True)
        if low > high
    )
    return f'<path d="{drawn}" fill="{bars.colour}"/>'


def _cells(cells: Cells, x: Axis, y: Axis) -> str:
    edges = (x.at(cells.left), x.at(cells.right), y.at(cells.low), y.at(cells.high))
    if cells.colour == NO_VALUE:
        rectangles = np.stack(edges, axis=1).tolist()
        hatched = "".join(_hatching(a, b, min(c, d), max(c, d)) for a, b, c, d in rectangles)
        return f'<path d="{hatched}" stroke="{NO_VALUE}"/>'
    drawn = "".join(f"M{a:.1f} {c:.1f}H{b:.1f}V{d:.1f}H{a:.1f}Z" for a, b, c, d in zip(*edges, strict=True))
    return f'<path d="{drawn}" fill="{cells.colour}" shape-rendering="crispEdges"/>'


def _hatching(left: float, right: float, top: float, bottom: float) -> str:
    """Return strokes along x + y = constant within a rectangle; those of neighbours go on into each other."""
    first = math.ceil((left + top) / _HATCH)
    last = math.floor((right + bottom) / _HATCH)
    ends = []
    for total in (k * _HATCH for k in range(first, last + 1)):
        x0 = max(left, total - bottom)
        x1 = min(right, total - top)
        ends.append(f"M{x0:.1f} {total - x0:.1f}L{x1:.1f} {total - x1:.1f}")
    return "".join(ends)
