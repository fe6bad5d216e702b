"""Charts as plotly figures, written as plain data.

A plotly figure is a JSON object with ``data`` (traces) and ``layout``; it is written here directly, so that drawing
needs no import of plotly at all. Curves travel as base64 of little-endian float32 (float64 on the x axis, whose
spacing can be fine against its size), equally spaced level axes as start and step.
"""

from __future__ import annotations

import math
from base64 import b64encode
from typing import Any

import numpy as np

from gearrattle.report.plots.chart import Bars, Cells, Chart, Heat, Label, Line, Panel, Rule
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.palette import ACCENT, CENTRE, FAINT, INK, MUTED, NO_VALUE, PAPER, SHADES, tint
from gearrattle.report.plots.shapes import DASHES, SHAPES
from gearrattle.report.plots.svg_axes import log_ticks
from gearrattle.trajectory import Array

_HATCHED = {
    "color": PAPER,
    "pattern": {"shape": "/", "fgcolor": NO_VALUE, "bgcolor": PAPER, "size": 6, "solidity": 0.2},
}
FONT = "-apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', 'Liberation Sans', Arial, sans-serif"

_TOP = 30
_BOTTOM = 46
_LEFT = 62
_RIGHT = 40
_TITLE_GAP = 32
_AXIS_GAP = 40
_COLUMN_GAP = 0.085
_FEW_DECADES = 2
_GL_FROM = 20_000


def plotly_figure(chart: Chart) -> dict[str, Any]:
    """Write a chart as a plotly figure, ``{"data": [...], "layout": {...}}`` of JSON types only."""
    # layout common to all panels
    gap = _TITLE_GAP + (0 if chart.share_x else _AXIS_GAP)
    inner = chart.rows * chart.panel_height + (chart.rows - 1) * gap
    layout: dict[str, Any] = {
        "height": inner + _TOP + _BOTTOM,
        "margin": {"t": _TOP, "b": _BOTTOM, "l": _LEFT, "r": _RIGHT},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"family": FONT, "size": 12, "color": MUTED},
        "showlegend": False,
        "hovermode": "closest",
        "hoverlabel": {"bgcolor": "#ffffff", "bordercolor": FAINT, "font": {"color": INK, "size": 12}},
        "dragmode": "zoom",
        "modebar": {"orientation": "v", "bgcolor": "rgba(0,0,0,0)", "color": CENTRE, "activecolor": ACCENT},
        "barmode": "overlay",
        "bargap": 0,
        "shapes": [],
        "annotations": [],
    }
    data: list[dict[str, Any]] = []
    # axes, decorations and traces of every panel
    for index, panel in enumerate(chart.panels):
        _lay_out(layout, chart, index, inner, gap)
        _decorate(layout, panel, _axis("x", index), _axis("y", index))
        data += [_heat(panel.heat, index)] if panel.heat else []
        data += [_cells(cells, index) for cells in panel.cells]
        data += [_bars(bars, index) for bars in panel.bars]
        data += [_line(line, index) for line in panel.lines]
    return {"data": data, "layout": layout}


def _axis(letter: str, index: int) -> str:
    return letter if index == 0 else f"{letter}{index + 1}"


def _lay_out(layout: dict[str, Any], chart: Chart, index: int, inner: int, gap: int) -> None:
    """Place the axes of one panel in the grid."""
    # position of the panel on the grid, in shares of the figure
    panel = chart.panels[index]
    row, column = divmod(index, chart.columns)
    width = (1.0 - _COLUMN_GAP * (chart.columns - 1)) / chart.columns
    left = column * (width + _COLUMN_GAP)
    top = 1.0 - row * (chart.panel_height + gap) / inner
    # the x axis
    style = {
        "gridcolor": FAINT,
        "gridwidth": 1,
        "zeroline": False,
        "linecolor": FAINT,
        "tickfont": {"size": 11, "color": MUTED},
        "ticks": "",
    }
    labelled = chart.is_bottom(index) or not chart.share_x
    x_axis: dict[str, Any] = {
        **style,
        "domain": [left, left + width],
        "anchor": _axis("y", index),
        "showgrid": False,
        "showline": True,
        "showticklabels": labelled,
    }
    if labelled and panel.x_title:
        x_axis["title"] = {"text": panel.x_title, "font": {"size": 12, "color": MUTED}, "standoff": 6}
    if chart.share_x and index > 0:
        x_axis["matches"] = "x"
    if panel.x_log:
        x_axis["type"] = "log"
    if panel.x_range is not None:
        x_axis |= _decades(*panel.x_range) if panel.x_log else {"range": list(panel.x_range)}
    # the y axis
    y_axis: dict[str, Any] = {
        **style,
        "domain": [max(0.0, top - chart.panel_height / inner), top],
        "anchor": _axis("x", index),
        "nticks": 5,
        "exponentformat": "power",
        "minexponent": 6,
    }
    if panel.y_log:
        y_axis["type"] = "log"
    if panel.y_range is not None and panel.y_log:
        y_axis |= _decades(*panel.y_range)
    elif panel.y_range is not None:
        y_axis["range"] = list(panel.y_range)
    if panel.equal_scales:
        y_axis |= {"scaleanchor": _axis("x", index), "scaleratio": 1}
    # prescribed ticks
    for axis, ticks in ((x_axis, panel.x_ticks), (y_axis, panel.y_ticks)):
        if ticks:
            axis |= {"tickmode": "array", "tickvals": [v for v, _ in ticks], "ticktext": [word for _, word in ticks]}
    layout[f"xaxis{'' if index == 0 else index + 1}"] = x_axis
    layout[f"yaxis{'' if index == 0 else index + 1}"] = y_axis


