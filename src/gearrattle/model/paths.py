"""Key paths such as ``coupling.damper.stages.1.stiffness``: changing values in the tables of a model.

Named tables (inertia, coupling, mesh) go by name, everything else by its key or its 0-based index. ``*`` stands for any
text, dots too: such a pattern means the paths of all values that are set and match it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model.components import COMPONENTS
from gearrattle.model.factors import factor_in, is_factor
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.model.value_kinds import AnyTable, checked

_NAMED = ("inertia", *COMPONENTS)
_LISTS = (*_NAMED, "torque")
_TABLES = ("excitation", "simulation", "criteria")
_INNER = ("criteria", "negligible")
"""A table within a table that need not stand there either."""
SAME_THING = ("speed", "frequency", "sweep")
"""Keys of ``excitation`` of which one alone may stand."""
ANY = "*"
"""What stands for any text in a pattern."""


class _NoPathError(LookupError):
    """A path that leads nowhere: the rule and the remedy."""

    def __init__(self, rule: str, remedy: str = "") -> None:
        self.rule = rule
        self.remedy = remedy
        super().__init__(rule)


def changed(tables: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of the tables with the changes made (see ``resolved``); a value of None takes a key out.

    Setting one of ``excitation.speed``, ``.frequency`` and ``.sweep`` takes out the others, as they are one quantity.
    ModelError for all paths that lead nowhere, and as ``resolved``.
    """
    plain = resolved(tables, checked(AnyTable(), changes, "changes"))
    fresh: dict[str, Any] = _thawed(tables)
    problems: list[Problem] = []
    for path, value in plain.items():
        try:
            _set(fresh, path, _thawed(value))
        except _NoPathError as error:
            problems.append(Problem(f"path {path}", "", error.rule, error.remedy))
    if problems:
        raise ModelError(problems)
    keys_set = [key for key in SAME_THING if plain.get(f"excitation.{key}") is not None]
    for other in SAME_THING:
        if keys_set and f"excitation.{other}" not in plain:
            fresh.get("excitation", {}).pop(other, None)
    return fresh


