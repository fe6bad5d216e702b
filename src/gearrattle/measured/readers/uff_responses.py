"""Frequency responses of a universal file: complex functions of dataset 58 over frequency, with their units.

Specific data types of the axes say what they are: 18 a frequency, 15 a pressure, 13 an excitation force, 9 a reaction
force; the direction of the reference (1, 2, 3: x, y, z; negative: against it) is that of the force. Source: as ``uff``.
"""

from __future__ import annotations

from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.files import opened, within_limit
from gearrattle.measured.readers.uff import _axis, _first_number, _record_7, _unit
from gearrattle.measured.readers.uff_blocks import (
    HEADER,
    Block,
    Samples,
    blocks,
    check_count,
    read_bytes_of,
    read_text_of,
)
from gearrattle.model import units
from gearrattle.model.units import PRESSURE_PER_FORCE, UnitError, convert
from gearrattle.recording import Array

_COMPLEX = {5: 13, 6: 20}  # width of a number in a text by kind: single and double precision
_FREQUENCY = 18  # specific data type of an abscissa
_PRESSURE = 15
_FORCES = (9, 13)
_DIRECTION = slice(76, 80)  # of the reference, in record 6


class Response(NamedTuple):
    """A frequency response.

    Attributes
    ----------
    frequency
        (K,) [Hz].
    value
        (K,) complex [Pa/N].
    direction
        of the force: 1, 2, 3 along x, y, z, negative against it; 0 unknown.
    """

    name: str
    frequency: Array
    value: NDArray[np.complex128]
    direction: int


def responses(path: Path) -> list[Response]:
    """Return all responses of a pressure to a force; ModelError for units that are none of it, and damaged numbers."""
    known: list[Response] = []
    with opened(path) as stream:
        for position, block in enumerate(list(blocks(stream, path)), 1):
            if block.number == 58 and len(block.lines) >= HEADER:
                response = _response(stream, block, f"{path}: dataset {position}")
                known += [] if response is None else [response]
    return known


def _response(stream: BinaryIO, block: Block, location: str) -> Response | None:
    """Return the frequency response of a dataset; None where it is another function."""
    # header: complex values over a frequency
    kind, count, even, first, step = _record_7(block.lines[6], location)
    abscissa = _axis(block.lines[7])
    if kind not in _COMPLEX or abscissa.kind not in (0, 1, _FREQUENCY) or count < 2:
        return None
    factor = _factor(block, location)
    # numbers: pairs of real and imaginary part, each with its frequency where these are not even
    numbers = count * (2 if even else 3)
    within_limit(8 * numbers)
    samples = Samples(np.empty(numbers), None)
    width = check_count(block, numbers, numbers, location)
    if block.order and not even:
        rule = "binary numbers at uneven frequencies are not read"
        raise ModelError(Problem(location, "uneven spacing", rule, "export it as text, or at equal spacing"))
    if block.order:
        read_bytes_of(stream, block, width, samples)
    else:
        read_text_of(stream, block, _COMPLEX[kind], samples, location)
    table = samples.values.reshape(count, -1)
    if not np.isfinite(table).all():
        raise ModelError(Problem(location, "NaN", "must be finite at every frequency", "cut it, or measure again"))
    # frequency, value and direction
    frequency: Array = np.asarray(first + step * np.arange(count) if even else table[:, 0], dtype=np.float64)
    try:
        frequency = frequency * convert(f"1 {abscissa.unit or 'Hz'}", units.FREQUENCY)
    except UnitError as error:
        raise ModelError(Problem(f"{location}, record 8", abscissa.unit, error.rule, error.remedy)) from None
    value = np.asarray(factor * (table[:, -2] + 1j * table[:, -1]), dtype=np.complex128)
    return Response(block.lines[0].strip(), frequency, value, _first_number(block.lines[5][_DIRECTION]))


def _factor(block: Block, location: str) -> float:
    """Return the factor of the values to Pa/N; ModelError where they are something else, or nothing says what."""
    unit = _unit(block)
    numerator = _axis(block.lines[8]).kind
    denominator = _axis(block.lines[9]).kind
    if not unit and numerator == _PRESSURE and denominator in _FORCES:
        unit = "Pa/N"
    if not unit:
        rule = "does not say what it is: a path needs a pressure per force"
        raise ModelError(Problem(f"{location}, records 9 and 10", "no unit", rule, "export it with units, or as CSV"))
    try:
        return convert(f"1 {unit}", PRESSURE_PER_FORCE)
    except UnitError as error:
        remedy = error.remedy or "such as Pa over N"
        raise ModelError(Problem(f"{location}, records 9 and 10", unit, error.rule, remedy)) from None
