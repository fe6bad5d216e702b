"""The driveline at a glance: bodies, springs, gaps and gears, coloured by what rattles.

An inline SVG of our own drawing. Bodies are discs seen from the side, taller for larger inertia. Whatever rattles
carries the colour of its regime, its word and its rate, so that no meaning rests on colour alone.

Takes Findings; gives SVG text to the report.
"""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from gearrattle.pipeline import Findings
from gearrattle.plots import symbols
from gearrattle.plots.numerals import numeral, quantity
from gearrattle.plots.palette import MUTED, REGIMES
from gearrattle.plots.placement import Cell, Placement, place
from gearrattle.trajectory import Array, Layout

if TYPE_CHECKING:
    from gearrattle.criteria import Part
    from gearrattle.model import Torque

_PITCH_X, _PITCH_Y = 196, 200
_LEFT, _RIGHT, _TOP, _BOTTOM = 92, 150, 104, 96
_HALF_WIDTH = 13.0
_SHORTEST, _TALLEST = 34.0, 74.0


@dataclass(frozen=True)
class _Scene:
    """What is drawn, and where; half heights of the discs [px]."""

    findings: Findings
    layout: Layout
    placement: Placement
    heights: Array

    def at(self, body: int, element: int) -> symbols.Point:
        """Return the middle of a body, or of an element's ground symbol if the body is ground (-1)."""
        return self.pixel(self.placement.bodies[body] if body >= 0 else self.placement.grounds[element])

    def pixel(self, cell: Cell) -> symbols.Point:
        """Return the middle of a cell."""
        column, row = cell
        return _LEFT + column * _PITCH_X, _TOP + row * _PITCH_Y

    def unit(self, unit: str) -> str:
        """Return the unit, or nothing in a dimensionless model."""
        return unit if self.findings.model.units == "SI" else ""


def sketch(findings: Findings) -> str:
    """Draw the driveline.

    Returns:
        One ``<svg>`` element with its size in its viewBox, a title and a description for screen readers.
    """
    layout = findings.run.trajectory.layout
    placement = place(layout)
    scene = _Scene(findings, layout, placement, _disc_heights(layout.inertia))
    width = _LEFT + _RIGHT + max(column for column, _ in placement.cells) * _PITCH_X
    height = _TOP + _BOTTOM + max(row for _, row in placement.cells) * _PITCH_Y
    drawn = [_element(scene, element) for element in range(len(layout.element_names))]
    drawn += [symbols.ground(*scene.at(-1, element)) for element in placement.grounds]
    drawn += [_body(scene, body) for body in placement.bodies]
    words = escape(f"{findings.model.name}: {findings.verdict.sentence}")
    return (
        f'<svg class="sketch" viewBox="0 0 {width} {height}" style="max-width:{width}px" role="img" '
        f'aria-label="Driveline sketch"><title>Driveline sketch</title><desc>{words}</desc>{"".join(drawn)}</svg>'
    )


def _disc_heights(inertia: Array) -> Array:
    """Return half heights of the discs [px], by the logarithm of their inertia."""
    size = np.log10(inertia)
    spread = float(np.ptp(size)) or 1.0
    return np.asarray(0.5 * (_SHORTEST + (_TALLEST - _SHORTEST) * (size - size.min()) / spread), dtype=np.float64)


def _body(scene: _Scene, body: int) -> str:
    """Draw one disc with its name, inertia and loads."""
    x, y = scene.at(body, -1)
    half = float(scene.heights[body])
    name = scene.layout.inertia_names[body]
    inertia = quantity(float(scene.layout.inertia[body]), scene.unit("kg m²"))
    lines = [f'<tspan class="name">{escape(name)}</tspan>', f"J = {inertia}"]
    lines += [f'<tspan class="load">{words}</tspan>' for words in _loads(scene, name)]
    up, down = _mesh_sides(scene, body)
    seats = {
        x,
        *(scene.pixel(seat)[0] for element, seat in scene.placement.seats.items() if _upper(scene, element) == body),
    }
    drawn = symbols.shaft(x, max(seats), y) if len(seats) > 1 else ""
    drawn += "".join(symbols.disc(seat, y, _HALF_WIDTH, half) for seat in sorted(seats))
    if up and down:
        return drawn + symbols.text(x + _HALF_WIDTH + 8, y + half + 6, lines, "start")
    top = y + half + 18 if up else y - half - 10 - symbols.LINE_HEIGHT * (len(lines) - 1)
    return drawn + symbols.text(x, top, lines, "middle")


