"""Dashes, markers and hatching by colour, so that curves can be distinguished without colour.

On a black-and-white printer two colours may have the same grey. So every colour of curves in a chart has its own
dashes, every colour of points its own marker, and areas with similar greys are hatched. A colour has the same look in
all panels of a chart. Grey that is not in the legend is context, and is drawn as thin solid lines.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from gearrattle.report.plots.chart import Chart, Dash, Key, Shape
from gearrattle.report.plots.palette import CENTRE, FAINT, MUTED, NO_VALUE, PAPER
from gearrattle.report.plots.shapes import SHAPES
from gearrattle.report.plots.typeset.style import POINTS

Dashes = tuple[float, tuple[float, ...] | None]
_DASHES: tuple[tuple[float, ...] | None, ...] = (
    None, (4.0, 1.5), (1.2, 1.2), (6.0, 1.5, 1.2, 1.5), (8.0, 2.0), (2.5, 1.2), (6.0, 1.2, 1.2, 1.2, 1.2, 1.2),
    (10.0, 2.0, 3.0, 2.0),
)  # fmt: skip
"""Lengths of dashes and gaps [pt]."""
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p", "h", "*", "d", "8")
_HATCHES = ("", "////", "....", "xxxx", "\\\\\\\\", "++++", "oo")
_NO_VALUE = "/////"
"""Hatching of cells without a value: finer than the others, and dark on paper, while others are white on a colour."""
_CONTEXT = frozenset({MUTED, CENTRE, FAINT})
_APART = 0.12
"""Least difference of two greys (0 black to 1 white) that can be seen on paper."""


@dataclass(frozen=True)
class Looks:
    """How each colour of a chart is drawn: dashes and widths [pt] of curves, markers of points, hatches of areas."""

    dashes: dict[str, Dashes]
    widths: dict[str, float]
    markers: dict[str, str]
    hatches: dict[str, str]

    def handle(self, key: Key) -> Any:
        """Return what stands next to a word of the legend."""
        from matplotlib.lines import Line2D
        from matplotlib.patches import Patch

        # keys with a shape or dash of their own
        style: dict[str, Any]
        colour = key.colour
        if key.shape or key.dash:
            style = {"linestyle": self.dash(colour, key.dash) if key.dash else "none", "linewidth": 1.0}
            if key.shape:
                style |= {"marker": self.marker(colour, key.shape), "markersize": 4.5}
                style["markeredgewidth"] = self.edge(key.shape)
            return Line2D([], [], color=colour, label=key.name, **style)
        # keys of curves and points by colour
        if colour in self.dashes or colour in self.markers:
            style = {"linestyle": "none"}
            if colour in self.dashes:
                style = {"linestyle": self.dashes[colour], "linewidth": self.widths[colour]}
            if colour in self.markers:
                style |= {"marker": self.markers[colour], "markersize": 3.5, "markeredgewidth": 0.0}
            return Line2D([], [], color=colour, label=key.name, **style)
        # keys of areas
        hatch = self.hatches.get(colour, "")
        if colour == NO_VALUE:
            return Patch(facecolor=PAPER, edgecolor=NO_VALUE, linewidth=0.0, hatch=hatch, label=key.name)
        return Patch(facecolor=colour, edgecolor=PAPER, linewidth=0.0, hatch=hatch or None, label=key.name)

    def dash(self, colour: str, dash: Dash) -> Dashes:
        """Return the dashes of a line: those that mean something, or those of its colour."""
        if dash:
            return (0.0, {"dashed": _DASHES[1], "dotted": _DASHES[2]}.get(dash))
        return self.dashes.get(colour, (0.0, None))

    def marker(self, colour: str, shape: Shape) -> str:
        """Return the marker of points: the shape that means something, or that of their colour."""
        return SHAPES[shape].matplotlib if shape else self.markers.get(colour, "o")

    def edge(self, shape: Shape) -> float:
        """Return the width of the strokes of a marker [pt]; none for areas."""
        return 0.8 if shape and SHAPES[shape].is_open else 0.0


def looks_of(chart: Chart) -> Looks:
    """Give every colour of a chart its look, those of the legend first."""
    panels = chart.panels
    curves = [line for panel in panels for line in panel.lines if line.mark == "line" and line.x.size]
    points = [line for panel in panels for line in panel.lines if line.mark == "points" and line.x.size]
    areas = [bars.colour for panel in panels for bars in panel.bars]
    areas += [cells.colour for panel in panels for cells in panel.cells]
    legend = [key.colour for key in chart.legend]
    dashed = _ordered({line.colour for line in curves}, legend, (line.colour for line in curves))
    dotted = _ordered({line.colour for line in points}, legend, (line.colour for line in points))
    named = [colour for colour in dashed if colour not in _CONTEXT or colour in legend]
    own = sorted(named, key=lambda colour: colour in _CONTEXT)  # grey takes what is left
    widths = {line.colour: min(1.2, stroke(line.width)) for line in curves}
    dashes = dict.fromkeys(dashed, (0.0, None)) | {c: (0.0, _DASHES[k % len(_DASHES)]) for k, c in enumerate(own)}
    markers = {PAPER: "o"} | {c: _MARKERS[k % len(_MARKERS)] for k, c in enumerate(c for c in dotted if c != PAPER)}
    return Looks(dashes, widths, markers, _hatched(_ordered(set(areas), legend, areas)))


def stroke(width: float) -> float:
    """Return a width on the page [px] as one in print [pt], none finer than a printer holds."""
    return max(0.35, width * POINTS)


def blended(colour: str, opacity: float) -> str:
    """Return what a colour of some opacity looks like on paper; EPS knows no transparency."""
    pairs = ((int(colour[k : k + 2], 16), int(PAPER[k : k + 2], 16)) for k in (1, 3, 5))
    return "#" + "".join(f"{round(b + opacity * (a - b)):02x}" for a, b in pairs)


def grey(colour: str) -> float:
    """Return how light a colour is on a black-and-white printer, 0 to 1 (ITU-R BT.601 luma)."""
    red, green, blue = (int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    return 0.299 * red + 0.587 * green + 0.114 * blue


def _ordered(used: set[str], legend: Iterable[str], drawn: Iterable[str]) -> list[str]:
    """Return colours in the order of the legend, then of drawing."""
    return [colour for colour in dict.fromkeys((*legend, *drawn)) if colour in used]


def _hatched(colours: list[str]) -> dict[str, str]:
    """Hatch every colour whose grey is close to that of one before with the same hatching."""
    hatches = {NO_VALUE: _NO_VALUE} if NO_VALUE in colours else {}
    for colour in (one for one in colours if one != NO_VALUE):
        free = (
            hatch
            for hatch in _HATCHES
            if all(abs(grey(colour) - grey(other)) >= _APART for other, own in hatches.items() if own == hatch)
        )
        hatches[colour] = next(free, _HATCHES[-1])
    return hatches
