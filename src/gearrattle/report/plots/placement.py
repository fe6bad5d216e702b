"""The placement of bodies in the sketch of a driveline.

Bodies connected by couplings are side by side on one shaft line. A gear mesh leads down to the next line, as in usual
transmission drawings. A carrier is at the end of the line of its planets. A body that drives several gears has a longer
shaft with one *seat* for every gear. The drawing of a train begins at an end of a shaft, preferably at the driven body.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gearrattle.trajectory import Array, IntArray

Cell = tuple[int, int]
"""Column, row."""


class Connections(Protocol):
    """The attributes of a ``Layout`` that say what connects its bodies."""

    @property
    def between(self) -> IntArray:
        """Return by element the two bodies it lies between, (m, 2); -1 is ground."""
        ...

    @property
    def is_mesh(self) -> NDArray[np.bool_]:
        """Return by element whether it is a gear mesh, (m,)."""
        ...

    @property
    def rows(self) -> Array:
        """Return deflections from angles, (m, n)."""
        ...

    @property
    def reference(self) -> int:
        """Return the driven body."""
        ...


@dataclass
class Placement:
    """The cells of a sketch.

    Attributes
    ----------
    bodies
        cell of each inertia index.
    grounds
        cell of the ground symbol of each element index tied to ground.
    seats
        for each mesh drawn straight down, by element index: the cell on the upper body's shaft it hangs from.
    shafts
        by inertia index, the column of the last seat on its shaft.
    feet
        by inertia index, further cells on its shaft that stand below gears.
    """

    bodies: dict[int, Cell] = field(default_factory=dict)
    grounds: dict[int, Cell] = field(default_factory=dict)
    seats: dict[int, Cell] = field(default_factory=dict)
    shafts: dict[int, int] = field(default_factory=dict)
    feet: dict[int, list[Cell]] = field(default_factory=dict)

    @property
    def cells(self) -> list[Cell]:
        """Every cell that holds something."""
        feet = [cell for cells in self.feet.values() for cell in cells]
        return [*self.bodies.values(), *self.grounds.values(), *self.seats.values(), *feet]


def place(layout: Connections) -> Placement:
    """Place all bodies, and one ground symbol for every element that is tied to ground."""
    placement = Placement()
    degree = np.count_nonzero(layout.rows, axis=0).tolist()
    starts = sorted(range(len(degree)), key=lambda body: (degree[body] > 1, body != layout.reference, body))
    for start in starts:
        if start not in placement.bodies:
            row = 1 + max((row for _, row in placement.cells), default=-1)
            placement.bodies[start] = (0, row)
            _grow(layout, start, placement)
    return placement


def _grow(layout: Connections, start: int, placement: Placement) -> None:
    """Walk one train breadth first: of each body first the gears below it, then what its couplings lead to; bearings
    have no place in it.
    """
    queue = deque([start])
    while queue:
        body = queue.popleft()
        placement.shafts.setdefault(body, placement.bodies[body][0])
        for meshes in (True, False):
            for element, pair in enumerate(layout.between.tolist()):
                if body not in pair or bool(layout.is_mesh[element]) != meshes:
                    continue
                if meshes and not np.any(layout.rows[element]):  # a bearing
                    continue
                other = pair[1] if pair[0] == body else pair[0]
                if _join(body, element, other, placement, meshes=meshes) and other >= 0:
                    queue.append(other)
        for carrier in carriers(layout, body):
            if carrier not in placement.bodies:
                _carry(body, carrier, placement)
                queue.append(carrier)


def _join(body: int, element: int, other: int, placement: Placement, *, meshes: bool) -> bool:
    """Place what an element leads to; False if it has a place already."""
    if other in placement.bodies or (other < 0 and element in placement.grounds):
        if meshes and element not in placement.seats:
            _stand(body, element, other, placement)
        return False
    if meshes and other >= 0:
        _hang(body, element, other, placement)
    else:
        _append(body, element, other, placement)
    return True


def carriers(layout: Connections, planet: int) -> list[int]:
    """Return the bodies on which a planet's axle turns: those its meshes touch besides the two gears."""
    meshes = np.flatnonzero(layout.between[:, 1] == planet)
    touched = {int(body) for element in meshes for body in np.flatnonzero(layout.rows[element])}
    return sorted(touched.difference(layout.between[meshes].ravel().tolist()))


def _carry(planet: int, carrier: int, placement: Placement) -> None:
    """Place a carrier at the end of its planets' line."""
    row = placement.bodies[planet][1]
    placement.bodies[carrier] = (1 + max(column for column, other in placement.cells if other == row), row)


def _stand(body: int, element: int, other: int, placement: Placement) -> None:
    """Draw a mesh straight down to a gear that stands on the next line already, if its shaft can reach there."""
    (column, row) = placement.bodies[body]
    (own, below) = placement.bodies.get(other, (0, 0))
    last = max([own, *(foot for foot, _ in placement.feet.get(other, ()))])
    reach = [(between, row + 1) for between in range(last + 1, column + 1)]
    if below == row + 1 and column > last and not set(reach) & set(placement.cells):
        placement.seats[element] = (column, row)
        placement.feet.setdefault(other, []).append((column, row + 1))
        placement.shafts[other] = column


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
    column = placement.shafts[body] + 1
    row = placement.bodies[body][1]
    taken = set(placement.cells)
    while (column, row) in taken:
        row += 1
    if other < 0:
        placement.grounds[element] = (column, row)
    else:
        placement.bodies[other] = (column, row)
