"""Widgets and the parts that they need, as notebooks, the workbench and pages of results load them.

A widget's file names the parts that it needs in its first line (``// needs: plot, theme``); a part ends with ``export
default``, as a widget does. A notebook loads a widget as one text, so relative imports fail there: the parts are put
before it, each in a scope of its own; so it is with the script of a page. The workbench imports them, so that it loads
every part once.
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
    """Return a widget with all it needs as one ES module; KeyError for an unknown one."""
    return with_parts(_source(name))


def with_parts(source: str) -> str:
    """Return a script behind all parts that its first line names."""
    return "\n".join([*(_scoped(part) for part in _needed(source)), source])


@cache
def module(name: str) -> str:
    """Return a widget as an ES module that imports all parts, also those that parts need, so that a browser asks for
    them at once; KeyError for an unknown one.
    """
    source = _source(name)
    direct = _needs(source)
    others = [part for part in _needed(source) if part not in direct]
    lines = [f'import {part} from "./{part}.js";' for part in direct] + [f'import "./{part}.js";' for part in others]
    return "\n".join([*lines, source])


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
    """Return the parts of a script, what a part needs before it, each once."""
    parts = [part for direct in _needs(source) for part in (*_needed(_source(direct)), direct)]
    return list(dict.fromkeys(parts))


def _scoped(name: str) -> str:
    """Return a part as a constant of its name, without its lines of comment: every widget that needs it holds it."""
    return f"const {name} = (() => {{\n{_EXPORT.sub('return ', _COMMENT.sub('', _source(name)))}\n}})();"
