"""Drawing of a model file: bodies, elements and loads, with positions in pixels.

The file may be incomplete or wrong; all its readable parts are drawn. Bodies have the same positions as in the sketch
of the report (``report/plots/placement.py``), so a driveline looks the same in the editor and after a run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from gearrattle.model import Coupling, Element, Inertia, Mesh, Motion, Piece, Torque
from gearrattle.model.components import COMPONENTS
from gearrattle.model.over_speed import OMEGA
from gearrattle.model.table_symbol import Shown
from gearrattle.model.value_kinds import GROUND
from gearrattle.report.plots.driveline import disc_heights
from gearrattle.report.plots.placement import Placement, carriers, place
from gearrattle.report.plots.sketch import inertia_words, torque_words
from gearrattle.trajectory import Array, IntArray
from gearrattle.workbench.references import BODY, ends_of, rows_of
from gearrattle.workbench.toml_blocks import Location

PITCH = (152.0, 152.0)
"""Distances between cells, horizontal and vertical [px]."""
MISSING = -2
"""Number of a body that does not exist."""
_LOADS: Mapping[str, type[Shown]] = {"torque": Torque, "motion": Motion}


@dataclass(frozen=True)
class Link:
    """An element, or a pair of bodies of a component that is not valid yet.

    ``ends`` are two body numbers; -1 for ground, -2 for a body that does not exist. ``arms`` are all bodies whose
    angles the element depends on.
    """

    table: str
    index: int
    ends: tuple[int, int]
    arms: tuple[int, ...]
    element: Element | None = None

    @property
    def along_line(self) -> bool:
        """Whether it is drawn as gears in mesh."""
        turns = bool(self.element and self.element.arms)  # a bearing turns nothing
        return turns and self.element.along_line if self.element else issubclass(COMPONENTS[self.table], Mesh)

    @property
    def has_gap(self) -> bool:
        """Whether there is a clearance in it."""
        return self.element is not None and (len(self.element.drive) > 1 or len(self.element.coast) > 1)


@dataclass(frozen=True)
class _Connections:
    """The attributes of a driveline that ``place`` reads."""

    between: IntArray
    is_mesh: NDArray[np.bool_]
    rows: Array
    reference: int


def drawing(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Draw the tables of a model file.

    Returns
    -------
    dict
        ``bodies``, ``links``, ``axles`` and ``loads``; positions in px, x to the right and y down, those of bodies to
        the middle of their first disc. ``path`` is where the row stands in the file.
    """
    rows = rows_of(tables, BODY)
    numbers: dict[Any, int] = {GROUND: -1}
    for number, row in enumerate(rows):
        if isinstance(row.get("name"), str):
            numbers.setdefault(row["name"], number)
    links = list(_links(tables, numbers))
    loads = list(_loads(tables, numbers))
    driven = next((load["body"] for load in loads if load["path"][0] == "torque" and load["body"] >= 0), 0)
    connections = _connections(links, len(rows), driven)
    placement = place(connections)
    return {
        "bodies": _bodies(tables, rows, placement),
        "links": [_drawn(number, link, placement, tables) for number, link in enumerate(links)],
        "axles": [[planet, carrier] for planet in range(len(rows)) for carrier in carriers(connections, planet)],
        "loads": loads,
    }


def law_of(element: Element) -> list[list[float]]:
    """Return the corners of its law and a point beyond each end: deflection [rad or m], torque or force [N m or N]."""
    corners = [piece.until for piece in (*element.drive, *element.coast) if piece.until is not None]
    beyond = 0.4 * max(corners, default=2.5)
    drive = _side(element.drive, beyond)
    coast = _side(element.coast, beyond)
    points = [(-x, -force) for x, force in reversed(coast)] + [(0.0, 0.0), *drive]
    return [[x, force + element.preload] for x, force in points]


