"""The answer of a study, for a terminal and for machines: a few short tables, and plain values by name.

Takes Tables and numbers; gives an Answer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from gearrattle.report.tables import Table


@dataclass(frozen=True)
class Answer:
    """What came out, for a terminal and for machines.

    Attributes:
        tables: a few rows each.
        content: JSON types by name: SI values, by the paths of the model file.
    """

    tables: tuple[Table, ...]
    content: Mapping[str, Any]


def shortened(table: Table, most: int = 12) -> Table:
    """Return a table with a few rows for a terminal; the page has the others."""
    left = len(table.rows) - most
    return table if left <= 0 else replace(table, rows=table.rows[:most], note=f"{left} more rows stand on the page.")
