"""Marks of a panel on matplotlib axes: heat, bands, cells, rules, bars, lines and words.

All data of the chart are drawn. Only a curve with more samples than a printer can show is thinned (``thinning``), to
four samples per column of a 600 dpi printer; the lowest and the highest sample of every bucket are kept. Maps, and
marks with thousands of pieces, become pictures inside a vector file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.report.plots.chart import Band, Bars, Cells, Heat, Label, Line, Panel, Rule
from gearrattle.report.plots.palette import FAINT, NO_VALUE, PAPER, SHADES
from gearrattle.report.plots.thinning import thin
from gearrattle.report.plots.typeset.row_names import Rows
from gearrattle.report.plots.typeset.styles_by_colour import Looks, blended, stroke
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage
    from matplotlib.text import Annotation

PRINTER = 600.0
"""Resolution of the finest printer that is considered [dpi]."""
_PIECES = 4000
"""Number of points or cells of one colour, from which they are drawn as a picture."""
_SMALLEST_POINT = 1.4  # pt
_BEYOND = 10.0


def draw_marks(axes: Axes, rows: Rows, looks: Looks, *, inches: float) -> list[Annotation]:
    """Draw all that a panel holds, from the heat up, and return the words in it, the most important first.

    Limits and scales must have been set. The figure is ``inches`` wide.
    """
    panel = rows.panel
    if panel.heat is not None:
        heat(axes, panel.heat, most=round(inches * PRINTER))
    for band in panel.bands:
        _band(axes, band)
    for cells in panel.cells:
        _cells(axes, cells, looks)
    words = [drawn for rule in panel.rules if (drawn := _rule(axes, rule)) is not None]
    for bars in panel.bars:
        _bars(axes, bars, looks)
    for order, line in enumerate(panel.lines):
        _line(axes, line, looks, order, most=round(4.0 * inches * PRINTER))
    placement: Any = {"shift": (3.0, 0.0), "alignment": ("left", "center"), "along": "yaxis"}
    for label in rows.right:
        _words(axes, label.words, (1.0, label.y), label.colour, **placement).set_in_layout(True)
    return words + [_label(axes, label) for label in panel.labels]


def heat(axes: Axes, heat_map: Heat, *, most: int) -> AxesImage:
    """Draw a map; where it has more cells than a printer points, each point shows the largest of its cells."""
    from matplotlib.colors import LinearSegmentedColormap

    colours = LinearSegmentedColormap.from_list("shades", list(SHADES)).with_extremes(bad=PAPER)
    values = pooled(pooled(heat_map.values, most).T, most).T
    return axes.imshow(
        np.ma.masked_invalid(values),
        cmap=colours,
        vmin=heat_map.low,
        vmax=heat_map.high,
        origin="lower",
        aspect="auto",
        extent=(*heat_map.x_range, *heat_map.y_range),
        interpolation="nearest",
        zorder=0.2,
        label=heat_map.name,
    )


def pooled(values: Array, most: int) -> Array:
    """Return at most ``most`` rows, each the largest of equally many of the given ones; NaN where all are missing."""
    share = -(-values.shape[0] // most)
    if share == 1:
        return values
    starts = np.arange(0, values.shape[0], share)
    largest = np.maximum.reduceat(np.where(np.isnan(values), -np.inf, values), starts, axis=0)
    return np.where(np.isneginf(largest), np.nan, largest)


def _band(axes: Axes, band: Band) -> None:
    """Shade a strip in the colour it has on paper; one open to a side goes on far beyond the limits."""
    low, high = axes.get_xlim() if band.along == "x" else axes.get_ylim()
    log = (axes.get_xscale() if band.along == "x" else axes.get_yscale()) == "log"
    ends = (low * 1e-9, high * 1e9) if log else (low - _BEYOND * (high - low), high + _BEYOND * (high - low))
    first = ends[0] if band.low is None else band.low
    last = ends[1] if band.high is None else band.high
    span = axes.axvspan if band.along == "x" else axes.axhspan
    span(first, last, facecolor=blended(band.colour, band.opacity), edgecolor="none", linewidth=0.0, zorder=0.3)


def _cells(axes: Axes, cells: Cells, looks: Looks) -> None:
    """Fill rectangles; a hairline of their own colour closes the seams that viewers leave between them."""
    from matplotlib.collections import PolyCollection

    # (N, 4, 2) corners of the rectangles
    corners = np.stack(
        [
            np.stack([x, y], -1)
            for x, y in (
                (cells.left, cells.low),
                (cells.right, cells.low),
                (cells.right, cells.high),
                (cells.left, cells.high),
            )
        ],
        axis=1,
    )
    # hatched cells have edges of paper, empty ones no filling
    hatch = looks.hatches.get(cells.colour, "")
    is_empty = cells.colour == NO_VALUE
    axes.add_collection(
        PolyCollection(
            list(corners),
            facecolors=PAPER if is_empty else cells.colour,
            edgecolors=PAPER if hatch and not is_empty else cells.colour,
            linewidths=0.0 if hatch else 0.2,
            hatch=hatch or None,
            label=cells.name,
            zorder=1.2,
            rasterized=len(corners) > _PIECES,
        ),
        autolim=False,
    )


def _rule(axes: Axes, rule: Rule) -> Annotation | None:
    across = rule.along == "x"
    style: Any = (0.0, (1.5, 1.5)) if rule.dashed else "solid"
    line = axes.axvline if across else axes.axhline
    line(rule.at, color=rule.colour, linewidth=0.6, linestyle=style, zorder=1.4)
    if not rule.label:
        return None
    xy, words = ((rule.at, 1.0), "xaxis") if across else ((1.0, rule.at), "yaxis")
    shift, ha = ((2.0, -1.0), "left") if across else ((-2.0, -1.0), "right")
    return _words(axes, rule.label, xy, rule.colour, shift=shift, alignment=(ha, "top"), along=words)


_SIDES: dict[str, tuple[tuple[float, float], tuple[str, str]]] = {
    "above": ((-2.0, 2.0), ("right", "bottom")),
    "right": ((3.0, 0.0), ("left", "center")),
    "at": ((0.0, 0.0), ("center", "center")),
}
"""By side of a label: its shift from the point [points], and its alignment."""


def _label(axes: Axes, label: Label) -> Annotation:
    shift, alignment = _SIDES[label.side]
    written = _words(
        axes, label.words, (label.x, label.y), label.colour, shift=shift, alignment=alignment, along="data"
    )
    if label.side == "at":
        written.set_path_effects([])
    return written


def _words(
    axes: Axes,
    words: str,
    xy: tuple[float, float],
    colour: str,
    *,
    shift: tuple[float, float],
    alignment: tuple[str, str],
    along: str,
) -> Annotation:
    """Write near a point, with a rim of paper about the letters."""
    from matplotlib import rcParams
    from matplotlib.patheffects import withStroke

    where: Any = {"xaxis": axes.get_xaxis_transform(), "yaxis": axes.get_yaxis_transform(), "data": axes.transData}
    written = axes.annotate(
        words,
        xy,
        xytext=shift,
        xycoords=where[along],
        textcoords="offset points",
        color=colour,
        ha=alignment[0],
        va=alignment[1],
        fontsize=rcParams["legend.fontsize"],
        annotation_clip=True,
        zorder=4.0,
        parse_math=False,
        path_effects=[withStroke(linewidth=1.6, foreground=PAPER)],
    )
    written.set_in_layout(False)
    return written


def _bars(axes: Axes, bars: Bars, looks: Looks) -> None:
    base = np.zeros(bars.heights.size) if bars.base is None else bars.base
    hatch = looks.hatches.get(bars.colour, "")
    axes.bar(
        bars.edges[:-1],
        bars.heights,
        np.diff(bars.edges),
        base,
        align="edge",
        facecolor=bars.colour,
        edgecolor=PAPER,
        linewidth=0.3,
        hatch=hatch or None,
        label=bars.name,
        zorder=1.6,
    )


def _line(axes: Axes, line: Line, looks: Looks, order: int, *, most: int) -> None:
    """Draw a curve or a cloud, the later above the earlier."""
    x, y = _kept(line, most)
    common: dict[str, Any] = {
        "color": line.colour,
        "alpha": None if line.opacity >= 1.0 else line.opacity,
        "label": line.name or "_",
        "zorder": 2.0 + 1e-3 * order,
    }
    if line.mark == "line":
        style: Any = looks.dash(line.colour, line.dash)
        axes.plot(x, y, linestyle=style, linewidth=stroke(line.width), solid_joinstyle="round", **common)
        return
    size = max(_SMALLEST_POINT, stroke(line.width))
    axes.plot(
        x,
        y,
        linestyle="none",
        marker=looks.marker(line.colour, line.shape),
        markersize=size,
        markeredgewidth=looks.edge(line.shape),
        rasterized=x.size > _PIECES,
        **common,
    )


def _kept(line: Line, most: int) -> tuple[Array, Array]:
    """Return a line's samples, thinned if they are more than print can show."""
    if line.mark == "points" or line.x.size <= most or not np.all(np.isfinite(line.y)):
        return line.x, line.y
    chosen = thin(line.y, most)
    return line.x[chosen], line.y[chosen]


def grid(axes: Axes, panel: Panel) -> None:
    """Draw level grid lines, below everything; none over a map."""
    if panel.heat is None and not panel.cells:
        axes.grid(visible=True, axis="y", which="major", color=FAINT, linewidth=0.4)
