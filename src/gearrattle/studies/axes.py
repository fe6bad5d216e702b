"""Axes of a study: what is varied, by paths of the model file, as plain numbers in SI.

An axis takes one path through its values, or several paths together, value by value. Values stand as a list, or as a
range: from, to, count, spacing "linear" or "log". Each is read as the model file reads it, units and all; what the
model refuses an axis refuses, before anything runs.

Values may be an array of NumPy, a Series of pandas or a DataArray of xarray; the attribute ``units`` of the latter two
counts.

Takes mappings; gives frozen axes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.path_values import in_si
from gearrattle.model.quantity import AnyTable, Choice, Count, checked
from gearrattle.model.table import did_you_mean, shown

_RANGE = ("from", "to", "count", "spacing")
SPACING = Choice(("linear", "log"))
_MOST_VALUES = 10_000_000
_NAME = re.compile(r"[\w-]+( [\w-]+)*")
_LONGEST_NAME = 60
_TAKEN = frozenset(
    (
        "sample",
        "part",
        "inertia",
        "cycle",
        "direction",
        "design",
        "objective",
        "generation",
        "attractor",
        "multiplier",
        "outcome",
        "verdict",
        "verdict severity",
        "regime",
        "severity",
        "motion",
        "motions",
        "period",
        "basin",
        "share",
    )
)
"""Dimensions and variables of the Datasets of studies."""


@dataclass(frozen=True)
class Axis:
    """One axis.

    Attributes
    ----------
    name
        of its coordinate: its path, or what the user calls several paths together.
    values
        by path, equally many: what the model is given; numbers are SI.
    """

    name: str
    values: Mapping[str, tuple[Any, ...]]

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))

    @property
    def coordinate(self) -> tuple[Any, ...]:
        """Its values; 0, 1, 2, ... if it takes several paths."""
        return next(iter(self.values.values())) if len(self.values) == 1 else tuple(range(len(self)))

    def at(self, index: int) -> dict[str, Any]:
        """Return what it changes at one of its values."""
        return {path: values[index] for path, values in self.values.items()}


def axes_of(requested: Mapping[str, Any], model: Model) -> tuple[Axis, ...]:
    """Read axes.

    Parameters
    ----------
    requested
        by path a list of values or a range; by another name a mapping from paths to such lists.
    model
        what they vary.

    Raises
    ------
    ModelError
        a path that leads nowhere, values the model refuses, a range without sense; all of them.
    """
    problems: list[Problem] = []
    axes = []
    for name, values in checked(AnyTable(), requested, "axes").items():
        several = isinstance(values, Mapping) and not set(values) & set(_RANGE)
        problems += _wrong_name(name) if several else []
        by_path = dict(values) if several else {name: values}
        read: dict[str, tuple[Any, ...]] = {}
        for path, entry in by_path.items():
            try:
                read[path] = values_of(path, entry, partial(_read, path, model))
            except ModelError as error:
                problems += [Problem(f"axis {name}: {p.place}", p.value, p.rule, p.remedy) for p in error.problems]
        lengths = {len(entries) for entries in read.values()}
        if len(lengths) > 1:
            rule = "paths that vary together must have equally many values"
            problems.append(Problem(f"axis {name}", ", ".join(map(str, sorted(lengths))), rule))
        if read:
            axes.append(Axis(name, read))
    if problems:
        raise ModelError(problems)
    return tuple(axes)


def _wrong_name(name: object) -> list[Problem]:
    """Return the problem of a name for several paths; it becomes a dimension, and a file where the study is kept."""
    if not isinstance(name, str) or _NAME.fullmatch(name) is None or len(name) > _LONGEST_NAME:
        rule = f"the name of several paths has letters, digits, _, - and single blanks, {_LONGEST_NAME} at most"
        return [Problem(f"axis {shown(name)}", "", rule, "or give one path and its values")]
    if name in _TAKEN:
        return [Problem(f"axis {name}", "", "the results of studies use this name", "choose another")]
    return []


def _read(path: str, model: Model, value: Any) -> Any:
    return in_si(path, value, model)


def values_of(path: str, entry: Any, read: Callable[[Any], Any]) -> tuple[Any, ...]:
    """Return the values of a list or a range.

    Parameters
    ----------
    path
        what they are of, for messages.
    entry
        a list, or a mapping with from, to, count, spacing.
    read
        takes a value as written, gives it in SI, refuses with ModelError.

    Raises
    ------
    ModelError
        neither of them, a range without sense, or what ``read`` refuses.
    """
    if isinstance(entry, Mapping):
        return _ranged(path, entry, read)
    values = listed_values(entry)
    if not values:
        raise ModelError(Problem(path, shown(entry), "must be a list of values, or a range with from, to and count"))
    return tuple(read(value) for value in values)


def listed_values(entry: Any) -> list[Any]:
    """Return the values of a list or of an array in one dimension, numbers with the unit it names; else nothing."""
    if isinstance(entry, Sequence) and not isinstance(entry, str | bytes):
        return list(entry)
    if not hasattr(entry, "__array__"):
        return []
    array = np.asarray(entry)
    if array.ndim != 1 or array.dtype.kind not in "iufOUT":
        return []
    values: list[Any] = array.tolist()
    unit = str(getattr(entry, "attrs", {}).get("units", "")).replace(" ", "*")
    if unit in ("", "1"):
        return values
    return [value if isinstance(value, str) else f"{value!r} {unit}" for value in values]


def _ranged(path: str, table: Mapping[str, Any], read: Callable[[Any], Any]) -> tuple[float, ...]:
    unknown = [key for key in table if key not in _RANGE]
    if unknown:
        remedy = did_you_mean(unknown[0], _RANGE)
        raise ModelError(Problem(path, unknown[0], f"a range has {', '.join(_RANGE)}", remedy))
    missing = [key for key in ("from", "to", "count") if key not in table]
    if missing:
        raise ModelError(Problem(path, shown(dict(table)), f"a range needs {', '.join(missing)}"))
    count = checked(Count(2, _MOST_VALUES), table["count"], f"{path}.count")
    spacing = checked(SPACING, table.get("spacing", "linear"), f"{path}.spacing")
    ends = [read(table[key]) for key in ("from", "to")]
    if not all(isinstance(end, float | int) and not isinstance(end, bool) for end in ends):
        raise ModelError(Problem(path, shown(ends), "the ends of a range must be numbers"))
    if spacing == "log" and not min(ends) > 0.0:
        raise ModelError(Problem(path, shown(ends), 'spacing "log" needs positive ends'))
    low, high = map(float, ends)
    with np.errstate(over="ignore", invalid="ignore"):
        spaced = np.geomspace(low, high, count) if spacing == "log" else np.linspace(low, high, count)
    if not np.isfinite(spaced).all():
        raise ModelError(Problem(path, shown(ends), "the ends of a range lie too far apart for floating-point numbers"))
    return tuple(spaced.tolist())
