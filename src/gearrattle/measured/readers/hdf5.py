"""HDF5, and what is HDF5 inside: MAT files of version 7.3, netCDF-4.

Every vector of real numbers is a signal, named by its path; a table is one signal a column. Units, quantities and
subjects are attributes (``units`` or ``unit``, ``quantity``, ``subject``); times are a vector of a name or unit of time
beside the signal, or the only dimension scale of its length. Format: The HDF Group, HDF5 File Format Specification 3.0.

Takes a path; gives columns with times.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import datasets, opened_hdf5
from gearrattle.formats import check_format, format_name
from gearrattle.measured.readers.base import (
    HDF5_SIGNATURE,
    Column,
    Raw,
    Request,
    is_time,
    split_columns,
    unfit,
    with_times,
)
from gearrattle.recording import Recording

NAME = "hdf5"
SUFFIXES = (".h5", ".hdf5", ".hdf", ".nc", ".mat")
_PLACES = (0, 512, 1024, 2048)
_NO_SIGNALS = ("char", "cell", "logical")


def knows(_path: Path, head: bytes) -> bool:
    """Tell the signature, at the beginning or behind a user block as MATLAB writes it."""
    return any(head[at : at + 8] == HDF5_SIGNATURE for at in _PLACES)


def read(path: Path, request: Request) -> Raw:
    """Return its vectors."""
    columns: list[Column] = []
    scales: dict[str, Column] = {}
    with opened_hdf5(path) as file:
        _check_origin(_text(file.attrs.get("format", "")), path)
        for name, item in datasets(file):
            if (
                "/#" in f"/{name}"  # MATLAB's references
                or not item.shape
                or item.dtype.kind not in "fiu"
                or item.ndim > 2
                or _text(item.attrs.get("MATLAB_class", "")) in _NO_SIGNALS
            ):
                continue
            said = {key: _text(item.attrs.get(key, "")) for key in ("quantity", "subject")}
            unit = _text(item.attrs.get("units", item.attrs.get("unit", "")))
            for full, values in split_columns(name, item[...]):
                columns.append(Column(full, unit, values, None, said["quantity"], said["subject"]))
                if _text(item.attrs.get("CLASS", "")) == "DIMENSION_SCALE":
                    scales[full] = columns[-1]
    if not columns:
        rule = "holds no vectors of real numbers"
        raise ModelError(Problem(str(path), "", rule, "store time and signals as vectors"))
    return Raw(with_times(_with_axes(columns, scales), path, request), str(path), NAME)


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


def _with_axes(columns: list[Column], scales: dict[str, Column]) -> list[Column]:
    """Let signals be over the only dimension scale of their length, if it may be one of times.

    The references from signals to scales would tell more, but the library ends the process on damaged ones (HDF5 1.14).
    """
    fitting: dict[int, list[str]] = {}
    for name, scale in scales.items():
        if not scale.unit or is_time(name, scale.unit):
            fitting.setdefault(scale.values.size, []).append(name)
    assigned = []
    for column in columns:
        names = [] if column.name in scales else fitting.get(column.values.size, [])
        assigned.append(replace(column, axis=names[0]) if len(names) == 1 else column)
    return assigned


def _check_origin(name: str, path: Path) -> None:
    """Refuse a recording that a later version of ``write`` wrote; a file from elsewhere may have any ``format``."""
    if name.startswith("gearrattle recording "):
        check_format(name, path, "recording")


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
