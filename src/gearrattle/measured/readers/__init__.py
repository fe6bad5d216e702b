"""Formats of measured files: recognition, reading and writing.

A format is recognised by the first bytes of the file; by its suffix only if the content is not enough. Every fault of a
file is reported as one ``ModelError`` with its position, whatever error the library of the format raises.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused, opened
from gearrattle.measured.readers import csv, hdf5, lvm, mat, mdf4, netcdf3, run_reader, tdms, uff, wav, xlsx
from gearrattle.measured.readers.reader import HEAD, Column, Raw, Reader, Request, Writer, refuse_doubles
from gearrattle.measured.readers.reader_answers import ANSWERS
from gearrattle.model.model_file import unreadable
from gearrattle.model.table import did_you_mean, listed
from gearrattle.recording import Recording
from gearrattle.wording import counted
from gearrattle.writing import whole

_MODULES = (run_reader, hdf5, netcdf3, mat, mdf4, tdms, xlsx, wav, uff, lvm, csv)
READERS: dict[str, Reader] = {reader.NAME: reader for reader in (cast(Reader, module) for module in _MODULES)}
"""Every format by its name, in the order in which a file is offered to them."""
WRITERS: dict[str, Writer] = {
    name: cast(Writer, reader) for name, reader in READERS.items() if hasattr(reader, "write")
}
"""The formats that recordings are written in."""

EVERYTHING = Request()

__all__ = ["ANSWERS", "READERS", "Column", "Raw", "Reader", "Request", "format_of", "read_raw", "write"]


def format_of(path: str | os.PathLike[str]) -> str:
    """Return the format of a file by its content; ModelError for a file that is missing, empty or of none known."""
    # the first bytes of the file
    file_path = Path(path)
    name = str(path)
    try:
        if file_path.is_dir():
            raise ModelError(Problem(name, "a folder", "must be a file"))
        with opened(file_path) as stream:
            head = stream.read(HEAD)
    except FileNotFoundError:
        raise ModelError(Problem(name, "", "no such file", _neighbour(file_path))) from None
    except (OSError, ValueError) as error:
        raise ModelError(unreadable(name, error)) from None
    if not head:
        raise ModelError(Problem(name, "", "the file is empty", "copy or export it again"))
    # the reader that knows them
    for reader in READERS.values():
        if reader.knows(file_path, head):
            return reader.NAME
    # no reader: name the likely cause
    if head[:4] == b"CDF\x05":
        rule = "netCDF of version 5 is not read; netCDF 3 and netCDF-4 are"
        raise ModelError(Problem(name, "a netCDF file", rule, "nccopy -k nc4 old.nc new.nc converts it"))
    ending = next((r.NAME for r in READERS.values() if file_path.suffix.lower() in r.SUFFIXES), "")
    rule = f"its content is none of {listed(READERS)}"
    remedy = (
        f"it ends like {ending}: damaged, or another format under that name" if ending else "export it as one of these"
    )
    raise ModelError(Problem(name, "", rule, remedy))


def read_raw(path: str | os.PathLike[str], request: Request = EVERYTHING, format: str = "") -> Raw:
    """Read the columns of a file as they stand.

    A ModelError refuses a file that is missing, damaged, without signals, or of another or an unknown format, two
    columns of one name, and times that do not ascend.
    """
    detected = format_of(path)
    reader = READERS[format or detected]
    file_path = Path(path)
    try:
        raw = reader.read(file_path, request)
    except (ModelError, MemoryError):
        raise
    except Refused as error:
        raise ModelError(unreadable(str(path), error)) from None
    except Exception as error:  # a library complains as it likes; the user gets one kind of answer
        rule = f"cannot be read as {reader.NAME}: damaged, truncated, or another format"
        remedy = "copy or export it again" if detected == reader.NAME else f"its content looks like {detected}"
        words = " ".join(str(error).split())[:120] or type(error).__name__
        raise ModelError(Problem(str(path), words, rule, remedy)) from None
    raw = _with_samples(raw, request)
    refuse_doubles(raw.columns, raw.source, request)
    for column in raw.columns:
        _check_times(column, raw.source)
    return raw


def _with_samples(raw: Raw, request: Request) -> Raw:
    """Leave out columns of less than two samples where all are wanted, with notes; also on a rate without use."""
    columns = raw.columns
    notes = list(raw.notes)
    if request.names is None:
        columns = tuple(column for column in raw.columns if column.values.size > 1)
        short = [column.name for column in raw.columns if column.values.size < 2]
        if not columns:
            raise ModelError(Problem(raw.source, "", "holds names, and no samples", "is this the whole record?"))
        if short:
            notes.append(f"fewer than two samples, left out: {', '.join(short)}")
    if request.interval is not None and not any(_is_sampled(column, request.interval) for column in columns):
        notes.append("sampled has no use: the file tells the times of its samples")
    return replace(raw, columns=columns, notes=tuple(notes))


def _is_sampled(column: Column, interval: float) -> bool:
    """Return whether the first two times of a column have the stated interval."""
    return column.time is not None and column.time.size > 1 and column.time[1] - column.time[0] == interval


def write(recording: Recording, path: str | os.PathLike[str], format: str = "") -> None:
    """Write a recording as a file, whole or not at all.

    Parameters
    ----------
    recording
        its channels, in SI.
    path
        the file; one that exists is replaced.
    format
        csv, mat, hdf5, netcdf3, mdf4, tdms, uff, wav or xlsx; empty: by the file's ending.

    Raises
    ------
    ModelError
        an ending of no format, or a recording that the format cannot hold.
    OSError
        the machine refused; nothing half-written is left.

    Examples
    --------
    >>> load = gr.measured.Channel("load", "torque", "", "N m", np.array([0.0, 1.0, 0.5, 0.0]))
    >>> record = gr.measured.Recording(np.arange(4) / 1000.0, (load,), "rig")
    >>> gr.write(record, "rig.h5")
    >>> gr.read("rig.h5")["load"].unit
    'N*m'
    """
    # formats that can be written, and their suffixes
    target = Path(path)
    endings = {suffix: writer for writer in reversed(WRITERS.values()) for suffix in writer.SUFFIXES}
    endings |= {writer.SUFFIXES[0]: writer for writer in WRITERS.values()}
    endings.pop(".nc")
    if format and format not in WRITERS:
        rule = f"must be one of {listed(WRITERS)}"
        raise ModelError(Problem("format", format, rule, did_you_mean(format, WRITERS)))
    if not format and target.suffix.lower() not in endings:
        rule = f"the ending tells the format: {listed(writer.SUFFIXES[0] for writer in WRITERS.values())}"
        raise ModelError(Problem(str(path), target.suffix or "no ending", rule, "or give format"))
    # write beside the target, then replace it
    writer = WRITERS[format] if format else endings[target.suffix.lower()]
    if not recording.channels or recording.time.size < 2:
        rule = "a recording to be written needs a channel, and two samples"
        raise ModelError(
            Problem(
                str(path),
                f"{counted(len(recording.channels), 'channel')}, {counted(recording.time.size, 'sample')}",
                rule,
            )
        )
    try:
        with whole(target) as path_while_written:
            writer.write(recording, path_while_written)
    except ModelError as error:
        raise type(error)([Problem(str(path), p.value, p.rule, p.remedy) for p in error.problems]) from None


def _check_times(column: Column, source: str) -> None:
    """Refuse times that are no numbers or do not ascend."""
    time = column.time
    assert time is not None
    location = f"{source}: times of {column.name}"
    if not np.isfinite(time).all():
        at = int(np.argmin(np.isfinite(time)))
        raise ModelError(Problem(location, f"{time[at]} at sample {at}", "must be finite numbers", "cut the record"))
    wrong = time[1:] <= time[:-1]
    if wrong.any():
        at = int(np.argmax(wrong)) + 1
        rule = f"must ascend; sample {at - 1} is at {time[at - 1]:.9g} s"
        raise ModelError(
            Problem(location, f"{time[at]:.9g} s at sample {at}", rule, "sort the record, or drop doubles")
        )


def _neighbour(path: Path) -> str:
    """Suggest a file of a similar name in the same folder."""
    try:
        names = [entry.name for entry in path.parent.iterdir()]
    except OSError:
        return f"the folder {path.parent} does not exist or cannot be read"
    return did_you_mean(path.name, names[:100])
