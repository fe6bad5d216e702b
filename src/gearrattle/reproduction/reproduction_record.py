"""Result of a reproduction: sections with rows of "paper, ours, why they differ", each row with its status."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, ClassVar, Literal

from gearrattle.json_types import Json, json_value
from gearrattle.report.plots.chart import Chart
from gearrattle.report.tables import Table
from gearrattle.result import Result

Status = Literal[
    "reproduced",
    "holds by construction",
    "differs",
    "cannot be decided, since the paper does not print the loads",
    "cannot be decided, since the figure does not survive as numbers",
    "cannot be told from zero",
    "not available here",
]
REPRODUCED: Status = "reproduced"
CONSTRUCTED: Status = "holds by construction"
"""Of a row that cannot fail: our model was fitted to what it compares with, or the setting of the run forces it."""
DIFFERS: Status = "differs"
UNDECIDED: Status = "cannot be decided, since the paper does not print the loads"
LOST: Status = "cannot be decided, since the figure does not survive as numbers"
NOISE: Status = "cannot be told from zero"
UNAVAILABLE: Status = "not available here"
STATUSES = (REPRODUCED, CONSTRUCTED, DIFFERS, UNDECIDED, LOST, NOISE, UNAVAILABLE)


@dataclass(frozen=True)
class Row:
    """One statement of the paper with its place, and the result of its check.

    Attributes
    ----------
    why
        the reason, where there is one to give; always for ``differs``.
    """

    item: str
    paper: str
    ours: str
    status: Status
    why: str
    figures: dict[str, float]

    @property
    def verdict(self) -> str:
        """The status as the page says it."""
        return "differs, because" if self.status == DIFFERS else self.status


def row(item: str, paper: str, ours: str, status: Status, why: str = "", **figures: float) -> Row:
    """Make a row; ``figures`` are our numbers by name."""
    return Row(item, paper, ours, status, why, {name: float(value) for name, value in figures.items()})


@dataclass(frozen=True)
class Section:
    """A part of the page."""

    key: str
    title: str
    words: str
    rows: tuple[Row, ...]
    tables: tuple[Table, ...] = ()
    charts: tuple[Chart, ...] = ()


@dataclass(frozen=True)
class Reproduction(Result):
    """All sections; of a quick run the figures are samples, not results."""

    kind: ClassVar[str] = "reproduction"
    notes: ClassVar[tuple[str, ...]] = ()
    sections: tuple[Section, ...]
    quick: bool
    seconds: float

    @property
    def rows(self) -> tuple[Row, ...]:
        """The rows of all sections."""
        return tuple(row for section in self.sections for row in section.rows)

    def row(self, item: str) -> Row:
        """The row of an item."""
        return next(row for row in self.rows if row.item == item)

    def counts(self) -> dict[Status, int]:
        """How many rows have each status; those that none has are left out."""
        counts = {status: sum(row.status == status for row in self.rows) for status in STATUSES}
        return {status: number for status, number in counts.items() if number}

    def to_dict(self) -> dict[str, Json]:
        """Return everything but the charts in JSON types; numbers that are not finite become None."""
        sections = [
            {
                "key": section.key,
                "title": section.title,
                "words": section.words,
                "rows": [asdict(row) for row in section.rows],
                "tables": [{"title": t.title, "head": t.head, "rows": t.rows, "note": t.note} for t in section.tables],
            }
            for section in self.sections
        ]
        content: dict[str, Any] = json_value(
            {"quick": self.quick, "seconds": self.seconds, "counts": self.counts(), "sections": sections}
        )
        return content