def resolved(tables: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return changes as plain ones: every path leads to one value, and no value is a factor.

    Patterns become paths, and factors multiply the values of the tables, here alone. ModelError for a pattern that
    matches nothing, a factor of what is no number, and a path that is changed twice; it names all of them.
    """
    plain: dict[str, Any] = {}
    changed_by: dict[str, str] = {}
    problems: list[Problem] = []
    for path, value in changes.items():
        if not isinstance(path, str):
            problems.append(Problem("path", shown(path), "must be a text", 'such as "mesh.gear.backlash"'))
            continue
        try:
            times = factor_in(value) if is_factor(value) else None
            paths = paths_at(tables, path)
            values = {one: value if times is None else times.of(_number_at(tables, one)) for one in paths}
        except ModelError as error:
            problems += error.problems
            continue
        for one in plain.keys() & values.keys():
            rule = f"is changed twice, by {changed_by[one]} and by {path}"
            problems.append(Problem(f"path {one}", "", rule, "change it by one of them"))
        plain |= values
        changed_by |= dict.fromkeys(values, path)
    if problems:
        raise ModelError(problems)
    return plain


def factored(tables: Mapping[str, Any], path: str) -> dict[str, float]:
    """Return the numbers that a factor at a path or a pattern multiplies, by plain path; ModelError as ``resolved``."""
    return {one: _number_at(tables, one) for one in paths_at(tables, path)}


def _number_at(tables: Mapping[str, Any], path: str) -> float:
    """Return the number that a factor multiplies; ModelError if there is none."""
    own = value_at(tables, path)
    if own is None:
        rule = "a factor is of what the model says, and it says nothing here"
        raise ModelError(Problem(f"path {path}", "", rule, "give it a value in the model first"))
    if isinstance(own, bool) or not isinstance(own, int | float):
        what = "a table" if isinstance(own, dict) else shown(own)
        raise ModelError(Problem(f"path {path}", what, "a factor needs a number here", "give a value without a factor"))
    return own


def paths_at(tables: Mapping[str, Any], path: str) -> tuple[str, ...]:
    """Return the plain paths that a path means: itself, or what a pattern matches; ModelError if that is nothing."""
    if ANY not in path:
        return (path,)
    paths = path_names(tables, path)
    if not paths:
        raise ModelError(_no_match(tables, path))
    return paths


def _no_match(tables: Mapping[str, Any], pattern: str) -> Problem:
    """Say that a pattern matches nothing, and what there is: values of its key, else keys of its section, sections."""
    names = path_names(tables)
    section = pattern.partition(".")[0]
    key = pattern.rpartition(".")[2]
    alike = [name for name in names if name.endswith(f".{key}")]
    keys = list(dict.fromkeys(name.rpartition(".")[2] for name in names if name.startswith(f"{section}.")))
    options = alike or keys or list(dict.fromkeys(name.partition(".")[0] for name in names))
    remedy = did_you_mean(key if keys else section, options) if not alike else ""
    return Problem(f"path {pattern}", "", f"matches no value that is set; there are {listed(options)}", remedy)


def expanded(tables: Mapping[str, Any], paths: Iterable[str]) -> list[str]:
    """Return paths with patterns replaced by what they match, every path once; ModelError for a pattern without a
    match.
    """
    return list(dict.fromkeys(one for path in paths for one in paths_at(tables, path)))


def check_one(tables: Mapping[str, Any], path: str) -> None:
    """Refuse a pattern where a path must lead to one value (ModelError)."""
    if ANY in path:
        paths = paths_at(tables, path)
        rule = f"stands for several values ({listed(paths)}), and here one is needed"
        raise ModelError(Problem(f"path {path}", "", rule, f'such as "{paths[0]}"'))


def value_at(tables: Mapping[str, Any], path: str) -> Any:
    """Return the value at a path, None where a key may stand but does not; ModelError for a pattern or a path that
    leads nowhere.
    """
    check_one(tables, path)
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
    """Return the keys and 0-based indices of a path, whose last key need not be there; ModelError for a pattern or a
    path that leads nowhere.
    """
    check_one(tables, path)
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


def path_names(tables: Mapping[str, Any], pattern: str = ANY) -> tuple[str, ...]:
    """Return the paths of the values in the tables that match a pattern; a table whose own path alone matches is one.

    Such a table stands where a number may: an amplitude over speed. An entry of a list matches by its index,
    ``mesh.*.radii.0``.
    """
    if pattern == ANY:
        return tuple(_matching(tables, "", lambda _: True))
    written = re.compile(".*".join(map(re.escape, pattern.split(ANY))), re.DOTALL)
    paths = _matching(tables, "", lambda path: written.fullmatch(path) is not None)
    owner, _, index = pattern.rpartition(".")
    if not paths and owner and index.isascii() and index.isdigit():
        lists = {path: value_at(tables, path) for path in path_names(tables, owner)}
        paths = [f"{path}.{index}" for path, row in lists.items() if isinstance(row, list) and int(index) < len(row)]
    return tuple(paths)


def _matching(node: Any, prefix: str, is_match: Callable[[str], bool]) -> list[str]:
    """Return the paths of the matching values below a table or an array of tables, else its own if that matches."""
    below = [path for name, inner in inner_of(node, prefix) for path in _matching(inner, name, is_match)]
    return below or ([prefix] if prefix and node != {} and is_match(prefix) else [])


def inner_of(node: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    """Yield path and content of what a table or an array of tables holds; nothing of a value."""
    if isinstance(node, Mapping):
        for key, value in node.items():
            yield f"{prefix}.{key}" if prefix else key, value
    elif isinstance(node, (list, tuple)) and node and isinstance(node[0], Mapping):
        for index, row in enumerate(node):
            yield f"{prefix}.{row['name'] if prefix in _NAMED else index}", row


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
