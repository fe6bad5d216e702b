"""First values of a new table or row: valid values with as little effect as possible.

A table begins with its required keys, with the examples in the JSON Schema of model files as values. A further sine has
the next order. The first stages of a coupling are its present law, and a further stage continues the last one; so the
law does not change until the user changes a value.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from gearrattle.model import json_schema
from gearrattle.model.balance import BALANCE
from gearrattle.model.components import Coupling
from gearrattle.workbench.references import BODY, rows_of
from gearrattle.workbench.toml_blocks import Location

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")
_UNTIL = "5 deg"
"""End of the first stage of a coupling without stages."""
_VALUES: Mapping[str, Any] = {
    "share": 0.5,
    "fewer": 0.5,
    "cylinders": 4,
    "bore": "80 mm",
    "stroke": "90 mm",
    "rod": "140 mm",
    "file": "record.csv",
}
"""Values of keys that have no example, or whose examples do not fit together."""
_ASCENDING: Mapping[str, Sequence[str]] = {
    "time": ("0 s", "1 s", "2 s", "3 s"),
    "angle": ("0 deg", "240 deg", "480 deg", "720 deg"),
    "speed": ("500 rpm", "3000 rpm"),
}
"""First entries of lists that must ascend."""
_OVER_SPEED = ["speed", "value"]
_INSTEAD: Mapping[tuple[Any, Any], tuple[str, ...]] = {
    ("torque", "engine"): ("mean", "harmonics"),
    ("motion", "speed"): ("angle", "harmonics"),
    ("motion", "angle"): ("speed", "harmonics"),
    ("motion", "harmonics"): ("speed", "angle"),
}
"""Keys that exclude a key."""
_OF_STAGES = ("hysteresis", "stick_stiffness")
"""Keys of the clearance form that stages have, too."""

Node = dict[str, Any]
Begun = list[dict[str, Any]]

SCHEMA: Node = json_schema()
"""The JSON Schema of a model file.

It is made while this module is imported, before requests have threads of their own: Python 3.11 cannot make syntax
trees in two threads at once (``SystemError: AST constructor recursion depth mismatch``).
"""

_FIRST_ROW = {"ramps": "at"}
"""Key by list that its first row must have; a later one goes on from the row before."""


def begun(tables: Mapping[str, Any], location: Location, option: int = 0) -> Begun:
    """Return the edits that begin a table or a list, or add a row to it; ``option`` chooses among the tables that may
    stand there. LookupError if none may.
    """
    if location[:1] == ("coupling",) and location[2:] in (("stages",), ("coast_stages",)):
        return list(_staged(_found(tables, location[:2]), location))
    is_plain = tables.get("units") == "dimensionless"
    now = _found(tables, location)
    choices = _options(_node_at(location))
    gone = [
        {"op": "delete", "path": [*location[:-1], key]}
        for key in _INSTEAD.get((location[0], location[-1]), ())
        if _found(tables, (*location[:-1], key)) not in (None, BALANCE)
    ]
    lists = [choice for choice in choices if choice.get("type") == "array" and "items" in choice]
    if lists:
        made = _row(now, lists[0]["items"], _FIRST_ROW.get(str(location[-1]), ""))
        return [*gone, {"op": "add", "table": list(location), "value": _plain(made) if is_plain else made}]
    value = _table([choice for choice in choices if "properties" in choice][option])
    if location == ("simulation", "initial"):
        value = {key: [0.0] * len(rows_of(tables, BODY)) for key in value}
    elif list(value) == _OVER_SPEED and now not in (None, BALANCE):
        value["value"] = [now] * len(value["value"])
    return [*gone, {"op": "set", "path": list(location), "value": _plain(value) if is_plain else value}]


def _row(rows: Any, item: Node, first_key: str) -> Any:
    """Return a row as the last one is; of sines of the next order; a key that only the first must have is left out."""
    if not isinstance(rows, list) or not rows or not isinstance(rows[-1], Mapping):
        row = _first(item)
        return {first_key: _first(_resolved(item)["properties"][first_key], first_key), **row} if first_key else row
    if first_key:
        return {key: value for key, value in rows[-1].items() if key != first_key}
    orders = [row.get("order") for row in rows if isinstance(row, Mapping)]
    known = [order for order in orders if isinstance(order, int | float)]
    return {**rows[-1], "order": max(known) + 1} if known else dict(rows[-1])


def _staged(row: Any, location: Location) -> Iterator[dict[str, Any]]:
    """Yield the edits after which a coupling has stages, or one more on a side, and the law that it had."""
    if not isinstance(row, Mapping):
        raise LookupError(location)
    key = location[2]
    path = list(location[:2])
    stages = row.get("stages")
    if not isinstance(stages, list) or not stages:
        for name in Coupling.clearance_form:
            if name in row:
                yield {"op": "delete", "path": [*path, name]}
        stages = list(_stages_of(row))
        yield {"op": "set", "path": [*path, "stages"], "value": stages}
        if key == "stages":
            return
    own = row.get(key)
    if not isinstance(own, list) or not own:
        yield {"op": "set", "path": [*path, key], "value": stages}
        return
    last = dict(own[-1]) if isinstance(own[-1], Mapping) else {}
    before = own[-2].get("until", _UNTIL) if len(own) > 1 and isinstance(own[-2], Mapping) else None
    until = last.pop("until", None) or (multiplied(before, 2.0) if before is not None else _UNTIL)
    yield {"op": "set", "path": [*path, key, len(own) - 1, "until"], "value": until}
    yield {"op": "add", "table": [*path, key], "value": last}


def _stages_of(row: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the stages of the law that a coupling in the clearance form has."""
    kept = {key: row[key] for key in _OF_STAGES if key in row}
    stiffness = row.get("stiffness", Coupling.template["stiffness"])
    damping = row.get("damping", 0.0)
    clearance = row.get("clearance")
    if clearance is not None and multiplied(clearance, 1.0) not in (0.0, "0"):
        first = {"stiffness": multiplied(stiffness, row.get("stiffness_ratio", 0.0)), "until": clearance}
        yield {**first, "damping": multiplied(damping, row.get("damping_ratio", 0.0)), **kept}
    yield {"stiffness": stiffness, "damping": damping, **kept}


