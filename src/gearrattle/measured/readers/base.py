"""What a reader is, and the columns it gives: one file format each, recognised by the file's content.

A reader tells whether a file with these first bytes is of its format, what is in the file, and how a recording is
written in this format. Names and units in the result are those of the file. Units are read in ``quantities``; what a
reader takes for times and for values is declared in ``answers``.
``measured.readers`` reports damaged files in one form, so a reader need not catch the errors of its library.

Takes paths; gives ``Raw`` columns, or writes a ``Recording``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import units
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.recording import Array, Recording

HEAD = 4096
"""Bytes of a file that a reader is shown."""
HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
TIME_NAMES = ("time", "t", "Time", "TIME", "Zeit", "timestamps")
"""What a column of times is called where a file has no better way to say so."""
_TIME_SPELLINGS = {"": "s", "S": "s", "sec": "s", "sek": "s", "msec": "ms", "usec": "us", "none": "s"}


class Request(NamedTuple):
    """What is wanted of a file, where it does not say so itself.

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
    names: tuple[str, ...] | None = None


@dataclass(frozen=True, eq=False)
class Column:
    """One column of a file.

    Attributes
    ----------
    name, unit
        as they stand in the file; unit empty where there is none.
    values
        (N,); (0,) for a column that was not asked for and not read.
    time
        (N,) [s]; None until it is found among the columns.
    quantity, subject
        where the file says them.
    axis
        name of the column of its times, where the file says it.
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
    """What a file holds.

    Attributes
    ----------
    columns
        in the order of the file; every one has its times.
    source
        the file as messages name it.
    format
        name of its reader.
    notes
        what the user must know about it.
    """

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
        """Tell whether a file of this beginning is of the format."""
        ...

    def read(self, path: Path, request: Request, /) -> Raw:
        """Return the columns of a file; raise ``ModelError`` or whatever its library raises."""
        ...

    def write(self, recording: Recording, path: Path, /) -> None:
        """Write a recording; raise ``ModelError`` where the format cannot hold it."""
        ...


def with_times(columns: Sequence[Column], path: Path, request: Request) -> tuple[Column, ...]:
    """Give every column its times, and leave the columns of times out.

    The times of a column are those the request names, those its file names for it, or a column of a name or unit
    of time that stands beside it and is as long.

    Raises
    ------
    ModelError
        there are no times, they are not those of the column, or two columns wanted have one name.
    """
    refuse_doubles(columns, str(path), request)
    by_name = {column.name: column for column in columns}
    if request.interval is not None:
        step = request.interval
        made: dict[int, Array] = {
            size: np.asarray(np.arange(size) * step, np.float64) for size in {c.values.size for c in columns}
        }
        return tuple(replace(column, time=made[column.values.size]) for column in columns)
    if request.time and request.time not in by_name:
        rule = f"no column has this name; there are {listed(shown(name) for name in by_name)}"
        raise ModelError(Problem(f"{path}: time", shown(request.time), rule, did_you_mean(request.time, list(by_name))))
    times = [by_name[request.time]] if request.time else [c for c in columns if is_time(c.name, c.unit)]
    times += [by_name[c.axis] for c in columns if c.axis in by_name and not request.time]
    called = {column.name for column in times}
    read = {name: by_name[name].values * _seconds(path, by_name[name], request.time_unit) for name in called}
    timed, without = [], []
    for column in columns:
        if column.name in called:
            continue
        if not column.values.size and request.names is not None:
            timed.append(replace(column, time=column.values))
            continue
        name = _axis_of(column, times)
        if name and read[name].size == column.values.size:
            timed.append(replace(column, time=read[name]))
        else:
            without.append(column)
    wanted = [c for c in without if request.names is not None and c.name in request.names]
    if wanted or not timed:
        names = listed(shown(c.name) for c in wanted or columns)
        rule = f"no column of as many times belongs to {names or 'anything'}"
        remedy = 'name the column of times: time = "..."; or the rate, if there is none: sampled = "10 kHz"'
        raise ModelError(Problem(str(path), "", rule, remedy))
    return tuple(timed)


def refuse_doubles(columns: Sequence[Column], source: str, request: Request) -> None:
    """Refuse two columns of one name, where that name is wanted or may be that of the times.

    Parameters
    ----------
    columns
        in the order of the file.
    source
        the file as messages name it.
    request
        what is wanted of the file.

    Raises
    ------
    ModelError
        the first such name, and which columns have it.
    """
    first: dict[str, int] = {}
    for number, column in enumerate(columns, 1):
        before = first.setdefault(column.name, number)
        wanted = request.names is None or column.name in (*request.names, request.time)
        if before != number and (wanted or (not request.time and is_time(column.name, column.unit))):
            rule = f"columns {before} and {number} of the file have this name, so it does not tell which one is meant"
            remedy = "rename one of them, or let a mapping name the channels wanted"
            raise ModelError(Problem(source, shown(column.name), rule, remedy))


def is_time(name: str, unit: str) -> bool:
    """Tell a column of times by its name, the last part of a path, or by its unit."""
    return name.rsplit("/", 1)[-1].rsplit(".", 1)[-1] in TIME_NAMES or unit in ("s", "ms", "us", "sec")


def _axis_of(column: Column, times: Sequence[Column]) -> str:
    """Return the name of the column's times: those it names, then those nearest to it in the tree, of its length."""
    if column.axis and any(time.name == column.axis for time in times):
        return column.axis
    fitting = [time for time in times if time.values.size == column.values.size]
    ranked = sorted(fitting, key=lambda time: -_shared(time.name, column.name))
    return ranked[0].name if ranked else ""


