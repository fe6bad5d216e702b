"""``look``: the contents of a measured file, and a first mapping file for it."""

from __future__ import annotations

import json
import os
import re
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.json_types import Json, json_value
from gearrattle.measured.readers import Column, Request, read_raw
from gearrattle.measured.readers.mapping import mapped_file
from gearrattle.measured.readers.packing import PIECE
from gearrattle.measured.readers.quantities import guess
from gearrattle.recording import QUANTITIES, Array, Recording
from gearrattle.result import Result

if TYPE_CHECKING:
    import pandas as pd

PREVIEW = 3
"""Samples of each channel that are shown."""
_PARTS = 500
"""Equal parts of a channel whose extremes outline it."""
_HEADER = """\
# Which channels are read, and what is done to them: the how-to "Read measured data" has every key.
schema = 1
file = {file}
"""
_CHANNEL = """
[[channel]]
name = {name}
source = {source}
quantity = {quantity}{guessed}
{of}
unit = {unit}
"""
_UNKNOWN = """
# Its unit does not say what this one measures. Remove the # signs, and choose the quantity:
# {quantities}
# [[channel]]
# name = {name}
# source = {source}
# quantity = "torque"
# unit = "N*m"                 # of scale x the stored number + offset
# scale = 1.0
"""
_ROTATION = {
    "velocity": '; "speed" if the mean rotation is included',
    "speed": ', and never zero: with the mean rotation; "velocity" without',
    "angle": '; "shaft angle" if the mean rotation is included',
}


@dataclass(frozen=True, eq=False)
class Contents(Result):
    """What a measured file holds.

    Attributes
    ----------
    source
        the file's name.
    format
        name of its format.
    table
        one row per channel: ``channel``, ``unit`` (as in the file), ``quantity`` and ``subject`` (empty where
        neither file nor unit says it), ``samples``, ``rate`` [Hz] (mean; NaN for one sample), ``uniform``,
        ``begin`` and ``end`` [s], ``smallest`` and ``largest`` (of the finite samples), ``not_numbers`` (count),
        ``first`` (the first three samples).
    notes
        what was assumed.
    outline
        by channel: times [s] and values (as in the file) of all samples, of a long one of the smallest and
        the largest in each of 500 equal parts.

    Examples
    --------
    >>> load = gr.measured.Channel("x", "torque", "", "N m", np.zeros(3))
    >>> gr.write(gr.measured.Recording(np.arange(3.0), (load,), "rig"), "x.csv")
    >>> type(gr.measured.look("x.csv")).__name__
    'Contents'
    """

    kind: ClassVar[str] = "contents"
    source: str
    format: str
    table: pd.DataFrame
    notes: tuple[str, ...]
    outline: tuple[tuple[Array, Array], ...] = field(repr=False)
    _request: Request

    def mapping(self, folder: str | os.PathLike[str] = ".") -> str:
        """Return a mapping file for ``read``: every channel whose quantity is known, at the highest rate.

        The file is named relative to the folder in which the mapping will stand.
        """
        request = self._request
        rows: list[dict[str, Any]] = [{str(key): row[key] for key in row} for row in self.table.to_dict("records")]
        file = os.path.relpath(self.source, folder)
        text = _HEADER.format(file=_quoted(Path(file).as_posix()))
        if request.time:
            text += f"time = {_quoted(request.time)}\n"
        if request.time_unit:
            text += f"time_unit = {_quoted(request.time_unit)}\n"
        if request.interval is not None:
            text += f'sampled = "{1.0 / request.interval!r} Hz"\n'
        known = [row for row in rows if row["quantity"]]
        if len({(row["samples"], row["begin"], row["end"]) for row in known}) > 1:
            rate = max(row["rate"] for row in known)
            text += f'rate = "{rate:.9g} Hz"{"":<10}# the channels have different times: all are brought to this rate\n'
        taken: dict[str, int] = {}
        entries = [_entry(_label(row["channel"], taken), row) for row in rows]
        return text + "".join(entries)

    def to_dict(self) -> dict[str, Json]:
        """Return the contents in JSON types; numbers that are not finite are null."""
        rows = [{str(key): json_value(value) for key, value in row.items()} for row in self.table.to_dict("records")]
        return {"source": self.source, "format": self.format, "channels": rows, "notes": list(self.notes)}


def look(source: str | os.PathLike[str], *, time: str = "", sampled: float | None = None) -> Contents:
    """List the channels of a measured file.

    Parameters
    ----------
    source
        CSV, MAT, HDF5, ASAM MDF, UFF, WAV, or a saved run; or a mapping file, whose record is looked at with the
        times that the mapping states.
    time
        name of the time column, if the file does not define it.
    sampled
        rate of a file without times [Hz].

    Raises
    ------
    ModelError
        no such file, another format, damage, no times.

    Examples
    --------
    >>> import gearrattle as gr
    >>> _ = open("rig.csv", "w").write("t [s],n [rpm]\\n0,800\\n0.001,801\\n0.002,803\\n")
    >>> contents = gr.measured.look("rig.csv")
    >>> list(map(str, contents.table.loc[0, ["channel", "unit", "quantity", "rate"]]))
    ['n', 'rpm', 'speed', '1000.0']
    """
    import pandas as pd

    if sampled is not None and not (np.isfinite(sampled) and sampled > 0.0):
        raise ModelError(Problem("sampled", f"{sampled}", "must be a positive rate in Hz"))
    path, request, file_format, notes = _looked_at(source)
    if time or sampled is not None:
        request = Request(time=time, interval=None if sampled is None else 1.0 / sampled)
    raw = read_raw(path, request, file_format)
    times = {id(column.time): column.time for column in raw.columns if column.time is not None}
    even = {key: Recording(time, (), "").interval is not None for key, time in times.items()}
    table = pd.DataFrame([_row(column, is_uniform=even[id(column.time)]) for column in raw.columns])
    return Contents(raw.source, raw.format, table, (*notes, *raw.notes), tuple(map(_outline, raw.columns)), request)


