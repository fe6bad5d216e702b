"""Layout of a CSV file: encoding, separators, decimal sign, and the rows of names, units and numbers.

    t [s], T [N*m]          Zeit;Drehmoment
    0.000, 12.1             s;Nm
    0.001, 12.4             0,000;12,1

The first line with two or more numbers determines the separator and the number of columns; a time stamp counts as a
number. ``csv_heads`` finds the names in the lines above. Lines above the names are ignored. Lines that begin with # are
comments. Entries in double quotes may contain the separator (RFC 4180).
"""

from __future__ import annotations

import codecs
import csv
import itertools
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from gearrattle.files import opened, opened_text
from gearrattle.model.csv_heads import Head, heads_of
from gearrattle.model.time_stamps import instant_of

_LOOKED_AT = 200  # lines, comments not counted, that are searched for the first numbers
_CHARACTERS_LOOKED_AT = 4_000_000  # characters in these lines together
_BYTES_LOOKED_AT = 65_536  # bytes from which the encoding is determined
_LONGEST_LINE = 1_000_000  # bytes
_PIECE = 500_000  # bytes that are read at once to count line ends; less than the longest line
_MOST_COLUMNS = 100_000
_COMMA_NUMBER = re.compile(r"[+-]?(\d+(,\d*)?|,\d+)([eE][+-]?\d+)?")
_COMMA_TO_POINT = str.maketrans(",.", ".,")
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f]")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_QUOTED = "\x1f"  # separator of entries whose quotes have been removed
EXAMPLE = "such as: t [s], n [rpm]"


class RecordError(ValueError):
    """A file that is not a table of columns; ``place`` is file, line and column, other fields as in ``Problem``."""

    def __init__(self, place: str, value: str, rule: str, remedy: str = "") -> None:
        super().__init__(rule)
        self.place = place
        self.value = value
        self.rule = rule
        self.remedy = remedy


class Stamps(NamedTuple):
    """Index of the column of time stamps, and the first stamp.

    If dates and clock times are in two columns, ``day_index`` and ``first_day`` are those of the column of dates.
    """

    column: int
    first: str
    day_index: int | None = None
    first_day: str = ""


class Layout(NamedTuple):
    """Encoding, separators, heads and time stamps of a file of columns.

    Attributes
    ----------
    names_line
        line of the names, counted from 1.
    first_row
        number of lines above the first row, without blank lines and comments.
    stamps
        time stamps; None if the file has none.
    notes
        assumptions about the file.
    """

    encoding: str
    separator: str
    decimal_comma: bool
    heads: tuple[Head, ...]
    names_line: int
    first_row: int
    quoted: bool = False
    stamps: Stamps | None = None
    notes: tuple[str, ...] = ()

    @property
    def delimiter(self) -> str:
        """Separator of the columns in ``readable`` lines."""
        return _QUOTED if self.quoted else self.separator

    def rows(self, path: Path) -> Iterator[tuple[int, str]]:
        """Yield number and text of the rows below names and units."""
        with opened_text(path, self.encoding, "replace") as stream:
            yield from itertools.islice(numbered(stream), self.first_row, None)

    def cells(self, line: str) -> list[str]:
        """Return the entries of a line, without blanks and quotes around them."""
        return cells_of(line, self.separator)

    def readable(self, line: str) -> str:
        """Return a line with decimal points and without quotes."""
        return self.with_points(_QUOTED.join(self.cells(line)) if self.quoted else line)

    def with_points(self, text: str) -> str:
        """Return a text with decimal points; with decimal commas in the file, "1.5" becomes no number."""
        return text.translate(_COMMA_TO_POINT) if self.decimal_comma else text


def cells_of(line: str, separator: str) -> list[str]:
    """Return the entries of a line, without blanks and quotes around them; a text in quotes is one entry."""
    line = line.rstrip("\r\n")
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]


