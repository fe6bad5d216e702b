"""A table of the report."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from markupsafe import Markup

from gearrattle.wording import counted


@dataclass(frozen=True)
class Table:
    """A table of text, ready to print.

    Attributes
    ----------
    rows
        cells, as many in a row as in ``head``. Text is escaped by the page, ``Markup`` is not.
    words
        indices of the columns of words, aligned left; all others are numbers, aligned right.
    """

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: frozenset[int] = field(default=frozenset({0}))
    title: str = ""
    note: str = ""


@dataclass(frozen=True)
class Tile:
    """One large number: what it is, its value, and what it refers to."""

    label: str
    value: str
    detail: str


def cell_text(cell: str) -> str:
    """Return a cell as plain text: of HTML, such as a small drawing, the words alone."""
    return cell.striptags() if isinstance(cell, Markup) else str(cell)


def shortened(table: Table, most: int = 12) -> Table:
    """Return a table with its first rows, for a terminal or a notebook; a saved page has the others."""
    left = len(table.rows) - most
    if left <= 0:
        return table
    return replace(
        table, rows=table.rows[:most], note=f"{counted(left, 'row')} more: save the result to see all of them."
    )
