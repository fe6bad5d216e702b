"""Shapes of points and dashes of lines that carry a meaning, so that they can be distinguished without colour.

All renderers draw the same shapes: static SVG and the browser (``browser/plot.js``) as paths, matplotlib as markers by
name, the legend of a page as letters.
"""

from __future__ import annotations

from typing import NamedTuple

from gearrattle.report.plots.chart import Key
from gearrattle.report.plots.palette import NO_VALUE, PAPER


class Drawn(NamedTuple):
    """One shape: its SVG path about the origin, half as wide as 1, and its letter in a line of text.

    An open one is strokes, not an area.
    """

    path: str
    is_open: bool
    matplotlib: str
    letter: str


SHAPES = {
    "circle": Drawn("M-1 0a1 1 0 1 0 2 0a1 1 0 1 0 -2 0z", False, "o", "●"),
    "square": Drawn("M-.9-.9h1.8v1.8h-1.8z", False, "s", "■"),
    "diamond": Drawn("M0-1.2L1.1 0L0 1.2L-1.1 0z", False, "D", "◆"),
    "triangle": Drawn("M0-1.15L1.1.85H-1.1z", False, "^", "▲"),
    "inverted triangle": Drawn("M0 1.15L1.1-.85H-1.1z", False, "v", "▼"),
    "cross": Drawn("M-.9-.9L.9.9M-.9.9L.9-.9", True, "x", "×"),
    "plus": Drawn("M-1.1 0H1.1M0-1.1V1.1", True, "+", "+"),
    "star": Drawn("M0-1.3L.35-.45L1.25-.4L.55.2L.8 1.1L0 .6L-.8 1.1L-.55.2L-1.25-.4L-.35-.45z", False, "*", "★"),
}
"""Every shape."""
DASHES = {"dashed": "5 3", "dotted": "2 2"}
"""On and off [px]."""


def background(key: Key) -> str:
    """Return the CSS background of an entry's swatch: its colour, or the hatching of cells without a value."""
    if key.colour != NO_VALUE:
        return key.colour
    return f"repeating-linear-gradient(135deg, {NO_VALUE} 0 1.5px, {PAPER} 1.5px 4px)"


def swatch(key: Key) -> str:
    """Return the letters that stand for an entry of a legend: its shape or dash; empty for a swatch of its colour."""
    if key.shape:
        return SHAPES[key.shape].letter
    return {"": "", "solid": "──", "dashed": "╌╌", "dotted": "┈┈"}[key.dash]