def numbered(lines: Iterator[str]) -> Iterator[tuple[int, str]]:
    """Yield number and text of the lines that are neither blank nor comments."""
    for number, line in enumerate(lines, 1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, line


def encoding_of(head: bytes) -> str | None:
    """Return the encoding of a text by its first bytes: UTF-8, UTF-16 with byte order mark, else Windows-1252.

    None if it is not text. Windows-1252 contains the printable characters of Latin-1, such as ° and µ.
    """
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    if _CONTROL.search(head.decode("latin-1")):
        return None
    try:
        codecs.getincrementaldecoder("utf-8-sig")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def count_lines(path: Path) -> int:
    """Return the number of lines of a file, by counting line ends in blocks.

    RecordError for a line too long for a table, OSError if the file cannot be read.
    """
    ends = 0
    open_line = 0
    with opened(path) as stream:
        while piece := stream.read(_PIECE):
            marked = piece.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
            first = marked.find(b"\n")
            open_line += len(marked) if first < 0 else first
            if open_line > _LONGEST_LINE:
                value = f"more than {_LONGEST_LINE // 1_000_000} MB"
                rule = "a line must be shorter: it has one number of every column"
                raise RecordError(f"{path}:{ends + 1}", value, rule, "is this file a table?")
            ends += marked.count(b"\n")
            open_line = open_line if first < 0 else len(marked) - 1 - marked.rfind(b"\n")
    return ends + 1


def _first_lines(stream: Iterator[str]) -> list[tuple[int, str]]:
    """Return number and text of the first lines that are neither blank nor comments."""
    lines: list[tuple[int, str]] = []
    size = 0
    for number, line in itertools.islice(numbered(stream), _LOOKED_AT):
        lines.append((number, line.rstrip("\r\n")))
        size += len(line)
        if size > _CHARACTERS_LOOKED_AT:
            break
    return lines


def layout_of(path: Path) -> Layout:
    """Determine the layout of a file.

    RecordError if it is not text or has no line of names above the numbers, OSError if it cannot be read.
    """
    # encoding and first lines
    with opened(path) as binary:
        encoding = encoding_of(binary.read(_BYTES_LOOKED_AT))
    if encoding is None:
        raise RecordError(str(path), "", "must be a text", "export the record as CSV")
    with opened_text(path, encoding, "replace") as stream:
        lines = _first_lines(stream)
    if not lines:
        raise RecordError(str(path), "", "must begin with a line of column names and units", EXAMPLE)
    # separator and number of columns, by the first row of numbers
    separator, first_row = _first_numbers([line for _, line in lines])
    rows = [cells_of(line, separator) for _, line in lines]
    count = len(rows[min(first_row, len(rows) - 1)])
    if count > _MOST_COLUMNS:
        number, _ = lines[min(first_row, len(lines) - 1)]
        rule = f"a table has at most {_MOST_COLUMNS}"
        raise RecordError(f"{path}:{number}", f"{count} columns", rule, "a row has the samples of one time")
    while first_row > 0 and len(rows[first_row - 1]) == count and _has_gaps(rows[first_row - 1]):
        first_row -= 1
    # rows of names and units above the numbers
    top = _top_of_heads(rows, first_row, count)
    if top is None:
        number, _ = lines[min(first_row, len(lines) - 1)]
        rule = f"a line of {count} column names must stand above the numbers"
        raise RecordError(f"{path}:{number}", "", rule, EXAMPLE)
    kept = [index for index in range(top, first_row) if len(rows[index]) == count]
    heads, names, units = heads_of([rows[index] for index in kept])
    # the numbers
    stamps = _stamps(rows[first_row]) if first_row < len(rows) else None
    if stamps is not None:
        heads = _with_stamps(heads, stamps)
    comma = _has_decimal_comma(path, encoding, first_row, separator)
    quoted = any('"' in line for _, line in lines[first_row:]) or (comma and separator == ",")
    # notes on what was assumed and left out
    used = [index for index in (kept[names], None if units is None else kept[units]) if index is not None]
    left_out = [(index, lines[index][0]) for index in range(first_row) if index not in used]
    notes = (
        *_notes(encoding, comma),
        *_notes_of_lines([number for index, number in left_out if index < kept[names]], "above"),
        *_notes_of_lines([number for index, number in left_out if index > kept[names]], "below"),
        *_notes_of_stamps(heads, stamps),
    )
    return Layout(
        encoding=encoding,
        separator=separator,
        decimal_comma=comma,
        heads=heads,
        names_line=lines[kept[names]][0],
        first_row=first_row,
        quoted=quoted,
        stamps=stamps,
        notes=notes,
    )


def _first_numbers(lines: Sequence[str]) -> tuple[str, int]:
    """Return the separator, and the index of the first line with two or more numbers.

    A time stamp counts as a number in a line that begins with a time stamp or a number. If there is no line with two
    numbers, the first line holds the names and the file has no rows.
    """
    for separator in ";\t,":
        for index, line in enumerate(lines):
            cells = cells_of(line, separator)
            numbers = sum(map(_is_number, cells))
            if numbers >= 1 and (_is_number(cells[0]) or instant_of(cells[0])):
                numbers += sum(instant_of(cell) is not None for cell in cells)
            if numbers >= 2 and 2 * numbers >= sum(bool(cell) for cell in cells):
                return separator, index
    separator = next((mark for mark in ";\t" if mark in lines[0]), ",")
    return separator, 1 if separator in lines[0] else 0


def _has_gaps(row: Sequence[str]) -> bool:
    """Whether a row has one number or time stamp, and all its other entries are empty."""
    entries = [cell for cell in row if cell]
    return bool(entries) and all(_is_number(cell) or instant_of(cell) is not None for cell in entries)


def _top_of_heads(rows: Sequence[Sequence[str]], first_row: int, count: int) -> int | None:
    """Return the index of the first of the consecutive lines above the numbers that have ``count`` entries."""
    index = first_row - 1
    while index >= 0 and len(rows[index]) != count:  # comments between the names and the numbers
        index -= 1
    if index < 0:
        return None
    while index > 0 and len(rows[index - 1]) == count:
        index -= 1
    return index


def _stamps(row: Sequence[str]) -> Stamps | None:
    """Return the time stamps of the first row: date and clock time in one column, or in two columns, or only one."""
    instants = {index: instant for index, cell in enumerate(row) if (instant := instant_of(cell)) is not None}
    whole = [index for index, instant in instants.items() if instant.day is not None and instant.clock is not None]
    clocks = [index for index, instant in instants.items() if instant.day is None]
    days = [index for index, instant in instants.items() if instant.clock is None]
    if not whole and clocks and days:
        return Stamps(clocks[0], row[clocks[0]], days[0], row[days[0]])
    index = next(iter([*whole, *clocks, *days]), None)
    return None if index is None else Stamps(index, row[index])


def _with_stamps(heads: tuple[Head, ...], stamps: Stamps) -> tuple[Head, ...]:
    """Return heads with unit s for the time stamps and without a name for a separate column of dates."""
    timed = list(heads)
    timed[stamps.column] = Head(heads[stamps.column].name, "s")
    if stamps.day_index is not None:
        timed[stamps.day_index] = Head("", None)
    return tuple(timed)


def _is_number(cell: str) -> bool:
    if _COMMA_NUMBER.fullmatch(cell):  # if the comma is the separator, such a number is in quotes
        return True
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _has_decimal_comma(path: Path, encoding: str, first_row: int, separator: str) -> bool:
    """Whether numbers have a decimal comma, by the first row with a comma or a point in a number.

    RecordError if the comma is also the separator of columns, and all commas in quoted numbers may separate thousands.
    """
    unsure: tuple[int, str] | None = None
    with opened_text(path, encoding, "replace") as stream:
        for number, line in itertools.islice(numbered(stream), first_row, None):
            if not ("," in line or "." in line) or (separator == "," and '"' not in line and "." not in line):
                continue
            numbers = [cell for cell in cells_of(line, separator) if _is_number(cell)]
            commas = [cell for cell in numbers if "," in cell]
            if any("." in cell for cell in numbers):
                return False
            if commas and (separator != "," or not all(map(_THOUSANDS.fullmatch, commas))):
                return True
            if commas:
                unsure = unsure or (number, commas[0])
    if unsure is not None:
        rule = "has a comma that parts decimals or thousands: the file does not tell which"
        remedy = "part columns by semicolons, or write numbers without separators of thousands"
        raise RecordError(f"{path}:{unsure[0]}", unsure[1], rule, remedy)
    return False


def _notes(encoding: str, decimal_comma: bool) -> Iterator[str]:
    """Yield notes on the assumed encoding and decimal sign."""
    if encoding == "cp1252":
        yield "no UTF-8: read as Windows-1252 (Latin-1)"
    if decimal_comma:
        yield "decimals are parted by a comma"


def _notes_of_lines(numbers: Sequence[int], where: str) -> Iterator[str]:
    """Yield a note on ignored lines above or below the names."""
    if numbers:
        lines = f"line {numbers[0]}" if len(numbers) == 1 else f"{len(numbers)} lines up to line {numbers[-1]}"
        yield f"{lines} {where} the names: left out"


def _notes_of_stamps(heads: Sequence[Head], stamps: Stamps | None) -> Iterator[str]:
    """Yield a note on the time stamp at which time is zero."""
    if stamps is not None:
        first = f"{stamps.first_day} {stamps.first}".strip()
        yield f"{heads[stamps.column].name}: time stamps, taken as s from the first, {first}"
