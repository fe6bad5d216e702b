"""MAT files of version 5, as MATLAB's ``save`` writes them without further words, and of version 4.

A vector is a signal; a matrix is one signal per column; fields of structures are read through their dots, structures of
an array by their number: ``rec.Y(2).Data``. ``write`` puts names, units and quantities beside the signals, as JSON in
the text ``gearrattle``, and the format in ``gearrattle_format``. Version 7.3 is HDF5, and read there.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

from gearrattle.errors import ModelError, Problem
from gearrattle.files import opened
from gearrattle.formats import check_format, format_name
from gearrattle.measured.readers.mat import version_4, version_5
from gearrattle.measured.readers.mat.mat_contents import DESCRIPTION, FORMAT, Clock, Contents, contents_of
from gearrattle.measured.readers.mat.variables import Variable, part_of
from gearrattle.measured.readers.reader import Column, Raw, Request, ask_for, column_names, unfit, with_times
from gearrattle.recording import Array, Recording

NAME = "mat"
SUFFIXES = (".mat",)
_LONGEST_NAME = 63


def knows(_path: Path, head: bytes) -> bool:
    """Return whether a file has text and byte-order mark of version 5, or the head of a variable of version 4."""
    return _is_version_5(head) or version_4.is_version_4(head)


def read(path: Path, request: Request) -> Raw:
    """Return its vectors; those that are not asked for have a name only."""
    with opened(path) as stream:
        _check_packed(stream, request)
        contents = contents_of(_variables(stream, within=True), str(path))
        check_format(contents.texts.get(FORMAT, ""), path, "recording")
        wanted = contents.wanted(request)
        ask_for(list(contents.lengths(wanted)), request)
        columns = _columns(stream, contents, wanted)
    if not columns:
        rule = "holds no vectors of real numbers"
        left_out = ", ".join([*contents.objects, *contents.left_out][:8])
        raise ModelError(Problem(str(path), left_out, rule, "save time and signals as plain vectors"))
    return Raw(with_times(columns, path, request), str(path), NAME, tuple(contents.notes()))


def write(recording: Recording, path: Path) -> None:
    """Write ``time`` [s], one vector per channel, and their names, units and quantities."""
    from scipy.io import savemat

    variables: dict[str, Any] = {"time": recording.time}
    rows = {}
    for channel in recording.channels:
        variable = re.sub(r"\W", "_", channel.name, flags=re.ASCII)
        variable = variable if variable[:1].isalpha() else f"x{variable}"
        if variable in (*variables, DESCRIPTION, FORMAT) or len(variable) > _LONGEST_NAME:
            rule = f"as a variable of MATLAB its name would be {variable}, which is taken or too long"
            raise unfit(path, channel.name, rule, "rename the channel")
        variables[variable] = channel.values
        rows[variable] = {k: getattr(channel, k) for k in ("name", "unit", "quantity", "subject")}
    about = {FORMAT: format_name("recording"), DESCRIPTION: json.dumps(rows)}
    savemat(path, {**variables, **about}, oned_as="column", appendmat=False, long_field_names=True)


def _is_version_5(head: bytes) -> bool:
    return head[:10] == b"MATLAB 5.0" or (len(head) >= 128 and head[124:128] in (b"\x00\x01IM", b"\x01\x00MI"))


def _variables(stream: BinaryIO, *, within: bool) -> Iterator[Variable]:
    """Yield the variables of an open file from its beginning; compressed structures whole, or their content."""
    size = os.fstat(stream.fileno()).st_size
    stream.seek(0)
    head = stream.read(version_5.HEAD)
    if _is_version_5(head):
        return version_5.variables(head, part_of(stream, size), within=within)
    stream.seek(0)
    return version_4.variables(part_of(stream, size))


def _check_packed(stream: BinaryIO, request: Request) -> None:
    """Refuse, by the heads of its variables, a file that takes more memory than the limit (Refused).

    Counted are the vectors that are wanted and the structures, before compressed ones are unpacked for more heads.
    """
    lengths: list[int] = []
    packed = 0
    for variable in _variables(stream, within=False):
        names = column_names(variable.name, variable.shape) if variable.sort == "numbers" else []
        if names and (request.names is None or not {*request.names, request.time}.isdisjoint(names)):
            lengths += [max(variable.shape)] * len(names)
        if variable.sort == "structure" and variable.part is not None:
            packed += variable.part.left
    ask_for(lengths, request, packed)


def _columns(stream: BinaryIO, contents: Contents, wanted: set[str]) -> list[Column]:
    """Read the columns that are wanted, and name the others."""
    read: dict[str, Array] = {}
    for variable in _variables(stream, within=True):
        if variable.name in wanted and variable.name not in read:
            read[variable.name] = variable.table()
    columns = []
    times: dict[tuple[Clock, int], Array] = {}
    for path, signal in contents.signals.items():
        if path not in wanted:
            columns += signal.columns
            continue
        clock = contents.clock(path)
        if clock is not None and (clock, signal.samples) not in times:
            times[clock, signal.samples] = clock.times(signal.samples)
        made = None if clock is None else times[clock, signal.samples]
        filled = zip(signal.columns, read[path], strict=True)
        columns += [replace(column, values=values, time=made) for column, values in filled]
    return columns
