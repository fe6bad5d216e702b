"""Rules between the drag parts of inertias and the rest of a model file: the bodies they name, and the oil."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from gearrattle.model.drag_points import damper_name
from gearrattle.model.table import Breach, Location, did_you_mean, listed
from gearrattle.model.value_kinds import GROUND


def drag_rules(inertias: Sequence[Mapping[str, Any]], names: Mapping[str, None], oil: object) -> Iterator[Breach]:
    """Yield breaches: ``on`` is no body or the part's own body; a law needs the oil, and the model has none."""
    for index, inertia in enumerate(inertias):
        rows = inertia.get("drag_parts")
        if not rows or not isinstance(rows, list | tuple):
            continue
        from gearrattle.model.drag_parts import DRAG_PARTS  # imported here, because most models have none

        for number, row in enumerate(rows):
            location = ("inertia", index, "drag_parts", number)
            on = _of(row, "on")
            if isinstance(on, str) and on != GROUND and on not in names:
                rule = f"no inertia has this name; there are {listed(names)}"
                yield Breach((*location, "on"), on, rule, did_you_mean(on, names))
            elif on is not None and on == inertia.get("name"):
                yield Breach((*location, "on"), on, "a drag part must act between two different bodies")
            kind = _of(row, "kind")
            law = DRAG_PARTS.get(kind) if isinstance(kind, str) else None
            if oil is None and law is not None and law.needs_oil:
                remedy = 'add [oil], such as type = "70w-75w-gl4", temperature = "40 degC"'
                yield Breach((*location, "kind"), kind, "its law needs the oil, and the model has none", remedy)


def damper_names(inertias: Sequence[Mapping[str, Any]]) -> Iterator[tuple[Location, str]]:
    """Yield where a drag part acts on another body, and the name of the element that stands for it."""
    for index, inertia in enumerate(inertias):
        rows = inertia.get("drag_parts")
        for number, row in enumerate(rows if isinstance(rows, list | tuple) else ()):
            on = _of(row, "on")
            if isinstance(on, str) and on != GROUND:
                yield ("inertia", index, "drag_parts", number, "on"), damper_name(str(inertia.get("name")), on)


def _of(row: object, key: str) -> Any:
    """Return the value of a key, from a table as written or from a table object."""
    if isinstance(row, Mapping):
        return row.get(key)
    return getattr(row, key, None)
