"""Rules of prescribed motions: no other motion and no torque on the inertia, no element with both ends prescribed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from gearrattle.model.components import COMPONENTS
from gearrattle.model.table import Breach
from gearrattle.model.value_kinds import GROUND

Rows = Sequence[Mapping[str, Any]]


def prescribed_rules(rows: Mapping[str, Rows]) -> Iterator[Breach]:
    """Yield breaches of rules between ``[[motion]]`` and the other tables, each a list of rows by its key."""
    moved: list[str] = []
    for index, row in enumerate(rows["motion"]):
        on = row.get("on")
        if isinstance(on, str):
            if on in moved:
                yield Breach(("motion", index, "on"), on, "its motion is prescribed already", "remove one")
            moved.append(on)
    if not moved:
        return
    for index, row in enumerate(rows["torque"]):
        if row.get("on") in moved:
            rule = "its motion is prescribed, so a torque on it changes nothing"
            yield Breach(("torque", index, "on"), row["on"], rule, "remove the torque or the motion")
    for kind, component in COMPONENTS.items():
        for index, row in enumerate(rows[kind]):
            bodies = list(component.bodies(row))
            if len(bodies) > 1 and all(body.name == GROUND or body.name in moved for body in bodies):
                rule = "both ends move as prescribed, so the element moves nothing"
                yield Breach((kind, index, "between"), row.get("between"), rule, "remove it, or a motion")
    names = [row.get("name") for row in rows["inertia"]]
    if names and all(name in moved for name in names):
        yield Breach(("motion",), moved, "at least one inertia must be free to move", "remove a motion")
