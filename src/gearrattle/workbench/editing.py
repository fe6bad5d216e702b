"""Edits of a model file that keep its comments and layout.

Edits are ``{"op": "set", "path", "value" | "typed"}``, ``{"op": "add", "table", "value"}``,
``{"op": "delete", "path"}``, ``{"op": "rename", "table", "name", "to"}`` and ``{"op": "begin", "path", "option"}``,
which begins a table or a list with valid values (``first_values``), or adds a row. A path is a text as for
``Model.with_``, "mesh.gear.backlash", or keys and 0-based indices, ``["mesh", 0, "backlash"]``. The text must be valid
TOML, but need not be a valid model. A value may be a factor, ``{"factor": 3}``, and its path a pattern; every value
keeps its unit. ``typed`` is the text that a user types into a field: a number is kept as it is typed, anything else
becomes a text.

After every edit, the values of the text are compared with those of the same edit on plain tables.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from itertools import pairwise
from typing import Any, NamedTuple

import tomlkit
from tomlkit.items import InlineTable, Item

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.factors import factor_in, is_factor
from gearrattle.model.model_file import read_tables
from gearrattle.model.paths import ANY, SAME_THING, location_of, paths_at, value_at
from gearrattle.model.toml_text import value_text
from gearrattle.wording import listed
from gearrattle.workbench import toml_blocks as documents
from gearrattle.workbench.first_values import begun, multiplied
from gearrattle.workbench.references import BODY, dependents, label, references, rows_of
from gearrattle.workbench.toml_blocks import Block, Location

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?")
_MOST = 1000
Edit = Mapping[str, Any]
Step = tuple[str, Location, str]
"""Operation ("set", "add", "delete"), location, and the value as TOML text."""


class Edited(NamedTuple):
    """A text after its edits, and notes on further parts that they removed."""

    text: str
    notes: tuple[str, ...]


def edited(text: str, edits: Sequence[Edit]) -> Edited:
    """Apply edits to a model file in TOML, one after another, and keep its comments; notes say what a deleted body took
    along. ModelError if the text is no TOML, an edit is not valid, or its path does not exist.
    """
    if not isinstance(edits, Sequence) or isinstance(edits, str) or len(edits) > _MOST:
        raise _refused("edits", "", f"must be a list of at most {_MOST} edits")
    notes: list[str] = []
    for edit in edits:
        for part in _parts(text, edit):
            tables, _ = read_tables(text, "text")
            steps, note = _steps(tables, part)
            notes += [note] if note else []
            for step in steps:
                text = _carried_out(text, step)
    return Edited(text, tuple(notes))


def literal_of(typed: str) -> str:
    """Return the TOML of what is typed into a field: a number as it is typed, anything else as text."""
    text = typed.strip()
    if not _NUMBER.fullmatch(text):
        return value_text(text.strip('"'))
    try:
        tomllib.loads(f"x = {text}")
    except tomllib.TOMLDecodeError:
        return value_text(float(text))
    return text


def _parts(text: str, edit: Edit) -> Sequence[Edit]:
    """Return the edits that an edit stands for: those that begin what it asks for, one for each value, or itself."""
    if not isinstance(edit, Mapping) or edit.get("op") not in ("begin", "set"):
        return [edit]
    tables, _ = read_tables(text, "text")
    if edit["op"] == "set":
        return _single_settings(tables, edit)
    location = _location(tables, edit, "path")
    option = edit.get("option", 0)
    if type(option) is not int or option < 0:
        raise _refused("edits", str(option), "option must be a whole number from 0")
    try:
        return begun(tables, location, option)
    except LookupError:
        words = ".".join(str(part) for part in location)
        raise _refused(f"path {words}", "", "no table or list may stand here") from None


def _single_settings(tables: Mapping[str, Any], edit: Edit) -> Sequence[Edit]:
    """Return the edits that set what a pattern matches, each to its own value times a factor where one is asked for."""
    path = edit.get("path")
    value = edit.get("value")
    if not isinstance(path, str) or not (ANY in path or is_factor(value)):
        return [edit]
    paths = paths_at(tables, path)
    if not is_factor(value):
        return [{**edit, "path": one} for one in paths]
    factor = factor_in(value).times
    return [{"op": "set", "path": one, "value": _times(tables, one, factor)} for one in paths]


def _times(tables: Mapping[str, Any], path: str, factor: float) -> Any:
    """Return the number at a path, as it is written, times a factor."""
    own = value_at(tables, path)
    value = multiplied(own, factor)
    if value is own:
        raise _refused(f"path {path}", str(own), "a factor needs a number here")
    return value


def _steps(tables: Mapping[str, Any], edit: Edit) -> tuple[list[Step], str]:
    """Return the steps of an edit, and a sentence where it does more than it says."""
    makers: dict[str, Callable[[Mapping[str, Any], Edit], tuple[list[Step], str]]] = {
        "set": _setting,
        "add": _adding,
        "delete": _deleting,
        "rename": _renaming,
    }
    op = edit.get("op") if isinstance(edit, Mapping) else None
    if not isinstance(op, str) or op not in makers:
        raise _refused("edits", str(op), f"an edit is one of {', '.join(makers)}")
    return makers[op](tables, edit)


def _setting(tables: Mapping[str, Any], edit: Edit) -> tuple[list[Step], str]:
    location = _location(tables, edit, "path")
    typed = edit.get("typed")
    value = edit.get("value")
    if isinstance(typed, str) and typed.strip():
        literal = literal_of(typed)
    elif value is not None:
        literal = value_text(value)
    else:
        return _deleting(tables, edit)
    same = (
        [(*location[:-1], key) for key in SAME_THING]
        if location[:-1] == ("excitation",) and location[-1] in SAME_THING
        else []
    )
    others: list[Step] = [("delete", key, "") for key in same if key != location and _stands(tables, key)]
    return [*others, ("set", location, literal)], ""


def _adding(tables: Mapping[str, Any], edit: Edit) -> tuple[list[Step], str]:
    location = _location(tables, edit, "table")
    value = edit.get("value")
    if value is None:
        raise _refused("edits", "", "an added row needs a value")
    words = ".".join(str(part) for part in location)
    if _stands(tables, location) and not isinstance(_value_at(tables, location), list):
        raise _refused(f"path {words}", "", "is no list, to which a row can be added")
    if len(location) == 1 and not isinstance(value, Mapping):
        raise _refused(f"path {words}", str(value), "a row of it must be a table")
    steps: list[Step] = [("add", location, value_text(value))]
    if location == (BODY,):
        steps += [("add", start, "0.0") for start in _starts(tables)]
    return steps, ""


def _deleting(tables: Mapping[str, Any], edit: Edit) -> tuple[list[Step], str]:
    location = _location(tables, edit, "path")
    if not _stands(tables, location):
        return [], ""
    row = _value_at(tables, location)
    name = row.get("name") if location[:1] == (BODY,) and len(location) == 2 and isinstance(row, Mapping) else None
    if not isinstance(name, str) or sum(row.get("name") == name for row in rows_of(tables, BODY)) > 1:
        return [("delete", location, "")], ""
    gone = sorted(
        dependents(tables, name), key=lambda row: [(str(key), 0) if isinstance(key, str) else ("", key) for key in row]
    )
    gone += [(*start, location[1]) for start in _starts(tables)]
    steps: list[Step] = [("delete", row, "") for row in [*reversed(gone), location]]
    rows = [label(tables, row) for row in gone if row[0] != "simulation"]
    return steps, f"{listed(rows)} went with {name}" if rows else ""


def _renaming(tables: Mapping[str, Any], edit: Edit) -> tuple[list[Step], str]:
    kind, name, to = (edit.get(key) for key in ("table", "name", "to"))
    if not isinstance(kind, str) or not isinstance(name, str) or not isinstance(to, str):
        raise _refused("edits", "", "a rename has the texts table, name and to")
    own = [index for index, row in enumerate(rows_of(tables, kind)) if row.get("name") == name]
    if not own:
        raise _refused(f"{kind}.{name}", "", f"no {kind} is named {name}")
    locations: list[Location] = [(kind, own[0], "name")]
    if kind == BODY and len(own) == 1:
        locations += references(tables, name)
    return [("set", location, value_text(to)) for location in locations], ""


def _starts(tables: Mapping[str, Any]) -> list[Location]:
    """Return the lists of an initial state that have one entry per inertia."""
    count = len(rows_of(tables, BODY))
    keys = ("angle", "velocity")
    locations: list[Location] = [("simulation", "initial", key) for key in keys]
    return [
        location
        for location in locations
        if _stands(tables, location) and isinstance(row := _value_at(tables, location), list) and len(row) == count
    ]


def _location(tables: Mapping[str, Any], edit: Edit, key: str) -> Location:
    """Read the path of an edit."""
    path = edit.get(key)
    if isinstance(path, str) and path:
        return location_of(tables, path)
    if isinstance(path, Sequence) and path and all(type(part) in {str, int} for part in path):
        return tuple(path)
    raise _refused(key, str(path), 'must be a path, such as "mesh.gear.backlash" or ["mesh", 0, "backlash"]')


def _stands(tables: Mapping[str, Any], location: Location) -> bool:
    """Tell whether something stands at a location."""
    try:
        _value_at(tables, location)
    except LookupError:
        return False
    return True


def _value_at(tables: Mapping[str, Any], location: Location) -> Any:
    """Return the value at a location, or raise a ``LookupError``."""
    node: Any = tables
    for part in location:
        holder: Any = dict if isinstance(part, str) else list
        if not isinstance(node, holder):
            raise LookupError(part)
        node = node[part]
    return node


def _carried_out(text: str, step: Step) -> str:
    """Return the text after one step; its values must be those of the same step on plain tables."""
    op, location, literal = step
    document = documents.blocks_of(text if text.endswith("\n") or not text else text + "\n")
    words = ".".join(str(part) for part in location)
    if op == "delete":
        location = _last_of_its_kind(tomllib.loads(text), location)
    try:
        expected = _on_tables(tomllib.loads(text), op, location, literal)
        {"set": _set, "add": _add, "delete": _delete}[op](document, location, literal)
        changed = documents.text_of(document)
        if tomllib.loads(changed) != expected:
            raise ValueError("other values")
    except LookupError:
        raise _refused(f"path {words}", "", "leads nowhere") from None
    except (ValueError, TypeError, tomlkit.exceptions.TOMLKitError):
        raise _refused(f"path {words}", "", "cannot be edited here", "edit the text") from None
    return changed


def _last_of_its_kind(tables: Mapping[str, Any], location: Location) -> Location:
    """Return the array in place of its only entry, which is deleted with it."""
    only = isinstance(location[-1], int) and _value_at(tables, location[:-1])
    return location[:-1] if isinstance(only, list) and len(only) == 1 else location


def _on_tables(tables: dict[str, Any], op: str, location: Location, literal: str) -> dict[str, Any]:
    """Carry a step out on plain tables."""
    value = tomllib.loads(f"x = {literal}")["x"] if literal else None
    fresh = deepcopy(tables)
    node: Any = fresh
    for part, following in pairwise(location):
        if isinstance(node, dict) and isinstance(part, str) and isinstance(following, str):
            node.setdefault(part, {})
        node = _value_at(node, (part,))
    last = location[-1]
    holder: Any = dict if isinstance(last, str) else list
    if not isinstance(node, holder):
        raise LookupError(last)
    if op == "delete":
        del node[last]
    elif op == "add":
        rows = node.setdefault(last, []) if isinstance(node, dict) else node[last]
        if not isinstance(rows, list):
            raise LookupError(last)
        rows.append(value)
    else:
        node[last] = value
    return fresh


def _set(document: list[Block], location: Location, literal: str) -> None:
    block = documents.around(document, location)
    rest = location[len(block.path) :]
    if not block.path and len(rest) > 1 and isinstance(rest[1], str) and rest[0] not in tomllib.loads(block.body):
        _new_table(document, rest, literal)
    elif not rest:
        raise ValueError("a whole table")
    else:
        _in_body(block, rest, lambda node, key: _put(node, key, _item(literal)), literal)


def _new_table(document: list[Block], location: Location, literal: str) -> None:
    """Open a table for its first key."""
    for part in reversed(location[2:]):
        literal = f"{{ {part} = {literal} }}"
    documents.insert(
        document, _above(document, str(location[0])), location[:1], f"{location[1]} = {literal}\n", is_array=False
    )


def _add(document: list[Block], location: Location, literal: str) -> None:
    rows = [block.path for block in document if block.path[:-1] == location and isinstance(block.path[-1], int)]
    block = documents.around(document, location)
    is_new = not rows and len(location) == 1 and location[0] not in tomllib.loads(block.body)
    if rows or (is_new and literal.startswith("{")):
        after = documents.within(document, rows[-1])[-1] if rows else _above(document, str(location[0]))
        keys = tomllib.loads(f"x = {literal}")["x"]
        documents.insert(document, after, (*location, len(rows)), _lines(keys), is_array=True)
        return
    _in_body(block, location[len(block.path) :], lambda node, key: _append(node, key, literal), "")


def _delete(document: list[Block], location: Location, _literal: str) -> None:
    if own := documents.within(document, location):
        documents.remove(document, own)
        return
    block = documents.around(document, location)

    def take_out(node: Any, key: int | str) -> None:
        del node[key]

    _in_body(block, location[len(block.path) :], take_out, "")


def _in_body(block: Block, rest: Location, change: Callable[[Any, int | str], None], literal: str) -> None:
    """Change the keys of one block; a table that is missing on the way begins with the key alone."""
    keys = tomlkit.parse(block.body)
    node: Any = keys
    for depth, part in enumerate(rest[:-1]):
        if isinstance(part, str) and part not in node and literal:
            for key in reversed(rest[depth + 1 :]):
                literal = f"{{ {key} = {literal} }}"
            _put(node, part, _item(literal))
            break
        node = node[part]
    else:
        change(node, rest[-1])
    body = tomlkit.dumps(keys)
    block.body = body if body.endswith("\n") or not body else body + "\n"


def _item(literal: str) -> Item:
    """Return a value of TOML as it is written."""
    value = tomlkit.parse(f"x = {literal}\n").item("x")
    if not isinstance(value, Item):
        raise TypeError("no value")
    return value


def _put(node: Any, key: int | str, value: Item) -> None:
    """Set a value; the comment behind it stays in its column."""
    old = node.item(key) if isinstance(key, str) and key in node else None
    if old is not None and old.trivia.comment and not isinstance(node, InlineTable):
        shift = len(old.as_string()) - len(value.as_string())
        value.trivia.comment = old.trivia.comment
        value.trivia.comment_ws = " " * max(len(old.trivia.comment_ws) + shift, 1)
    is_new = old is None and isinstance(node, InlineTable)
    spaced = is_new and node.as_string().endswith(" }")
    node[key] = value
    if spaced:
        value.trivia.trail = " "


def _append(node: Any, key: int | str, literal: str) -> None:
    """Add an entry to an array; a new array of tables has one on each line."""
    if key in node if isinstance(key, str) else True:
        node[key].append(_item(literal))
    else:
        text = (
            f"[\n  {literal},\n]" if literal.startswith("{") and not isinstance(node, InlineTable) else f"[{literal}]"
        )
        _put(node, key, _item(text))


def _above(document: Sequence[Block], kind: str) -> int:
    """Return the last block that stands above a table of a kind in the usual order."""
    order = {key: number for number, key in enumerate(Model.keys())}
    rank = order.get(kind, len(order))
    ranks = [order.get(str(block.path[0]), len(order)) if block.path else -1 for block in document]
    return max(number for number, own in enumerate(ranks) if own <= rank)


def _lines(keys: Mapping[str, Any]) -> str:
    """Return the keys of a new table, one per line."""
    return "".join(f"{key} = {_shown(value)}\n" for key, value in keys.items())


def _shown(value: Any) -> str:
    if isinstance(value, list) and value and isinstance(value[0], Mapping):
        return "[\n" + "".join(f"  {value_text(row)},\n" for row in value) + "]"
    return value_text(value)


def _refused(where: str, value: str, rule: str, remedy: str = "") -> ModelError:
    """Return the error of an edit that cannot be made."""
    return ModelError(Problem(where, value, rule, remedy))
