"""LVM, the text files of LabVIEW's Write To Measurement File.

A head of the file, then segments, one after another: a head with units, first times and intervals of the channels, a
line of names, and rows of numbers. Times are the X columns of a segment, or follow from X0 and Delta_X. Segments with
the same channels continue each other; where they all begin at the same X, their dates and clock times part them.
Format: NI, Specification for the LabVIEW Measurement File (.lvm).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import opened, opened_text, within_limit
from gearrattle.measured.readers.reader import HEAD, Column, Raw, Request
from gearrattle.model.csv_layout import encoding_of
from gearrattle.model.table import shown
from gearrattle.model.time_stamps import FromFirst, instant_of
from gearrattle.recording import Array
from gearrattle.wording import counted

NAME = "lvm"
SUFFIXES = (".lvm",)
_MARK = b"LabVIEW Measurement"
_END_OF_HEAD = "***End_of_Header***"
_SPECIAL = ("***Start_Special***", "***End_Special***")
_X = "X_Value"
_COMMENT = "Comment"
_NO_NUMBERS = ("nan", "inf", "infinity")  # what rows may begin with that is no digit
_BYTES_A_NUMBER = 64  # bytes that a number takes while a file is read, as an object of Python in a list
_DAMAGED = "export it again, or save it as CSV or TDMS"


def knows(_path: Path, head: bytes) -> bool:
    """Return whether a file begins with the format's name."""
    return head.lstrip(b"\xef\xbb\xbf").startswith(_MARK)


class _Line(NamedTuple):
    """A line and its number, from 1."""

    number: int
    text: str


@dataclass
class _Segment:
    """Head and rows of a segment.

    Attributes
    ----------
    about
        entries behind the keyword of a line of the head, by keyword.
    names
        of the columns.
    rows
        the numbers, (columns) each; NaN for an entry that is empty.
    """

    about: dict[str, list[str]]
    names: list[str]
    rows: list[list[float]] = field(default_factory=list)

    @property
    def channels(self) -> list[int]:
        """Indices of the columns that are channels."""
        return [index for index, name in enumerate(self.names) if name not in (_X, _COMMENT, "")]

    def entry(self, keyword: str, column: int, default: str) -> str:
        """Return what the head says of a channel; its entries stand above the columns, or one behind another."""
        entries = self.about.get(keyword, [])
        above = column - 1 if len(entries) >= self.channels[-1] else self.channels.index(column)
        return (entries[above] if above < len(entries) else "") or default

    def number(self, keyword: str, column: int, default: float) -> float:
        """Return a number that the head says of a channel; ValueError for an entry that is none."""
        entry = self.entry(keyword, column, "")
        return float(entry.replace(",", ".")) if entry else default

    def x_column(self, column: int) -> int | None:
        """Return the index of the X column of a channel, the last one before it; None where X is not stored."""
        before = [index for index in range(column) if self.names[index] == _X]
        stored = before and self.rows and not np.isnan(self.rows[0][before[-1]])
        return before[-1] if stored else None

    @property
    def stamp(self) -> str:
        """Date and clock time of the first channel; empty where there are none."""
        parts = [self.about.get(keyword, [""])[0] for keyword in ("Date", "Time")]
        return " ".join(parts).strip()


def read(path: Path, request: Request) -> Raw:
    """Return its channels."""
    segments = _segments(path)
    # the channels of all segments
    first = segments[0]
    names = [first.names[column] for column in first.channels]
    for segment in segments:
        own = [segment.names[column] for column in segment.channels]
        if own != names:
            rule = f"a segment has the channels {', '.join(own)}, the first one {', '.join(names)}"
            raise ModelError(Problem(str(path), "", rule, "write one file for every set of channels"))
    # their values and times, segment after segment
    columns = []
    notes: list[str] = []
    for name, column in zip(names, first.channels, strict=True):
        unit = first.entry("Y_Unit_Label", column, "")
        if not request.wants(name):
            columns.append(Column(name, unit, np.empty(0), np.empty(0)))
            continue
        parts = [_channel(segment, column, path) for segment in segments]
        notes = _continue_by_stamps(segments, parts)
        values = np.concatenate([part.values for part in parts])
        time = np.concatenate([part.time for part in parts])
        if request.interval is not None:
            time = np.arange(values.size) * request.interval
        columns.append(Column(name, unit, values, time))
    return Raw(tuple(columns), str(path), NAME, tuple(notes))


class _Part(NamedTuple):
    """Samples of a channel in one segment: values and times [s]."""

    values: Array
    time: Array


