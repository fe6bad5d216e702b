"""Universal files: dataset 58, functions at nodal degrees of freedom, as text or binary (58b); time histories only.

A dataset stands between lines that hold -1. Its number, eleven lines of header, then the values: columns of Fortran's
E13.5 or E20.12, or as many bytes as the line of the number says. The values' spacing has six digits there; ``write``
repeats it in full in the fourth line, which only this reader understands. What stands along the abscissa, and in which
unit, record 8 says: only what is a time is taken for one. Formats: SDRC I-DEAS Test, dataset 58 (records 1 to 12);
University of Cincinnati, SDRL, dataset 58b.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import opened
from gearrattle.measured.readers.reader import Column, Raw, Request, ask_for, seconds, unfit
from gearrattle.measured.readers.uff_blocks import (
    HEADER,
    Block,
    Samples,
    blocks,
    check_count,
    read_bytes_of,
    read_text_of,
)
from gearrattle.model.units import UnitError
from gearrattle.recording import Array, Channel, Recording
from gearrattle.wording import counted

NAME = "uff"
SUFFIXES = (".uff", ".unv", ".bunv", ".uf58")
_MARK = "gearrattle: "
_TIMES = re.compile(r"first (\S+) s, interval (\S+) s")
_TIME = 17  # specific data type of an abscissa
_NOT_SAID = (0, 1)  # specific data types "unknown" and "general"
_ABSCISSAS = {18: "a frequency", 19: "a speed", 20: "an order"}
_RESPONSE = 1  # function type of a time history
_LAGS = {7: "auto-correlation", 8: "cross-correlation", 25: "impulse response"}  # function types over time lags
_COLUMNS = {2: 13, 4: 20}  # width of a number in a text by kind: single and double precision
_DIGITS = 1e-5  # relative precision of E13.5


class _Axis(NamedTuple):
    """Entries of an axis: specific data type, label and unit; empty where the file has NONE."""

    kind: int
    label: str
    unit: str


class _History(NamedTuple):
    """A time history before its numbers are read; ``factor`` is that of the abscissa to s."""

    block: Block
    location: str
    column: Column
    kind: int
    samples: int
    even: bool
    first: float
    step: float
    factor: float
    notes: tuple[str, ...]

    @property
    def numbers(self) -> int:
        """Count of numbers by the header."""
        return self.samples if self.even else 2 * self.samples

    @property
    def axis(self) -> tuple[float, float, int]:
        """First time and interval [s], and count: histories that have these alike share their times."""
        return self.factor * self.first, self.factor * self.step, self.samples


class _LeftOut(Exception):
    """Reason why a dataset is no time history."""


def knows(_path: Path, head: bytes) -> bool:
    """Return whether a file begins with the line of -1 and the number of a dataset."""
    lines = [line for line in head.splitlines()[:4] if line.strip()]
    return len(lines) > 1 and lines[0].strip() == b"-1" and re.match(rb"\s*\d{1,5}\b|\s*58[bB]", lines[1]) is not None


def read(path: Path, request: Request) -> Raw:
    """Return its real time histories; those that are not asked for have a name only."""
    histories: list[_History] = []
    notes: list[str] = []
    with opened(path) as stream:
        for position, block in enumerate(blocks(stream, path), 1):
            if block.number != 58:
                continue
            try:
                histories.append(_history(block, f"{path}: dataset {position}"))
            except _LeftOut as reason:
                notes.append(f"dataset {position} left out: {reason}")
        if not histories:
            rule = "holds no time history (dataset 58)"
            raise ModelError(Problem(str(path), "", rule, "; ".join(notes[:3])))
        count = Counter(history.column.name.rpartition(" @ ")[0] for history in histories)
        histories = [history._replace(column=_shortest(history.column, count)) for history in histories]
        wanted = [history for history in histories if request.wants(history.column.name)]
        columns = _columns(stream, histories, wanted, request, notes)
    return Raw(tuple(columns), str(path), NAME, tuple(notes))


def _columns(
    stream: BinaryIO, histories: list[_History], wanted: list[_History], request: Request, notes: list[str]
) -> list[Column]:
    """Read what is wanted, and name the others; notes of what is read are added.

    ModelError where a header states other numbers than there are; Refused where numbers and times take too much memory.
    """
    widths = {id(history): _width(history) for history in wanted}
    axes = {history.axis for history in wanted if history.even}
    uneven = [history.samples for history in wanted if not history.even]
    ask_for([*(h.samples for h in wanted), *uneven, *(axis[2] for axis in axes)], request)
    times: dict[tuple[float, float, int], Array] = {}
    columns = []
    for history in histories:
        if id(history) not in widths:
            columns.append(replace(history.column, time=history.column.values))
            continue
        samples, behind = _samples(stream, history, widths[id(history)])
        time = samples.time
        if time is None:
            time = times[history.axis] if history.axis in times else _times(*history.axis)
            times[history.axis] = time
        columns.append(replace(history.column, values=samples.values, time=time))
        said = [f"{counted(behind, 'number')} behind the {history.numbers} that the header tells: left out"]
        notes += [f"{history.column.name}: {note}" for note in (*history.notes, *(said if behind else []))]
    return columns


def _width(history: _History) -> int:
    """Return the bytes of a sample, 0 in a text; raise ``ModelError`` if so many cannot be there."""
    return check_count(history.block, history.numbers, history.samples, history.location)


def _samples(stream: BinaryIO, history: _History, width: int) -> tuple[Samples, int]:
    """Read the numbers of a dataset, its abscissa in s; return as well how many fill up its last line."""
    samples = Samples(np.empty(history.samples), None if history.even else np.empty(history.samples))
    behind = 0
    if history.block.order:
        read_bytes_of(stream, history.block, width, samples)
    else:
        columns = _COLUMNS[history.kind]
        behind = read_text_of(stream, history.block, columns, samples, history.location)
    if samples.time is not None:
        samples.time *= history.factor
    return samples, behind


def _times(first: float, step: float, count: int) -> Array:
    """Return times of even spacing [s]."""
    times = np.arange(count, dtype=np.float64)
    times *= step
    times += first
    return times


def _shortest(column: Column, count: Counter[str]) -> Column:
    """Remove the node from a name that is unique without it."""
    name = column.name.rpartition(" @ ")[0]
    return replace(column, name=name) if count[name] == 1 else column


def _history(block: Block, location: str) -> _History:
    """Return the entries of a dataset's header.

    _LeftOut where it is no time history, ModelError where its header cannot be read.
    """
    # the header: kind and number of values, first time and step
    if len(block.lines) < HEADER:
        raise ModelError(Problem(location, f"{len(block.lines)} lines", f"a dataset 58 has {HEADER} lines of header"))
    factor, notes = _seconds(block)
    kind, count, even, first, step = _record_7(block.lines[6], location)
    if kind not in _COLUMNS:
        raise _LeftOut("its values are complex")
    if count < 2:
        raise _LeftOut(f"it has {counted(count, 'sample')}")
    if even and not step > 0.0:
        rule = "must have samples a step above zero apart"
        raise ModelError(Problem(f"{location}, record 7", block.lines[6].strip(), rule))
    # times repeated in full digits by this package's own writer
    exact = _TIMES.search(block.lines[3])
    if exact and factor == 1.0 and abs(float(exact[2]) - step) <= _DIGITS * step:
        first = float(exact[1])
        step = float(exact[2])
    # name, unit and quantity
    name = block.lines[0].strip()
    record = block.lines[5]
    node = f"{record[31:41].strip()}:{record[41:51].strip()}:{record[51:55].strip()}"
    name = f"{name} @ {node}" if name and name.upper() != "NONE" else f"{node} @ {node}"
    said = block.lines[1].strip()
    quantity, _, subject = said.removeprefix(_MARK).partition(",") if said.startswith(_MARK) else ("", "", "")
    column = Column(name, _unit(block), np.empty(0), None, quantity, subject.strip())
    return _History(
        block=block,
        location=location,
        column=column,
        kind=kind,
        samples=count,
        even=even,
        first=first,
        step=step,
        factor=factor,
        notes=tuple(notes),
    )


def _seconds(block: Block) -> tuple[float, list[str]]:
    """Return the factor of the abscissa to s, and a note if the file does not state that it is a time.

    _LeftOut where the abscissa is something else.
    """
    axis = _axis(block.lines[7])
    function = _first_number(block.lines[5][:5]) or _first_number(block.lines[5])
    called = f"its abscissa is {axis.label or 'not named'}{f' [{axis.unit}]' if axis.unit else ''}"
    if function in _LAGS:
        raise _LeftOut(f"function of type {function} ({_LAGS[function]}), over time lags")
    if axis.kind not in (_TIME, *_NOT_SAID):
        what = _ABSCISSAS.get(axis.kind, f"of specific data type {axis.kind}")
        raise _LeftOut(f"function of type {function}, not of time: {called}, {what}")
    try:
        factor = seconds(axis.unit)
    except UnitError:
        raise _LeftOut(f"function of type {function}, not of time: {called}, no unit of time") from None
    if axis.kind == _TIME or axis.unit or axis.label.lower() in ("t", "time", "zeit"):
        return factor, []
    if function != _RESPONSE:
        raise _LeftOut(f"function of type {function}, not of time")
    return factor, ["the file does not say what its abscissa is: taken for a time in s, as it is a time response"]


def _axis(line: str) -> _Axis:
    """Read a record of data characteristics (I10, 3I5, 1X, 20A1, 1X, 20A1), or one whose entries blanks part."""
    try:
        kind = int(line[:10])
        _ = [int(line[at : at + 5] or 0) for at in (10, 15, 20)]
        label = line[25:46].strip()
        unit = line[46:67].strip()
    except ValueError:
        kind = _first_number(line)
        rest = re.sub(r"^\s*(-?\d+\s+)*", "", line).split()
        label, unit = (" ".join(rest[:-1]), rest[-1]) if len(rest) > 1 else (" ".join(rest), "")
    label, unit = ("" if word.upper() == "NONE" else word for word in (label, unit))
    return _Axis(kind, label, unit)


def _unit(block: Block) -> str:
    """Return the unit of the ordinate: numerator over denominator, where the file names one."""
    numerator = _axis(block.lines[8]).unit
    denominator = _axis(block.lines[9])
    if denominator.kind == 0 or not denominator.unit:
        return numerator
    return f"({numerator or '1'})/({denominator.unit})"


def _record_7(text: str, location: str) -> tuple[int, int, bool, float, float]:
    """Read kind of numbers, their count, whether they are evenly spaced, first abscissa and spacing."""
    touching = [text[a:b] for a, b in ((0, 10), (10, 20), (20, 30), (30, 43), (43, 56))]
    for words in (text.split(), touching):
        try:
            kind, count, even = (int(word) for word in words[:3])
            first, step = (float(word.replace("D", "E")) for word in words[3:5])
        except ValueError:
            continue
        return kind, count, bool(even), first, step
    rule = "must tell kind, count, spacing, first value and step"
    raise ModelError(Problem(f"{location}, record 7", text.strip(), rule))


def _first_number(text: str) -> int:
    """Return the whole number at the beginning of a text; 0 where there is none."""
    match = re.match(r"\s*(-?\d+)\b", text)
    return int(match[1]) if match else 0


def write(recording: Recording, path: Path) -> None:
    """Write one dataset 58b a channel, in double precision."""
    interval = recording.interval
    if interval is None:
        rule = "uniform samples are written only: other times would keep six digits"
        raise unfit(path, "samples that are not uniform", rule, 'resample: rate = "10 kHz" in a mapping')
    with open(path, "wb") as stream:
        for channel in recording.channels:
            stream.write(_dataset(channel, float(recording.time[0]), interval))


def _dataset(channel: Channel, first: float, interval: float) -> bytes:
    data = np.asarray(channel.values, "<f8").tobytes()
    axis = "{:10d}{:5d}{:5d}{:5d} {:<20.20s} {:<20.20s}"
    none = axis.format(0, 0, 0, 0, "NONE", "NONE")
    lines = [
        f"    58b{1:6d}{2:6d}{HEADER:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}",
        channel.name,
        f"{_MARK}{channel.quantity}, {channel.subject}",
        "NONE",
        f"first {first!r} s, interval {interval!r} s",
        "NONE",
        f"{1:5d}{0:10d}{0:5d}{0:10d} {'NONE':<10s}{0:10d}{0:4d} {'NONE':<10s}{0:10d}{0:4d}",
        f"{4:10d}{channel.values.size:10d}{1:10d}{first:13.5E}{interval:13.5E}{0.0:13.5E}",
        axis.format(_TIME, 0, 0, 0, "Time", "s"),
        axis.format(0, 0, 0, 0, channel.quantity or "NONE", channel.unit),
        none,
        none,
    ]
    text = "\n".join(f"{line:<80.80s}" for line in ["    -1", *lines])
    return text.encode("latin-1", "replace") + b"\n" + data + b"    -1\n"
