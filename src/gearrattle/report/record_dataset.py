"""Records (dataclasses or mappings) as a Dataset: one variable per field, one row per record."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


def records_dataset(
    records: Sequence[Any],
    dimension: str,
    *,
    prefix: str = "",
    names: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
) -> xr.Dataset:
    """Return ``record_columns`` as a Dataset."""
    import xarray as xr

    return xr.Dataset(record_columns(records, dimension, prefix=prefix, names=names, units=units))


def record_columns(
    records: Sequence[Any],
    dimension: str,
    *,
    prefix: str = "",
    names: Sequence[str] = (),
    units: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Return the fields of records that are numbers or text, each as a variable over one dimension, for ``Arrays``.

    Records are dataclasses of one kind, or mappings with the same keys. None among numbers becomes NaN; fields of
    another type are left out. ``names`` are the fields to take, by default all.
    """
    columns = {}
    rows = [
        record if isinstance(record, Mapping) else {field.name: getattr(record, field.name) for field in fields(record)}
        for record in records
    ]
    for name in rows[0] if rows else ():
        values = [row[name] for row in rows]
        if names and name not in names:
            continue
        if all(value is None or isinstance(value, bool | int | float | np.number) for value in values):
            whole = all(isinstance(value, bool | int) for value in values)
            column = np.array([math.nan if value is None else value for value in values], np.int64 if whole else float)
        elif all(isinstance(value, str) for value in values):
            column = texts(values)
        else:
            continue
        unit = (units or {}).get(name)
        columns[f"{prefix}{name}"] = (dimension, column, {"units": unit} if unit else {})
    return columns


def number_columns(name: str, word: str, values: Sequence[float | str], dimension: str) -> dict[str, Any]:
    """Return numbers or words as two variables: numbers (NaN for words) and words (empty for numbers)."""
    return {
        name: (dimension, [math.nan if isinstance(value, str) else value for value in values]),
        word: (dimension, texts(value if isinstance(value, str) else "" for value in values)),
    }


def stacked(rows: Sequence[Any]) -> Any:
    """Return rows of numbers as one array (m, longest), shorter rows filled with NaN."""
    table = np.full((len(rows), max((len(row) for row in rows), default=0)), math.nan)
    for target, row in zip(table, rows, strict=True):
        target[: len(row)] = row
    return table


def texts(words: Iterable[str]) -> Any:
    """Return text as an array that netCDF can hold."""
    return np.array(list(words), dtype=np.str_)