def _channel(segment: _Segment, column: int, path: Path) -> _Part:
    """Return a channel of a segment; rows below its last sample are left out."""
    location = f"{path}: {segment.names[column]}"
    dimension = segment.entry("X_Dimension", column, "Time")
    if dimension.lower() != "time":
        rule = f"is sampled over {dimension}, not over time"
        raise ModelError(Problem(location, dimension, rule, "export it over time"))
    table = np.asarray(segment.rows, np.float64).reshape(-1, len(segment.names))
    samples = int(segment.number("Samples", column, len(table)))
    if not 0 <= samples <= len(table):
        rule = f"its head tells {counted(samples, 'sample')}, of {counted(len(table), 'row')}"
        raise ModelError(Problem(location, "", rule, _DAMAGED))
    x = segment.x_column(column)
    if x is not None:
        return _Part(table[:samples, column], table[:samples, x])
    first = segment.number("X0", column, 0.0)
    interval = segment.number("Delta_X", column, 1.0)
    return _Part(table[:samples, column], first + interval * np.arange(samples, dtype=np.float64))


def _continue_by_stamps(segments: list[_Segment], parts: list[_Part]) -> list[str]:
    """Add to times that begin anew in every segment what its date and clock time say, in place; return a note on it."""
    filled = [part for part in parts if part.time.size]
    if all(later.time[0] > former.time[-1] for former, later in itertools.pairwise(filled)):
        return []
    stamps = [segment.stamp for segment in segments]
    if any(instant_of(stamp) is None for stamp in stamps):
        return []  # times that do not ascend are refused
    since_first = FromFirst(stamps[0])
    for part, stamp in zip(parts, stamps, strict=True):
        part.time[:] += since_first(stamp)
    return [f"times of {counted(len(segments), 'segment')} count from {stamps[0]}, by their dates and clock times"]


def _segments(path: Path) -> list[_Segment]:
    """Return the segments of a file; ModelError for one without rows of numbers."""
    with opened(path) as stream:
        encoding = encoding_of(stream.read(HEAD)) or "cp1252"
    with opened_text(path, encoding, "replace") as text:
        lines = _lines(text)
        head = [line.text for line in itertools.takewhile(lambda line: not line.text.startswith(_END_OF_HEAD), lines)]
        separator = "," if any(line.startswith("Separator,") for line in head) else "\t"
        comma = f"Decimal_Separator{separator}," in head
        segments = [segment for segment in _parsed(lines, separator, comma, path) if segment.rows]
    if not segments:
        raise ModelError(Problem(str(path), "", "has no rows of numbers", "is this the whole record?"))
    return segments


def _lines(text: Iterator[str]) -> Iterator[_Line]:
    """Yield the lines that are neither blank nor part of a special block."""
    is_special = False
    for number, line in enumerate(text, 1):
        if line.startswith(_SPECIAL):
            is_special = line.startswith(_SPECIAL[0])
        elif not is_special and line.strip():
            yield _Line(number, line.rstrip())


def _parsed(lines: Iterator[_Line], separator: str, comma: bool, path: Path) -> Iterator[_Segment]:
    """Yield the segments; a ModelError refuses an entry that is no number."""
    about: dict[str, list[str]] = {}
    segment = _Segment({}, [])
    count = 0
    for line in lines:
        entries = [entry.strip() for entry in line.text.split(separator)]
        if entries[0] == _END_OF_HEAD:
            yield segment
            names = next(lines, _Line(0, "")).text.split(separator)
            segment = _Segment(about, [name.strip() for name in names])
            about = {}
        elif entries[0][:1].isalpha() and entries[0].lower() not in _NO_NUMBERS:
            about[entries[0]] = entries[1:]
        else:
            segment.rows.append(_row(entries, segment.names, comma, f"{path}:{line.number}"))
            count += len(segment.names)
            within_limit(_BYTES_A_NUMBER * count)
    yield segment


def _row(entries: list[str], names: list[str], comma: bool, location: str) -> list[float]:
    """Return the numbers of a row, NaN where there is none."""
    row = [np.nan] * len(names)
    for index, (name, entry) in enumerate(zip(names, entries, strict=False)):
        if name == _COMMENT or not entry:
            continue
        try:
            row[index] = float(entry.replace(",", ".") if comma else entry)
        except ValueError:
            raise ModelError(Problem(f"{location}: {name}", shown(entry), "must be a number", _DAMAGED)) from None
    return row
