"""Measured drag torques over speed and temperature, from CSV files or from Python.

    speed [rpm], temperature [degC], torque [N*m]

The speed is that of the body against what its parts act on. An optional column ``error`` is the standard error of the
torque; without ``temperature`` the oil has that of the model.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.data_file import Data, tables_of
from gearrattle.measured.identification.data_tables import DataTables, DragTable
from gearrattle.measured.identification.unit_columns import check_sign, check_units, in_si, read_unit_columns
from gearrattle.model import Model, units
from gearrattle.model.drag_parts import DragPart
from gearrattle.model.model_file import check_reachable, read_text
from gearrattle.model.pydantic_problems import model_error, place
from gearrattle.model.table import Breach, did_you_mean, listed, shown

Array = NDArray[np.float64]

DRAG_ERROR = 0.05
"""Relative standard error assumed where none is given."""
_EXAMPLE = "such as: speed [rpm], temperature [degC], torque [N*m]"
_COLUMNS = {"speed": units.ANGULAR_VELOCITY, "torque": units.TORQUE, "error": units.TORQUE}


class DragSamples(NamedTuple):
    """Samples in SI: (N,) speed, torque, temperature [degC] and error; None where they were not given."""

    speed: Array
    torque: Array
    temperature: Array | None
    error: Array | None


@dataclass(frozen=True)
class MeasuredDrags:
    """Measured drag torques of one body.

    Attributes
    ----------
    indices
        of the drag parts that were measured together.
    speed
        (N,) against what they act on [rad/s].
    temperature
        (N,) of the oil [degC]; None: that of the model.
    torque, error
        (N,) torques and their standard errors [N m].
    assumed
        whether the errors were assumed.
    """

    body: str
    indices: tuple[int, ...]
    speed: Array
    temperature: Array | None
    torque: Array
    error: Array
    assumed: bool

    @property
    def paths(self) -> tuple[str, ...]:
        """Paths of the drag parts."""
        return tuple(f"inertia.{self.body}.drag_parts.{index}" for index in self.indices)

    def parts(self, model: Model) -> list[DragPart]:
        """Return the drag parts of a model."""
        (drag_parts,) = (inertia.drag_parts for inertia in model.inertias if inertia.name == self.body)
        return [drag_parts[index] for index in self.indices]


def has_drags(data: Data) -> bool:
    """Whether data are drag torques."""
    return bool(tables_of(data)[0].get("drag"))


def read_drags(data: Data, model: Model) -> tuple[MeasuredDrags, ...]:
    """Read drag torques and check them against a model; a ModelError has every problem and its place in the file."""
    tables, positions, folder = tables_of(data)
    dimensionless = model.units == "dimensionless"
    try:
        rows = DataTables.model_validate(tables, context={"dimensionless": dimensionless}).drags
    except ValidationError as error:
        raise model_error(error, tables, positions) from None
    breaches = [breach for index, row in enumerate(rows) for breach in _breaches(("drag", index), row, model)]
    if breaches:
        raise ModelError(Problem(place(b.location, {}, positions), shown(b.value), b.rule, b.remedy) for b in breaches)
    measured = []
    for row in rows:
        samples = DragSamples(row.speed, row.torque, row.temperature, row.error)
        if row.file is not None:
            if positions.name:  # tables from Python may name any file that their author may read
                check_reachable(row.file, folder)
            samples = read_drag_samples(folder / row.file, dimensionless)
        measured.append(_with_errors(row, samples, model))
    return tuple(measured)


def read_drag_samples(path: Path, dimensionless: bool) -> DragSamples:
    """Read a CSV file of drag torques; a ModelError refuses what is none."""
    name = os.fspath(path)
    columns = read_unit_columns(read_text(path, "drag file"), name, _EXAMPLE)
    if set(columns.units) - {"temperature", "error"} != {"speed", "torque"}:
        rule = "the columns must be speed and torque; temperature and error may be added"
        raise ModelError(Problem(columns.header, ", ".join(columns.units), rule, _EXAMPLE))
    check_units(columns, dimensionless, _EXAMPLE)
    for column in _COLUMNS:
        check_sign(name, columns, column)
    values: dict[str, Array] = dict(columns.numbers)
    if not dimensionless:
        dimensions = {**_COLUMNS, "temperature": units.TEMPERATURE}
        values = {column: in_si(columns, column, (dimensions[column],))[0] for column in columns.units}
    return DragSamples(values["speed"], values["torque"], values.get("temperature"), values.get("error"))


def _breaches(at: tuple[str | int, ...], row: DragTable, model: Model) -> Iterator[Breach]:
    """Yield breaches: a body that the model does not have, or that has no such parts."""
    counts = {inertia.name: len(inertia.drag_parts) for inertia in model.inertias}
    if row.of not in counts:
        rule = f"no inertia has this name; there are {listed(list(counts))}"
        yield Breach((*at, "of"), row.of, rule, did_you_mean(row.of, tuple(counts)))
        return
    if not counts[row.of]:
        rule = "has no drag_parts in the model: there is no law to compare with"
        yield Breach((*at, "of"), row.of, rule, 'give it a part, or use the table as kind = "measured"')
        return
    for index in row.parts or ():
        if index >= counts[row.of]:
            yield Breach((*at, "parts"), index, f"{row.of} has the parts 0 to {counts[row.of] - 1}")


def _with_errors(row: DragTable, samples: DragSamples, model: Model) -> MeasuredDrags:
    """Return the torques of a body with their standard errors, assumed where none are stated."""
    (count,) = (len(inertia.drag_parts) for inertia in model.inertias if inertia.name == row.of)
    error: Any = samples.error
    is_assumed = error is None and row.relative_error is None
    if error is None:
        error = (row.relative_error or DRAG_ERROR) * samples.torque
    indices = dict.fromkeys(range(count) if row.parts is None else row.parts)
    return MeasuredDrags(row.of, tuple(indices), samples.speed, samples.temperature, samples.torque, error, is_assumed)
