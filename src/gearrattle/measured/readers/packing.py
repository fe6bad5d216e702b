"""Packed numbers and missing values in HDF5 and netCDF, as the attributes of a variable describe them.

A value is ``scale_factor`` times the stored number plus ``add_offset``. Stored numbers equal to ``_FillValue`` or
``missing_value``, or outside of ``valid_range``, ``valid_min`` and ``valid_max``, are gaps. Conventions: CF 1.11,
sections 2.5.1 and 8.1; NetCDF Users Guide, appendix A (``_Unsigned``, the type of ``valid_range``, netCDF's own fills).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.recording import Array

PIECE = 250_000
"""Numbers converted at once: temporary arrays of this size are small against a long record."""
ATTRIBUTES = (
    *("scale_factor", "add_offset", "_FillValue", "missing_value"),
    *("valid_range", "valid_min", "valid_max", "_Unsigned"),
)
"""Attributes that say how stored numbers become values."""
FILLS = {
    "i1": -127.0,
    "u1": 255.0,
    "i2": -32767.0,
    "u2": 65535.0,
    "i4": -2147483647.0,
    "u4": 4294967295.0,
    "i8": -9223372036854775806.0,
    "u8": 18446744073709551614.0,
    "f4": 9.969209968386869e36,
    "f8": 9.969209968386869e36,
}
"""What netCDF stores where nothing was written, by the type of the numbers."""


class Packing(NamedTuple):
    """Conversion of stored numbers to values; a number outside of a range is a gap."""

    scale: float = 1.0
    offset: float = 0.0
    missing: tuple[float, ...] = ()  # stored numbers that are gaps
    stored_range: tuple[float, float] = (-np.inf, np.inf)  # least and greatest valid stored number
    value_range: tuple[float, float] = (-np.inf, np.inf)  # least and greatest valid value
    wraps: float = 0.0  # added to stored numbers below zero: 2^bits where signed numbers stand for unsigned ones

    @property
    def scales(self) -> bool:
        """Whether values differ from the stored numbers."""
        return self.scale != 1.0 or self.offset != 0.0


def packing_of(attributes: Mapping[str, Any], kind: np.dtype[Any], fill: float, location: str) -> Packing:
    """Return the packing of a variable by its attributes.

    A ModelError refuses a scale or an offset that is no finite number, and a scale of zero.
    """
    # scale and offset; unsigned numbers that the file stores as signed ones
    scale = _factor(attributes, "scale_factor", 1.0, location)
    offset = _factor(attributes, "add_offset", 0.0, location)
    unsigned = kind.kind == "i" and _text(attributes.get("_Unsigned", "")).lower() == "true"
    wraps = 2.0 ** (8 * kind.itemsize) if unsigned else 0.0

    def stored(name: str) -> list[float]:
        """Return the numbers of an attribute as they would be after storage and reading."""
        numbers = _numbers(attributes.get(name))
        rounded = numbers.astype(kind).astype(np.float64) if kind.kind == "f" else numbers
        return [float(x) + (wraps if x < 0.0 else 0.0) for x in rounded]

    # stored numbers that are gaps
    missing = [x for name in ("_FillValue", "missing_value") for x in stored(name)]
    if "_FillValue" not in attributes and fill == FILLS.get(f"{kind.kind}{kind.itemsize}"):
        missing.append(fill + (wraps if fill < 0.0 else 0.0))
    # the valid range, of stored numbers or of values
    both = stored("valid_range")
    lowest, highest = both if len(both) == 2 else (-np.inf, np.inf)
    for lower in stored("valid_min")[:1]:
        lowest = max(lowest, lower)
    for upper in stored("valid_max")[:1]:
        highest = min(highest, upper)
    of_values = kind.kind in "iu" and any(
        getattr(attributes.get(name), "dtype", np.dtype("i8")).kind == "f"
        for name in ("valid_range", "valid_min", "valid_max")
    )
    ranges = {"value_range" if of_values else "stored_range": (lowest, highest)}
    return Packing(scale, offset, tuple(missing), wraps=wraps, **ranges)


def unpack(numbers: Array, packing: Packing) -> None:
    """Convert stored numbers (N,) to values in place; gaps become NaN."""
    if packing == Packing():
        return
    for begin in range(0, numbers.size, PIECE):
        part = numbers[begin : begin + PIECE]
        if packing.wraps:
            part[part < 0.0] += packing.wraps
        gaps = _outside(part, packing.stored_range)
        for number in packing.missing:
            gaps |= part == number
        if packing.scales:
            part *= packing.scale
            part += packing.offset
        gaps |= _outside(part, packing.value_range)
        part[gaps] = np.nan


def _outside(numbers: Array, limits: tuple[float, float]) -> NDArray[np.bool_]:
    return (numbers < limits[0]) | (numbers > limits[1])


def _factor(attributes: Mapping[str, Any], name: str, default: float, location: str) -> float:
    """Return a scale or an offset; a ModelError refuses an attribute that is no finite number."""
    if name not in attributes:
        return default
    numbers = _numbers(attributes[name])
    number = float(numbers[0]) if numbers.size == 1 else np.nan
    if not np.isfinite(number) or (number == 0.0 and default != 0.0):
        rule = "must be a finite number, since it says what the stored numbers mean; a factor is not zero"
        raise ModelError(Problem(f"{location}: {name}", _text(attributes[name])[:60], rule, "correct it in the file"))
    return number


def _numbers(value: Any) -> Array:
    """Return the numbers of an attribute; an empty array if it holds none."""
    try:
        return np.asarray(_text(value) if isinstance(value, str | bytes) else value, np.float64).reshape(-1)
    except (TypeError, ValueError):
        return np.empty(0)


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
