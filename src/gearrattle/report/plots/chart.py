"""A figure as plain data, without a renderer.

A ``Chart`` is a grid of ``Panel``s; a panel holds lines, filled bars and cells, shaded bands and thin rules. Charts
are frozen, so every renderer draws the same data: ``interactive`` data for a browser, ``static`` an SVG, ``typeset`` a
matplotlib figure for print. A test can read them too.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from gearrattle.report.plots.palette import ACCENT, CENTRE, MUTED
from gearrattle.trajectory import Array

Mark = Literal["line", "points"]
Shape = Literal["", "circle", "square", "diamond", "triangle", "inverted triangle", "cross", "plus", "star"]
Dash = Literal["", "solid", "dashed", "dotted"]


@dataclass(frozen=True)
class Line:
    """One curve or one cloud of points.

    Attributes
    ----------
    x, y
        (N,) coordinates in the units of the panel's axes; NaN lifts the pen.
    colour
        ``"#rrggbb"``.
    width
        line width, or point diameter [px].
    shape
        shape of the points, if it has a meaning; empty: a circle, or in print a marker that depends on the colour.
    dash
        dashes of the line, if they have a meaning; empty: solid, or in print dashes that depend on the colour.
    """

    x: Array
    y: Array
    name: str
    colour: str = ACCENT
    mark: Mark = "line"
    width: float = 1.3
    opacity: float = 1.0
    legend: bool = False
    shape: Shape = ""
    dash: Dash = ""


@dataclass(frozen=True)
class Bars:
    """A histogram: heights over bins, bottom to top.

    Attributes
    ----------
    edges
        (N + 1,) ascending bin edges.
    heights
        (N,) heights.
    base
        (N,) lower ends of the bars; zero by default.
    """

    edges: Array
    heights: Array
    name: str
    colour: str = ACCENT
    base: Array | None = None
    legend: bool = False


@dataclass(frozen=True)
class Cells:
    """Filled rectangles of one colour: the cells of a map with the same meaning, or horizontal bars.

    The edges (N,) are in the units of the axes.
    """

    left: Array
    right: Array
    low: Array
    high: Array
    name: str
    colour: str = ACCENT


@dataclass(frozen=True)
class Heat:
    """A map of numbers over equal cells, in shades from ``low`` to ``high`` (``palette.shade``).

    Attributes
    ----------
    x_range, y_range
        outer edges of the map, in the units of the axes.
    values
        (rows, columns), the first row lowest; NaN leaves a cell empty.
    low, high
        values of the lightest and darkest shade; values outside have the shade of the nearer end.
    name
        name of the numbers with their unit, shown at the pointer.
    """

    x_range: tuple[float, float]
    y_range: tuple[float, float]
    values: Array
    low: float
    high: float
    name: str


@dataclass(frozen=True)
class Band:
    """A shaded strip across a panel, between ``low`` and ``high`` on the axis ``along``; None reaches the edge."""

    low: float | None
    high: float | None
    colour: str
    along: Literal["x", "y"] = "y"
    opacity: float = 0.08


@dataclass(frozen=True)
class Rule:
    """A thin straight line across a panel at ``at`` on the axis ``along``, with an optional small label."""

    at: float
    along: Literal["x", "y"] = "y"
    colour: str = CENTRE
    dashed: bool = True
    label: str = ""


@dataclass(frozen=True)
class Label:
    """A few words near a point of a panel, in units of its axes: right of it, above it and ending there, or at it."""

    x: float
    y: float
    words: str
    colour: str = MUTED
    side: Literal["above", "right", "at"] = "right"


@dataclass(frozen=True)
class Panel:
    """One pair of axes.

    Attributes
    ----------
    unit
        unit of the y axis, printed after the title.
    x_title
        title of the x axis; drawn below the lowest panel of a column only if the chart shares it.
    heat, lines, bars, cells, bands, rules, labels
        content of the panel; heat, bands and cells are drawn first, lines and labels last.
    x_range, y_range
        limits; None fits the data.
    x_ticks, y_ticks
        positions and words of the ticks; empty: round values.
    note
        words to print in an empty panel.
    equal_scales
        whether one unit has the same length on both axes; the limits are then widened.
    """

    title: str
    unit: str = ""
    x_title: str = ""
    lines: tuple[Line, ...] = ()
    bars: tuple[Bars, ...] = ()
    bands: tuple[Band, ...] = ()
    rules: tuple[Rule, ...] = ()
    labels: tuple[Label, ...] = ()
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    y_log: bool = False
    x_log: bool = False
    cells: tuple[Cells, ...] = ()
    x_ticks: tuple[tuple[float, str], ...] = ()
    y_ticks: tuple[tuple[float, str], ...] = ()
    note: str = ""
    heat: Heat | None = None
    equal_scales: bool = False


@dataclass(frozen=True)
class Key:
    """One entry of a chart's legend: a coloured swatch, or the shape or the dash that it explains, and a word."""

    name: str
    colour: str = MUTED
    shape: Shape = ""
    dash: Dash = ""


@dataclass(frozen=True)
class Chart:
    """A figure.

    Attributes
    ----------
    key
        short name, used for file names and anchors.
    caption
        one or two sentences on how to read the figure; also its text for screen readers.
    panels
        in reading order, row by row.
    panel_height
        height of one panel [px].
    share_x
        whether all panels show the same x axis (zooming one then zooms all).
    group
        charts with the same group are shown in tabs of one section.
    """

    key: str
    title: str
    caption: str
    panels: tuple[Panel, ...]
    columns: int = 1
    panel_height: int = 132
    share_x: bool = True
    legend: tuple[Key, ...] = field(default=())
    group: str = ""
    tab: str = ""

    @property
    def rows(self) -> int:
        """Number of rows of the grid."""
        return -(-len(self.panels) // self.columns)

    def is_bottom(self, index: int) -> bool:
        """Whether no panel lies below panel ``index``."""
        return index + self.columns >= len(self.panels)