def multiplied(value: object, factor: float) -> object:
    """Return a number, or a number with its unit, times a factor; 0 without its unit; what is no number as it is."""
    text = _NUMBER.fullmatch(str(value))
    if not text or isinstance(value, Mapping):
        return value
    number = float(f"{float(text[1]) * factor:.12g}")
    return f"{number:.12g} {text[2]}" if text[2] and number else number


# ---- what the schema says


def _resolved(node: Node) -> Node:
    if "$ref" not in node:
        return node
    own = {key: value for key, value in node.items() if key != "$ref"}
    return {**SCHEMA["$defs"][str(node["$ref"]).rpartition("/")[2]], **own}


def _options(node: Node) -> list[Node]:
    """Return what may stand at a node."""
    full = _resolved(node)
    return [_resolved(choice) for choice in full.get("anyOf", [full])]


def _node_at(location: Location) -> Node:
    """Return the node of a location."""
    node: Node = SCHEMA
    for part in location:
        nodes = (
            choice.get("items") if isinstance(part, int) else choice.get("properties", {}).get(part)
            for choice in _options(node)
        )
        node = next(filter(None, nodes), {})
    if not node:
        raise LookupError(location)
    return node


def _table(node: Node) -> dict[str, Any]:
    """Return what a table must have; its first value if it must have none."""
    keys: Sequence[str] = node.get("required") or list(node["properties"])[:1]
    points = next((len(_ASCENDING[key]) for key in keys if key in _ASCENDING), 0)
    return {key: _first(node["properties"][key], key, points) for key in keys}


def _first(node: Node, key: str = "", points: int = 0) -> Any:
    """Return a valid value of a node, that of a key where that has one of its own; a list has so many entries."""
    full = _resolved(node)
    choices = _options(node)
    tables = [choice for choice in choices if "properties" in choice]
    if key in _VALUES:
        return _VALUES[key]
    if "enum" in full:
        return full["enum"][0]
    if "prefixItems" in full:
        return [_first(entry) for entry in full["prefixItems"]]
    if full.get("type") == "array":
        count = max(points, full.get("minItems", 1))
        return list(_ASCENDING[key][:count]) if key in _ASCENDING else [_first(full["items"])] * count
    if tables and len(tables) == len(choices):
        return _table(tables[-1])  # of a record the values themselves: a file is named by who has one
    example = next((choice["examples"][0] for choice in choices if choice.get("examples")), None)
    return example or ("column" if "minLength" in full else max(1, full.get("minimum", 1)))


def _found(tables: Any, location: Location) -> Any:
    """Return what stands at a location; None if nothing does."""
    for part in location:
        try:
            tables = tables[part]
        except (LookupError, TypeError):
            return None
    return tables


def _plain(value: Any) -> Any:
    """Return values without their units, for a model that has none."""
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_plain(entry) for entry in value]
    text = _NUMBER.fullmatch(value) if isinstance(value, str) else None
    return float(text[1]) if text else value
