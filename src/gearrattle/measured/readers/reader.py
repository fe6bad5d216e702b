"""Base of the readers, one file format each, recognised by the file's content; and the columns they give.

A reader recognises its format by the first bytes of a file, reads the columns of the file, and writes a recording in
this format. Names and units in the result are those of the file. Units are read in ``quantities``; ``reader_answers``
declares which columns a reader takes for times and which numbers for values. ``measured.readers`` reports damaged files
in one form, so a reader need not catch the errors of its library.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from heapq import nsmallest
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import within_limit
from gearrattle.model import units
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.recording import Array, Recording

HEAD = 4096
"""Bytes of a file that a reader is shown."""
HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
TIME_NAMES = ("time", "t", "Time", "TIME", "Zeit", "timestamps")
"""What a column of times is called where a file has no better way to say so."""
_TIME_SPELLINGS = {"": "s", "S": "s", "sec": "s", "sek": "s", "msec": "ms", "usec": "us", "none": "s"}
_TIME_UNITS = ("s", "ms", "us", "sec")
_MOST_COLUMNS = 100_000


class Request(NamedTuple):
    """Columns wanted of a file, and statements on its times that the file lacks.

    Attributes
    ----------
    time
        name of the time column; empty: defined by the file.
    time_unit
        of these times; empty: defined by the file, else s.
    interval
        between samples of a file without times [s]; None: there are times.
    names
        the columns wanted; None: all that are signals. A reader may give more.
    """

    time: str = ""
    time_unit: str = ""
    interval: float | None = None
    names: frozenset[str] | None = None
    copies: int = 0

    def wants(self, name: str) -> bool:
        """Return whether a column is asked for."""
        return self.names is None or name in self.names


@dataclass(frozen=True, eq=False)
class Column:
    """One column of a file.

    Attributes
    ----------
    name, unit
        as they stand in the file; unit empty where there is none.
    values
        (N,), its own, which may be changed; (0,) for a column that was not asked for and not read.
    time
        (N,) [s]; None until it is found among the columns, unless the file gives it with the column.
    """

    name: str
    unit: str
    values: Array
    time: Array | None = None
    quantity: str = ""
    subject: str = ""
    axis: str = ""


@dataclass(frozen=True, eq=False)
class Raw:
    """Columns of a file, with notes."""

    columns: tuple[Column, ...]
    source: str
    format: str = ""
    notes: tuple[str, ...] = ()


class Reader(Protocol):
    """One format: a module of this shelf."""

    NAME: str
    """What messages and the key ``format`` call it."""
    SUFFIXES: tuple[str, ...]
    """Endings of such files, the usual one first."""

    def knows(self, path: Path, head: bytes, /) -> bool:
        """Return whether a file with this beginning is of the format."""
        ...

    def read(self, path: Path, request: Request, /) -> Raw:
        """Return the columns of a file; raise ``ModelError`` or whatever its library raises."""
        ...


class Writer(Reader, Protocol):
    """A format that recordings are written in as well."""

    def write(self, recording: Recording, path: Path, /) -> None:
        """Write a recording; raise ``ModelError`` where the format cannot hold it."""
        ...


def with_times(columns: Sequence[Column], path: Path, request: Request) -> tuple[Column, ...]:
    """Give every column its times, and leave the columns of times out.

    The times of a column are those the request names, those its file names for it, or a neighbouring column that is as
    long and has a name of time, or else a unit of time. The columns come in the order of the file; one of times may be
    changed to s in place. ModelError where there are no times, they are not those of the column, or two columns wanted
    have one name.
    """
    refuse_doubles(columns, str(path), request)
    # an interval was stated: count the samples
    if request.interval is not None:
        step = request.interval
        made = {size: np.arange(size, dtype=np.float64) for size in {c.values.size for c in columns}}
        for times in made.values():
            np.multiply(times, step, out=times)
        return tuple(replace(column, time=made[column.values.size]) for column in columns)
    # the column of times of every signal, in s
    axes = _axes(columns, path, request)
    used = {name for name in axes.values() if name}
    by_name = {column.name: column for column in columns}
    read = {name: _in_seconds(path, by_name[name], request.time_unit) for name in used}
    # give every signal its times
    timed = []
    without = []
    for column in columns:
        if column.name in used or column.name not in axes:
            continue  # times
        if column.time is not None and not request.time:
            timed.append(column)
        elif not column.values.size and request.names is not None:
            timed.append(replace(column, time=column.values))
        elif axes[column.name] and read[axes[column.name]].size == column.values.size:
            timed.append(replace(column, time=read[axes[column.name]]))
        else:
            without.append(column)
    # refuse a wanted signal without times
    wanted = [c for c in without if request.names is not None and c.name in request.names]
    if wanted or not timed:
        names = listed(shown(c.name) for c in wanted or columns)
        rule = f"no column of as many times belongs to {names or 'anything'}"
        remedy = 'name the column of times: time = "..."; or the rate, if there is none: sampled = "10 kHz"'
        raise ModelError(Problem(str(path), "", rule, remedy))
    return tuple(timed)


def _axes(columns: Sequence[Column], path: Path, request: Request) -> dict[str, str]:
    """Return the name of its times for every column that is a signal; empty where it has none or brings them itself."""
    if request.time:
        names = [column.name for column in columns]
        if request.time not in names:
            rule = f"no column has this name; there are {listed(shown(name) for name in names)}"
            raise ModelError(Problem(f"{path}: time", shown(request.time), rule, did_you_mean(request.time, names)))
        return {name: request.time for name in names if name != request.time}
    axis_names = {column.axis for column in columns}
    times = [c for c in columns if c.name in axis_names or (c.time is None and is_time(c.name, c.unit))]
    by_name = {time.name for time in times if _is_named_time(time.name) and _is_unit_of_time(time.unit)}
    by_unit = {time.name for time in times if time.name not in axis_names | by_name}
    possible = {time.name for time in times}
    choice = _Choice(times, by_unit)
    axes = {column.name: choice.axis_of(column) for column in columns if column.name not in possible}
    taken = set(axes.values())
    serving = [time for time in times if time.name not in by_unit or time.name in taken]
    choice = _Choice(serving, by_unit)
    for column in times:  # a signal in a unit of time, such as a delay, if other times are there
        if column.name in by_unit and column.name not in taken and (axis := choice.axis_of(column)):
            axes[column.name] = axis
    return axes


def refuse_doubles(columns: Sequence[Column], source: str, request: Request) -> None:
    """Refuse two columns of one name, where that name is wanted or may be that of the times.

    The ModelError has the first such name, and which columns have it.
    """
    first: dict[str, int] = {}
    for number, column in enumerate(columns, 1):
        before = first.setdefault(column.name, number)
        wanted = request.wants(column.name) or column.name == request.time
        if before != number and (wanted or (not request.time and is_time(column.name, column.unit))):
            rule = f"columns {before} and {number} of the file have this name, so it does not tell which one is meant"
            remedy = "rename one of them, or let a mapping name the channels wanted"
            raise ModelError(Problem(source, shown(column.name), rule, remedy))


def is_time(name: str, unit: str) -> bool:
    """Return whether a column holds times, by its name (the last part of a path) or by its unit."""
    return _is_named_time(name) or (bool(unit) and _is_unit_of_time(unit))


def _is_named_time(name: str) -> bool:
    """Return whether the last part of a path is a name of time."""
    return name.rsplit("/", 1)[-1].rsplit(".", 1)[-1] in TIME_NAMES


def _is_unit_of_time(unit: str) -> bool:
    """Return whether a unit is one of time; no unit is none."""
    return not unit or " since " in unit or unit in _TIME_UNITS


class _Choice:
    """Chooses the times of columns: those it names, then of its length by name, then nearest in the tree.

    Of those that only have a unit of time, the ones that ascend come first. Columns of one group and length have the
    same ranks, so that a table of very many columns is ranked once.
    """

    def __init__(self, times: Sequence[Column], by_unit: set[str]) -> None:
        self._names = {time.name for time in times}
        self._by_unit = by_unit
        self._best: dict[tuple[int, str], list[Column]] = {}
        self._of_size: dict[int, list[Column]] = {}
        for time in times:
            self._of_size.setdefault(time.values.size, []).append(time)

    def axis_of(self, column: Column) -> str:
        """Return the name of the column's times; empty where it has none or brings them itself."""
        if column.time is not None:
            return ""
        if column.axis and column.axis in self._names:
            return column.axis
        key = (column.values.size, column.name.rpartition("/")[0])
        if key not in self._best:
            fitting = self._of_size.get(column.values.size, [])
            self._best[key] = nsmallest(2, fitting, key=lambda time: self._rank(time, column.name))
        return next((time.name for time in self._best[key] if time is not column), "")

    def _rank(self, time: Column, name: str) -> tuple[int, int]:
        if time.name not in self._by_unit:
            return 0, -_shared(time.name, name)
        if not _is_unit_of_time(time.unit):
            return 3, 0
        ascends = bool((time.values[1:] > time.values[:-1]).all())
        return 1 if ascends else 2, -_shared(time.name, name)


