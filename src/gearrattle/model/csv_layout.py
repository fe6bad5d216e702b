"""How a CSV file is written: its encoding, what parts columns and decimals, where names, units and numbers stand.

    t [s], T [N*m]          Zeit;Drehmoment
    0.000, 12.1             s;Nm
    0.001, 12.4             0,000;12,1

The first line with two numbers or more tells the rest: what parts its columns, and how many there are. The line above
it has the units if one entry is a unit of time or angle, and then the names stand above that; otherwise it has the
names. What stands above the names is left out. Lines that begin with # are comments.

Takes a path; gives a ``Layout``.
"""

from __future__ import annotations

import codecs
import itertools
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from gearrattle.files import opened, opened_text

_LOOKED_AT = 200  # lines that are no comments, at most, until the first numbers
_BYTES_LOOKED_AT = 65_536
_LONGEST_LINE = 100_000
_OF_TIME_OR_ANGLE = ("s", "sec", "ms", "us", "µs", "min", "h", "deg", "°", "Grad", "rad")
_BRACKETS = re.compile(r"([^\[\]]*?)\s*\[([^\[\]]*)\]")
_PARENTHESES = re.compile(r"(.*?\S)\s*\((?!\d*\))([^()]*)\)")
_COMMA_NUMBER = re.compile(r"[+-]?(\d+(,\d*)?|,\d+)([eE][+-]?\d+)?")
_COMMA_TO_POINT = str.maketrans(",.", ".,")
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f]")
_FORMULA = ("=", "+", "-", "@")
EXAMPLE = "such as: t [s], n [rpm]"


class RecordError(ValueError):
    """A file that is no such record.

    Attributes
    ----------
    place
        file, line and column.
    value
        what stands there.
    rule, remedy
        as in ``errors.Problem``.
    """

    def __init__(self, place: str, value: str, rule: str, remedy: str = "") -> None:
        super().__init__(rule)
        self.place = place
        self.value = value
        self.rule = rule
        self.remedy = remedy


class Head(NamedTuple):
    """Name and unit of a column; unit None where none is written."""

    name: str
    unit: str | None


class Layout(NamedTuple):
    """How a file is written.

    Attributes
    ----------
    encoding
        of the text.
    separator
        between columns.
    decimal_comma
        whether a comma parts decimals; otherwise a point.
    heads
        names and units of the columns.
    names_line
        line of the names, counted from 1.
    first_row
        how many lines that are neither blank nor comments stand above the first row.
    notes
        what was assumed.
    """

    encoding: str
    separator: str
    decimal_comma: bool
    heads: tuple[Head, ...]
    names_line: int
    first_row: int
    notes: tuple[str, ...] = ()

    def rows(self, path: Path) -> Iterator[tuple[int, str]]:
        """Yield number and text of the rows below names and units."""
        with opened_text(path, self.encoding, "replace") as stream:
            yield from itertools.islice(numbered(stream), self.first_row, None)

    def with_points(self, text: str) -> str:
        """Return a text whose numbers have decimal points; a point beside decimal commas makes no number of it."""
        return text.translate(_COMMA_TO_POINT) if self.decimal_comma else text


