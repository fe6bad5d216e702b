"""Frequency responses in CSV files whose header names the units.

    frequency [Hz], real [rad/s^2/(N*m)], imag [rad/s^2/(N*m)]
    frequency [Hz], magnitude [rad/s^2/(N*m)], phase [deg]

The unit says whether an angle, a velocity or an acceleration was measured. An optional column ``error`` is the standard
error of the real and of the imaginary part. Lines that begin with # are comments. The convention is exp(+i omega t).
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.measured_modes import QUANTITIES
from gearrattle.model import units
from gearrattle.model.table import shown
from gearrattle.model.units import Dimension, UnitError

Array = NDArray[np.float64]

PER_TORQUE = tuple(
    Dimension(f"{name} per torque", f"{si}/(N*m)", (-1, -2, 2 - power, 1), f"1 {si}/(N*m)")
    for power, (name, si) in enumerate(zip(QUANTITIES, ("rad", "rad/s", "rad/s^2"), strict=True))
)
_FORMS = (("frequency", "real", "imag"), ("frequency", "magnitude", "phase"))
_COLUMN = re.compile(r"\s*([a-z]+)\s*(?:\[([^\]]*)\])?\s*")
_EXAMPLE = "such as: frequency [Hz], real [rad/s^2/(N*m)], imag [rad/s^2/(N*m)]"


class Samples(NamedTuple):
    """What a file holds, in SI: (F,) omega, complex value and error (None if not given), and derivatives in time."""

    omega: Array
    value: NDArray[np.complex128]
    error: Array | None
    derivatives: int | None


def read_samples(text: str, name: str, dimensionless: bool) -> Samples:
    """Read a frequency response.

    A ModelError refuses a column that is missing or without its unit, a row of other length, and a value that is no
    finite number.
    """
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise ModelError(Problem(name, "", "holds no header and no samples", _EXAMPLE))
    number, header = lines[0]
    location = f"{name}:{number}"
    columns = _columns(location, next(csv.reader([header])))
    factors, derivatives = _factors(location, columns, dimensionless)
    rows = [_row(f"{name}:{n}", next(csv.reader([line])), tuple(columns)) for n, line in lines[1:]]
    if not rows:
        raise ModelError(Problem(name, "", "has a header but no samples"))
    table = dict(zip(columns, np.array(rows).T, strict=True))
    values = {key: table[key] * factors[key] for key in columns}
    _check(name, lines[1:], values)
    if "real" in values:
        value = values["real"] + 1j * values["imag"]
    else:
        value = values["magnitude"] * np.exp(1j * values["phase"])
    return Samples(values["frequency"], value, values.get("error"), derivatives)


def _columns(location: str, header: Sequence[str]) -> dict[str, str]:
    """Return unit by column, in the order of the file."""
    units: dict[str, str] = {}
    for cell in header:
        match = _COLUMN.fullmatch(cell)
        if match is None or match[1] in units:
            raise ModelError(
                Problem(location, shown(cell.strip()), "must be a column name, once, and its unit", _EXAMPLE)
            )
        units[match[1]] = match[2] or ""
    if not any(set(units) - {"error"} == set(form) for form in _FORMS):
        rule = "the columns must be frequency, real and imag, or frequency, magnitude and phase; error may be added"
        raise ModelError(Problem(location, ", ".join(units), rule, _EXAMPLE))
    return units


def _factors(location: str, columns: dict[str, str], dimensionless: bool) -> tuple[dict[str, float], int | None]:
    """Return the factor to SI by column, and how many derivatives in time were measured."""
    # a dimensionless model has columns without units
    if dimensionless:
        with_units = [f"{name} [{unit}]" for name, unit in columns.items() if unit]
        if with_units:
            raise ModelError(Problem(location, with_units[0], "must have no unit: this model is dimensionless"))
        return dict.fromkeys(columns, 1.0), None
    # otherwise every column needs its unit, and has a factor to SI
    missing = [name for name, unit in columns.items() if not unit]
    if missing:
        raise ModelError(Problem(location, missing[0], "must name its unit in brackets", _EXAMPLE))
    factors: dict[str, float] = {}
    kinds: dict[str, int] = {}
    for name, unit in columns.items():
        if name == "frequency":
            hertz = unit in units.FREQUENCY.symbols
            dimension = units.FREQUENCY if hertz else units.ANGULAR_VELOCITY
            factors[name] = _factor(location, name, unit, (dimension,))[0] * (math.tau if hertz else 1.0)
        elif name == "phase":
            factors[name] = _factor(location, name, unit, (units.ANGLE,))[0]
        else:
            factors[name], kinds[name] = _factor(location, name, unit, PER_TORQUE)
    # all columns are of one quantity per torque
    if len(set(kinds.values())) > 1:
        value = ", ".join(f"{name} [{columns[name]}]" for name in kinds)
        raise ModelError(Problem(location, value, "all must be the same quantity per torque"))
    return factors, next(iter(kinds.values()))


def _factor(location: str, name: str, unit: str, dimensions: Sequence[Dimension]) -> tuple[float, int]:
    """Return one such unit in SI, and which of the dimensions it has."""
    for index, dimension in enumerate(dimensions):
        try:
            return units.convert(f"1 {unit}", dimension), index
        except UnitError as error:
            last = error
    rule = last.rule
    if len(dimensions) > 1:
        rule = "must have a unit of " + " or ".join(f"{d.name} ({d.si})" for d in dimensions)
    raise ModelError(Problem(location, f"{name} [{unit}]", rule, last.remedy))


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


def _check(name: str, lines: Sequence[tuple[int, str]], values: dict[str, Array]) -> None:
    """Refuse frequencies and errors that are not positive, and magnitudes that are negative."""
    for column, rule, wrong in (
        ("frequency", "must be greater than zero", values["frequency"] <= 0),
        ("error", "must be greater than zero", values.get("error", np.ones(1)) <= 0),
        ("magnitude", "must not be negative", values.get("magnitude", np.ones(1)) < 0),
    ):
        if wrong.any():
            at = int(np.argmax(wrong))
            raise ModelError(Problem(f"{name}:{lines[at][0]}: {column}", f"{values[column][at]:g}", rule))
