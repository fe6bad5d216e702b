"""netCDF 3, classic and with 64-bit offsets, through ``scipy.io``; netCDF-4 is HDF5, and read there.

Every variable of real numbers is a signal; a table is one signal per column. Its times are the variable that has the
name of its first dimension, if that one is of times; else the rule of ``with_times``. Units, quantities and subjects
are attributes, as in HDF5; ``packing`` reads those of packed numbers and of gaps. Format: Unidata, NetCDF Classic and
64-bit Offset File Formats.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import check_regular
from gearrattle.formats import check_format, format_name
from gearrattle.measured.readers.packing import ATTRIBUTES, FILLS, Packing, packing_of, unpack
from gearrattle.measured.readers.reader import Column, Raw, Request, ask_for, column_names, is_time, unfit, with_times
from gearrattle.recording import Array, Recording

NAME = "netcdf3"
SUFFIXES = (".nc3", ".cdf", ".nc")
_VERSIONS = (b"CDF\x01", b"CDF\x02")
_TEXTS = ("units", "quantity", "subject")


def knows(_path: Path, head: bytes) -> bool:
    """Return whether a file begins with the mark of version 1 or 2."""
    return head[:4] in _VERSIONS


def read(path: Path, request: Request) -> Raw:
    """Return its variables of numbers; those that are not asked for have a name only."""
    check_regular(path)
    with _opened(path, "r") as file:
        check_format(_text(file, "format"), path, "recording")
        columns, scaled = _columns(file, path, request)
    if not columns:
        rule = "holds no variables of real numbers"
        raise ModelError(Problem(str(path), "", rule, "store time and signals as vectors"))
    notes = [f"scaled by scale_factor and add_offset of the file: {', '.join(scaled)}"] if scaled else []
    return Raw(with_times(columns, path, request), str(path), NAME, tuple(notes))


def _columns(file: Any, path: Path, request: Request) -> tuple[list[Column], list[str]]:
    """Return the columns, and names of the signals that are scaled; nothing keeps a part of the file mapped."""
    # the signals, and the memory of those wanted
    signals = [_Signal(name, variable) for name, variable in file.variables.items()]
    signals = [signal for signal in signals if signal.names]
    wanted = [signal for signal in signals if signal.is_wanted(request)]
    ask_for([max(signal.variable.shape) for signal in wanted for _ in signal.names], request)
    # their numbers, unpacked
    columns: list[Column] = []
    scaled = []
    for signal in signals:
        table = [np.empty(0)] * len(signal.names)
        if signal in wanted:
            packing = signal.packing(path)
            table = list(signal.table())
            for values in table:
                unpack(values, packing)
            scaled += [signal.name] if packing.scales else []
        # columns with unit, quantity, subject and axis
        axis = signal.axis if signal.axis in file.variables else ""
        unit, quantity, subject = (_text(signal.variable, key) for key in _TEXTS)
        named = zip(signal.names, table, strict=True)
        columns += [Column(name, unit, values, None, quantity, subject, axis) for name, values in named]
    return columns, scaled


class _Signal:
    """A variable that may hold signals, before it is read."""

    def __init__(self, name: str, variable: Any) -> None:
        self.name = name
        self.variable = variable
        is_numeric = variable.shape and variable.data.dtype.kind in "fiu"
        self.names = column_names(name, variable.shape) if is_numeric else []

    @property
    def axis(self) -> str:
        """The dimension of its samples, if a variable of times may have that name; empty for an axis itself."""
        dimension = str(self.variable.dimensions[int(np.argmax(self.variable.shape))])
        return dimension if dimension != self.name and is_time(dimension, "") else ""

    def is_wanted(self, request: Request) -> bool:
        """Return whether it is read: a column of it is asked for, or it may hold times."""
        if request.names is None:
            return True
        may_hold_times = not request.time and is_time(self.name, _text(self.variable, "units"))
        return may_hold_times or not {*request.names, request.time}.isdisjoint(self.names)

    def packing(self, path: Path) -> Packing:
        """Return its packing by its attributes; netCDF's own fill value is a gap, but for single bytes."""
        kind = self.variable.data.dtype
        attributes = {key: getattr(self.variable, key) for key in ATTRIBUTES if hasattr(self.variable, key)}
        fill = FILLS[f"{kind.kind}{kind.itemsize}"] if kind.itemsize > 1 else 0.0
        return packing_of(attributes, kind, fill, f"{path}: {self.name}")

    def table(self) -> Array:
        """Return a copy of its numbers as (columns, samples)."""
        array = np.array(self.variable.data, np.float64)
        table = array.reshape(1, -1) if array.ndim == 1 or 1 in array.shape else array
        return np.ascontiguousarray(table.T if table.shape[0] >= table.shape[1] else table)


def write(recording: Recording, path: Path) -> None:
    """Write ``time`` [s] and one variable a channel over it, with its attributes, as version 2."""
    with _opened(path, "w", version=2) as file:
        file.format = format_name("recording").encode()
        file.source = recording.source.encode()
        file.createDimension("time", recording.time.size)
        time = file.createVariable("time", "f8", ("time",))
        time[:] = recording.time
        time.units = b"s"
        for channel in recording.channels:
            if channel.name in file.variables or not channel.name.strip("/. "):
                raise unfit(path, channel.name, "no name of a variable, or taken already", "rename the channel")
            variable = file.createVariable(channel.name, "f8", ("time",))
            variable[:] = channel.values
            for key, value in zip(_TEXTS, (channel.unit, channel.quantity, channel.subject), strict=True):
                if value:
                    setattr(variable, key, value.encode())


@contextmanager
def _opened(path: Path, mode: str, version: int = 1) -> Iterator[Any]:
    """Open a file; one that is read is mapped, so that no header takes more memory than the file has.

    The library warns of arrays that still refer to a file that is refused.
    """
    from scipy.io import netcdf_file

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        try:
            file = netcdf_file(path, mode, mmap=mode == "r", version=version)
        except Exception as error:  # its half-made object goes here
            words = " ".join(str(error).split()) or type(error).__name__
            error.__traceback__ = None
            error.__context__ = None
            raise ValueError(words) from None
        with file:
            yield file


def _text(item: Any, name: str) -> str:
    """Return an attribute as text; empty where there is none."""
    value = getattr(item, name, "")
    return value.decode("utf-8", "replace").strip() if isinstance(value, bytes) else str(value)
