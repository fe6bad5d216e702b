"""Where each body of a driveline sketch stands.

Bodies joined by couplings stand side by side on one shaft line; a gear mesh leads down to the next line, as on any
transmission drawing. A body that drives several gears gets a longer shaft: one *seat* for each of them, side by side.
Each train begins with an end of its shaft, the driven body if that is one.

Takes a Layout; gives grid cells to ``sketch``.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from gearrattle.trajectory import Layout

Cell = tuple[int, int]
"""Column, row."""


@dataclass
class Placement:
    """The cells of a sketch.

    Attributes:
        bodies: cell of each inertia index.
        grounds: cell of the ground symbol of each element index tied to ground.
        seats: for each mesh drawn straight down, by element index: the cell on the upper body's shaft it hangs from.
        shafts: by inertia index, the column of the last seat on its shaft.
    """

    bodies: dict[int, Cell] = field(default_factory=dict)
    grounds: dict[int, Cell] = field(default_factory=dict)
    seats: dict[int, Cell] = field(default_factory=dict)
    shafts: dict[int, int] = field(default_factory=dict)

    @property
    def cells(self) -> list[Cell]:
        """Every cell that holds something."""
        return [*self.bodies.values(), *self.grounds.values(), *self.seats.values()]


def place(layout: Layout) -> Placement:
    """Place all bodies, and one ground symbol for every element that is tied to ground."""
    placement = Placement()
    degree = [int((layout.between == body).sum()) for body in range(len(layout.inertia_names))]
    starts = sorted(range(len(degree)), key=lambda body: (degree[body] > 1, body != layout.reference, body))
    for start in starts:
        if start not in placement.bodies:
            row = 1 + max((row for _, row in placement.cells), default=-1)
            placement.bodies[start] = (0, row)
            _grow(layout, start, placement)
    return placement


def _grow(layout: Layout, start: int, placement: Placement) -> None:
    """Walk one train breadth first: of each body first the gears below it, then what its couplings lead to."""
    queue = deque([start])
    while queue:
        body = queue.popleft()
        placement.shafts.setdefault(body, placement.bodies[body][0])
        for meshes in (True, False):
            for element, pair in enumerate(layout.between.tolist()):
                if body not in pair or bool(layout.is_mesh[element]) != meshes:
                    continue
                other = pair[1] if pair[0] == body else pair[0]
                if other in placement.bodies or (other < 0 and element in placement.grounds):
                    continue
                if meshes and other >= 0:
                    _hang(body, element, other, placement)
                else:
                    _append(body, element, other, placement)
                if other >= 0:
                    queue.append(other)


def _hang(body: int, element: int, other: int, placement: Placement) -> None:
    """Place a gear below the first seat of the body's shaft with nothing beneath it, making a seat if there is none."""
    column, row = placement.bodies[body]
    taken = set(placement.cells)
    while (column, row + 1) in taken or (column > placement.shafts[body] and (column, row) in taken):
        column += 1
    placement.seats[element] = (column, row)
    placement.shafts[body] = max(placement.shafts[body], column)
    placement.bodies[other] = (column, row + 1)


def _append(body: int, element: int, other: int, placement: Placement) -> None:
    """Place what a coupling leads to in the next column, on the body's own line if it is free there, or below."""
    column, row = placement.shafts[body] + 1, placement.bodies[body][1]
    taken = set(placement.cells)
    while (column, row) in taken:
        row += 1
    if other < 0:
        placement.grounds[element] = (column, row)
    else:
        placement.bodies[other] = (column, row)
