"""Universal files: dataset 58, functions at nodal degrees of freedom, as text or binary (58b); time histories only.

A dataset stands between lines that hold -1. Its number, eleven lines of header, then the values: columns of Fortran's
E13.5 or E20.12, or as many bytes as the line of the number says. The values' spacing has six digits there; ``write``
repeats it in full in the fourth line, which only this reader understands. What stands along the abscissa, and in which
unit, record 8 says: only what is a time is taken for one. Formats: SDRC I-DEAS Test, dataset 58 (records 1 to 12);
University of Cincinnati, SDRL, dataset 58b.

Takes a path; gives columns with times.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import read_bytes
from gearrattle.measured.readers.base import Column, Raw, Request, seconds, unfit
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
_HEADER = 11
_DIGITS = 1e-5  # relative: what E13.5 keeps


class _Block(NamedTuple):
    """A dataset: its number, header, and what follows: lines, or bytes in an order."""

    number: int
    lines: list[str]
    data: bytes
    order: str


class _Axis(NamedTuple):
    """What stands along an axis: its specific data type, label and unit; empty where the file has NONE."""

    kind: int
    label: str
    unit: str


class _LeftOut(Exception):
    """Why a dataset is no time history."""


def knows(_path: Path, head: bytes) -> bool:
    """Tell the line of -1 and the number of a dataset after it."""
    lines = [line for line in head.splitlines()[:4] if line.strip()]
    return len(lines) > 1 and lines[0].strip() == b"-1" and re.match(rb"\s*\d{1,5}\b|\s*58[bB]", lines[1]) is not None


def read(path: Path, _request: Request) -> Raw:
    """Return its real time histories."""
    columns: list[Column] = []
    notes: list[str] = []
    for position, block in enumerate(_blocks(path), 1):
        if block.number != 58:
            continue
        try:
            column, said = _history(block, f"{path}: dataset {position}")
        except _LeftOut as reason:
            notes.append(f"dataset {position} left out: {reason}")
        else:
            columns.append(column)
            notes += [f"{column.name.rpartition(' @ ')[0]}: {note}" for note in said]
    if not columns:
        rule = "holds no time history (dataset 58)"
        raise ModelError(Problem(str(path), "", rule, "; ".join(notes[:3])))
    count = Counter(column.name.rpartition(" @ ")[0] for column in columns)
    named = [_shortest(column, count) for column in columns]
    return Raw(tuple(named), str(path), NAME, tuple(notes))


def _shortest(column: Column, count: Counter[str]) -> Column:
    """Leave the node out of a name that is the only one without it."""
    name = column.name.rpartition(" @ ")[0]
    return replace(column, name=name) if count[name] == 1 else column


def _blocks(path: Path) -> Iterator[_Block]:
    """Cut the file into datasets; binary ones by the number of bytes they tell."""
    content = read_bytes(path)
    at, end = 0, len(content)

    def line() -> bytes:
        nonlocal at
        stop = content.find(b"\n", at)
        stop = end if stop < 0 else stop
        text = content[at:stop]
        at = min(stop + 1, end)
        return text

    while at < end:
        if line().strip() != b"-1":
            continue
        head = line().decode("latin-1")
        words = head.split()
        if head[5:7].lower() == "8b" and len(words) >= 5:
            fields = [int(word) for word in head[7:].split()]
            if not (0 <= fields[2] <= end - at and 0 <= fields[3] <= end - at):
                raise _cut(path)
            lines = [line().decode("latin-1") for _ in range(fields[2])]
            data, at = content[at : at + fields[3]], at + fields[3]
            if fields[1] != 2:
                rule = "binary numbers must be of IEEE 754"
                raise ModelError(Problem(str(path), f"format {fields[1]}", rule, "write it as text"))
            closing = line().strip()
            while not closing and at < end:  # a line break may stand between the bytes and the line that closes
                closing = line().strip()
            if len(data) < fields[3] or closing not in (b"-1", b""):
                raise _cut(path)
            yield _Block(58, lines, data, "<" if fields[0] == 1 else ">")
            continue
        lines = []
        while (text := line()).strip() != b"-1":
            if at >= end:
                raise _cut(path)
            lines.append(text.decode("latin-1"))
        yield _Block(int(words[0]), lines, b"", "")


def _cut(path: Path) -> ModelError:
    return ModelError(Problem(str(path), "", "ends inside a dataset: the file is truncated", "copy it again"))


def _history(block: _Block, location: str) -> tuple[Column, list[str]]:
    """Return the column of a dataset, and what must be known of it.

    Raises
    ------
    _LeftOut
        it is no time history.
    ModelError
        its header cannot be read, or its values are not as many as that says.
    """
    if len(block.lines) < _HEADER:
        raise ModelError(Problem(location, f"{len(block.lines)} lines", f"a dataset 58 has {_HEADER} lines of header"))
    factor, notes = _seconds(block)
    kind, count, even, first, step = _record_7(block.lines[6], location)
    if kind not in (2, 4):
        raise _LeftOut("its values are complex")
    if count < 2:
        raise _LeftOut(f"it has {counted(count, 'sample')}")
    if even and not step > 0.0:
        rule = "must have samples a step above zero apart"
        raise ModelError(Problem(f"{location}, record 7", block.lines[6].strip(), rule))
    # values and times
    values, behind = _values(block, kind, count if even else 2 * count, location, even)
    if behind:
        notes.append(f"{counted(behind, 'number')} behind the {count} that the header tells: left out")
    if even:
        exact = _TIMES.search(block.lines[3])
        if exact and factor == 1.0 and abs(float(exact[2]) - step) <= _DIGITS * step:
            first, step = float(exact[1]), float(exact[2])
        time = np.asarray(factor * first + factor * step * np.arange(count), np.float64)
    else:
        time, values = factor * values[::2], values[1::2]
    # name, unit and quantity
    name = block.lines[0].strip()
    record = block.lines[5]
    node = f"{record[31:41].strip()}:{record[41:51].strip()}:{record[51:55].strip()}"
    name = f"{name} @ {node}" if name and name.upper() != "NONE" else f"{node} @ {node}"
    said = block.lines[1].strip()
    quantity, _, subject = said.removeprefix(_MARK).partition(",") if said.startswith(_MARK) else ("", "", "")
    return Column(name, _unit(block), values, time, quantity, subject.strip()), notes


def _seconds(block: _Block) -> tuple[float, list[str]]:
    """Return the factor of the abscissa to s, and a note if the file does not say that it is a time.

    Raises
    ------
    _LeftOut
        the abscissa is something else.
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
        label, unit = line[25:46].strip(), line[46:67].strip()
    except ValueError:
        kind = _first_number(line)
        rest = re.sub(r"^\s*(-?\d+\s+)*", "", line).split()
        label, unit = (" ".join(rest[:-1]), rest[-1]) if len(rest) > 1 else (" ".join(rest), "")
    label, unit = ("" if word.upper() == "NONE" else word for word in (label, unit))
    return _Axis(kind, label, unit)


