"""Plain text in columns, for terminals and pipes alike.

Takes rows of text; gives lines.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence


def columns(head: Sequence[str], rows: Iterable[Sequence[str]], words: Collection[int] = (0,)) -> str:
    """Return a table: the columns of words aligned left, the others right, two spaces between."""
    table = [list(head), *(list(row) for row in rows)]
    widths = [max(len(row[k]) for row in table) for k in range(len(head))]
    lines = (
        "  ".join(cell.ljust(widths[k]) if k in words else cell.rjust(widths[k]) for k, cell in enumerate(row))
        for row in table
    )
    return "\n".join(line.rstrip() for line in lines)
