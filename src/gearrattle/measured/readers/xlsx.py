"""Excel workbooks (.xlsx), through openpyxl (extra ``measured``).

A sheet is read as the CSV that it would be saved as: names and units in the rows above the numbers, dates and clock
times as times. Where several sheets have a table, a column is named by sheet and column. Of formulas the values stored
with them are read. The library writes numbers to 16 digits. Format: ECMA-376, part 1.
"""

from __future__ import annotations

import datetime
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, NotInstalled, Problem
from gearrattle.files import Refused, check_archive, opened
from gearrattle.measured.readers import csv
from gearrattle.measured.readers.reader import Raw, Request, unfit
from gearrattle.model.csv_layout import RecordError, layout_of
from gearrattle.model.table import listed
from gearrattle.recording import Recording
from gearrattle.wording import counted

NAME = "xlsx"
SUFFIXES = (".xlsx", ".xlsm")
_MOST_CELLS = 10_000_000  # cells that are read of a workbook, empty ones counted
_MOST_ROWS = 1_048_576  # rows of a sheet
_ERROR = "e"  # data type of a cell that holds an error, such as #N/A


def knows(path: Path, head: bytes) -> bool:
    """Return whether a file is a zip archive that holds a workbook."""
    if head[:4] != b"PK\x03\x04":
        return False
    try:
        with opened(path) as stream, zipfile.ZipFile(stream) as archive:
            return "xl/workbook.xml" in archive.namelist()
    except (OSError, zipfile.BadZipFile):
        return False


def read(path: Path, request: Request) -> Raw:
    """Return the columns of its sheets."""
    library = _library(path)
    check_archive(path)
    with tempfile.TemporaryDirectory() as folder:
        sheets = _sheets_as_text(library, path, Path(folder))
        fewest = 1 if len(sheets) == 1 else 2
        tables = {title: file for title, file in sheets.items() if _columns_of(file) >= fewest}
        # the columns of every sheet with a table; named by their sheets where several have one
        records: list[Raw] = []
        refused: dict[str, ModelError] = {}
        for title, file in tables.items():
            prefix = f"{title}/" if len(tables) > 1 else ""
            try:
                records.append(_read_sheet(file, _asked_of(request, prefix), f"{path}: {title}", prefix))
            except ModelError as error:
                refused[title] = error
    # refuse a workbook without signals; name the sheets that are left out
    if not tables:
        rule = "has no sheet with a table of numbers and names above them"
        remedy = "the values of formulas are stored where Excel has saved the workbook"
        raise ModelError(Problem(str(path), listed(sheets), rule, remedy))
    if not records:
        raise next(iter(refused.values()))
    notes = [note for record in records for note in record.notes]
    notes += [f"sheet {title} left out: {error.problems[0].rule}" for title, error in refused.items()]
    others = [title for title in sheets if title not in tables]
    notes += [f"sheets without a table of numbers, left out: {', '.join(others)}"] if others else []
    columns = [column for record in records for column in record.columns]
    return Raw(tuple(columns), str(path), NAME, tuple(notes))


def _sheets_as_text(library: Any, path: Path, folder: Path) -> dict[str, Path]:
    """Write every sheet as a CSV whose lines are its rows; return the files by the titles of the sheets."""
    files: dict[str, Path] = {}
    cells = 0
    with _opened(library, path) as workbook:
        for number, sheet in enumerate(workbook.worksheets):
            sheet.reset_dimensions()  # some programs store wrong ones
            rows: list[list[str]] = []
            for row in sheet.iter_rows():
                cells += len(row) + 1
                if cells > _MOST_CELLS:
                    raise Refused(f"has more than {_MOST_CELLS} cells", "save the sheet as CSV")
                rows.append([_text(cell) for cell in row])
            width = max(map(len, rows), default=0)
            files[sheet.title] = folder / f"{number}.csv"
            with open(files[sheet.title], "w", encoding="utf-8", newline="\n") as stream:
                for row in rows:
                    is_comment = bool(row) and row[0].startswith("#")
                    missing = 0 if is_comment else width - len(row)
                    stream.write("\t".join(row + [""] * missing).rstrip("\t" if is_comment else "\n") + "\n")
    return files


def _text(cell: Any) -> str:
    """Return the content of a cell as an entry of a CSV: numbers to the last bit, an error as a gap."""
    value = cell.value
    if value is None or cell.data_type == _ERROR:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, datetime.timedelta):
        return repr(value.total_seconds())
    if isinstance(value, datetime.datetime | datetime.date | datetime.time):
        return value.isoformat()
    return " ".join(str(value).replace('"', "'").split())


def _columns_of(file: Path) -> int:
    """Return the number of columns of a sheet's table; 0 where there is no row of numbers."""
    with suppress(RecordError):
        layout = layout_of(file)
        return len(layout.heads) if next(layout.rows(file), None) else 0
    return 0


def _asked_of(request: Request, prefix: str) -> Request:
    """Return the request with names as a sheet has them."""
    if not prefix:
        return request
    names = request.names
    own = None if names is None else frozenset(n.removeprefix(prefix) for n in names if n.startswith(prefix))
    return request._replace(names=own, time=request.time.removeprefix(prefix))


def _read_sheet(file: Path, request: Request, location: str, prefix: str) -> Raw:
    """Return the columns of a sheet; a ModelError has the place in the workbook."""
    try:
        record = csv.read(file, request)
    except ModelError as error:
        problems = [replace(p, place=p.place.replace(str(file), location)) for p in error.problems]
        raise ModelError(problems) from None
    columns = tuple(replace(column, name=f"{prefix}{column.name}") for column in record.columns)
    return replace(record, columns=columns)


def write(recording: Recording, path: Path) -> None:
    """Write one sheet: what the columns are, ``time [s]`` and one column per channel."""
    library = _library(path)
    comments, heads = csv.head_of(recording, path)
    if len(comments) + 1 + recording.time.size > _MOST_ROWS:
        raise unfit(path, counted(recording.time.size, "sample"), f"a sheet has {_MOST_ROWS} rows", "write CSV or HDF5")
    workbook = library.Workbook(write_only=True)
    sheet = workbook.create_sheet("recording")
    for comment in comments:
        sheet.append([comment])
    sheet.append(heads)
    for row in csv.rows_of(recording):
        sheet.append(row)
    workbook.save(path)


@contextmanager
def _opened(library: Any, path: Path) -> Iterator[Any]:
    """Open a workbook to read the values of its cells, a row at a time."""
    with opened(path) as stream:
        workbook = library.load_workbook(stream, read_only=True, data_only=True, keep_links=False)
        try:
            yield workbook
        finally:
            workbook.close()


def _library(path: Path) -> Any:
    """Return openpyxl."""
    try:
        import openpyxl
    except ImportError:
        rule = "Excel workbooks need openpyxl, which is not installed"
        raise NotInstalled.of("measured", str(path), "", rule) from None
    return openpyxl