def _unit(block: _Block) -> str:
    """Return the unit of the ordinate: numerator over denominator, where the file names one."""
    numerator = _axis(block.lines[8]).unit
    denominator = _axis(block.lines[9])
    if denominator.kind == 0 or not denominator.unit:
        return numerator
    return f"({numerator or '1'})/({denominator.unit})"


def _record_7(text: str, location: str) -> tuple[int, int, bool, float, float]:
    """Read kind of numbers, their count, whether they are evenly spaced, first abscissa and spacing."""
    words = text.split()
    if len(words) < 5:
        words = [text[a:b] for a, b in ((0, 10), (10, 20), (20, 30), (30, 43), (43, 56))]
    try:
        kind, count, even = (int(word) for word in words[:3])
        first, step = (float(word.replace("D", "E")) for word in words[3:5])
    except ValueError:
        rule = "must tell kind, count, spacing, first value and step"
        raise ModelError(Problem(f"{location}, record 7", text.strip(), rule)) from None
    return kind, count, bool(even), first, step


def _values(block: _Block, kind: int, count: int, location: str, even: bool) -> tuple[Array, int]:
    """Read the numbers: bytes, or columns of text; return as well how many more fill the last line of a text."""
    behind = 0
    if block.order:
        samples = count if even else count // 2
        width = len(block.data) // samples if len(block.data) % samples == 0 else 0
        forms = {4: "f4", 8: "f8"} if even else {8: "f4,f4", 12: "f4,f8", 16: "f8,f8"}  # as many bytes as there are
        if width not in forms:
            rule = f"its header tells {counted(samples, 'sample')}"
            raise ModelError(
                Problem(location, f"{len(block.data)} bytes", rule, "the file is damaged: export it again")
            )
        form = np.dtype(",".join(f"{block.order}{part}" for part in forms[width].split(",")))
        table = np.frombuffer(block.data, form)
        flat = table if even else np.stack([table["f0"].astype("f8"), table["f1"].astype("f8")], axis=1).reshape(-1)
        values = flat.astype(np.float64)
    else:
        words, behind = _words(block.lines[_HEADER:], kind, count, even)
        values = np.array([float(word.replace("D", "E")) for word in words])
    if values.size != count:
        rule = f"its header tells {counted(count, 'number')}"
        raise ModelError(Problem(location, f"{values.size} numbers", rule, "the file is damaged: export it again"))
    return values, behind


def _words(lines: list[str], kind: int, count: int, even: bool) -> tuple[list[str], int]:
    """Return the numbers of a text, and how many of its last line are more than the count: that line is filled up."""
    lines = [line for line in lines if line.strip()]
    width = 13 if kind == 2 else 20
    rows = [line.split() for line in lines]
    if even and not 0 <= sum(map(len, rows)) - count < len(rows[-1] if rows else ()):  # no blank between columns
        fixed = [[w for k in range(0, len(line), width) if (w := line[k : k + width].strip())] for line in lines]
        rows = fixed
    words = [word for row in rows for word in row]
    behind = len(words) - count
    if not 0 < behind < len(rows[-1] if rows else ()):
        return words, 0
    return words[:count], behind


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
        f"    58b{1:6d}{2:6d}{_HEADER:12d}{len(data):12d}{0:6d}{0:6d}{0:12d}{0:12d}",
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
