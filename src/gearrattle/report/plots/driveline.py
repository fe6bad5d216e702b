"""A driveline laid out for drawing: positions of bodies and elements in pixels, and their symbols.

Colours and words come from the drawings that use this layout (``sketch``, ``mode_shapes``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearrattle.report.plots import symbols
from gearrattle.report.plots.placement import Cell, Placement, carriers, place
from gearrattle.trajectory import Array, Layout

HALF_WIDTH = 13.0
_SHORTEST = 34.0
_TALLEST = 74.0


@dataclass(frozen=True)
class Frame:
    """Distances of a sketch [px]: from cell to cell, and from the outermost cells to the edges."""

    pitch_x: float
    pitch_y: float
    left: float
    right: float
    top: float
    bottom: float


@dataclass(frozen=True)
class Scene:
    """The layout of a drawing: the placement of bodies, and half heights of their discs [px]."""

    layout: Layout
    placement: Placement
    heights: Array
    frame: Frame

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the drawing."""
        frame = self.frame
        cells = self.placement.cells
        return (
            frame.left + frame.right + max(column for column, _ in cells) * frame.pitch_x,
            frame.top + frame.bottom + max(row for _, row in cells) * frame.pitch_y,
        )

    def at(self, body: int, element: int) -> symbols.Point:
        """Return the middle of a body, or of an element's ground symbol if the body is ground (-1)."""
        return self.pixel(self.placement.bodies[body] if body >= 0 else self.placement.grounds[element])

    def pixel(self, cell: Cell) -> symbols.Point:
        """Return the middle of a cell."""
        column, row = cell
        return self.frame.left + column * self.frame.pitch_x, self.frame.top + row * self.frame.pitch_y

    def upper(self, element: int) -> int:
        """Return the body whose shaft carries a mesh that is drawn straight down."""
        row = self.placement.seats[element][1]
        ends: list[int] = self.layout.between[element].tolist()
        return next(end for end in ends if self.placement.bodies[end][1] == row)

    def mesh_sides(self, body: int) -> tuple[bool, bool]:
        """Return whether a mesh leaves the body upward, and whether one leaves its first seat downward."""
        cells = self.placement.bodies
        hung = [e for e in self.placement.seats if body in self.layout.between[e]]
        return (
            any(self.upper(e) != body for e in hung),
            any(self.upper(e) == body and self.placement.seats[e] == cells[body] for e in hung),
        )


def scene(layout: Layout, frame: Frame) -> Scene:
    """Lay a driveline out."""
    return Scene(layout, place(layout), disc_heights(layout.inertia), frame)


def disc_heights(inertia: Array) -> Array:
    """Return half heights of the discs [px], by the logarithm of their inertia."""
    size = np.log10(inertia)
    spread = float(np.ptp(size)) or 1.0
    return np.asarray(0.5 * (_SHORTEST + (_TALLEST - _SHORTEST) * (size - size.min()) / spread), dtype=np.float64)


def body(scene: Scene, number: int, lines: Sequence[str], up: float = 0.0, down: float = 0.0) -> str:
    """Draw one disc, or one for every gear it carries, and write lines where they are free of meshes.

    Lines are escaped text. Something else reaches ``up`` and ``down`` from its middle [px].
    """
    x, y = scene.at(number, -1)
    half = float(scene.heights[number])
    above, below = scene.mesh_sides(number)
    seats = {
        x,
        *(scene.pixel(seat)[0] for element, seat in scene.placement.seats.items() if scene.upper(element) == number),
        *(scene.pixel(foot)[0] for foot in scene.placement.feet.get(number, ())),
    }
    drawn = symbols.shaft(x, max(seats), y) if len(seats) > 1 else ""
    drawn += "".join(symbols.disc(seat, y, HALF_WIDTH, half) for seat in sorted(seats))
    if above and below:
        return drawn + symbols.text(x + HALF_WIDTH + 8, y + max(half, down) + 6, list(lines), "start")
    over = y - max(half, up) - 10 - symbols.LINE_HEIGHT * (len(lines) - 1)
    return drawn + symbols.text(x, y + max(half, down) + 18 if above else over, list(lines), "middle")


def element(scene: Scene, number: int, colour: str, label: Sequence[str]) -> str:
    """Draw one coupling or mesh between its two bodies, or between a body and ground, with escaped lines of text."""
    # a mesh straight below its upper body
    layout = scene.layout
    placement = scene.placement
    words = list(label)
    ends: list[int] = layout.between[number].tolist()
    gap = number in layout.clearance
    if number in placement.seats:
        upper = scene.upper(number)
        lower = ends[0] if ends[1] == upper else ends[1]
        x, y = scene.pixel(placement.seats[number])
        top = y + float(scene.heights[upper])
        bottom = y + scene.frame.pitch_y - float(scene.heights[lower])
        drawn = symbols.mesh(x, top, bottom, colour, gap=gap)
        return drawn + symbols.text(x + 26, 0.5 * (top + bottom) - 2, words, "start")
    # ends on the shafts of both bodies
    left, right = sorted(ends, key=lambda end: scene.at(end, number))
    (x_a, y_a) = scene.at(left, number)
    (x_b, y_b) = scene.at(right, number)
    if left >= 0 and not layout.is_mesh[number]:
        x_a = scene.pixel((placement.shafts[left], 0))[0]
    # a spring between neighbours, where no earlier element joins them
    earlier = sum(set(ends) == set(pair) for pair in layout.between[:number].tolist())
    if not earlier and y_a == y_b and x_b - x_a == scene.frame.pitch_x:
        drawn = symbols.spring(x_a + HALF_WIDTH, x_b - HALF_WIDTH, y_a, colour, gap=gap)
        return drawn + symbols.text(0.5 * (x_a + x_b), y_a + 30, words, "middle")
    # a bow around what lies between
    drawn, (x, y) = symbols.bow((x_a, y_a), (x_b, y_b), 34.0 + 36.0 * earlier, colour)
    return drawn + (symbols.text(x + 6, y, words, "start") if x_a == x_b else symbols.text(x, y + 16, words, "middle"))


def frames(scene: Scene) -> list[str]:
    """Draw the fixed frame wherever something is tied to it, and the axles of planets on their carriers."""
    drawn = [symbols.ground(*scene.at(-1, number)) for number in scene.placement.grounds]
    first: dict[tuple[int, float], symbols.Point] = {}  # planet of every carrier on every line
    for planet in range(len(scene.layout.inertia_names)):
        x, y = scene.at(planet, -1)
        for carrier in carriers(scene.layout, planet):
            first[carrier, y] = min(first.get((carrier, y), (x, y)), (x, y))
    return drawn + [symbols.axle(point, scene.at(carrier, -1)) for (carrier, _), point in first.items()]
