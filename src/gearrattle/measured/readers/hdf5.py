"""HDF5, and formats built on it: MAT files of version 7.3, netCDF-4.

Every vector of real numbers is a signal, named by its path; a table is one signal per column, also one of named columns
(a compound type, as pandas and PyTables write). Units, quantities and subjects are attributes (``units`` or ``unit``,
``quantity``, ``subject``); ``packing`` reads those of packed numbers and of gaps. Times are a vector of a name or unit
of time beside the signal, or the only dimension scale of its length that is of times; where no vector of times is as
long, an attribute such as ``fs`` of the signal or of a group that holds it tells the rate. Format: The HDF Group, HDF5
File Format Specification 3.0.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.files import datasets, opened_hdf5
from gearrattle.formats import check_format, format_name
from gearrattle.measured.readers.packing import ATTRIBUTES, PIECE, Packing, packing_of, unpack
from gearrattle.measured.readers.reader import (
    HDF5_SIGNATURE,
    Column,
    Raw,
    Request,
    ask_for,
    column_names,
    is_time,
    unfit,
    with_times,
)
from gearrattle.recording import Array, Recording

NAME = "hdf5"
SUFFIXES = (".h5", ".hdf5", ".hdf", ".nc", ".mat")
_PLACES = (0, 512, 1024, 2048)
_NO_SIGNALS = ("char", "cell", "logical")
_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable"
_OF_TIME = re.compile(r"(?i)time|zeit|^t$")
_RATES = ("fs", "Fs", "sampling_rate", "sample_rate", "sampling_frequency")
"""Attributes that tell the samples per second [Hz]."""
_PLAIN = (0, 1)  # classes of types of HDF5: whole numbers, floating point
_EXACT = 2**53  # the largest integer up to which a double holds every integer


def knows(_path: Path, head: bytes) -> bool:
    """Return whether a file has the signature, at the beginning or behind a user block as MATLAB writes it."""
    return any(head[at : at + 8] == HDF5_SIGNATURE for at in _PLACES)


def read(path: Path, request: Request) -> Raw:
    """Return its vectors; those that are not asked for have a name only."""
    columns: list[Column] = []
    scales: list[str] = []
    scaled: list[str] = []
    origins: dict[str, int] = {}
    # find the signals, and ask for the memory of those wanted
    with opened_hdf5(path, in_parts=True) as file:
        _check_origin(_text(file.attrs.get("format", "")), path)
        signals = [signal for name, item in datasets(file) for signal in _signals_of(name, item) if signal.names]
        wanted = [signal for signal in signals if signal.is_wanted(request)]
        rates = {name: rate for signal in wanted if (rate := _rate(signal, file, path)) for name in signal.names}
        lengths = [max(signal.item.shape) for signal in wanted for _ in signal.names]
        lengths += {max(signal.item.shape) for signal in wanted if not rates.keys().isdisjoint(signal.names)}
        ask_for(lengths, request, max((signal.extra for signal in wanted), default=0))
        # read the wanted signals and unpack their numbers
        read_ones = {id(signal) for signal in wanted}
        for signal in signals:
            table = [np.empty(0)] * len(signal.names)
            if id(signal) in read_ones:
                packing = _packing(signal, path)
                table = list(_table(signal, origins))
                for values in table:
                    unpack(values, packing)
                scaled += [signal.name] if packing.scales else []
            # columns with unit, quantity and subject
            said = [signal.said(key) for key in ("quantity", "subject")]
            columns += [
                Column(full, signal.unit, values, None, *said) for full, values in zip(signal.names, table, strict=True)
            ]
            scales += signal.names if signal.is_scale_of_times else []
    if not columns:
        rule = "holds no vectors of real numbers"
        raise ModelError(Problem(str(path), "", rule, "store time and signals as vectors"))
    # notes on scaled numbers and origins of times
    notes = [f"scaled by scale_factor and add_offset of the file: {', '.join(scaled)}"] if scaled else []
    notes += [f"times count from {origin} {unit}" for unit, origin in origins.items()]
    columns, by_rate = _with_rates(_with_axes(columns, scales), scales, rates)
    notes += [f"times by the sampling rate of the file: {', '.join(by_rate)}"] if by_rate else []
    return Raw(with_times(columns, path, request), str(path), NAME, tuple(notes))


def _signals_of(name: str, item: Any) -> list[_Signal]:
    """Return a dataset as what may hold signals: every named column on its own, or all of it."""
    fields = item.dtype.names
    return [_Signal(name, item)] if fields is None else [_Signal(f"{name}/{field}", item, field) for field in fields]


class _Signal:
    """A dataset, or a named column of one, that may hold signals, before it is read."""

    def __init__(self, name: str, item: Any, field: str = "") -> None:
        self.name = name
        self.item = item
        self.field = field
        self.dtype = item.dtype[field] if field else item.dtype
        self.names = column_names(name, item.shape) if self._is_numeric else []
        unit = item.attrs.get("units", item.attrs.get("unit", ""))
        if field and np.shape(unit) == (len(item.dtype.names),):
            unit = unit[item.dtype.names.index(field)]
        self.unit = _text(unit).strip()

    @property
    def _is_numeric(self) -> bool:
        """Whether it holds real numbers that neither MATLAB nor netCDF marks as no signal."""
        return (
            "/#" not in f"/{self.name}"  # MATLAB's references
            and bool(self.item.shape)
            and self.dtype.kind in "fiu"
            and _text(self.item.attrs.get("MATLAB_class", "")) not in _NO_SIGNALS
            and not _text(self.item.attrs.get("NAME", "")).startswith(_NO_VARIABLE)
        )

    @property
    def view(self) -> Any:
        """What reads its numbers: the dataset, or the view of a named column."""
        return self.item.fields(self.field) if self.field else self.item

    def said(self, key: str) -> str:
        """Return an attribute as text; empty where there is none."""
        return _text(self.item.attrs.get(key, ""))

    @property
    def is_scale_of_times(self) -> bool:
        """Whether it is a dimension scale, and of times: by its unit, its role in CF, or, without a unit, its name."""
        if self.said("CLASS") != "DIMENSION_SCALE" or len(self.names) != 1:
            return False
        if self.unit:
            return is_time("", self.unit)
        is_told = self.said("axis") == "T" or self.said("standard_name") == "time"
        return is_told or _OF_TIME.search(self.name.rpartition("/")[2]) is not None

    @property
    def counts_in_whole_numbers(self) -> bool:
        """Whether it holds times since a date as whole numbers of 64 bits, which a double may not hold."""
        plain = not any(key in self.item.attrs for key in ("scale_factor", "add_offset"))
        return plain and " since " in self.unit and self.dtype.kind in "iu" and self.dtype.itemsize == 8

    def is_wanted(self, request: Request) -> bool:
        """Return whether it is read: a column of it is asked for, or it may hold times."""
        if request.names is None:
            return True
        may_hold_times = not request.time and (self.is_scale_of_times or is_time(self.name, self.unit))
        return may_hold_times or not {*request.names, request.time}.isdisjoint(self.names)

    @property
    def block(self) -> int:
        """Rows of a tall table that are read at once: whole chunks of it."""
        rows = (self.item.chunks or (1,))[0]
        return int(rows * max(1, PIECE // (rows * self.item.size // max(self.item.shape))))

    @property
    def extra(self) -> int:
        """Bytes that reading needs besides its numbers: a chunk before and after it is unpacked, a block of rows."""
        kind = self.item.id.get_type().get_class()
        if kind not in _PLAIN:
            return int(self.item.size * self.item.dtype.itemsize)
        packed = self.item.chunks is not None and self.item.id.get_create_plist().get_nfilters() > 0
        chunk = 2 * int(np.prod(self.item.chunks, dtype=object)) * self.item.dtype.itemsize if packed else 0
        is_tall = self.item.ndim == 2 and self.item.shape[0] >= self.item.shape[1] > 1
        columns = self.item.shape[1] if is_tall else 0
        return chunk + int(min(self.block, self.item.shape[0]) * columns * self.item.dtype.itemsize)


def write(recording: Recording, path: Path) -> None:
    """Write ``time`` [s] as a dimension scale, and one dataset a channel with its attributes."""
    import h5py

    with h5py.File(path, "w", track_order=True) as file:
        time = file.create_dataset("time", data=recording.time)
        time.attrs["units"] = np.bytes_("s")
        time.make_scale("time")
        file.attrs["format"] = np.bytes_(format_name("recording").encode())
        file.attrs["source"] = np.bytes_(recording.source.encode())
        for channel in recording.channels:
            if channel.name in file or not channel.name.strip("/. "):
                raise unfit(path, channel.name, "no name of a dataset, or taken already", "rename the channel")
            dataset = file.create_dataset(channel.name, data=channel.values)
            dataset.dims[0].attach_scale(time)
            for key, value in (("units", channel.unit), ("quantity", channel.quantity), ("subject", channel.subject)):
                dataset.attrs[key] = np.bytes_(value.encode()) if value else ""


def _packing(signal: _Signal, path: Path) -> Packing:
    """Return the packing of a dataset by its attributes."""
    fill = 0.0 if signal.field else signal.item.fillvalue
    known = {key: signal.item.attrs[key] for key in ATTRIBUTES if key in signal.item.attrs}
    return packing_of(known, signal.dtype, float(fill or 0.0), f"{path}: {signal.name}")


def _table(signal: _Signal, origins: dict[str, int]) -> Array:
    """Read the stored numbers of a dataset as (columns, samples), without a copy of all of them."""
    item = signal.item
    samples = max(item.shape)
    table = np.empty((item.size // samples, samples))
    if signal.counts_in_whole_numbers:
        return _since(signal, table, origins)
    if signal.field:
        table[...] = _lying(signal.view[...])
    elif item.id.get_type().get_class() not in _PLAIN:  # enumerations, which the library does not turn into numbers
        table[...] = _lying(np.asarray(item[...]))
    elif min(item.shape) == 1 or item.ndim == 1 or item.shape[0] < samples:
        item.read_direct(table.reshape(item.shape))
    else:
        for begin in range(0, samples, signal.block):
            rows = item[begin : begin + signal.block]
            table[:, begin : begin + signal.block] = rows.T
    return table


def _lying(array: NDArray[np.generic]) -> NDArray[np.generic]:
    """Return an array as (columns, samples)."""
    table = array.reshape(1, -1) if array.ndim == 1 or 1 in array.shape else array
    return table.T if table.shape[0] >= table.shape[1] else table


def _since(signal: _Signal, table: Array, origins: dict[str, int]) -> Array:
    """Read whole numbers of 64 bits that count from a date: from the first one if a double cannot hold them.

    Axes of one unit count from the same number.
    """
    whole = table.view(signal.dtype.newbyteorder("="))
    if signal.field:
        whole.reshape(signal.item.shape)[...] = signal.view[...]
    else:
        signal.item.read_direct(whole.reshape(signal.item.shape))
    largest = max(abs(int(whole.max())), abs(int(whole.min())))
    origin = origins.setdefault(signal.unit, int(whole.flat[0])) if largest > _EXACT else 0
    for begin in range(0, whole.size, PIECE):
        part = slice(begin, begin + PIECE)
        table.reshape(-1)[part] = whole.reshape(-1)[part] - np.array(origin, whole.dtype)
    return table


def _with_axes(columns: list[Column], scales: list[str]) -> list[Column]:
    """Let signals be over the only dimension scale of times of their length.

    The references from signals to scales would tell more, but the library ends the process on damaged ones (HDF5 1.14).
    """
    fitting: dict[int, list[str]] = {}
    are_scales = set(scales)
    for column in columns:
        if column.name in are_scales:
            fitting.setdefault(column.values.size, []).append(column.name)
    assigned = []
    for column in columns:
        names = [] if column.name in are_scales else fitting.get(column.values.size, [])
        assigned.append(replace(column, axis=names[0]) if len(names) == 1 and column.values.size else column)
    return assigned


def _rate(signal: _Signal, file: Any, path: Path) -> float | None:
    """Return the samples per second [Hz] that a signal or the nearest group about it states; None where none does."""
    groups = signal.item.name.split("/")[1:-1]
    holders = [signal.item, *(file["/".join(groups[:depth]) or "/"] for depth in range(len(groups), -1, -1))]
    for holder in holders:
        key = next((key for key in _RATES if key in holder.attrs), "")
        if not key:
            continue
        numbers = np.asarray(holder.attrs[key]).reshape(-1)
        rate = float(numbers[0]) if numbers.size == 1 and numbers.dtype.kind in "fiu" else 0.0
        if not 0.0 < rate < np.inf:
            rule = "a sampling rate must be one positive number, in Hz"
            value = _text(holder.attrs[key])[:60]
            raise ModelError(Problem(f"{path}: {holder.name}: {key}", value, rule, "correct it in the file"))
        return rate
    return None


def _with_rates(columns: list[Column], scales: list[str], rates: dict[str, float]) -> tuple[list[Column], list[str]]:
    """Give times to columns that have a rate, and no vector of times of their length; return their names as well."""
    lengths = {column.values.size for column in columns if column.name in scales or is_time(column.name, column.unit)}
    by_rate = {c.name for c in columns if c.name in rates and c.values.size and c.values.size not in lengths}
    keys = {column.name: (column.values.size, rates[column.name]) for column in columns if column.name in by_rate}
    times = {(samples, rate): np.arange(samples) / rate for samples, rate in keys.values()}
    timed = [replace(c, time=times[keys[c.name]]) if c.name in by_rate else c for c in columns]
    return timed, [column.name for column in columns if column.name in by_rate]


def _check_origin(name: str, path: Path) -> None:
    """Refuse a recording that a later version of ``write`` wrote; a file from elsewhere may have any ``format``."""
    if name.startswith("gearrattle recording "):
        check_format(name, path, "recording")


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