def _shared(one: str, other: str) -> int:
    """Count the groups two names have in common."""
    a = one.split("/")[:-1]
    b = other.split("/")[:-1]
    return next((i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))


def seconds(unit: str) -> float:
    """Return the factor of a unit of time to s, of an empty one 1; brackets about it are allowed.

    UnitError where it is unknown, or no unit of time.
    """
    text = unit.strip().strip("[]()").strip().replace("µ", "u").replace("μ", "u")
    text = text.lower() if len(text) > 2 else text  # SEC; but Ms is no ms
    return units.convert(f"1 {_TIME_SPELLINGS.get(text, text)}", units.TIME)


def _in_seconds(path: Path, column: Column, unit: str) -> Array:
    """Return times in s, changed in place; the origin they count from is left out."""
    text = (unit or column.unit or "s").partition(" since ")[0].strip()
    try:
        factor = seconds(text)
    except units.UnitError as error:
        location = f"{path}: {column.name}"
        raise ModelError(
            Problem(location, shown(text), error.rule, error.remedy or 'such as time_unit = "ms"')
        ) from None
    if factor != 1.0:
        np.multiply(column.values, factor, out=column.values)
    return column.values


def column_names(name: str, shape: Sequence[int]) -> list[str]:
    """Name the signals of an array: a vector as it is, a table by its columns, ``name[0]``, ``name[1]``, ...

    The longer side of a table is that of the samples. There are no names for what is no signal: a single number,
    nothing, three dimensions, more than 100 000 columns.
    """
    if not 1 <= len(shape) <= 2 or min(shape) < 1 or max(shape) < 2:
        return []
    if min(shape) == 1 or len(shape) == 1:
        return [name]
    return [f"{name}[{index}]" for index in range(min(shape))] if min(shape) <= _MOST_COLUMNS else []


def ask_for(lengths: Sequence[int], request: Request, extra: int = 0) -> None:
    """Ask, once and before anything is unpacked, whether the memory that a file needs is allowed.

    Parameters
    ----------
    lengths
        samples of every column that is read, columns of times among them: each sample becomes eight bytes.
    request
        what is wanted; times that are made of an interval and copies of columns are counted as well.
    extra
        bytes that are needed at the same time, such as copies.

    Raises
    ------
    Refused
        it may not.
    """
    made = sum(set(lengths)) if request.interval is not None else 0
    made += request.copies * max(lengths, default=0)
    within_limit(8 * (sum(lengths) + made) + extra)


def unfit(path: Path, value: str, rule: str, remedy: str = "") -> ModelError:
    """Return the error for a recording that a format cannot hold."""
    return ModelError(Problem(str(path), value, rule, remedy))
