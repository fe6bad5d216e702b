"""JavaScript widgets and the parts that they need, for notebooks, the workbench and pages of results.

The first line of a widget's file names the parts that it needs (``// needs: plot, theme``). A part ends with ``export
default``, like a widget. A notebook loads a widget as one text, where relative imports fail; there the parts are put in
front of the widget, every part in its own scope. The script of a page is made in the same way. The workbench imports
the parts, so that it loads every part only once.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

FOLDER = Path(__file__).parent
_NEEDS = re.compile(r"\A// needs: ([a-z_, ]+)\n")
_COMMENT = re.compile(r"^ *//.*\n", flags=re.MULTILINE)
_EXPORT = re.compile(r"^export default ", flags=re.MULTILINE)


def names() -> tuple[str, ...]:
    """Return the names of all widgets and parts."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.js")))


@cache
def text(name: str) -> str:
    """Return a widget and all parts it needs as one ES module; KeyError for an unknown widget."""
    return with_parts(_source(name))


def with_parts(source: str) -> str:
    """Return a script with all parts that its first line names in front of it."""
    return "\n".join([*(_scoped(part) for part in _needed(source)), source])


@cache
def module(name: str) -> str:
    """Return a widget as an ES module that imports all parts, those of its parts included, so that a browser loads them
    at the same time, without comment lines; KeyError for an unknown widget.
    """
    source = _source(name)
    direct = _needs(source)
    others = [part for part in _needed(source) if part not in direct]
    lines = [f'import {part} from "./{part}.js";' for part in direct] + [f'import "./{part}.js";' for part in others]
    return "\n".join([*lines, _COMMENT.sub("", source)])


@cache
def style() -> str:
    """Return the style sheet of all widgets."""
    return (FOLDER / "widgets.css").read_text(encoding="utf-8")


def _source(name: str) -> str:
    if name not in names():
        raise KeyError(name)
    return (FOLDER / f"{name}.js").read_text(encoding="utf-8")


def _needs(source: str) -> list[str]:
    head = _NEEDS.match(source)
    return re.split(r",\s*", head[1].strip()) if head else []


def _needed(source: str) -> list[str]:
    """Return the parts of a script without repetitions; a part comes after the parts that it needs."""
    parts = [part for direct in _needs(source) for part in (*_needed(_source(direct)), direct)]
    return list(dict.fromkeys(parts))


def _scoped(name: str) -> str:
    """Return a part as a constant with its name, without comment lines, because every widget has a copy of it."""
    return f"const {name} = (() => {{\n{_EXPORT.sub('return ', _COMMENT.sub('', _source(name)))}\n}})();"
