"""The drawing symbols of a driveline sketch, as SVG.

A zigzag is a spring, two vertical bars a clearance, teeth facing teeth a gear mesh, hatching the ground. The paths of a
coupling and a mesh are in ``model/components/coupling.py`` and ``mesh.py``. Positions are in pixels.
"""

from __future__ import annotations

from gearrattle.model import Coupling, Mesh
from gearrattle.model.table_symbol import Symbol
from gearrattle.report.plots.palette import INK

Point = tuple[float, float]

LINE_HEIGHT = 15.0


def text(x: float, y: float, lines: list[str], anchor: str) -> str:
    """Write lines of (escaped) text below each other, the first on the base line ``y``."""
    return "".join(
        f'<text x="{x:g}" y="{y + LINE_HEIGHT * number:.1f}" text-anchor="{anchor}">{line}</text>'
        for number, line in enumerate(lines)
    )


def disc(x: float, y: float, half_width: float, half_height: float) -> str:
    """Draw a rotating body seen from the side."""
    return (
        f'<rect class="disc" x="{x - half_width:g}" y="{y - half_height:.1f}" width="{2 * half_width:g}" '
        f'height="{2 * half_height:.1f}" rx="4"/>'
    )


def shaft(left: float, right: float, y: float) -> str:
    """Draw the rigid shaft between two gears of one body."""
    return f'<path class="link" style="stroke-width:5" stroke="{INK}" d="M{left:g} {y:g} H{right:g}"/>'


def spring(left: float, right: float, y: float, colour: str, *, gap: bool) -> str:
    """Draw a shaft line with a spring, and with a clearance after it where there is one."""
    return _path(_along(Coupling.gap_symbol if gap else Coupling.symbol, left, right, y), colour)


def mesh(x: float, top: float, bottom: float, colour: str, *, gap: bool) -> str:
    """Draw two gears in mesh, teeth from above and from below, apart where there is backlash."""
    path = _along(Mesh.gap_symbol if gap else Mesh.symbol, 0.0, bottom - top, 0.0)
    return f'<path class="link" stroke="{colour}" transform="translate({x:g} {top:.1f}) rotate(90)" d="{path}"/>'


def _along(symbol: Symbol, left: float, right: float, y: float) -> str:
    """Return the path data of a line with a symbol in its middle."""
    return f"M{left:g} {y:g} H{0.5 * (left + right - symbol.width):g} {symbol.path} H{right:g}"


def bow(a: Point, b: Point, depth: float, colour: str) -> tuple[str, Point]:
    """Draw an element that runs parallel to another one, or between bodies far apart, and return its outermost point.

    The point is ``depth`` [px] below the middle, or beside it where one end is above the other.
    """
    aside = a[0] == b[0]
    x, y = 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])
    outermost = (x + depth, y) if aside else (x, y + depth)
    control = (x + 2.0 * depth, y) if aside else (x, y + 2.0 * depth)
    path = f"M{a[0]:g} {a[1]:g} Q{control[0]:g} {control[1]:g} {b[0]:g} {b[1]:g}"
    return _path(path, colour), outermost


def axle(a: Point, b: Point) -> str:
    """Draw what carries a planet, between the middles of two discs: behind them, dashed."""
    return f'<path class="link" stroke="{INK}" stroke-dasharray="5 4" d="M{a[0]:g} {a[1]:g} L{b[0]:g} {b[1]:g}"/>'


def ground(x: float, y: float) -> str:
    """Draw the fixed frame."""
    hatch = "".join(f" M{x + 6:g} {y + step:g} l9 8" for step in range(-26, 22, 9))
    return _path(f"M{x - 13:g} {y:g} h19 M{x + 6:g} {y - 26:g} v52{hatch}", INK)


def _path(d: str, colour: str) -> str:
    return f'<path class="link" stroke="{colour}" d="{d}"/>'
