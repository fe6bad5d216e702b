"""References to bodies in the tables of a model, for renaming a body and for deleting it with its dependent rows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from gearrattle.model.components import COMPONENTS
from gearrattle.workbench.toml_blocks import Location

_ON = ("torque", "motion")
BODY = "inertia"


def rows_of(tables: Mapping[str, Any], kind: str) -> list[Mapping[str, Any]]:
    """Return an array of tables, whatever stands there."""
    rows = tables.get(kind)
    return [row if isinstance(row, Mapping) else {} for row in rows] if isinstance(rows, list) else []


def ends_of(kind: str, row: Mapping[str, Any]) -> dict[Location, str]:
    """Return the names of bodies in a row of a component by where each stands, relative to the row."""
    ends: dict[Location, str] = {}
    for body in COMPONENTS[kind].bodies(row):
        written: Any = row
        for key in body.location:
            written = written[key]
        if isinstance(written, str):
            ends[body.location] = written
        elif isinstance(written, list):
            ends |= {(*body.location, k): name for k, name in enumerate(written) if isinstance(name, str)}
    return ends


def references(tables: Mapping[str, Any], name: str) -> Iterator[Location]:
    """Yield where a body is named, its own table apart."""
    for kind in COMPONENTS:
        for index, row in enumerate(rows_of(tables, kind)):
            yield from ((kind, index, *end) for end, written in ends_of(kind, row).items() if written == name)
    for kind in _ON:
        rows = rows_of(tables, kind)
        yield from ((kind, index, "on") for index, row in enumerate(rows) if row.get("on") == name)


def dependents(tables: Mapping[str, Any], name: str) -> list[Location]:
    """Return what cannot stand without a body: rows, and entries of lists that hold others as well."""
    locations: dict[Location, None] = {}
    for location in references(tables, name):
        kind, index, *end = location
        row = rows_of(tables, str(kind))[int(index)]
        others = _others(row, tuple(end))
        locations[location if others else (kind, index)] = None
    return [location for location in locations if len(location) == 2 or location[:2] not in locations]


def label(tables: Mapping[str, Any], location: Location) -> str:
    """Return what messages call a row: "coupling damper", "torque on hub"."""
    kind = str(location[0])
    index = int(location[1])
    row = rows_of(tables, kind)[index]
    if isinstance(row.get("on"), str):
        return f"{kind} on {row['on']}"
    return f"{kind} {row.get('name', index)}"


def _others(row: Mapping[str, Any], end: Location) -> bool:
    """Tell whether an end is one of a list that may be shorter; the two of a pair may not."""
    if len(end) != 2 or end[0] == "between":
        return False
    return len(row[str(end[0])]) > 1