def numbered(lines: Iterator[str]) -> Iterator[tuple[int, str]]:
    """Yield number and text of the lines that are neither blank nor comments."""
    for number, line in enumerate(lines, 1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield number, line


def encoding_of(head: bytes) -> str | None:
    """Return the encoding of a text that begins so: UTF-8, UTF-16 with its mark, else Windows-1252; None: no text.

    Windows-1252 holds what Latin-1 prints, the degree sign and the micro sign among it.
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


def layout_of(path: Path) -> Layout:
    """Find out how a file is written.

    Raises
    ------
    RecordError
        no text, or no line of names above the numbers.
    OSError
        the file cannot be read.
    """
    with opened(path) as binary:
        encoding = encoding_of(binary.read(_BYTES_LOOKED_AT))
    if encoding is None:
        raise RecordError(str(path), "", "must be a text", "export the record as CSV")
    with opened_text(path, encoding, "replace") as stream:
        lines = [(number, line.rstrip("\r\n")) for number, line in itertools.islice(numbered(stream), _LOOKED_AT)]
    if not lines or any(len(line) > _LONGEST_LINE for _, line in lines):
        raise RecordError(str(path), "", "must begin with a line of column names and units", EXAMPLE)
    separator, first_row = _first_numbers([line for _, line in lines])
    count = len(lines[min(first_row, len(lines) - 1)][1].split(separator))
    above = first_row - 1
    if above < 0 or lines[above][1].count(separator) != count - 1:
        number, _ = lines[min(first_row, len(lines) - 1)]
        rule = f"a line of {count} column names must stand above the numbers"
        raise RecordError(f"{path}:{number}", "", rule, EXAMPLE)
    units = [_unit(cell) for cell in _cells(lines[above][1], separator)]
    has_units = any(unit in _OF_TIME_OR_ANGLE for unit in units)
    has_units = has_units and above > 0 and lines[above - 1][1].count(separator) == count - 1
    names = above - 1 if has_units else above
    heads = tuple(_head(cell) for cell in _cells(lines[names][1], separator))
    if has_units:
        heads = tuple(Head(head.name, unit or head.unit) for head, unit in zip(heads, units, strict=True))
    comma = separator != "," and _has_decimal_comma(path, encoding, first_row)
    return Layout(encoding, separator, comma, heads, lines[names][0], first_row, _notes(encoding, comma, lines[:names]))


def _first_numbers(lines: Sequence[str]) -> tuple[str, int]:
    """Return what parts columns, and the index of the first line with two numbers or more.

    Without such a line the first one holds the names, and nothing stands below it.
    """
    for separator in ";\t,":
        for index, line in enumerate(lines):
            cells = _cells(line, separator)
            numbers = sum(_is_number(cell, separator) for cell in cells)
            if numbers >= 2 and 2 * numbers >= sum(bool(cell) for cell in cells):
                return separator, index
    separator = next((mark for mark in ";\t" if mark in lines[0]), ",")
    return separator, 1 if separator in lines[0] else 0


def _cells(line: str, separator: str) -> list[str]:
    """Return the entries of a line, without blanks and quotes around them."""
    return [cell.strip().strip('"').strip() for cell in line.split(separator)]


def _is_number(cell: str, separator: str) -> bool:
    if separator != "," and _COMMA_NUMBER.fullmatch(cell):
        return True
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _unit(cell: str) -> str:
    """Return a unit without the brackets around it."""
    pairs = ("[]", "()")
    return next((cell[1:-1].strip() for pair in pairs if cell[:1] + cell[-1:] == pair), cell)


def defused(name: str) -> str:
    """Return a name for the head of a CSV file: a spreadsheet takes what begins with =, +, - or @ for a formula."""
    return f"'{name}" if name[:1] in _FORMULA else name


def _head(cell: str) -> Head:
    """Return name and unit of ``name [unit]`` or ``name (unit)``."""
    cell = cell[1:] if cell[:1] == "'" and cell[1:2] in _FORMULA else cell
    for form in (_BRACKETS, _PARENTHESES):
        if match := form.fullmatch(cell):
            return Head(match[1].strip(), match[2].strip())
    return Head(cell, None)


def _has_decimal_comma(path: Path, encoding: str, first_row: int) -> bool:
    """Tell by the first row with a comma or a point in it."""
    with opened_text(path, encoding, "replace") as stream:
        for _, line in itertools.islice(numbered(stream), first_row, None):
            if "," in line or "." in line:
                return "," in line and "." not in line
    return False


def _notes(encoding: str, decimal_comma: bool, above: Sequence[tuple[int, str]]) -> tuple[str, ...]:
    notes = []
    if encoding == "cp1252":
        notes.append("no UTF-8: read as Windows-1252 (Latin-1)")
    if decimal_comma:
        notes.append("decimals are parted by a comma")
    if above:
        lines = f"line {above[0][0]}" if len(above) == 1 else f"{len(above)} lines up to line {above[-1][0]}"
        notes.append(f"{lines} above the names: left out")
    return tuple(notes)
