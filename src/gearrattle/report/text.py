"""A result as plain text: its sentence and its short tables in columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gearrattle.report.tables import shortened
from gearrattle.wording import columns

if TYPE_CHECKING:
    from gearrattle.report.presentation import Presentation

_MOST_ROWS = 60


def plain_text(presentation: Presentation[Any], width: int | None = None) -> str:
    """Return the sentence and the tables of the answer; of a long table the first sixty rows.

    ``width`` is of a line of a table, in characters; longer cells of words continue below themselves. None: no limit.
    """
    parts = [presentation.sentence, *presentation.further]
    for table in presentation.answer():
        if table.rows:
            short = shortened(table, _MOST_ROWS)
            lines = (short.title, columns(short.head, short.rows, short.words, width), short.note)
            parts.append("\n".join(line for line in lines if line))
    return "\n\n".join(parts)
