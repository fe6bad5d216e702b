"""How the axes of a study are drawn: where their values stand, how they are labelled, what they are called.

In maps every value takes one cell, in order; a linear or logarithmic range is then drawn as such. An axis of several
paths is labelled with the values of the first of them.

Takes the Dataset of a study; gives positions and words to maps and sweeps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearrattle.plots.numerals import numeral
from gearrattle.studies.boundary import is_logarithmic
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

Ticks = tuple[tuple[float, str], ...]


def paths_of(data: xr.Dataset, axis: str) -> list[str]:
    """What varies along an axis: the axis itself, or the paths that vary together in it, by name."""
    return sorted(str(name) for name, values in data.coords.items() if values.dims == (axis,) and name != axis) or [
        axis
    ]


def title_of(data: xr.Dataset, axis: str) -> str:
    """Name of an axis, and what its labels are if it takes several paths."""
    paths = paths_of(data, axis)
    return axis if paths == [axis] else f"{axis}: {paths[0]}"


def labels_of(data: xr.Dataset, axis: str) -> list[str]:
    """Words for every value of an axis."""
    values = np.asarray(data[paths_of(data, axis)[0]].values)
    return [numeral(float(v), 3) for v in values] if values.dtype.kind in "iuf" else [str(v) for v in values]


def cell_ticks(labels: list[str], most: int) -> Ticks:
    """Labels at the middle of cells 0, 1, 2, ...: all, or as many as there is room for."""
    step = max(1, -(-len(labels) // most))
    return tuple((float(i), labels[i]) for i in range(0, len(labels), step))


def positions(data: xr.Dataset, axis: str) -> tuple[Array, bool, Ticks]:
    """Where the values of an axis stand in a sweep, whether its scale is logarithmic, and its labels.

    Numbers stand at their values; words, or values that do not ascend, one after the other.
    """
    values = np.asarray(data[paths_of(data, axis)[0]].values)
    if values.dtype.kind not in "iuf" or np.any(np.diff(values.astype(np.float64)) <= 0.0):
        return np.arange(len(values), dtype=np.float64), False, cell_ticks(labels_of(data, axis), 9)
    numbers = values.astype(np.float64)
    if not is_logarithmic(numbers):
        return numbers, False, ()
    step = max(1, -(-len(numbers) // 9))
    return numbers, True, tuple((float(v), numeral(float(v), 3)) for v in numbers[::step])


def edges_of(x: Array, log: bool) -> Array:
    """Limits (N + 1,) of cells about N ascending positions: halfway, on a logarithmic axis by ratio."""
    at = np.log(x) if log else x
    if at.size < 2:
        room = 0.5 * abs(float(at[0])) or 0.5
        inner, ends = np.zeros(0), (at[0] - room, at[0] + room)
    else:
        inner = 0.5 * (at[:-1] + at[1:])
        ends = (2.0 * at[0] - inner[0], 2.0 * at[-1] - inner[-1])
    edges = np.concatenate([[ends[0]], inner, [ends[1]]])
    return np.asarray(np.exp(edges) if log else edges)