def _side(pieces: Sequence[Piece], beyond: float) -> list[tuple[float, float]]:
    """Return the points of one side of a law from the centre outward."""
    points = list[tuple[float, float]]()
    x = 0.0
    force = 0.0
    for piece in pieces:
        end = x + beyond if piece.until is None else piece.until
        force += piece.stiffness * (end - x)
        x = end
        points.append((x, force))
    return points


def _links(tables: Mapping[str, Any], numbers: Mapping[Any, int]) -> Iterator[Link]:
    """Yield what connects the bodies: the elements of sound components, and pairs of the others."""
    context = {"dimensionless": tables.get("units") == "dimensionless", OMEGA: None}
    for kind, component in COMPONENTS.items():
        for index, row in enumerate(rows_of(tables, kind)):
            try:
                elements = component.model_validate(row, context=context).elements()
            except ValidationError:
                yield from _pairs(kind, index, row, numbers)
                continue
            shown = elements[:1] if elements[0].radii[0] == 0.0 else elements  # of a bearing, all faces as one
            for element in shown:
                first, second = (numbers.get(end, MISSING) for end in element.between)
                arms = tuple(numbers[body] for body, _ in element.arms if numbers.get(body, MISSING) >= 0)
                if first >= 0 or second >= 0:
                    yield Link(kind, index, (first, second), arms, element)


def _pairs(kind: str, index: int, row: Mapping[str, Any], numbers: Mapping[Any, int]) -> Iterator[Link]:
    """Yield the first body of a component with each of the others; what holds one body lies between it and ground."""
    bodies = [numbers.get(name, MISSING) for name in ends_of(kind, row).values()]
    first = next((body for body in bodies if body >= 0), -1)
    others = [body for position, body in enumerate(bodies) if position != bodies.index(first)] if first >= 0 else []
    if first >= 0 and "on" in COMPONENTS[kind].template:
        yield Link(kind, index, (first, -1), (first,))
    for other in others:
        if other != first:
            yield Link(kind, index, (first, other), tuple(body for body in (first, other) if body >= 0))


def _connections(links: Sequence[Link], count: int, driven: int) -> _Connections:
    rows = np.zeros((len(links), count))
    for number, link in enumerate(links):
        rows[number, list(link.arms)] = 1.0
    between = np.array([link.ends for link in links], dtype=np.int64).reshape(-1, 2)
    is_mesh = np.array([link.along_line and min(link.ends) >= 0 for link in links], dtype=bool)
    return _Connections(between, is_mesh, rows, driven)


def _bodies(tables: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], placement: Placement) -> list[dict[str, Any]]:
    """Return bodies with the discs on their shafts."""
    # J of bodies that can be read
    is_dimensionless = tables.get("units") == "dimensionless"
    context = {"dimensionless": is_dimensionless, OMEGA: None}
    sizes = np.full(len(rows), np.nan)
    for number, row in enumerate(rows):
        try:
            sizes[number] = Inertia.model_validate({"name": "a", "J": row.get("J")}, context=context).J
        except ValidationError:
            continue
    # heights of discs, the median for unknown J
    known = sizes[np.isfinite(sizes)]
    usual = float(np.median(known)) if known.size else 1.0
    heights = disc_heights(np.where(np.isfinite(sizes), sizes, usual)) if rows else np.empty(0)
    # discs on every shaft
    discs: dict[int, set[int]] = {}
    for number, (column, _) in placement.bodies.items():
        below = {foot[0] - column for foot in placement.feet.get(number, ())}
        discs[number] = {0, *below, *(column_of - column for column_of in _seats(number, placement))}
    return [
        {
            "path": [BODY, number],
            "name": str(row.get("name", "")),
            "inertia": _inertia(row, sizes[number], is_dimensionless),
            "x": PITCH[0] * placement.bodies[number][0],
            "y": PITCH[1] * placement.bodies[number][1],
            "discs": [PITCH[0] * column for column in sorted(discs[number])],
            "height": 2.0 * float(heights[number]),
        }
        for number, row in enumerate(rows)
    ]