def _shared(one: str, other: str) -> int:
    """Count the groups two names have in common."""
    a, b = one.split("/")[:-1], other.split("/")[:-1]
    return next((i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b)))


def seconds(unit: str) -> float:
    """Return the factor of a unit of time to s.

    Parameters
    ----------
    unit
        as a file or a user writes it, without brackets or with them; empty: s.

    Raises
    ------
    UnitError
        it is unknown, or no unit of time.
    """
    text = unit.strip().strip("[]()").strip().replace("µ", "u").replace("μ", "u")
    text = text.lower() if len(text) > 2 else text  # SEC; but Ms is no ms
    return units.convert(f"1 {_TIME_SPELLINGS.get(text, text)}", units.TIME)


def _seconds(path: Path, column: Column, unit: str) -> float:
    """Return the factor of a column of times to s."""
    text = unit or column.unit or "s"
    try:
        return seconds(text)
    except units.UnitError as error:
        location = f"{path}: {column.name}"
        raise ModelError(
            Problem(location, shown(text), error.rule, error.remedy or 'such as time_unit = "ms"')
        ) from None


def split_columns(name: str, array: NDArray[np.generic]) -> Iterator[tuple[str, Array]]:
    """Yield real vectors out of an array: a vector as it is, a table by its columns, ``name[0]``, ``name[1]``, ...

    Anything else (single numbers, texts, complex numbers, three dimensions) is no signal and yields nothing.
    """
    if not (np.issubdtype(array.dtype, np.floating) or np.issubdtype(array.dtype, np.integer)):
        return
    if array.ndim == 2 and 1 in array.shape:
        array = array.reshape(-1)
    if array.ndim == 1 and array.size > 1:
        yield name, array.astype(np.float64)
    elif array.ndim == 2 and min(array.shape) > 1:
        tall = array if array.shape[0] >= array.shape[1] else array.T
        for index in range(tall.shape[1]):
            yield f"{name}[{index}]", tall[:, index].astype(np.float64)


def unfit(path: Path, value: str, rule: str, remedy: str = "") -> ModelError:
    """Return the refusal to write what a format cannot hold."""
    return ModelError(Problem(str(path), value, rule, remedy))