def _decades(low: float, high: float) -> dict[str, Any]:
    """Return range and ticks of a logarithmic axis: whole powers of ten, within two decades 1, 2 and 5 times such."""
    first = math.floor(math.log10(low))
    last = math.ceil(math.log10(high))
    if last - first <= _FEW_DECADES:
        shown = log_ticks(low, high)
        ends = [math.log10(low), math.log10(high)]
    else:
        shown = [10.0**power for power in range(last, first - 1, -max(1, round((last - first) / 4)))]
        ends = [float(first), float(last)]
    return {"range": ends, "tickmode": "array", "tickvals": shown, "ticktext": [numeral(value) for value in shown]}


def _decorate(layout: dict[str, Any], panel: Panel, x_name: str, y_name: str) -> None:
    """Add the title, bands, rules, labels and the note of one panel."""
    unit = f"  <span style='color:{MUTED}'>{panel.unit}</span>" if panel.unit else ""
    corner = {"xref": f"{x_name} domain", "yref": f"{y_name} domain", "showarrow": False}
    title = {"text": f"<b>{panel.title}</b>{unit}", "font": {"size": 12.5, "color": INK}}
    layout["annotations"].append(
        {**corner, **title, "x": 0, "y": 1, "yanchor": "bottom", "xanchor": "left", "yshift": 3}
    )
    if panel.note:
        layout["annotations"].append({**corner, "text": panel.note, "x": 0.5, "y": 0.5})
    for band in panel.bands:
        shape = _span(band.along, x_name, y_name, band.low, band.high)
        look = {"fillcolor": tint(band.colour, band.opacity), "line": {"width": 0}, "layer": "below"}
        layout["shapes"].append({"type": "rect", **shape, **look})
    for rule in panel.rules:
        dash = "dot" if rule.dashed else "solid"
        look = {"line": {"color": rule.colour, "width": 1, "dash": dash}, "layer": "below"}
        layout["shapes"].append({"type": "line", **_span(rule.along, x_name, y_name, rule.at, rule.at), **look})
        if rule.label:
            layout["annotations"].append(_on_axes(_rule_label(rule, x_name, y_name), panel))
    background = {} if panel.heat is None else {"bgcolor": tint(PAPER, 0.75), "borderpad": 1}
    layout["annotations"] += [_on_axes(_label(label, x_name, y_name), panel) | background for label in panel.labels]


def _on_axes(annotation: dict[str, Any], panel: Panel) -> dict[str, Any]:
    """Return an annotation where plotly puts it: on a logarithmic axis it takes logarithms, unlike lines and shapes."""
    for along, is_log in (("x", panel.x_log), ("y", panel.y_log)):
        if is_log and not annotation[f"{along}ref"].endswith("domain"):
            annotation[along] = math.log10(annotation[along])
    return annotation


def _span(along: str, x_name: str, y_name: str, low: float | None, high: float | None) -> dict[str, Any]:
    """Return the corners of a strip across a panel; an open end reaches far outside what is drawn."""
    other, name = ("y", x_name) if along == "x" else ("x", y_name)
    other_name = y_name if along == "x" else x_name
    strip: dict[str, Any] = {f"{along}ref": name, f"{other}ref": f"{other_name} domain", f"{other}0": 0, f"{other}1": 1}
    reach = 1e4 * max(abs(low or 0.0), abs(high or 0.0), 1e-12)
    strip[f"{along}0"] = -reach if low is None else low
    strip[f"{along}1"] = reach if high is None else high
    return strip


def _rule_label(rule: Rule, x_name: str, y_name: str) -> dict[str, Any]:
    look = {"text": rule.label, "showarrow": False, "font": {"size": 10.5, "color": rule.colour}}
    if rule.along == "x":
        position = {
            "xref": x_name,
            "yref": f"{y_name} domain",
            "x": rule.at,
            "y": 1,
            "yanchor": "top",
            "xanchor": "left",
        }
        return {**look, **position, "xshift": 2}
    position = {"xref": f"{x_name} domain", "yref": y_name, "x": 1, "y": rule.at, "yanchor": "top", "xanchor": "right"}
    return {**look, **position}