def _loads(scene: _Scene, name: str) -> list[str]:
    """Say what drives and what drags one body."""
    words = [_torque(scene, torque) for torque in scene.findings.model.torques if torque.on == name]
    inertia = next(i for i in scene.findings.model.inertias if i.name == name)
    if inertia.drag_torque:
        words.append(f"drag {quantity(inertia.drag_torque, scene.unit('N m'))}")
    return words


def _torque(scene: _Scene, torque: Torque) -> str:
    pieces = [quantity(torque.mean, scene.unit("N m"))] if torque.mean or not torque.harmonics else []
    orders = [numeral(term.order) for term in torque.harmonics]
    if orders:
        listed = ", ".join(orders) if len(orders) <= 4 else f"{orders[0]} … {orders[-1]}"
        pieces.append(f"order{'s' if len(orders) > 1 else ''} {listed}")
    return "↻ " + ", ".join(pieces)


def _upper(scene: _Scene, element: int) -> int:
    """Return the body whose shaft carries a mesh that is drawn straight down."""
    row = scene.placement.seats[element][1]
    ends: list[int] = scene.layout.between[element].tolist()
    return next(end for end in ends if scene.placement.bodies[end][1] == row)


def _mesh_sides(scene: _Scene, body: int) -> tuple[bool, bool]:
    """Return whether a mesh leaves the body upward, and whether one leaves its first seat downward."""
    cells = scene.placement.bodies
    hung = [e for e in scene.placement.seats if body in scene.layout.between[e]]
    return (
        any(_upper(scene, e) != body for e in hung),
        any(_upper(scene, e) == body and scene.placement.seats[e] == cells[body] for e in hung),
    )


def _element(scene: _Scene, element: int) -> str:
    """Draw one coupling or mesh between its two bodies, or between a body and ground."""
    layout, placement = scene.layout, scene.placement
    ends: list[int] = layout.between[element].tolist()
    part = next((p for p in scene.findings.verdict.parts if p.name == layout.element_names[element]), None)
    colour = REGIMES[part.regime] if part else MUTED
    label = _label(layout.element_names[element], part)
    gap = element in layout.clearance
    if element in placement.seats:
        upper = _upper(scene, element)
        lower = ends[0] if ends[1] == upper else ends[1]
        x, y = scene.pixel(placement.seats[element])
        top, bottom = y + float(scene.heights[upper]), y + _PITCH_Y - float(scene.heights[lower])
        drawn = symbols.mesh(x, top, bottom, colour, gap=gap)
        return drawn + symbols.text(x + 26, 0.5 * (top + bottom) - 2, label, "start")
    left, right = sorted(ends, key=lambda end: scene.at(end, element))
    (x_a, y_a), (x_b, y_b) = scene.at(left, element), scene.at(right, element)
    if left >= 0 and not layout.is_mesh[element]:
        x_a = scene.pixel((placement.shafts[left], 0))[0]
    earlier = sum(set(ends) == set(pair) for pair in layout.between[:element].tolist())
    if not earlier and y_a == y_b and x_b - x_a == _PITCH_X:
        drawn = symbols.spring(x_a + _HALF_WIDTH, x_b - _HALF_WIDTH, y_a, colour, gap=gap)
        return drawn + symbols.text(0.5 * (x_a + x_b), y_a + 30, label, "middle")
    drawn, (x, y) = symbols.bow((x_a, y_a), (x_b, y_b), 34.0 + 36.0 * earlier, colour)
    return drawn + (symbols.text(x + 6, y, label, "start") if x_a == x_b else symbols.text(x, y + 16, label, "middle"))


def _label(name: str, part: Part | None) -> list[str]:
    lines = [f'<tspan class="name">{escape(name)}</tspan>']
    if part is not None:
        words = [part.regime, *([f"{numeral(part.impacts_per_cycle, 3)} per cycle"] * (part.regime != "quiet"))]
        lines += [f'<tspan class="regime" fill="{REGIMES[part.regime]}">{word}</tspan>' for word in words]
    return lines
