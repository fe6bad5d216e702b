"""Axes of a study: the values that are varied, by paths of the model file, as plain numbers in SI.

An axis takes one path through its values, or several paths together, value by value. Values stand as a list, or as a
range: from, to, count, spacing "linear" or "log". Each is read as the model file reads it, units and all; what the
model refuses an axis refuses, before anything runs.

A path may be a pattern, ``inertia.*.drag_torque``, and values may be factors of what the model says, a list or a range
under the key ``factor``. An axis keeps both: the request, which names its coordinate, and plain values by plain
paths, which is all that cases are made of.

Values may be an array of NumPy, a Series of pandas or a DataArray of xarray; the attribute ``units`` of the latter two
counts.
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
from gearrattle.model.factors import FACTOR, factor_in, is_factor
from gearrattle.model.path_values import Varied
from gearrattle.model.table import did_you_mean, shown
from gearrattle.model.value_kinds import AnyTable, Choice, Count, checked

RANGE = ("from", "to", "count", "spacing")
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
    """Axis of a study: one path, or several that vary together.

    Attributes
    ----------
    name
        of its coordinate: its path, or what the user calls several paths together.
    values
        by plain path, equally many: what the model is given; numbers are SI.
    asked
        by path as it was asked for, such as a pattern, equally many: values in SI, or factors; None: ``values``.
    """

    name: str
    values: Mapping[str, tuple[Any, ...]]
    asked: Mapping[str, tuple[Any, ...]] | None = None
    by_factor: frozenset[str] = frozenset()

    def __len__(self) -> int:
        return len(next(iter(self.values.values())))

    @property
    def coordinates(self) -> Mapping[str, tuple[Any, ...]]:
        """Names of its paths in a Dataset, with their values or factors."""
        return self.values if self.asked is None else self.asked

    @property
    def coordinate(self) -> tuple[Any, ...]:
        """Its values, or the factors of all its paths; 0, 1, 2, ... if several paths take different ones."""
        first, *others = self.coordinates.values()
        by_one_factor = self.by_factor == self.coordinates.keys() and all(other == first for other in others)
        return first if not others or by_one_factor else tuple(range(len(self)))

    def at(self, index: int) -> dict[str, Any]:
        """Return the changes of the model at one of its values."""
        return {path: values[index] for path, values in self.values.items()}

    def requested(self) -> dict[str, list[Any]]:
        """Return its values as ``axes_of`` takes them: by path as it was asked for."""
        return {
            path: [Varied(path, path in self.by_factor).change(value) for value in values]
            for path, values in self.coordinates.items()
        }


def axes_of(requested: Mapping[str, Any], model: Model) -> tuple[Axis, ...]:
    """Read axes: by path a list of values or a range; by another name a mapping from paths to such lists.

    A ModelError has all paths that lead nowhere, values the model refuses, and ranges without sense.
    """
    problems: list[Problem] = []
    axes = []
    # one path, or several that vary together under a name
    for name, values in checked(AnyTable(), requested, "axes").items():
        several = isinstance(values, Mapping) and not set(values) & {*RANGE, FACTOR}
        problems += _wrong_name(name) if several else []
        by_path = dict(values) if several else {name: values}
        read: dict[Varied, tuple[Any, ...]] = {}
        # read values and factors of every path
        for path, entry in by_path.items():
            try:
                inner, by_factor = without_factor(path, entry)
                varied = Varied(path, by_factor)
                read[varied] = values_of(path, inner, partial(varied.read, model=model))
            except ModelError as error:
                problems += [Problem(f"axis {name}: {p.place}", p.value, p.rule, p.remedy) for p in error.problems]
        # equally many values
        lengths = {len(entries) for entries in read.values()}
        if len(lengths) > 1:
            rule = "paths that vary together must have equally many values"
            problems.append(Problem(f"axis {name}", ", ".join(map(str, sorted(lengths))), rule))
        try:
            axes += [_axis(name, read, model)] if read else []
        except ModelError as error:
            problems += [Problem(f"axis {name}: {p.place}", p.value, p.rule, p.remedy) for p in error.problems]
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


def _axis(name: str, read: Mapping[Varied, tuple[Any, ...]], model: Model) -> Axis:
    """Make an axis of values that were read; ModelError where two of its paths mean the same value."""
    by_path = [varied.spread(values, model) for varied, values in read.items()]
    check_once([path for spread in by_path for path in spread])
    values = {path: column for spread in by_path for path, column in spread.items()}
    asked = {varied.path: column for varied, column in read.items()}
    by_factor = frozenset(varied.path for varied in read if varied.by_factor)
    return Axis(name, values, None if asked == values else asked, by_factor)


def check_once(paths: Sequence[str]) -> None:
    """Refuse values that are varied twice with a ModelError that names all of them."""
    twice = sorted({path for path in paths if paths.count(path) > 1})
    if twice:
        raise ModelError([Problem(path, "", "is varied twice", "name it in one axis alone") for path in twice])


def without_factor(path: str, entry: Any) -> tuple[Any, bool]:
    """Return the content of ``{ factor = ... }``, or the numbers of factors in a list or range; and whether it is one.

    ModelError: factors among other values, or keys beside ``factor``.
    """
    if isinstance(entry, Mapping) and FACTOR in entry and "distribution" not in entry:
        if len(entry) > 1:
            others = ", ".join(str(key) for key in entry if key != FACTOR)
            rule = f"has keys beside {FACTOR}"
            remedy = f"{FACTOR} = {{ from = 1, to = 10, count = 5 }}"
            raise ModelError(Problem(path, others, rule, remedy))
        return entry[FACTOR], True
    ends = ("from", "to")
    is_range = isinstance(entry, Mapping)
    values = [entry[key] for key in ends if key in entry] if is_range else listed_values(entry)
    factors = [is_factor(value) for value in values]
    if not any(factors):
        return entry, False
    if not all(factors):
        raise ModelError(Problem(path, "", "has factors and other values", "give factors alone, or values alone"))
    if is_range:
        return {key: factor_in(value).times if key in ends else value for key, value in entry.items()}, True
    return [factor_in(value).times for value in values], True


def values_of(path: str, entry: Any, read: Callable[[Any], Any]) -> tuple[Any, ...]:
    """Return the values of a list, or of a range: a mapping with from, to, count, spacing.

    ``read`` takes a value as written, gives it in SI, and refuses with ModelError. A ModelError as well for what is
    neither of them, and for a range without sense.
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
    unknown = [key for key in table if key not in RANGE]
    if unknown:
        remedy = did_you_mean(unknown[0], RANGE)
        raise ModelError(Problem(path, unknown[0], f"a range has {', '.join(RANGE)}", remedy))
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
