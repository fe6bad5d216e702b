"""Symbol and template of a table of the model file, for drawings and the editor.

A symbol is drawn along the line from the first end of an element to the second; a template holds the first values of a
new table.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

from gearrattle.model.table import Table


class Symbol(NamedTuple):
    """A drawing symbol on a horizontal line, its width in px.

    The path is SVG path data in relative commands: it begins where the line comes in, and ends where the line goes on.
    """

    path: str
    width: float


BOX = Symbol("m0 -10 h28 v20 h-28 z m28 10", 28.0)
"""Of what has no symbol of its own."""


class Shown(Table):
    """A table that drawings show."""

    noun: ClassVar[str]
    """What it is called."""
    symbol: ClassVar[Symbol] = BOX
    """How it is drawn."""
    template: ClassVar[Mapping[str, Any]] = {}
    """What a new one holds, values as in a file; the bodies it names have names of one letter."""
