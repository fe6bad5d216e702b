"""A result as an Excel workbook: summary, the tables of its page, and all its numbers.

Cells of tables that are numbers are numbers in the sheet, with the digits of the page; the last sheet has every number
with all its digits, as far as a sheet can hold them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearrattle.errors import check_installed
from gearrattle.report.numbers import count_of_numbers, table_of_numbers
from gearrattle.report.provenance import versions
from gearrattle.report.tables import cell_text
from gearrattle.wording import counted

if TYPE_CHECKING:
    import pandas as pd

    from gearrattle.report.presentation import Presentation
    from gearrattle.report.tables import Table

_LONGEST_TITLE = 31  # characters of a sheet's name
_FORBIDDEN = re.compile(r"[\[\]:*?/\\']")
_MOST_NUMBERS = 100_000  # numbers that are written into the last sheet: some seconds
_WIDEST = 60  # characters of a column's width
_NUMERAL = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?")
_SIGNS = str.maketrans("−", "-", "\u00a0\u2009\u202f ")  # the sign, and spaces within numerals
_PLAIN = _SIGNS | str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")


def check(option: str, value: str) -> None:
    """Refuse a workbook without openpyxl (NotInstalled)."""
    check_installed("openpyxl", "office", option, value, "Excel tables need openpyxl, which is not installed")


def write(presentation: Presentation[Any], path: Path) -> None:
    """Write a workbook: a sheet with the summary, one a table, one with the numbers."""
    from openpyxl import Workbook

    book = Workbook(write_only=True)
    titles: set[str] = set()
    data = presentation.data()
    numbers = count_of_numbers(data)
    is_short = numbers <= _MOST_NUMBERS
    rule = f"its {counted(numbers, 'number')} are not in this workbook: save it as .nc or .csv for them"
    _append(book, _title("Summary", titles), _summary(presentation, "" if is_short else rule))
    # the answer, then the other tables of the page
    answer = [table for table in presentation.answer() if table.rows]
    for table in answer:
        _append(book, _title(table.title or "Answer", titles), _rows_of(table), is_table=True)
    for section in presentation.sections():
        for table in section.tables:
            if table.rows and table not in answer:
                _append(book, _title(table.title or section.title, titles), _rows_of(table), is_table=True)
    # every number
    if is_short:
        _append(book, _title("Numbers", titles), _rows_of_frame(table_of_numbers(data)), is_table=True)
    book.save(path)


def _summary(presentation: Presentation[Any], note: str) -> Iterator[list[Any]]:
    """Yield the rows of the first sheet: what the result is, its answer, notes, origin."""
    yield [presentation.title]
    yield [presentation.kind]
    for sentence in (presentation.sentence, *presentation.further):
        yield [sentence]
    yield []
    for text in (*presentation.notes, note):
        if text:
            yield [f"Note: {text}"]
    yield []
    yield [f"Created {presentation.created} with {', '.join(f'{n} {v}' for n, v in versions().items())}"]


def _rows_of(table: Table) -> Iterator[list[Any]]:
    """Yield the head, the rows and the note of a table."""
    yield list(table.head)
    for row in table.rows:
        yield [cell_text(cell) if index in table.words else _number(cell) for index, cell in enumerate(row)]
    if table.note:
        yield []
        yield [table.note]


def _rows_of_frame(frame: pd.DataFrame) -> Iterator[list[Any]]:
    """Yield the head and the rows of a table of numbers; empty cells for what is no number."""
    yield [str(name) for name in frame.columns]
    for row in frame.astype(object).where(frame.notna(), None).itertuples(index=False):
        yield [value.item() if hasattr(value, "item") else value for value in row]


def _number(cell: str) -> float | str:
    """Return a cell as a number, if its text is one, also as 1.5 × 10⁻⁴."""
    words = cell_text(cell)
    text = words.translate(_PLAIN).replace("×10", "e") if "× 10" in words else words.translate(_SIGNS)
    return float(text) if _NUMERAL.fullmatch(text) else words


def _append(book: Any, title: str, rows: Iterator[list[Any]], *, is_table: bool = False) -> None:
    """Add a sheet; the head of a table is bold and stays in view, its columns are as wide as their entries."""
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.styles import Alignment, Font
    from openpyxl.utils import get_column_letter

    sheet = book.create_sheet(title)
    buffered = list(rows)
    if is_table:
        sheet.freeze_panes = "A2"
        for index, width in enumerate(_widths(buffered), 1):
            sheet.column_dimensions[get_column_letter(index)].width = width
    else:
        sheet.column_dimensions["A"].width = 2 * _WIDEST
    for number, row in enumerate(buffered):
        cells = []
        for value in row:
            if number > 0 and not (isinstance(value, str) and (value.startswith("=") or not is_table)):
                cells.append(value)
                continue
            cell = WriteOnlyCell(sheet, value)
            if isinstance(value, str):
                cell.data_type = "s"  # a text that begins with = is no formula
                cell.alignment = Alignment(wrap_text=True, vertical="top")
            cell.font = Font(bold=number == 0)
            cells.append(cell)
        sheet.append(cells)


def _widths(rows: Sequence[Sequence[Any]]) -> list[float]:
    """Return the widths of the columns [characters], by their first thousand rows."""
    columns = max(map(len, rows), default=0)
    longest = [0] * columns
    for row in rows[:1000]:
        for index, value in enumerate(row):
            longest[index] = max(longest[index], len(str(value)))
    return [min(_WIDEST, count + 2.0) for count in longest]


def _title(words: str, taken: set[str]) -> str:
    """Return a name for a sheet: allowed, and not taken, in whichever letters."""
    base = _FORBIDDEN.sub(" ", words).strip()[:_LONGEST_TITLE] or "Table"
    title = base
    count = 1
    while title.lower() in taken:
        count += 1
        title = f"{base[: _LONGEST_TITLE - 4]} {count}"
    taken.add(title.lower())
    return title
