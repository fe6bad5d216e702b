"""Problems that a user reads, from the errors of pydantic: file, line, key path, value, rule, remedy."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

from pydantic import ValidationError

from gearrattle.errors import ModelError, Problem
from gearrattle.model.table import Location, shown


@dataclass(frozen=True)
class Positions:
    """Lines of the keys of a file, counted from 1, by key path; the name is empty if there is no file."""

    name: str = ""
    lines: Mapping[Location, int] = field(default_factory=dict)

    def line(self, location: Location) -> int | None:
        """Return the line of a key, or of the nearest table around it."""
        for length in range(len(location), 0, -1):
            line = self.lines.get(location[:length])
            if line is not None:
                return line
        return None


def model_error(
    error: ValidationError, tables: Mapping[str, Any], positions: Positions, only: Location = ()
) -> ModelError:
    """Return every entry of a pydantic error as a problem, in file order; ``only`` those below one key."""
    names = _names(tables)
    distinct: dict[tuple[Location, str, str], Problem] = {}
    for entry in cast(Sequence[dict[str, Any]], error.errors(include_url=False)):
        location: Location = entry["loc"]
        if location[: len(only)] != only:
            continue
        context = entry.get("ctx", {})
        value = "" if entry["input"] is ... else shown(entry["input"])
        rule = context.get("rule", entry["msg"])
        where = context.get("place", "")
        at, value = (where, context["value"]) if where else (place(location, names, positions), value)
        problem = Problem(at, value, rule, context.get("remedy", ""), location)
        distinct.setdefault((location, rule, value), problem)
    ordered = sorted(distinct.items(), key=lambda item: positions.line(item[0][0]) or 0)
    return ModelError(problem for _, problem in ordered)


def place(location: Location, names: Mapping[Location, str], positions: Positions) -> str:
    """Return ``"case3.toml:12: coupling.clutch.stiffness"``, or as much of it as is known."""
    parts = [printable(names.get(location[: depth + 1], part)) for depth, part in enumerate(location)]
    path = ".".join(parts)
    if not positions.name:
        return path or "model"
    line = positions.line(location)
    file = positions.name if line is None else f"{positions.name}:{line}"
    return f"{file}: {path}" if path else file


def _names(tables: Mapping[str, Any]) -> dict[Location, str]:
    """Return the names of the parts that have one of their own, by location; the others go by index."""
    display_names: dict[Location, str] = {}
    for kind in ("inertia", "coupling", "mesh", "bearing"):
        rows = tables.get(kind)
        if not isinstance(rows, list):
            continue
        names = [row.get("name") if isinstance(row, Mapping) else None for row in rows]
        count = Counter(name for name in names if isinstance(name, str))
        display_names |= {
            (kind, index): name
            for index, name in enumerate(names)
            if isinstance(name, str) and count[name] == 1 and 0 < len(name) <= 60
        }
    return display_names


def printable(part: int | str) -> str:
    """Return a key as it may be printed: odd ones in quotes, long ones cut."""
    text = str(part)
    return text if text.replace("_", "").replace("-", "").isalnum() and len(text) <= 60 else shown(text)
