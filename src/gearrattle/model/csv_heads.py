"""Names and units in the rows above the numbers of a table.

Rows of units and rows of types, such as ``f8``, are recognised by their entries. Of the other rows, the row of names is
one that has a usual name for time; otherwise one with units in brackets; otherwise one without blanks in its entries.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

_OF_TIME_OR_ANGLE = ("s", "sec", "ms", "us", "µs", "μs", "min", "h", "deg", "°", "Grad", "rad")
_OTHERS = (
    *("N", "kN", "Nm", "N*m", "N.m", "N m", "kNm", "kN*m", "rpm", "1/min", "min-1", "min^-1", "U/min", "rev/min"),
    *("r/min", "Upm", "1/s", "rad/s", "deg/s", "°/s", "rad/s2", "rad/s^2", "rad/s²", "Hz", "kHz", "V", "mV", "A", "mA"),
    *("m", "mm", "um", "µm", "m/s", "km/h", "m/s2", "m/s^2", "m/s²", "g", "g_n", "Pa", "kPa", "MPa", "hPa", "bar"),
    *("mbar", "°C", "degC", "K", "kg", "W", "kW", "J", "%", "dB", "dB(A)", "-", "--", "1", "l/min", "kg/h"),
)
_TYPE = re.compile(
    r"[<>|=]?[fiuUSbc]\d{1,3}|(float|double|single|real|u?int|integer|long|short|byte|bool|boolean|str|string|text|"
    r"number|numeric|date|datetime|object|char)\d{0,3}",
    re.IGNORECASE,
)
_TIME = re.compile(r"t|time|zeit|time ?stamps?|zeitstempel|uhrzeit|date|datum|date/?time", re.IGNORECASE)
_BRACKETS = re.compile(r"([^\[\]]*?)\s*\[([^\[\]]*)\]")
_PARENTHESES = re.compile(r"(.*?\S)\s*\((?!\d*\))([^()]*)\)")
_FORMULA = ("=", "+", "-", "@")


class Head(NamedTuple):
    """Name and unit of a column; the unit is None if the file has none."""

    name: str
    unit: str | None


def heads_of(rows: Sequence[Sequence[str]]) -> tuple[tuple[Head, ...], int, int | None]:
    """Return names and units of columns, and the indices of the rows with these, from the rows above the numbers."""
    filled = [index for index, row in enumerate(rows) if any(row)] or [len(rows) - 1]
    words = [index for index in filled if not _are_types(rows[index])]
    if all(_are_units(rows[index]) for index in words):
        words = filled  # all rows look like types: they may be names such as f1, f2
    units = [index for index in words if _are_units(rows[index]) and not _is_timed(rows[index])]
    names = max(words, key=lambda index: _likeness(rows, index, units))
    heads = tuple(_head(cell) for cell in rows[names])
    units = [index for index in words if index != names and _are_units(rows[index])]
    if not units:
        return heads, names, None
    best = max(units, key=lambda index: (sum(map(_is_unit, rows[index])), -abs(index - names)))
    own_units = (_unit(cell) for cell in rows[best])
    return tuple(Head(head.name, unit or head.unit) for head, unit in zip(heads, own_units, strict=True)), names, best


def is_name_of_time(name: str) -> bool:
    """Whether a name is usual for a column of times or time stamps."""
    return _TIME.fullmatch(name) is not None


def defused(name: str) -> str:
    """Return a name that is safe in the head of a CSV file: spreadsheets take text after =, +, - or @ as a formula."""
    return f"'{name}" if name[:1] in _FORMULA else name


def _likeness(rows: Sequence[Sequence[str]], index: int, units: Sequence[int]) -> tuple[float, ...]:
    """Return a sort key; the row of names has the largest.

    Of two rows with a name for time, the row with fewer letters is preferred; of two other rows, the row nearest above
    the units, or the last one.
    """
    row = rows[index]
    heads = [_head(cell) for cell in row]
    timed = _is_timed(row)
    bracketed = any(head.name and head.unit is not None for head in heads)
    told_apart = len({cell for cell in row if cell}) == len(row) and not any(cell[:1].isdigit() for cell in row)
    blanks = sum(" " in head.name for head in heads)
    above = index < units[-1] if units else True
    order = -sum(map(len, row)) if timed else index
    return timed or not _are_units(row), timed, bracketed, told_apart, -blanks, above, order


def _is_timed(row: Sequence[str]) -> bool:
    """Whether a row has a usual name for time."""
    return any(is_name_of_time(_head(cell).name) for cell in row)


def _are_types(row: Sequence[str]) -> bool:
    """Whether a row holds types."""
    return any(row) and all(_TYPE.fullmatch(cell) for cell in row if cell)


def _are_units(row: Sequence[str]) -> bool:
    """Whether a row has a unit of time or angle, or only units."""
    entries = [cell for cell in row if cell]
    if any(_unit(cell) in _OF_TIME_OR_ANGLE for cell in entries):
        return True
    return all(map(_is_unit, entries)) and any(len(cell) > 1 for cell in entries)


def _is_unit(cell: str) -> bool:
    return _unit(cell) != cell or cell in _OF_TIME_OR_ANGLE or cell in _OTHERS


def _unit(cell: str) -> str:
    """Return a unit without the brackets around it."""
    pairs = ("[]", "()")
    return next((cell[1:-1].strip() for pair in pairs if cell[:1] + cell[-1:] == pair), cell)


def _head(cell: str) -> Head:
    """Return name and unit of ``name [unit]`` or ``name (unit)``."""
    cell = cell[1:] if cell[:1] == "'" and cell[1:2] in _FORMULA else cell
    for form in (_BRACKETS, _PARENTHESES):
        if match := form.fullmatch(cell):
            return Head(match[1].strip(), match[2].strip())
    return Head(cell, None)
