"""Meaning of the variables of a MAT file: signals, their names, and their times.

A MAT file has no units and often no times. So this module reads the variables that recorders store beside their
signals: ``Name`` and ``Unit`` beside ``Data``; ``X.Data`` as the axis of ``Y(k).Data``, or ``X(i).Data`` with
``XIndex`` i; ``Tstart``, ``Tinterval`` and ``Length`` as the times of the vectors beside them.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.readers.mat.variables import Variable
from gearrattle.measured.readers.reader import Column, Request, column_names, is_time
from gearrattle.recording import Array
from gearrattle.wording import counted

DESCRIPTION = "gearrattle"
"""Name of the text that ``write`` stores with the signals: their names, units, quantities and subjects."""
FORMAT = "gearrattle_format"
"""Name of the text that says the format of a file made by ``write``."""
_MOST_NAMED = 8  # variables that a note names
_DATA = ("Data", "data")
_NAMES = ("Name", "name")
_UNITS = ("Unit", "unit", "Units", "units")
_TRIPLE = ("Tstart", "Tinterval", "Length")
_SERIES = re.compile(r"((?:.*\.)?)([XxYy])(?:\((\d+)\))?\.([Dd]ata)")
_OF_TIME = re.compile(r"(?i)time|zeit|^t$|^$")


class Signal(NamedTuple):
    """A variable that holds numbers: samples per column, and its columns, still without values."""

    samples: int
    columns: list[Column]


class Clock(NamedTuple):
    """Times by start, interval and length as the file states them; length 0: not stated."""

    start: float
    interval: float
    length: int

    def times(self, samples: int) -> Array:
        """Return the times [s]."""
        times = np.arange(samples, dtype=np.float64)
        times *= self.interval
        times += self.start
        return times


@dataclass(frozen=True, eq=False)
class Contents:
    """Signals, clocks, texts and other variables of a file.

    Attributes
    ----------
    signals
        by path, in the order of the file.
    clocks
        by the path in front of Tstart and Tinterval; empty for variables of the file itself.
    texts
        by path: texts that describe signals.
    objects
        by path: MATLAB classes of objects that only MATLAB can read.
    left_out
        paths of variables that are no signals and describe none.
    """

    signals: dict[str, Signal]
    clocks: dict[str, Clock]
    texts: dict[str, str]
    objects: dict[str, str]
    left_out: list[str]

    def clock(self, path: str) -> Clock | None:
        """Return the clock stored with a signal, if its length is that of the signal or not stated."""
        clock = self.clocks.get(_parent(path))
        return clock if clock and clock.length in (0, self.signals[path].samples) else None

    def wanted(self, request: Request) -> set[str]:
        """Return the paths to read: the signals asked for, and every signal that may hold times."""
        if request.names is None:
            return set(self.signals)
        columns = [(path, column) for path, signal in self.signals.items() for column in signal.columns]
        needed = {*request.names, request.time}
        if not request.time:
            needed |= {column.axis for _, column in columns if column.name in needed}
            needed |= {column.name for _, column in columns if is_time(column.name, column.unit)}
        return {path for path, column in columns if column.name in needed}

    def lengths(self, wanted: set[str]) -> Iterator[int]:
        """Yield the number of samples of every column that is read, and of every time axis that is made."""
        yield from (self.signals[path].samples for path in wanted for _ in self.signals[path].columns)
        made = {(_parent(path), self.signals[path].samples) for path in wanted if self.clock(path)}
        yield from (samples for _, samples in made)

    def notes(self) -> Iterator[str]:
        """Yield notes for the user."""
        for path, kind in list(self.objects.items())[:_MOST_NAMED]:
            yield f"{path} is an object of MATLAB ({kind}) and is left out: save what it holds as plain vectors"
        if self.left_out:
            more = len(self.left_out) - _MOST_NAMED
            names = ", ".join(self.left_out[:_MOST_NAMED]) + (
                f" and {counted(more, 'more', 'more')}" if more > 0 else ""
            )
            yield f"left out, because they are no signals: {names}"
        for parent, clock in self.clocks.items():
            said = f"{clock.interval:.9g} s apart, from {clock.start:.9g} s"
            yield f"times from {parent}Tstart and {parent}Tinterval: {said}"
        axes = {column.axis for signal in self.signals.values() for column in signal.columns if column.axis}
        for axis in sorted(axes):
            yield f"{axis} is taken for the times of the signals beside it"


def contents_of(variables: Iterable[Variable], source: str) -> Contents:
    """Return the contents of a file.

    A ModelError refuses a start or interval of samples that is not valid, and two variables of one name.
    """
    shapes: dict[str, tuple[int, ...]] = {}
    texts: dict[str, str] = {}
    numbers: dict[str, float] = {}
    objects: dict[str, str] = {}
    others: list[str] = []
    # sort the variables: objects, signals, single numbers, texts
    for variable in variables:
        if variable.sort == "object":
            objects[variable.name] = variable.said
        elif variable.name in shapes:
            rule = "two variables have this name, so it does not tell which one is meant"
            raise ModelError(Problem(source, variable.name, rule, "save one of them under another name"))
        elif variable.sort == "numbers" and column_names(variable.name, variable.shape):
            shapes[variable.name] = variable.shape
        else:
            others.append(variable.name)
            if variable.sort == "numbers" and set(variable.shape) == {1}:
                numbers[variable.name] = _number(variable)
            elif variable.name in (DESCRIPTION, FORMAT) or variable.name.rpartition(".")[2] in (*_NAMES, *_UNITS):
                texts[variable.name] = variable.text()
    # times by Tstart, Tinterval and Length; variables that describe others
    clocks = _clocks(numbers, source)
    used = {*(DESCRIPTION, FORMAT), *(f"{parent}{key}" for parent in clocks for key in _TRIPLE)}
    used |= {f"{_parent(path)}{key}" for path in shapes if _parent(path) for key in (*_NAMES, *_UNITS, "XIndex")}
    # the signals, and the variables left over
    signals = _signals(shapes, texts, numbers)
    return Contents(signals, clocks, texts, objects, [name for name in others if name not in used])


def _signals(shapes: dict[str, tuple[int, ...]], texts: dict[str, str], numbers: dict[str, float]) -> dict[str, Signal]:
    """Give the columns of every variable their names, units and axes."""
    # what the file says of them: entries of ``write``, and the text Name beside Data, which counts if it is unique
    rows = _rows(texts.get(DESCRIPTION, ""))
    names_beside = {path: _text_of(texts, path, _NAMES) for path in shapes}
    taken = Counter([*shapes, *names_beside.values()])
    axes = _time_axes(shapes, names_beside)
    # columns of every variable
    signals = {}
    for path, shape in shapes.items():
        is_axis = _is_axis(path)
        name_beside = names_beside[path] if taken[names_beside[path]] == 1 and not is_axis else ""
        columns = []
        for full in column_names(path, shape):
            row = rows.get(full, {})
            unit, quantity, subject = (str(row.get(key, "")) for key in ("unit", "quantity", "subject"))
            name = str(row.get("name", full.replace(path, name_beside, 1) if name_beside else full))
            axis = "" if is_axis else _axis(path, max(shape), axes, numbers)
            unit = unit or _text_of(texts, path, _UNITS)
            columns.append(Column(name, unit, np.empty(0), None, quantity, subject, axis))
        signals[path] = Signal(max(shape), columns)
    return signals


def _time_axes(
    shapes: dict[str, tuple[int, ...]], names_beside: dict[str, str]
) -> dict[tuple[str, int], list[tuple[str, float]]]:
    """Return every ``X.Data`` that may hold times, and its number, by parent path and length."""
    axes: dict[tuple[str, int], list[tuple[str, float]]] = {}
    for path, shape in shapes.items():
        axis = _SERIES.fullmatch(path)
        if axis is not None and axis[2] in "Xx" and _OF_TIME.search(names_beside[path]):
            axes.setdefault((axis[1], max(shape)), []).append((path, float(axis[3] or 1)))
    return axes


def _axis(
    path: str, samples: int, axes: dict[tuple[str, int], list[tuple[str, float]]], numbers: dict[str, float]
) -> str:
    """Return the path of ``X.Data`` beside ``Y(k).Data``: the one that XIndex names, else the first of its length.

    An axis is taken for times only if its name says so or is empty.
    """
    series = _SERIES.fullmatch(path)
    if series is None:
        return ""
    index = numbers.get(f"{_parent(path)}XIndex", 0.0)
    return next((other for other, number in axes.get((series[1], samples), []) if index in (0.0, number)), "")


def _is_axis(path: str) -> bool:
    """Return whether a path is an ``X.Data``."""
    series = _SERIES.fullmatch(path)
    return series is not None and series[2] in "Xx"


def _clocks(numbers: dict[str, float], source: str) -> dict[str, Clock]:
    """Return the clocks by Tstart, Tinterval and Length, by the path before these names."""
    clocks = {}
    for path, interval in numbers.items():
        parent = _parent(path)
        if path != f"{parent}Tinterval" or f"{parent}Tstart" not in numbers:
            continue
        start = numbers[f"{parent}Tstart"]
        if not (np.isfinite(start) and np.isfinite(interval) and interval > 0.0):
            rule = "Tstart and Tinterval must be times of samples in s"
            raise ModelError(Problem(f"{source}: {path}", f"{interval:.9g} from {start:.9g}", rule, "export it again"))
        clocks[parent] = Clock(start, interval, int(max(0.0, numbers.get(f"{parent}Length", 0.0))))
    return clocks


def _number(variable: Variable) -> float:
    """Return a single number; in single precision the decimal number that was meant, 0.1 and not 0.10000000149."""
    number = float(variable.table()[0, 0])
    return float(str(np.float32(number))) if variable.stored.endswith("f4") else number


def _parent(path: str) -> str:
    """Return the path before the last name, with its dot; empty for a variable of the file."""
    return path[: path.rfind(".") + 1]


def _text_of(texts: dict[str, str], path: str, keys: tuple[str, ...]) -> str:
    """Return the text beside ``Data`` under one of some names; empty for other signals."""
    if path.rpartition(".")[2] not in _DATA or not _parent(path):
        return ""
    return next((text.strip() for key in keys if (text := texts.get(f"{_parent(path)}{key}"))), "")


def _rows(text: str) -> dict[str, dict[str, Any]]:
    """Return the entries that ``write`` stored with the signals, by variable."""
    try:
        rows = json.loads(text)
    except ValueError:
        return {}
    plain = isinstance(rows, dict) and all(isinstance(row, dict) for row in rows.values())
    return rows if plain else {}
