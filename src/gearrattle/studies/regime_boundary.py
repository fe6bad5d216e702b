"""Regime boundary over the grid of a study: midpoints between neighbouring values with different codes.

The true boundary lies somewhere between the two neighbours, and both are given. Between values of a logarithmic range
the midpoint is the geometric mean, elsewhere the arithmetic one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.result import KIND
from gearrattle.studies.dataset_layout import axes_in, chosen_codes, output_in, subject_of, words_of
from gearrattle.studies.output import SEVERITY

if TYPE_CHECKING:
    import xarray as xr

CROSSING = "crossing"
_WORDS = {"long_name", "units"}


def regime_boundary(data: xr.Dataset, output: str | None = None) -> xr.Dataset:
    """Return every place of the grid where an output's code changes from one value of an axis to the next.

    Parameters
    ----------
    data
        what ``study`` returned.
    output
        of codes: "severity", "regime" or one of the whole; None for the first of these that was kept.

    Returns
    -------
    xr.Dataset
        A Dataset along "crossing": ``along``, the axis that is crossed; ``below`` and ``above``, its values on either
        side; ``from`` and ``to``, the words of the codes there; every axis (and what varies together in one) by its
        name: the values held, and on the axis crossed the midpoint; the subject and the sample, if there are any.
        Axes of words have no midpoints and are held only; neighbours without a result are passed over.

    Raises
    ------
    ModelError
        no such output.

    Examples
    --------
    >>> axes = {"mesh.gear.backlash": ["0.01 mm", "0.1 mm"], "inertia.output_gear.drag": [0.001, 0.01, 0.1]}
    >>> data = gr.study(gr.example("case1"), axes, outputs=["regime"], workers=1)
    >>> dict(gr.studies.regime_boundary(data).sizes)
    {'crossing': 2}
    """
    import xarray as xr

    # codes, and coordinates held
    codes = output_in(data, output if output is not None else chosen_codes(data) or SEVERITY, codes=True)
    words = np.array(words_of(codes))
    dims = [str(name) for name in codes.dims]
    held = _held(data, codes)
    columns: dict[str, list[NDArray[Any]]] = {}
    # changes of code from one value of an axis to the next
    for axis in axes_in(data):
        values = np.asarray(data[axis].values)
        if values.dtype.kind not in "iuf" or len(values) < 2:
            continue
        k = dims.index(axis)
        before, after = (np.moveaxis(codes.values, k, 0)[part] for part in (slice(None, -1), slice(1, None)))
        edges = np.argwhere((before != after) & (before >= 0) & (after >= 0))
        places = np.insert(edges[:, 1:], k, edges[:, 0], axis=1)
        # values on either side, midpoints along the axis
        rows = {"along": np.full(len(edges), axis), "below": values[edges[:, 0]], "above": values[edges[:, 0] + 1]}
        rows |= {"from": words[before[tuple(edges.T)]], "to": words[after[tuple(edges.T)]]}
        for name, (dim, column) in held.items():
            at = places[:, dims.index(dim)]
            rows[name] = midpoints(column)[at] if dim == axis and column.dtype.kind in "iuf" else column[at]
        for name, column in rows.items():
            columns.setdefault(name, []).append(column)
    # table of crossings
    joined = {name: (CROSSING, np.concatenate(parts)) for name, parts in columns.items()}
    subject = subject_of(data, str(codes.name))
    changes = xr.Dataset(joined, attrs={KIND: "regime boundary", "output": str(codes.name), "subject": subject})
    for name in sorted(held.keys() & data.variables.keys() & changes.keys()):
        changes[name].attrs = {key: data[name].attrs[key] for key in sorted(_WORDS & data[name].attrs.keys())}
    return changes


def _held(data: xr.Dataset, codes: xr.DataArray) -> dict[str, tuple[str, NDArray[Any]]]:
    """Every coordinate of an output: its dimension and its values; numbers for a dimension without one."""
    dims = [str(name) for name in codes.dims]
    coordinates = {
        str(name): (str(values.dims[0]), np.asarray(values.values))
        for name, values in codes.coords.items()
        if len(values.dims) == 1 and str(values.dims[0]) in dims
    }
    return coordinates | {dim: (dim, np.arange(data.sizes[dim])) for dim in dims if dim not in coordinates}


def midpoints(values: NDArray[Any]) -> NDArray[np.float64]:
    """Return (n - 1,) what lies between neighbours: geometric means if the n values form a logarithmic range."""
    floats = np.asarray(values, dtype=np.float64)
    if is_logarithmic(floats):
        return np.asarray(np.sqrt(floats[:-1] * floats[1:]))
    return np.asarray(0.5 * (floats[:-1] + floats[1:]))


def is_logarithmic(values: NDArray[np.float64]) -> bool:
    """Whether three values or more stand at one ratio, not 1, to each other."""
    if values.size < 3 or not float(values.min()) > 0.0:
        return False
    steps = np.diff(np.log(values))
    return bool(abs(steps[0]) > 0.0 and np.all(np.abs(steps - steps[0]) <= 1e-6 * abs(steps[0])))
