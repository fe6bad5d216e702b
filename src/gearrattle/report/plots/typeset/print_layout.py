"""A chart as a matplotlib figure: panels on a grid, the legend above them, colour scales of maps on the right.

The figure is exactly as wide as asked; a narrow figure has fewer columns of panels. The height of a panel follows from
its height on the HTML page (``panel_height``). Titles, axis labels and the legend are measured when they are drawn; the
height of the figure is the height of the panels plus the height of these.

The caller may change the figure afterwards.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.plots.chart import Chart, Key
from gearrattle.report.plots.palette import MUTED, shade
from gearrattle.report.plots.svg_axes import limits
from gearrattle.report.plots.typeset.marks import draw_marks, grid
from gearrattle.report.plots.typeset.overlap_removal import settle_axes, settle_words
from gearrattle.report.plots.typeset.print_axes import number_label, prepare
from gearrattle.report.plots.typeset.row_names import rows_of
from gearrattle.report.plots.typeset.style import Style
from gearrattle.report.plots.typeset.styles_by_colour import Looks, looks_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation, Text

_NARROWEST = 40.0
"""Least width of a column of panels [mm]; twice as much for panels whose rows have names."""
_LOWEST = 16.0  # mm, least height of a panel
_SHEET = 235.0  # mm, largest height of a figure on a sheet of paper
_SCREEN = 880.0  # pixels, width of a chart on the HTML page
_INCH = 25.4  # mm


def matplotlib_figure(chart: Chart, style: Style | None = None) -> Figure:
    """Draw a chart for print.

    Parameters
    ----------
    style
        width, fonts and line widths; None: 175 mm wide, sans-serif letters of 8 pt.

    Returns
    -------
    Figure
        A figure of matplotlib's object-oriented interface: pyplot does not know it, so it need not be closed. Its axes
        are the panels in reading order, then the scales of maps. Its label is the chart's key. Its layout is fixed, so
        that it is saved with the measured layout; ``set_layout_engine("constrained")`` makes room for longer words.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    # columns that fit the width, and the height of panels
    how = style or Style()
    named = any(rows_of(panel).panel is not panel for panel in chart.panels)
    columns = max(1, min(chart.columns, int(how.millimetres // (2.0 * _NARROWEST if named else _NARROWEST))))
    rows = -(-len(chart.panels) // columns)
    height = panel_height(chart, how, rows)
    with how.context():
        # an empty figure
        figure = Figure(
            figsize=(how.millimetres / _INCH, (rows * (height + 10.0) + 12.0) / _INCH),
            layout="constrained",
            dpi=100.0,
            label=chart.key,
        )
        FigureCanvasAgg(figure)
        # panels, scales of maps and the legend
        titles, words = _panels(figure, chart, rows, columns)
        looks = looks_of(chart)
        _scales(figure, chart)
        _legend(figure, chart, looks)
        # words that overlap are moved, then the layout is fixed
        settle_axes(figure, titles, height / _INCH)
        settle_words(figure, words)
        figure.set_layout_engine("none")
    return figure


def panel_height(chart: Chart, style: Style, rows: int) -> float:
    """Return the height of one panel [mm], within a sheet.

    A figure of 175 mm has the scale of the HTML page, 175 mm to 880 pixels. The height grows with the power 0.6 of the
    width, so that panels of a narrower figure are higher in proportion and their curves can still be read.
    """
    scale = (style.millimetres / _SCREEN) ** 0.6 * (175.0 / _SCREEN) ** 0.4
    return float(max(_LOWEST, min(chart.panel_height * scale, _SHEET / rows - 9.0)))


def _panels(
    figure: Figure, chart: Chart, rows: int, columns: int
) -> tuple[dict[Axes, Text], dict[Axes, list[Annotation]]]:
    """Draw every panel on the grid; return titles, and words inside panels, which may overlap and are moved later."""
    looks = looks_of(chart)
    inches = float(figure.get_figwidth())
    shares_x = chart.share_x and len({limits(panel)[0] for panel in chart.panels}) == 1
    cells = figure.add_gridspec(rows, columns)
    first: Axes | None = None
    titles = {}
    words = {}
    for index, panel in enumerate(chart.panels):
        axes = figure.add_subplot(cells[divmod(index, columns)], sharex=first if shares_x else None)
        first = first or axes
        titles[axes] = prepare(
            axes, rows_of(panel), labelled=not shares_x or index + columns >= len(chart.panels), inches=inches
        )
        grid(axes, panel)
        words[axes] = draw_marks(axes, rows_of(panel), looks, inches=inches)
        axes.set_autoscale_on(False)
        if panel.note:
            axes.text(0.5, 0.5, panel.note, transform=axes.transAxes, ha="center", va="center", color=MUTED)
    return titles, words


def _scales(figure: Figure, chart: Chart) -> None:
    """Draw the colour scales of maps; maps with the same range and meaning share one."""
    from matplotlib import rcParams

    # groups of maps with the same range and meaning
    maps = [(axes, panel.heat) for axes, panel in zip(list(figure.axes), chart.panels, strict=True) if panel.heat]
    groups: dict[tuple[float, float, str], list[Axes]] = {}
    for axes, heat in maps:
        groups.setdefault((heat.low, heat.high, heat.name), []).append(axes)
    for (_, _, name), members in groups.items():
        # one scale for every group, shorter where the group has several rows
        rows = len({axes.get_subplotspec().rowspan.start for axes in members})  # type: ignore[union-attr]
        scale = figure.colorbar(
            members[0].images[0],
            ax=members,
            label=name,
            aspect=30.0 if rows == 1 else 40.0,
            pad=0.02,
            format=number_label,
            shrink=1.0 if rows == 1 else 0.6,
            anchor=(0.0, 1.0),
        )
        scale.outline.set_visible(False)
        scale.ax.tick_params(
            length=rcParams["ytick.major.size"],
            labelsize=rcParams["ytick.labelsize"],
            labelfontfamily=rcParams["font.family"],
        )


def _legend(figure: Figure, chart: Chart, looks: Looks) -> None:
    """Write the legend above the panels, in as many columns as fit; the shades of a map are in its colour scale."""
    keys = _keys(chart)
    if not keys:
        return
    handles = [looks.handle(key) for key in keys]
    for columns in range(len(keys), 0, -1):
        legend = figure.legend(handles=handles, loc="outside upper left", ncols=columns)
        if columns == 1 or legend.get_window_extent().width <= 0.98 * figure.bbox.width:
            return
        legend.remove()


def _keys(chart: Chart) -> list[Key]:
    """Return the keys of the legend without those for the shades of maps."""
    if not any(panel.heat for panel in chart.panels):
        return list(chart.legend)
    shades = {shade(share) for n in range(2, 13) for share in np.linspace(0.0, 1.0, n).tolist()}
    return [key for key in chart.legend if key.colour not in shades]
