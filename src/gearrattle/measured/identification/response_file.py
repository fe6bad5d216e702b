"""Frequency responses in CSV files whose header names the units.

    frequency [Hz], real [rad/s^2/(N*m)], imag [rad/s^2/(N*m)]
    frequency [Hz], magnitude [rad/s^2/(N*m)], phase [deg]

The unit says whether an angle, a velocity or an acceleration was measured. An optional column ``error`` is the standard
error of the real and of the imaginary part. Lines that begin with # are comments. The convention is exp(+i omega t).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.measured.identification.measured_modes import QUANTITIES
from gearrattle.measured.identification.unit_columns import (
    UnitColumns,
    check_sign,
    check_units,
    in_si,
    read_unit_columns,
)
from gearrattle.model import units
from gearrattle.model.units import Dimension

Array = NDArray[np.float64]

PER_TORQUE = tuple(
    Dimension(f"{name} per torque", f"{si}/(N*m)", (-1, -2, 2 - power, 1), f"1 {si}/(N*m)")
    for power, (name, si) in enumerate(zip(QUANTITIES, ("rad", "rad/s", "rad/s^2"), strict=True))
)
_FORMS = (("frequency", "real", "imag"), ("frequency", "magnitude", "phase"))
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
    columns = read_unit_columns(text, name, _EXAMPLE)
    if not any(set(columns.units) - {"error"} == set(form) for form in _FORMS):
        rule = "the columns must be frequency, real and imag, or frequency, magnitude and phase; error may be added"
        raise ModelError(Problem(columns.header, ", ".join(columns.units), rule, _EXAMPLE))
    check_units(columns, dimensionless, _EXAMPLE)
    values, derivatives = (columns.numbers, None) if dimensionless else _in_si(columns)
    for column in ("frequency", "error"):
        check_sign(name, columns, column)
    check_sign(name, columns, "magnitude", may_be_zero=True)
    if "real" in values:
        value = values["real"] + 1j * values["imag"]
    else:
        value = values["magnitude"] * np.exp(1j * values["phase"])
    return Samples(values["frequency"], value, values.get("error"), derivatives)


def _in_si(columns: UnitColumns) -> tuple[dict[str, Array], int | None]:
    """Return values by column in SI, and how many derivatives in time were measured."""
    values: dict[str, Array] = {}
    kinds: dict[str, int] = {}
    for name, unit in columns.units.items():
        if name == "frequency":
            hertz = unit in units.FREQUENCY.symbols
            dimension = units.FREQUENCY if hertz else units.ANGULAR_VELOCITY
            values[name] = in_si(columns, name, (dimension,))[0] * (math.tau if hertz else 1.0)
        elif name == "phase":
            values[name] = in_si(columns, name, (units.ANGLE,))[0]
        else:
            values[name], kinds[name] = in_si(columns, name, PER_TORQUE)
    # all columns are of one quantity per torque
    if len(set(kinds.values())) > 1:
        value = ", ".join(f"{name} [{columns.units[name]}]" for name in kinds)
        raise ModelError(Problem(columns.header, value, "all must be the same quantity per torque"))
    return values, next(iter(kinds.values()))
