"""The axes of a study in figures: positions of the values, their labels, and titles.

Words and SI units are in the attributes ``long_name`` and ``units`` of the Dataset (``model.path_labels``); here units
get a prefix that suits the values, and the reference speed is in rpm. In maps every value has one cell, in order. An
axis over several paths is labelled with the values of the first path.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gearrattle.model.path_labels import in_shown_unit
from gearrattle.report.plots.numerals import numeral, quantity
from gearrattle.studies.regime_boundary import is_logarithmic
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

Ticks = tuple[tuple[float, str], ...]
_FEWEST = 3  # significant digits of a label
_MOST = 6  # significant digits of a label


def paths_of(data: xr.Dataset, axis: str) -> list[str]:
    """Return the paths that vary along an axis, by name: the axis itself, or several that vary together in it."""
    return sorted(str(name) for name, values in data.coords.items() if values.dims == (axis,) and name != axis) or [
        axis
    ]


class Measure(NamedTuple):
    """Name of a variable of a study in words, and the unit in which its numbers are shown.

    Attributes
    ----------
    unit
        e.g. ``"mm"``; empty for counts, ratios, words, and in dimensionless models.
    factor
        shown number per number of the Dataset.
    """

    words: str
    unit: str
    factor: float

    @property
    def title(self) -> str:
        """Words with the unit in brackets."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words

    def with_unit(self, value: object, digits: int = 4) -> str:
        """Return a value of the Dataset in words, with its unit."""
        if not isinstance(value, int | float | np.number):
            return str(value)
        return quantity(float(value) * self.factor, self.unit, digits)


def measure_of(data: xr.Dataset, name: str) -> Measure:
    """Return the name of a variable or coordinate in words, with a unit that suits its values."""
    if name not in data.variables:
        return Measure(name, "", 1.0)
    values = np.asarray(data[name].values)
    attributes = data[name].attrs
    words = str(attributes.get("long_name", name))
    unit = str(attributes.get("units", ""))
    if values.dtype.kind not in "iuf" or unit in ("", "1"):
        return Measure(words, "", 1.0)
    finite = np.abs(values[np.isfinite(values)])
    return measure_at(name, words, unit, float(finite.max(initial=0.0)))


def measure_at(path: str, words: str, unit: str, largest: float) -> Measure:
    """Return the measure of numbers up to a size, in an SI unit, at a path: the reference speed is in rpm."""
    factor, shown = in_shown_unit(path, unit, largest)
    return Measure(words, shown, factor)


def title_of(data: xr.Dataset, axis: str) -> str:
    """Words and unit of an axis, after its own name if it takes several paths."""
    paths = paths_of(data, axis)
    title = measure_of(data, paths[0]).title
    return title if paths == [axis] else f"{axis}: {title}"


def words_of_axis(data: xr.Dataset, axis: str) -> str:
    """Return the name of an axis for a sentence."""
    return measure_of(data, axis).words


def labels_of(data: xr.Dataset, axis: str) -> list[str]:
    """Labels for every value of an axis, in the unit of its title, with enough digits to distinguish them."""
    path = paths_of(data, axis)[0]
    values = np.asarray(data[path].values)
    if values.dtype.kind not in "iuf":
        return [str(v) for v in values]
    factor = measure_of(data, path).factor
    for digits in range(_FEWEST, _MOST + 1):
        labels = [numeral(float(v) * factor, digits) for v in values]
        if len(set(labels)) == len(set(values.tolist())):
            break
    return labels


def cell_ticks(labels: list[str], most: int) -> Ticks:
    """Labels at the middle of cells 0, 1, 2, ...: all of them, or at most ``most``."""
    step = max(1, -(-len(labels) // most))
    return tuple((float(i), labels[i]) for i in range(0, len(labels), step))


def positions(data: xr.Dataset, axis: str) -> tuple[Array, bool, Ticks]:
    """Return positions of an axis' values in a sweep, whether its scale is logarithmic, and its labels."""
    values = np.asarray(data[paths_of(data, axis)[0]].values)
    if values.dtype.kind not in "iuf" or np.any(np.diff(values.astype(np.float64)) <= 0.0):
        return np.arange(len(values), dtype=np.float64), False, cell_ticks(labels_of(data, axis), 9)
    numbers = values.astype(np.float64) * measure_of(data, paths_of(data, axis)[0]).factor
    if not is_logarithmic(numbers):
        return numbers, False, ()
    step = max(1, -(-len(numbers) // 9))
    return numbers, True, tuple((float(v), numeral(float(v), 3)) for v in numbers[::step])


def edges_of(x: Array, log: bool) -> Array:
    """Limits (N + 1,) of cells about N ascending positions: halfway, on a logarithmic axis by ratio."""
    at = np.log(x) if log else x
    if at.size < 2:
        room = 0.5 * abs(float(at[0])) or 0.5
        inner = np.zeros(0)
        ends = (at[0] - room, at[0] + room)
    else:
        inner = 0.5 * (at[:-1] + at[1:])
        ends = (2.0 * at[0] - inner[0], 2.0 * at[-1] - inner[-1])
    edges = np.concatenate([[ends[0]], inner, [ends[1]]])
    return np.asarray(np.exp(edges) if log else edges)
