"""Key paths such as ``coupling.damper.stages.1.stiffness``: changing values in the tables of a model.

Named tables (inertia, coupling, mesh) go by name, everything else by its key or its 0-based index.

Takes and gives plain dictionaries and lists; ``model`` validates the outcome.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model.components import COMPONENTS
from gearrattle.model.quantity import AnyTable, checked
from gearrattle.model.table import did_you_mean, listed, shown

_NAMED = ("inertia", *COMPONENTS)
_LISTS = (*_NAMED, "torque")
_TABLES = ("excitation", "simulation", "criteria")
_INNER = ("criteria", "negligible")
"""A table within a table that need not stand there either."""
SAME_THING = ("speed", "frequency", "sweep")
"""Keys of ``excitation`` of which one alone may stand."""


class _NoPathError(LookupError):
    """A path that leads nowhere: the rule and the remedy."""

    def __init__(self, rule: str, remedy: str = "") -> None:
        self.rule = rule
        self.remedy = remedy
        super().__init__(rule)


def changed(tables: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of the tables with the changes made; a value of None takes a key out.

    Setting one of ``excitation.speed``, ``.frequency`` and ``.sweep`` takes out the others, as they are one quantity.

    Raises
    ------
    ModelError
        paths that lead nowhere, all of them.
    """
    fresh: dict[str, Any] = _thawed(tables)
    problems: list[Problem] = []
    for path, value in checked(AnyTable(), changes, "changes").items():
        if not isinstance(path, str):
            problems.append(Problem("path", shown(path), "must be a text", 'such as "mesh.gear.backlash"'))
            continue
        try:
            _set(fresh, path, _thawed(value))
        except _NoPathError as error:
            problems.append(Problem(f"path {path}", "", error.rule, error.remedy))
    if problems:
        raise ModelError(problems)
    keys_set = [key for key in SAME_THING if changes.get(f"excitation.{key}") is not None]
    for other in SAME_THING:
        if keys_set and f"excitation.{other}" not in changes:
            fresh.get("excitation", {}).pop(other, None)
    return fresh


def value_at(tables: Mapping[str, Any], path: str) -> Any:
    """Return the value at a path; None where a key may stand but does not.

    Raises
    ------
    ModelError
        the path leads nowhere.
    """
    parts = path.split(".")
    node: Any = _thawed(tables)
    try:
        for depth, part in enumerate(parts[:-1]):
            node = _child(node, part, parts[:depth])
        if isinstance(node, dict):
            return node.get(parts[-1])
        return _child(node, parts[-1], parts[:-1])
    except _NoPathError as error:
        raise ModelError(Problem(f"path {path}", "", error.rule, error.remedy)) from None


def location_of(tables: Mapping[str, Any], path: str) -> tuple[int | str, ...]:
    """Return the keys and 0-based indices of a path; its last key need not stand there.

    Raises
    ------
    ModelError
        the path leads nowhere.
    """
    parts = path.split(".")
    node: Any = _thawed(tables)
    location: tuple[int | str, ...] = ()
    try:
        for depth, part in enumerate(parts):
            is_row = isinstance(node, list)
            location = (*location, _index(node, part, parts[:depth]) if is_row else part)
            if depth < len(parts) - 1:
                node = _child(node, part, parts[:depth])
        if not isinstance(node, dict | list):
            raise _NoPathError(f"{'.'.join(parts[:-1])} is a single value; it has no {parts[-1]}")
    except _NoPathError as error:
        raise ModelError(Problem(f"path {path}", "", error.rule, error.remedy)) from None
    return location


def path_names(tables: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the path of every value in the tables."""
    return tuple(_leaves(tables, ""))


def _leaves(node: Any, prefix: str) -> Iterator[str]:
    """Yield the paths of the values below a table or an array of tables."""
    if isinstance(node, Mapping):
        for key, value in node.items():
            yield from _leaves(value, f"{prefix}.{key}" if prefix else key)
    elif isinstance(node, (list, tuple)) and node and isinstance(node[0], Mapping):
        for index, row in enumerate(node):
            label = row["name"] if prefix in _NAMED else str(index)
            yield from _leaves(row, f"{prefix}.{label}")
    else:
        yield prefix


def _thawed(value: Any) -> Any:
    """Return a deep copy in dictionaries and lists."""
    if isinstance(value, Mapping):
        return {key: _thawed(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_thawed(item) for item in value]
    return value


def _set(tables: dict[str, Any], path: str, value: Any) -> None:
    """Put one value at its path."""
    parts = path.split(".")
    node: Any = tables
    for depth, part in enumerate(parts[:-1]):
        node = _child(node, part, parts[:depth])
    last = parts[-1]
    if isinstance(node, list):
        index = _index(node, last, parts[:-1])
        if value is None:
            del node[index]
        else:
            node[index] = value
    elif not isinstance(node, dict):
        raise _NoPathError(f"{'.'.join(parts[:-1])} is a single value; it has no {last}")
    elif value is None:
        node.pop(last, None)
    else:
        node[last] = value


def _child(node: Any, part: str, above: Sequence[str]) -> Any:
    """Return the table or array one step down the path."""
    if isinstance(node, list):
        return node[_index(node, part, above)]
    if not isinstance(node, dict):
        raise _NoPathError(f"{'.'.join(above)} is a single value; it has no {part}")
    if part in node:
        return node[part]
    if not above and part in _TABLES:
        return node.setdefault(part, {})
    if (*above, part) == _INNER:
        return node.setdefault(part, {})
    where = f"{'.'.join(above)} has no {part}" if above else f"a model has no {part} here"
    options = list(dict.fromkeys([*node, *(_TABLES if not above else ())]))
    raise _NoPathError(f"{where}; there are {listed(options)}", did_you_mean(part, options))


def _index(node: list[Any], part: str, above: Sequence[str]) -> int:
    """Return the index of an entry that goes by name or by number."""
    where = ".".join(above)
    if list(above[:1]) == list(above) and where in _NAMED:
        names = [row.get("name") if isinstance(row, dict) else None for row in node]
        if part in names:
            return names.index(part)
        known = [name for name in names if isinstance(name, str)]
        raise _NoPathError(f"no {where} is named {part}; there are {listed(known)}", did_you_mean(part, known))
    if part.isascii() and part.isdigit() and len(part) < 10 and int(part) < len(node):
        return int(part)
    if not node:
        raise _NoPathError(f"{where} is empty")
    owners = listed(f"{i} on {row['on']}" for i, row in enumerate(node) if isinstance(row, dict) and "on" in row)
    raise _NoPathError(f"{where} goes by index from 0 to {len(node) - 1}{f' ({owners})' if owners else ''}")
