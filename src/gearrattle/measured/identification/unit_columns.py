"""CSV files whose header names the units: ``speed [rpm], torque [N*m]``; lines that begin with # are comments."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.model import units
from gearrattle.model.table import shown
from gearrattle.model.units import Dimension, UnitError

Array = NDArray[np.float64]

_COLUMN = re.compile(r"\s*([a-z]+)\s*(?:\[([^\]]*)\])?\s*")


class UnitColumns(NamedTuple):
    """Columns of a file as written.

    Attributes
    ----------
    header
        place of the header.
    units
        unit by column, in the order of the file; empty where there is none.
    lines
        number of every line with numbers.
    numbers
        (N,) numbers by column, in the unit of the file.
    """

    header: str
    units: dict[str, str]
    lines: list[int]
    numbers: dict[str, Array]


def read_unit_columns(text: str, name: str, example: str) -> UnitColumns:
    """Read the columns of a file; ModelError for a header or a row that is none, and for a value that is no number."""
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise ModelError(Problem(name, "", "holds no header and no samples", example))
    number, header = lines[0]
    location = f"{name}:{number}"
    columns = _units(location, next(csv.reader([header])), example)
    rows = [_row(f"{name}:{n}", next(csv.reader([line])), tuple(columns)) for n, line in lines[1:]]
    if not rows:
        raise ModelError(Problem(name, "", "has a header but no samples"))
    numbers = dict(zip(columns, np.array(rows).T, strict=True))
    return UnitColumns(location, columns, [n for n, _ in lines[1:]], numbers)


def check_units(columns: UnitColumns, dimensionless: bool, example: str) -> None:
    """Refuse a column without its unit; in a dimensionless model one with a unit."""
    if dimensionless:
        with_units = [f"{name} [{unit}]" for name, unit in columns.units.items() if unit]
        if with_units:
            raise ModelError(Problem(columns.header, with_units[0], "must have no unit: this model is dimensionless"))
        return
    missing = [name for name, unit in columns.units.items() if not unit]
    if missing:
        raise ModelError(Problem(columns.header, missing[0], "must name its unit in brackets", example))


def in_si(columns: UnitColumns, name: str, dimensions: Sequence[Dimension]) -> tuple[Array, int]:
    """Return (N,) numbers of a column in SI, and which of the dimensions its unit has."""
    unit = columns.units[name]
    for index, dimension in enumerate(dimensions):
        try:
            zero, one = (units.convert(f"{number} {unit}", dimension) for number in (0, 1))
        except UnitError as error:
            last = error
        else:
            return zero + (one - zero) * columns.numbers[name], index
    rule = last.rule
    if len(dimensions) > 1:
        rule = "must have a unit of " + " or ".join(f"{d.name} ({d.si})" for d in dimensions)
    raise ModelError(Problem(columns.header, f"{name} [{unit}]", rule, last.remedy))


def check_sign(name: str, columns: UnitColumns, column: str, *, may_be_zero: bool = False) -> None:
    """Refuse numbers of a column that are not greater than zero; with ``may_be_zero`` negative ones."""
    numbers = columns.numbers.get(column, np.ones(1))
    wrong = numbers < 0 if may_be_zero else numbers <= 0
    if wrong.any():
        at = int(np.argmax(wrong))
        rule = "must not be negative" if may_be_zero else "must be greater than zero"
        raise ModelError(Problem(f"{name}:{columns.lines[at]}: {column}", f"{numbers[at]:g}", rule))


def _units(location: str, header: Sequence[str], example: str) -> dict[str, str]:
    """Return unit by column, in the order of the file."""
    units_by_name: dict[str, str] = {}
    for cell in header:
        match = _COLUMN.fullmatch(cell)
        if match is None or match[1] in units_by_name:
            raise ModelError(
                Problem(location, shown(cell.strip()), "must be a column name, once, and its unit", example)
            )
        units_by_name[match[1]] = match[2] or ""
    return units_by_name


def _row(location: str, cells: Sequence[str], columns: Sequence[str]) -> list[float]:
    if len(cells) != len(columns):
        raise ModelError(Problem(location, f"{len(cells)} entries", f"must have {len(columns)}: {', '.join(columns)}"))
    numbers = []
    for column, cell in zip(columns, cells, strict=True):
        try:
            number = float(cell)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise ModelError(Problem(f"{location}: {column}", shown(cell.strip()), "must be a finite number"))
        numbers.append(number)
    return numbers
