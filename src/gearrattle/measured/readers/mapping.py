"""Reading of a ``measurement.toml``, or of the same tables from Python: the columns it names, in SI.

    schema = 1
    file = "record.mat"
    rate = "10 kHz"

    [[channel]]
    name = "n_engine"
    quantity = "velocity"
    of = "flywheel"
    unit = "rpm"

Nothing is processed here: the tables state the processing, and ``gearrattle.measured.read`` does it.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.readers import READERS, Column, Raw, Request, read_raw
from gearrattle.measured.readers.mapping_tables import ChannelTable, MeasurementTables
from gearrattle.measured.readers.quantities import factor
from gearrattle.model.model_file import check_reachable, read_tables, read_text
from gearrattle.model.pydantic_problems import Positions, model_error, place
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.model.units import UnitError
from gearrattle.recording import Array

KIND = "mapping file"


@dataclass(frozen=True, eq=False)
class Mapped:
    """A channel before it is processed.

    Attributes
    ----------
    time
        (N,) ascending [s].
    values
        (N,) in SI of what was measured; NaN where the file has no number.
    unit
        SI unit of what was measured.
    """

    table: ChannelTable
    time: Array
    values: Array
    unit: str
    place: str

    def wrong(self, key: str, value: str, rule: str, remedy: str = "") -> ModelError:
        """Return the error for one of its keys, or for the whole channel."""
        return ModelError(Problem(f"{self.place}.{key}" if key else self.place, value, rule, remedy))


@dataclass(frozen=True, eq=False)
class Measurement:
    """Channels and tables of a mapping."""

    tables: MeasurementTables
    channels: tuple[Mapped, ...]
    source: str
    notes: tuple[str, ...]
    place: str


def read_mapping(source: str | os.PathLike[str] | Mapping[str, Any]) -> Measurement:
    """Read a mapping, a TOML file or its tables, and the columns it names.

    Paths in it are relative to the file or the working directory. A ModelError has every problem of the mapping with
    its place, then those of the record.
    """
    tables, positions, folder = _tables(source)
    records = {file: _record(tables, file, folder) for file in dict.fromkeys(row.file for row in tables.channels)}
    columns = {file: {column.name: column for column in reversed(raw.columns)} for file, raw in records.items()}
    uses = Counter((row.file, row.source or row.name) for row in tables.channels)
    channels: list[Mapped] = []
    problems: list[Problem] = []
    notes: list[str] = []
    for index, row in enumerate(tables.channels):
        where = place(("channel", index), {("channel", index): row.name}, positions)
        try:
            column = (row.file, row.source or row.name)
            uses[column] -= 1
            mapped, said = _mapped(row, records[row.file], columns[row.file], where, is_last_use=uses[column] == 0)
            channels.append(mapped)
            notes += said
        except ModelError as error:
            problems += error.problems
    if problems:
        raise ModelError(problems)
    notes = [note for raw in records.values() for note in raw.notes] + notes
    return Measurement(tables, tuple(channels), tables.file, tuple(notes), positions.name or "mapping")


def mapped_file(source: str | os.PathLike[str]) -> tuple[Path, Request, str, tuple[str, ...]]:
    """Return the record that a mapping file names, how its times are stated, its format, and the further files.

    A ModelError has every problem of the mapping with its place.
    """
    tables, _, folder = _tables(source)
    further = dict.fromkeys(row.file for row in tables.channels if row.file is not None)
    return folder / tables.file, _request(tables, None), tables.format or "", tuple(further)


def _tables(source: str | os.PathLike[str] | Mapping[str, Any]) -> tuple[MeasurementTables, Positions, Path]:
    """Return the tables of a mapping, the positions of its keys, and the folder of its files.

    A ModelError has every problem of the mapping with its place, or a file that it may not name.
    """
    if isinstance(source, Mapping):
        plain = source
        positions = Positions()
        folder = Path()
    else:
        name = os.fspath(source)
        plain, positions = read_tables(read_text(name, KIND), name, KIND)
        folder = Path(name).parent
    try:
        tables = MeasurementTables.model_validate(plain)
    except ValidationError as error:
        raise model_error(error, plain, positions) from None
    if tables.format is not None and tables.format not in READERS:
        rule = f"must be one of {listed(READERS)}"
        remedy = did_you_mean(tables.format, READERS)
        raise ModelError(Problem(place(("format",), {}, positions), shown(tables.format), rule, remedy))
    if positions.name:  # tables from Python may name any file that their author may read
        for file in dict.fromkeys((tables.file, *(row.file for row in tables.channels if row.file is not None))):
            check_reachable(file, folder)
    return tables, positions, folder


def _request(tables: MeasurementTables, names: Sequence[str] | None) -> Request:
    """Return the request for the first file."""
    interval = None if tables.sampled is None else 1.0 / tables.sampled
    return Request(tables.time, tables.time_unit, interval)._replace(**_named(names))


def _named(names: Sequence[str] | None) -> dict[str, Any]:
    """Return the names of wanted columns, and how many are wanted more than once; None: all."""
    if names is None:
        return {}
    once = frozenset(names)
    return {"names": once, "copies": len(names) - len(once)}


def _record(tables: MeasurementTables, file: str | None, folder: Path) -> Raw:
    """Read one of the files; how times are stated holds for the first."""
    names = tuple(row.source or row.name for row in tables.channels if row.file == file)
    if file is not None:
        return read_raw(folder / file, Request(**_named(names)))
    return read_raw(folder / tables.file, _request(tables, names), tables.format or "")


def _mapped(
    row: ChannelTable, raw: Raw, columns: Mapping[str, Column], where: str, *, is_last_use: bool
) -> tuple[Mapped, list[str]]:
    """Convert the column of a channel to SI, in place if no other channel uses it."""
    # the column of the file
    name = row.source or row.name
    column = columns.get(name)
    if column is None:
        names = [c.name for c in raw.columns]
        rule = f"no column of {raw.source} has this name; there are {listed(map(shown, names))}"
        key = "name" if row.source is None else "source"
        remedy = did_you_mean(name, names[:100]) or 'source = "..." tells what the file calls it'
        raise ModelError(Problem(f"{where}.{key}", shown(name), rule, remedy))
    # its unit, and the factor to SI
    measured = row.measured or row.quantity
    notes = []
    if row.unit is not None and column.unit and row.unit.strip() != column.unit.strip():
        notes.append(f"{row.name}: taken to be in {row.unit}; the file says {column.unit}")
    try:
        by, unit = factor(column.unit if row.unit is None else row.unit, measured)
    except UnitError as error:
        raise ModelError(
            Problem(f"{where}.unit", shown(column.unit), f"{raw.source}: {error.rule}", error.remedy)
        ) from None
    # values in SI, with scale and offset
    values = column.values if is_last_use else column.values.copy()
    values *= row.scale
    values += row.offset
    values *= by
    return Mapped(row, _times(column), values, unit, where), notes


def _times(column: Column) -> Array:
    assert column.time is not None
    return column.time
