"""Universal files: dataset 58, functions at nodal degrees of freedom, as text or binary (58b); time histories only.

A dataset stands between lines that hold -1. Its number, eleven lines of header, then the values: columns of Fortran's
E13.5 or E20.12, or as many bytes as the line of the number says. The values' spacing has six digits there; ``write``
repeats it in full in the fourth line, which only this reader understands. Formats: SDRC I-DEAS Test, dataset 58
(records 1 to 12); University of Cincinnati, SDRL, dataset 58b.

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
from gearrattle.measured.readers.base import Column, Raw, Request, unfit
from gearrattle.recording import Array, Channel, Recording
from gearrattle.wording import counted

NAME = "uff"
SUFFIXES = (".uff", ".unv", ".bunv", ".uf58")
_MARK = "gearrattle: "
_TIMES = re.compile(r"first (\S+) s, interval (\S+) s")
_TIME = 17  # specific data type of an abscissa
_HEADER = 11
_DIGITS = 1e-5  # relative: what E13.5 keeps


class _Block(NamedTuple):
    """A dataset: its number, header, and what follows: lines, or bytes in an order."""

    number: int
    lines: list[str]
    data: bytes
    order: str


def knows(_path: Path, head: bytes) -> bool:
    """Tell the line of -1 and the number of a dataset after it."""
    lines = [line for line in head.splitlines()[:4] if line.strip()]
    return len(lines) > 1 and lines[0].strip() == b"-1" and re.match(rb"\s*\d{1,5}\b|\s*58[bB]", lines[1]) is not None


def read(path: Path, _request: Request) -> Raw:
    """Return its real time histories."""
    columns, notes = [], []
    for position, block in enumerate(_blocks(path), 1):
        if block.number != 58:
            continue
        location = f"{path}: dataset {position}"
        history = _history(block, location)
        if isinstance(history, str):
            notes.append(f"dataset {position} left out: {history}")
        else:
            columns.append(history)
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
            if len(data) < fields[3] or line().strip() not in (b"-1", b""):
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


def _history(block: _Block, location: str) -> Column | str:
    """Return the column of a dataset, or why it is none."""
    if len(block.lines) < _HEADER:
        raise ModelError(Problem(location, f"{len(block.lines)} lines", f"a dataset 58 has {_HEADER} lines of header"))
    kind, count, even, first, step = _record_7(block.lines[6], location)
    function = _whole(block.lines[5][:5])
    if _whole(block.lines[7][:10]) != _TIME and function != 1:
        return f"function of type {function}, not of time"
    if kind not in (2, 4):
        return "its values are complex"
    values = _values(block, kind, count if even else 2 * count, location, even)
    if even:
        exact = _TIMES.search(block.lines[3])
        if exact and abs(float(exact[2]) - step) <= _DIGITS * step:
            first, step = float(exact[1]), float(exact[2])
        time = np.asarray(first + step * np.arange(count), np.float64)
    else:
        time, values = values[::2], values[1::2]
    unit = block.lines[8][47:67].strip()
    name = block.lines[0].strip()
    record = block.lines[5]
    node = f"{record[31:41].strip()}:{record[41:51].strip()}:{record[51:55].strip()}"
    name = f"{name} @ {node}" if name and name.upper() != "NONE" else f"{node} @ {node}"
    said = block.lines[1].strip()
    quantity, _, subject = said.removeprefix(_MARK).partition(",") if said.startswith(_MARK) else ("", "", "")
    unit = "" if unit.upper() == "NONE" else unit
    return Column(name, unit, values, time, quantity, subject.strip())


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
    if count < 2 or (even and not step > 0.0):
        rule = "must have two samples or more, a step above zero apart"
        raise ModelError(Problem(f"{location}, record 7", text.strip(), rule))
    return kind, count, bool(even), first, step


def _values(block: _Block, kind: int, count: int, location: str, even: bool) -> Array:
    """Read the numbers: bytes, or columns of text."""
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
        lines = block.lines[_HEADER:]
        words = " ".join(lines).replace("D", "E").split()
        if len(words) != count and even:  # columns without a blank between them
            width = 13 if kind == 2 else 20
            words = [w for line in lines for k in range(0, len(line), width) if (w := line[k : k + width].strip())]
        values = np.array([float(word.replace("D", "E")) for word in words])
    if values.size != count:
        rule = f"its header tells {counted(count, 'number')}"
        raise ModelError(Problem(location, f"{values.size} numbers", rule, "the file is damaged: export it again"))
    return values


def _whole(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        return 0


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