def _inertia(row: Mapping[str, Any], size: float, is_dimensionless: bool) -> str:
    """Write an inertia as the report does; as it stands in the file where it is none yet."""
    return str(row.get("J", "")) if np.isnan(size) else inertia_words(float(size), is_si=not is_dimensionless)


def _seats(body: int, placement: Placement) -> list[int]:
    """Return the columns of a body's shaft from which meshes hang."""
    column, row = placement.bodies[body]
    last = placement.shafts.get(body, column)
    return [seat for seat, line in placement.seats.values() if line == row and column < seat <= last]


def _drawn(number: int, link: Link, placement: Placement, tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return one link: its ends relative to their bodies, its symbol and its law."""
    component = COMPONENTS[link.table]
    row = rows_of(tables, link.table)[link.index]
    shape: type[Any] = component
    if link.element is not None and len(link.arms) > 2:
        shape = Mesh if link.along_line else Coupling
    symbol = (shape.gap_symbol if link.has_gap else None) or shape.symbol
    seat = placement.seats.get(number)
    drawn = {
        "path": [link.table, link.index],
        "name": str(row.get("name", "")),
        "element": link.element.name if link.element else str(row.get("name", "")),
        "noun": component.noun,
        "symbol": symbol.path,
        "width": symbol.width,
        "sound": link.element is not None,
        "ends": [_end(number, body, seat, placement) for body in link.ends],
    }
    if link.element is not None:
        drawn |= {"law": law_of(link.element), "along_line": link.element.along_line}
    return drawn


def _end(number: int, body: int, seat: tuple[int, int] | None, placement: Placement) -> dict[str, Any]:
    """Return one end: a body and how far along its shaft, or a place for the symbol of ground."""
    if body >= 0:
        offset = seat[0] - placement.bodies[body][0] if seat else 0
        return {"body": body, "offset": PITCH[0] * offset}
    column, row = placement.grounds.get(number, (0, 0))
    return {"body": body, "x": PITCH[0] * column, "y": PITCH[1] * row}


def _loads(tables: Mapping[str, Any], numbers: Mapping[Any, int]) -> Iterator[dict[str, Any]]:
    """Yield what drives the bodies, with a few words."""
    for kind, shown in _LOADS.items():
        for index, row in enumerate(rows_of(tables, kind)):
            body = numbers.get(row.get("on"), MISSING) if isinstance(row.get("on"), str) else MISSING
            path: Location = (kind, index)
            symbol = shown.symbol
            yield {
                "path": list(path),
                "body": body,
                "words": _words(row, is_dimensionless=tables.get("units") == "dimensionless"),
                "symbol": symbol.path,
                "width": symbol.width,
            }


def _words(row: Mapping[str, Any], *, is_dimensionless: bool) -> str:
    """Say in short what a torque or a motion is, as the report does; as it stands in the file where it is none yet."""
    sources = [word for key, word in _SOURCES.items() if key in row]
    plain = {key: value for key, value in row.items() if key not in _SOURCES}
    if sources and not {"mean", "harmonics"} & set(plain):
        return ", ".join(sources)
    context = {"dimensionless": is_dimensionless, OMEGA: None}
    try:
        torque = Torque.model_validate(plain, context=context)
    except ValidationError:
        return ", ".join([*_as_written(row), *sources])
    return ", ".join([torque_words(torque, is_si=not is_dimensionless), *sources])


def _as_written(row: Mapping[str, Any]) -> list[str]:
    harmonics = row.get("harmonics")
    mean = row.get("mean")
    terms = [term for term in harmonics if isinstance(term, Mapping)] if isinstance(harmonics, list) else []
    orders = ", ".join(str(term.get("order", "?")) for term in terms[:4]) + (" …" if len(terms) > 4 else "")
    words = [str(mean)] if isinstance(mean, str | int | float) and mean else []
    return [*words, *([f"order {orders}"] if terms else [])]


_SOURCES = {"signal": "a record", "engine": "an engine", "speed": "speed record", "angle": "angle record"}
