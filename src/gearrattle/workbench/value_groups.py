"""Groups of values that a factor changes together, and words for changes of a model.

One key of all parts of a kind, such as the drag torque of all inertias, is a group, by a pattern with ``*``.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isclose
from typing import Any

from gearrattle.json_types import TomlTable
from gearrattle.model import Model
from gearrattle.model.components import COMPONENTS
from gearrattle.model.path_labels import path_label, path_words, shown_value
from gearrattle.model.paths import ANY
from gearrattle.wording import listed

_KINDS = ("inertia", *COMPONENTS)
_DRIVES = ("torque", "motion")
_NO_SIZE = ("order", "phase")
"""Keys of numbers whose multiples have no meaning."""
_MOST_SAID = 3
_DIGITS = 4


def groups_of(model: Model) -> dict[str, str]:
    """Return the patterns of values that a factor changes together, with what it is called.

    Examples
    --------
    >>> from gearrattle.workbench.value_groups import groups_of
    >>> groups_of(gr.example("manual_transmission"))["mesh.*.backlash"]
    'backlash of all meshes, times'
    """
    return {pattern: path_label(pattern, model, by_factor=True).words for pattern in _members(_numbers(model))}


def change_words(before: Model, after: Model) -> str:
    """Return in words what one model has that another has not; empty where they are the same.

    Examples
    --------
    >>> from gearrattle.workbench.value_groups import change_words
    >>> model = gr.example("manual_transmission")
    >>> change_words(model, model.with_({"inertia.*.drag_torque": gr.factor(3)}))
    'drag torque of 3 inertias x3'
    """
    # parts that are new or gone
    # parts added and removed
    old = before.to_tables()
    new = after.to_tables()
    words = []
    apart: list[str] = []
    for kind in _KINDS:
        ours = [row["name"] for row in new.get(kind, ())]
        theirs = [row["name"] for row in old.get(kind, ())]
        changed_names = [(name, "added") for name in ours if name not in theirs]
        changed_names += [(name, "removed") for name in theirs if name not in ours]
        words += [f"{kind} {name} {state}" for name, state in changed_names]
        apart += [f"{kind}.{name}." for name, _ in changed_names]
    # values that differ: groups by their factor first
    values = _values(new)
    known = _values(old)
    paths = [path for path in dict.fromkeys([*known, *values]) if not path.startswith(tuple(apart))]
    differing = [path for path in paths if path not in _TITLES and known.get(path) != values.get(path)]
    for pattern, members in _members(_numbers(before)).items():
        ratio = _ratio([(known[path], values.get(path)) for path in members])
        if ratio is not None and set(members) <= set(differing):
            words.append(f"{path_label(pattern, before).words} x{ratio:.{_DIGITS}g}")
            differing = [path for path in differing if path not in members]
    words += [_value_words(path, values.get(path), old, after) for path in differing]
    # the first changes, and the number of the others
    said = words if len(words) <= _MOST_SAID else [*words[: _MOST_SAID - 1], f"{len(words) - _MOST_SAID + 1} more"]
    return listed(said)


_TITLES = ("name", "schema")


def _values(tables: TomlTable) -> dict[str, Any]:
    """Return the values of a model by path: of a list of numbers the whole list."""
    values: dict[str, Any] = {}

    def walk(node: Any, path: str) -> None:
        if isinstance(node, Mapping):
            for key, child in node.items():
                walk(child, f"{path}.{key}" if path else key)
        elif isinstance(node, list | tuple) and any(isinstance(child, Mapping) for child in node):
            for number, child in enumerate(node):
                named = isinstance(child, Mapping) and isinstance(child.get("name"), str)
                walk(child, f"{path}.{child['name'] if named else number}")
        else:
            values[path] = node

    walk(tables, "")
    return values


def _numbers(model: Model) -> dict[str, float]:
    """Return the numbers that have a size, by path."""
    return {path: value for path, value in _values(model.to_tables()).items() if isinstance(value, float) and value}


def _members(numbers: Mapping[str, float]) -> dict[str, list[str]]:
    """Return the paths of every pattern that two numbers or more have in common."""
    members: dict[str, list[str]] = {}
    for path in numbers:
        section, *rest = path.split(".")
        if section not in (*_KINDS, *_DRIVES) or len(rest) < 2 or rest[-1] in _NO_SIZE:
            continue
        inner = [ANY if key.isdigit() else key for key in rest[1:]]
        members.setdefault(".".join([section, ANY, *inner]), []).append(path)
    return {pattern: paths for pattern, paths in members.items() if len(paths) > 1}


def _ratio(pairs: list[tuple[float, Any]]) -> float | None:
    """Return the factor from the first to the second of every pair; None if there is not one alone, or it is 1."""
    if not all(isinstance(new, float) for _, new in pairs):
        return None
    ratios = [new / old for old, new in pairs]
    is_one = all(isclose(ratio, ratios[0], rel_tol=1e-6) for ratio in ratios)
    return ratios[0] if is_one and ratios[0] != 1.0 else None


def _value_words(path: str, value: Any, before: TomlTable, model: Model) -> str:
    """Return what is said of one value that differs."""
    if value is None:
        return f"no {path_words(path, before)}"
    words = path_words(path, model.to_tables())
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{words} {shown_value(path, model, value, _DIGITS)}"
    return f"{words} {value}" if isinstance(value, str) else f"another {words}"
