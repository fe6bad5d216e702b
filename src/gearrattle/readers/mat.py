"""MAT files of version 5 (and 4), as MATLAB's ``save`` writes them without further words.

A vector is a signal; a matrix is one signal a column; fields of structures are read through their dots. Units are not
in such files, but ``write`` puts names, units and quantities beside the signals, in the structure ``gearrattle``.
Format: The MathWorks, MAT-File Format (R2023a). Version 7.3 is HDF5, and read there.

Takes a path; gives columns with times.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.readers.base import Column, Raw, Request, split_columns, unfit, with_times
from gearrattle.recording import Recording

NAME = "mat"
SUFFIXES = (".mat",)
_TOLD = "gearrattle"
_FIELDS = ("variable", "name", "unit", "quantity", "subject")
_LONGEST_NAME = 63


def knows(_path: Path, head: bytes) -> bool:
    """Tell the text and the mark of byte order of a MAT file of version 5; version 4 has neither."""
    return head[:10] == b"MATLAB 5.0" or (len(head) >= 128 and head[124:128] in (b"\x00\x01IM", b"\x01\x00MI"))


def read(path: Path, request: Request) -> Raw:
    """Return its vectors."""
    from scipy.io import loadmat

    content = loadmat(path, simplify_cells=True)
    told = _told(content.pop(_TOLD, None))
    columns: list[Column] = []
    skipped: list[str] = []
    for name, value in content.items():
        if name.startswith("__"):
            continue
        found = list(_vectors(name, value))
        skipped += [] if found else [name]
        for full, array in found:
            row = told.get(full, dict.fromkeys(_FIELDS, ""))
            called = row["name"] or full
            columns.append(Column(called, row["unit"], array, None, row["quantity"], row["subject"]))
    if not columns:
        rule = "holds no vectors of real numbers"
        raise ModelError(Problem(str(path), ", ".join(skipped[:8]), rule, "save time and signals as plain vectors"))
    notes = (f"no signals, left out: {', '.join(skipped)}",) if skipped else ()
    return Raw(with_times(columns, path, request), str(path), NAME, notes)


def write(recording: Recording, path: Path) -> None:
    """Write ``time`` [s], one vector a channel, and what they are."""
    from scipy.io import savemat

    variables: dict[str, Any] = {"time": recording.time}
    rows = []
    for channel in recording.channels:
        variable = re.sub(r"\W", "_", channel.name, flags=re.ASCII)
        variable = variable if variable[:1].isalpha() else f"x{variable}"
        if variable in (*variables, _TOLD) or len(variable) > _LONGEST_NAME:
            rule = f"as a variable of MATLAB its name would be {variable}, which is taken or too long"
            raise unfit(path, channel.name, rule, "rename the channel")
        variables[variable] = channel.values
        rows.append((variable, channel.name, channel.unit, channel.quantity, channel.subject))
    beside = {
        key: np.array(entries, dtype=object) for key, entries in zip(_FIELDS, zip(*rows, strict=True), strict=True)
    }
    savemat(path, {**variables, _TOLD: beside}, oned_as="column", appendmat=False)


def _vectors(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the vectors of a variable, of the fields of a structure as well."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _vectors(f"{name}.{key}", inner)
    elif isinstance(value, np.ndarray):
        yield from split_columns(name, value)


def _told(table: Any) -> dict[str, dict[str, str]]:
    """Return what ``write`` put beside the signals, by variable."""
    if not isinstance(table, dict) or not set(_FIELDS) <= set(table):
        return {}
    lists = [[str(x) if np.size(x) else "" for x in np.atleast_1d(np.asarray(table[key], object))] for key in _FIELDS]
    return {row[0]: dict(zip(_FIELDS, row, strict=True)) for row in zip(*lists, strict=False)}
