"""CSV whose header names the units: ``t [s], n_engine [rpm]``, or a line of names and one of units.

Lines that begin with # are comments; ``write`` uses them to say what each column is (``# n = velocity of flywheel``),
and this reader to know it again. Names of a saved run, such as ``angle.flywheel``, say their quantity and subject
themselves. Numbers are written so that they are read back to the last bit.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.files import opened_text
from gearrattle.measured.readers.reader import TIME_NAMES, Column, Raw, Request, ask_for, is_time, unfit, with_times
from gearrattle.model.csv_columns import read_all
from gearrattle.model.csv_heads import defused
from gearrattle.model.csv_layout import RecordError, encoding_of, numbered
from gearrattle.recording import QUANTITIES, Recording

NAME = "csv"
SUFFIXES = (".csv", ".txt", ".tsv", ".asc")
_SAID = re.compile(rf"# (.+) = ({'|'.join(QUANTITIES)})(?: of (.+))?")
_OF_A_RUN = re.compile(r"(angle|velocity|acceleration|deflection|force)\.([A-Za-z0-9_-]+)")
_SI = {"angle": "rad", "velocity": "rad/s", "acceleration": "rad/s^2", "speed": "rad/s"}
_FORBIDDEN = set(",;\t[]\n\r#\"'")


def knows(_path: Path, head: bytes) -> bool:
    """Return whether a file is a text with several columns."""
    encoding = encoding_of(head)
    if encoding is None:
        return False
    text = head.decode(encoding, errors="ignore")
    return any(mark in line for _, line in numbered(iter(text.splitlines())) for mark in ",;\t")


def read(path: Path, request: Request) -> Raw:
    """Return its columns of numbers."""

    def use(name: str, unit: str) -> bool:
        if not name:
            return False  # nothing but separators at the end of every line
        if request.wants(name):
            return True
        return name == request.time if request.time else is_time(name, unit)

    # read the columns wanted and those of times
    try:
        layout, values = read_all(path, use, lambda rows, columns: ask_for([rows] * columns, request))
    except RecordError as error:
        raise ModelError(Problem(error.place, error.value, error.rule, error.remedy)) from None
    # columns with unit, quantity and subject
    said = _stated_columns(path, layout.encoding)
    read_ones = iter(values.T)
    columns = []
    for name, unit in layout.heads:
        if not name:
            continue
        array = next(read_ones) if use(name, unit or "") else np.empty(0)
        quantity, subject = said.get(name) or _of_a_run(name)
        columns.append(Column(name, unit or _SI.get(quantity, ""), array, None, quantity, subject))
    # time stamps: finer times beside them are preferred
    if layout.stamps is not None:
        stamps = layout.heads[layout.stamps.column].name
        columns.sort(key=lambda column: column.name == stamps)  # times in s or ms beside them are finer
        if not request.time and any(column.name in TIME_NAMES and column.name != stamps for column in columns):
            columns = [column for column in columns if column.name != stamps]
        if request.time in ("", stamps):
            request = request._replace(time_unit="")
    return Raw(with_times(columns, path, request), str(path), NAME, layout.notes)


def _of_a_run(name: str) -> tuple[str, str]:
    """Return quantity and subject of a column of a saved run; two empty texts for other names."""
    match = _OF_A_RUN.fullmatch(name)
    return (match[1], match[2]) if match else ("", "")


def write(recording: Recording, path: Path) -> None:
    """Write ``time [s]`` and one column per channel."""
    comments, heads = head_of(recording, path)
    with open(path, "w", encoding="utf-8", newline="\n") as stream:
        stream.writelines(f"{comment}\n" for comment in comments)
        stream.write(", ".join(heads) + "\n")
        for row in rows_of(recording):
            stream.write(",".join(map(repr, row)) + "\n")


def head_of(recording: Recording, path: Path) -> tuple[list[str], list[str]]:
    """Return the lines of comments that say what the columns are, and the heads of the columns, times first.

    ModelError for a name that no column can have.
    """
    names = [channel.name for channel in recording.channels]
    wrong = next((name for name in names if _FORBIDDEN & set(name) or name != name.strip() or name == "time"), None)
    if wrong is not None:
        rule = "the name of a column holds no commas, semicolons, tabs, brackets, quotes or #, and is not time"
        raise unfit(path, wrong, rule, "rename the channel")
    comments = [f"# {' '.join(recording.source.split())}"]
    for channel in recording.channels:
        if channel.quantity:
            of = f" of {channel.subject}" if channel.subject else ""
            comments.append(f"# {channel.name} = {channel.quantity}{of}")
    heads = ["time [s]", *(f"{defused(channel.name)} [{channel.unit}]" for channel in recording.channels)]
    return comments, heads


def rows_of(recording: Recording) -> list[list[float]]:
    """Return the rows of numbers: a time and the values of all channels."""
    table = np.column_stack([recording.time, *(channel.values for channel in recording.channels)])
    rows: list[list[float]] = table.tolist()
    return rows


def _stated_columns(path: Path, encoding: str) -> dict[str, tuple[str, str]]:
    """Return quantity and subject by column, from the comments at the beginning."""
    stated: dict[str, tuple[str, str]] = {}
    with opened_text(path, encoding, "replace") as stream:
        for line in stream:
            if not line.startswith("#"):
                break
            if match := _SAID.fullmatch(line.rstrip("\n")):
                stated[match[1]] = (match[2], match[3] or "")
    return stated