def _label(label: Label, x_name: str, y_name: str) -> dict[str, Any]:
    above = label.side == "above"
    return {
        "text": label.words,
        "showarrow": False,
        "font": {"size": 10.5, "color": label.colour},
        "xref": x_name,
        "yref": y_name,
        "x": label.x,
        "y": label.y,
        "xanchor": "right" if above else "left",
        "yanchor": "bottom" if above else "middle",
        "xshift": -2 if above else 5,
    }


def _line(line: Line, index: int) -> dict[str, Any]:
    """Write one curve or cloud."""
    x = np.asarray(line.x, dtype=np.float64)
    trace: dict[str, Any] = {
        "type": "scattergl" if x.size > _GL_FROM else "scatter",
        "mode": "lines" if line.mark == "line" else "markers",
        "name": line.name,
        "y": _packed(line.y, "f4"),
        "xaxis": _axis("x", index),
        "yaxis": _axis("y", index),
        "opacity": line.opacity,
        "hovertemplate": "%{x:.4~g}, %{y:.4~g}<extra>" + line.name + "</extra>",
    }
    if line.mark == "line":
        trace["line"] = {"color": line.colour, "width": line.width, "simplify": False}
        if line.dash in DASHES:
            trace["line"]["dash"] = ",".join(f"{part}px" for part in DASHES[line.dash].split())
    elif line.shape:
        drawn = SHAPES[line.shape]
        rim = {"color": line.colour, "width": 1.6} if drawn.is_open else {"color": PAPER, "width": 0.8}
        trace["marker"] = {"color": line.colour, "size": line.width, "symbol": drawn.plotly, "line": rim}
    else:
        trace["marker"] = {"color": line.colour, "size": line.width, "line": {"width": 0}}
    return trace | _level(x)


def _bars(bars: Bars, index: int) -> dict[str, Any]:
    """Write one histogram."""
    return {
        "type": "bar",
        "name": bars.name,
        "x": _packed(0.5 * (bars.edges[1:] + bars.edges[:-1]), "f8"),
        "width": _packed(np.diff(bars.edges), "f8"),
        "y": _packed(bars.heights, "f4"),
        "base": _packed(np.zeros(bars.heights.size) if bars.base is None else bars.base, "f4"),
        "marker": {"color": bars.colour, "line": {"color": "#ffffff", "width": 0.5}},
        "xaxis": _axis("x", index),
        "yaxis": _axis("y", index),
        "hovertemplate": "%{x:.3~g}: %{y:.3~g}<extra>" + bars.name + "</extra>",
    }


def _heat(heat: Heat, index: int) -> dict[str, Any]:
    """Write a map of numbers; cells are named by their middles."""
    rows, columns = heat.values.shape
    (left, right) = heat.x_range
    (low, high) = heat.y_range
    width = (right - left) / columns
    height = (high - low) / rows
    return {
        "type": "heatmap",
        "name": heat.name,
        "z": {**_packed(heat.values, "f4"), "shape": f"{rows}, {columns}"},
        "x0": left + 0.5 * width,
        "dx": width,
        "y0": low + 0.5 * height,
        "dy": height,
        "zmin": heat.low,
        "zmax": heat.high,
        "colorscale": [[k / (len(SHADES) - 1), colour] for k, colour in enumerate(SHADES)],
        "showscale": False,
        "hoverongaps": False,
        "xaxis": _axis("x", index),
        "yaxis": _axis("y", index),
        "hovertemplate": "%{x:.4~g}, %{y:.4~g}: %{z:.3~g}<extra>" + heat.name + "</extra>",
    }


def _cells(cells: Cells, index: int) -> dict[str, Any]:
    """Write rectangles: bars that stand on their lower edges."""
    return {
        "type": "bar",
        "name": cells.name,
        "x": _packed(0.5 * (cells.left + cells.right), "f8"),
        "width": _packed(cells.right - cells.left, "f8"),
        "y": _packed(cells.high - cells.low, "f8"),
        "base": _packed(cells.low, "f8"),
        "marker": {"line": {"width": 0}} | (_HATCHED if cells.colour == NO_VALUE else {"color": cells.colour}),
        "xaxis": _axis("x", index),
        "yaxis": _axis("y", index),
        "hovertemplate": "%{x:.4~g}<extra>" + cells.name + "</extra>",
    }


def _level(x: Array) -> dict[str, Any]:
    """Write an x axis: start and step where it is equally spaced, its values elsewhere."""
    if x.size > 2:
        steps = np.diff(x)
        if np.all(np.isfinite(steps)) and float(np.ptp(steps)) <= 1e-9 * abs(float(x[-1] - x[0])) / x.size:
            return {"x0": float(x[0]), "dx": float(x[-1] - x[0]) / (x.size - 1)}
    return {"x": _packed(x, "f8")}


def _packed(values: Array, kind: str) -> dict[str, str]:
    """Return a typed array as plotly reads it."""
    raw = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
    return {"dtype": kind, "bdata": b64encode(raw).decode("ascii")}
