"""Results as values that are compared bit for bit, and what tells whether those of a killed command are right.

What is compared is every number and text of a result, but for how long it took and when it was written.

Takes paths; gives values by name, and functions that look at a place where a result may be.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.report.saved import PAGE
from gearrattle.studies.stored_studies import OUTCOME

Values = dict[str, object]
Look = Callable[[Path], float]
"""Tells how much of the results is there, 0 to 1; raises AssertionError where it is wrong."""
_OF_ALL = ("basin",)
"""Values of a case that follow from those of all others."""
_OF_THE_CLOCK = "@cost"
"""What a result says about the time that it took."""


def bits(values: Any) -> object:
    """Return what two arrays share if they are equal bit for bit: kind, shape and bytes; texts as they are."""
    array = np.asarray(values)
    return repr(array.tolist()) if array.dtype.kind == "O" else (array.dtype.str, array.shape, array.tobytes())


def values_of_file(path: Path) -> Values:
    """Return the arrays and attributes of a netCDF-4 file, by name."""
    values: Values = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            values[name] = bits(item[()])
        values.update({f"{name}@{key}": repr(value) for key, value in item.attrs.items()})

    with h5py.File(path) as file:
        file.visititems(visit)
        visit("", file)
    return {name: value for name, value in values.items() if name != _OF_THE_CLOCK}


def values_of_run(run: gr.Run) -> Values:
    """Return the arrays of a motion, by name: samples, events and the audit."""
    arrays = {f"data.{name}": bits(run.data[name].values) for name in (*run.data.variables,)}
    return arrays | {f"events.{name}": bits(run.events[name].to_numpy()) for name in run.events.columns}


def compare(actual: Values, expected: Values) -> None:
    """See that two results have the same values; say which are others."""
    names = sorted({*actual, *expected})
    other = [name for name in names if actual.get(name) != expected.get(name)]
    assert not other, f"other values: {', '.join(other[:5])}"


def content_of(folder: Path) -> dict[str, bytes]:
    """Return the files of a folder by name, but for hidden ones."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    names = {path.relative_to(folder).as_posix(): path for path in files}
    return {name: path.read_bytes() for name, path in names.items() if not name.startswith(".")}


def look_at_file(references: Sequence[Values]) -> Look:
    """Return what tells whether a file holds the values of one of some results, each of another title."""

    def looked(path: Path) -> float:
        if not path.exists():
            return 0.0
        actual = values_of_file(path)
        compare(actual, next(one for one in references if one["@title"] == actual["@title"]))
        return 1.0

    return looked


def look_at_report(references: Mapping[str, tuple[set[str], Values]]) -> Look:
    """Return what tells whether a report is wholly that of one model; of each title its files and its values."""

    def looked(folder: Path) -> float:
        if not folder.exists():
            return 0.0
        files = content_of(folder)
        title = json.loads(files["summary.json"])["model"]
        title = title["name"] if isinstance(title, dict) else title
        names, values = references[title]
        assert set(files) >= names, f"missing: {names - set(files)}"
        compare(values_of_file(folder / "results.nc"), values)
        assert title in files["report.html"].decode(), "page of the other model"
        return 1.0

    return looked


def look_at_figures(references: Sequence[Mapping[str, bytes]]) -> Look:
    """Return what tells whether figures are wholly those of one result."""

    def looked(folder: Path) -> float:
        if not folder.exists():
            return 0.0
        assert content_of(folder) in references, "a mixture of figures"
        return 1.0

    return looked


def look_at_stream(reference: Sequence[Values]) -> Look:
    """Return what tells how many chunks of a motion are there."""

    def looked(folder: Path) -> float:
        if not (folder / "state.npz").exists():
            return 0.0
        count = 0
        for run in gr.open_stream(folder):
            compare(values_of_run(run), reference[count])
            count += 1
        return count / len(reference)

    return looked


def look_at_study(reference: xr.Dataset) -> Look:
    """Return what tells how many cases of a study are there; with the page all that follows from them must be."""

    def looked(folder: Path) -> float:
        if not (folder / "results.zarr" / "zarr.json").exists() or not (folder / "done").exists():
            return 0.0
        try:
            actual = gr.open_study(folder)
        except ModelError:
            assert not list((folder / "done").glob("*.json")), "done, and cannot be read"
            return 0.0
        is_done = actual[OUTCOME].values == 1
        is_whole = (folder / PAGE).exists()
        assert is_done.all() or not is_whole, "a page of a study that is not done"
        compare(_values_of_cases(actual, is_done, is_whole), _values_of_cases(reference, is_done, is_whole))
        return float(is_done.mean())

    return looked


def _values_of_cases(data: xr.Dataset, is_done: np.ndarray[Any, Any], is_whole: bool) -> Values:
    """Return the values of the cases that are done; of a whole study those of all cases together as well."""
    if is_whole:
        return {str(name): bits(one.values) for name, one in data.variables.items()}
    axes = data[OUTCOME].dims
    of_cases = {name: one.values for name, one in data.variables.items() if one.dims[: len(axes)] == axes}
    return {str(name): bits(values[is_done]) for name, values in of_cases.items() if name not in _OF_ALL}