def _looked_at(source: str | os.PathLike[str]) -> tuple[str | os.PathLike[str], Request, str, tuple[str, ...]]:
    """Return the file, how its times are stated, its format where stated, and notes."""
    if Path(source).suffix.lower() != ".toml":
        return source, Request(), "", ()
    path, request, file_format, further = mapped_file(source)
    notes = [f"{source} is a mapping: the file that it names is looked at, {path}"]
    if further:
        notes.append(f"it names further files: {', '.join(further)}")
    return path, request, file_format, tuple(notes)


def _row(column: Column, *, is_uniform: bool) -> dict[str, Any]:
    """Return the entries of one channel."""
    times = column.time
    assert times is not None
    count, smallest, largest = _extremes(column.values)
    span = float(times[-1] - times[0])
    return {
        "channel": column.name,
        "unit": column.unit,
        "quantity": column.quantity if column.quantity in QUANTITIES else _guessed(column.unit, smallest, largest),
        "subject": column.subject,
        "samples": column.values.size,
        "rate": (times.size - 1) / span if span > 0.0 else float("nan"),
        "uniform": is_uniform,
        "begin": float(times[0]),
        "end": float(times[-1]),
        "smallest": smallest,
        "largest": largest,
        "not_numbers": column.values.size - count,
        "first": column.values[:PREVIEW].tolist(),
    }


def _guessed(unit: str, smallest: float, largest: float) -> str:
    """Return the quantity that a unit means: a velocity that never passes zero contains the mean rotation."""
    quantity = guess(unit)
    return "speed" if quantity == "velocity" and (smallest > 0.0 or largest < 0.0) else quantity


def _outline(column: Column) -> tuple[Array, Array]:
    """Return the samples of a channel, of a long one the extremes of equal parts; what is not finite is left out."""
    assert column.time is not None
    values = column.values
    if values.size <= 2 * _PARTS:
        finite = np.flatnonzero(np.isfinite(values))
        return column.time[finite], values[finite]
    edges = np.linspace(0, values.size, _PARTS + 1).astype(np.int64)
    shown: list[int] = []
    last: list[int] = []
    for first, end in pairwise(edges.tolist()):
        numbers = np.flatnonzero(np.isfinite(values[first:end])) + first
        if numbers.size:
            part = values[numbers]
            shown += [] if shown else [int(numbers[0])]
            shown += [int(numbers[np.argmin(part)]), int(numbers[np.argmax(part)])]
            last = [int(numbers[-1])]
    at = np.unique(np.array([*shown, *last], dtype=np.int64))
    return column.time[at], values[at]


def _extremes(values: Array) -> tuple[int, float, float]:
    """Return how many values are finite, the smallest and the largest; NaN if there is none."""
    count = 0
    smallest = np.inf
    largest = -np.inf
    for begin in range(0, values.size, PIECE):
        part = values[begin : begin + PIECE]
        numbers = part[np.isfinite(part)]
        count += numbers.size
        smallest = min(smallest, float(numbers.min(initial=np.inf)))
        largest = max(largest, float(numbers.max(initial=-np.inf)))
    return (count, smallest, largest) if count else (0, float("nan"), float("nan"))


def _entry(name: str, row: dict[str, Any]) -> str:
    """Return the lines of one channel in a mapping file."""
    if not row["quantity"]:
        return _UNKNOWN.format(name=_quoted(name), source=_quoted(row["channel"]), quantities=", ".join(QUANTITIES))
    stated = bool(row["subject"])
    entry = _CHANNEL.format(
        name=_quoted(name),
        source=_quoted(row["channel"]),
        quantity=_quoted(row["quantity"]),
        guessed="" if stated else f"        # by its unit{_ROTATION.get(row['quantity'], '')}",
        of=f"of = {_quoted(row['subject'])}" if stated else '# of = "..."                 # the inertia or element',
        unit=_quoted(row["unit"]),
    )
    if not row["unit"]:
        entry = entry.replace('unit = ""', '# unit = "..."               # the file does not say it')
    if row["not_numbers"]:
        entry += f'gaps = "bridge"              # {row["not_numbers"]} of its samples are no numbers\n'
    return entry


def _label(name: str, taken: dict[str, int]) -> str:
    """Return a name of letters, digits, _ and - that is not taken: by name, the last number behind it."""
    label = re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "channel"
    free = label
    while free in taken:
        taken[label] += 1
        free = f"{label}_{taken[label]}"
    taken[free] = 1
    return free


def _quoted(text: str) -> str:
    """Return a basic string of TOML."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
