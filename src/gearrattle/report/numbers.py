"""The numbers of a result as files: netCDF-4 and CSV."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.formats import format_name
from gearrattle.result import KIND

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_LARGEST_TABLE = 20_000_000  # numbers
_NONE: Mapping[str, Any] = {}
_STRINGS = np.dtype("O", metadata={"vlen": str})
"""Type of texts of any length in HDF5, equal to ``h5py.string_dtype()``."""


class Arrays(NamedTuple):
    """Arrays by name, as ``xr.Dataset`` takes them; they are written without xarray, whose import takes 0.25 s.

    Attributes
    ----------
    variables
        by name, (dimensions, values) or (dimensions, values, attributes); a single dimension is a string.
    coordinates
        by dimension, the values of the coordinate, or a tuple as for a variable.
    """

    variables: Mapping[str, Any]
    coordinates: Mapping[str, Any] = _NONE
    attributes: Mapping[str, Any] = _NONE

    def dataset(self) -> xr.Dataset:
        """Return the arrays as a Dataset."""
        import xarray as xr

        return xr.Dataset(*self)


def write_netcdf(data: xr.Dataset | Arrays, path: Path, kind: str) -> None:
    """Write a Dataset, or arrays by name, with the format and the kind of result."""
    attributes = {"format": format_name("result"), KIND: kind}
    if isinstance(data, Arrays):
        _write_arrays(data._replace(attributes={**data.attributes, **attributes}), path)
    else:
        data.assign_attrs(attributes).to_netcdf(path, engine="h5netcdf")


def _write_arrays(arrays: Arrays, path: Path) -> None:
    import h5netcdf

    coordinates = {name: of if isinstance(of, tuple) else (name, of) for name, of in arrays.coordinates.items()}
    with h5netcdf.File(path, "w") as file:
        for name, (dimensions, values, *attributes) in {**coordinates, **arrays.variables}.items():
            axes = (dimensions,) if isinstance(dimensions, str) else dimensions
            array = np.asarray(values)
            for axis, length in zip(axes, array.shape, strict=True):
                if axis not in file.dimensions:
                    file.dimensions[axis] = length
            if array.dtype.kind in "UO":
                variable = file.create_variable(name, axes, _STRINGS, data=array.astype(object))
            elif array.dtype.kind == "b":  # netCDF has no booleans; xarray reads this as boolean
                variable = file.create_variable(name, axes, np.int8, data=array.astype(np.int8))
                variable.attrs["dtype"] = "bool"
            else:
                variable = file.create_variable(name, axes, array.dtype, data=array)
            variable.attrs.update(*attributes)
        file.attrs.update(arrays.attributes)


def write_csv(data: xr.Dataset, path: Path) -> None:
    """Write a Dataset as one table; ModelError for more than twenty million numbers."""
    count = count_of_numbers(data)
    if count > _LARGEST_TABLE:
        raise ModelError(Problem("path", f'"{path.name}"', f"would be a table of {count} numbers", "save it as .nc"))
    table_of_numbers(data).to_csv(path, index=False)


def count_of_numbers(data: xr.Dataset) -> int:
    """Return how many numbers the variables of a Dataset have."""
    return sum(int(variable.size) for variable in data.data_vars.values())


def table_of_numbers(data: xr.Dataset) -> pd.DataFrame:
    """Return a Dataset as one table.

    If all variables have the same dimensions, the columns are the coordinates and then the variables, with units in the
    head. Otherwise every number has a row: quantity, coordinates, value, unit.
    """
    shapes = {variable.dims for variable in data.data_vars.values() if variable.dims}
    return _wide(data) if len(shapes) == 1 else _long(data)


def _wide(data: xr.Dataset) -> pd.DataFrame:
    """A row for every combination of coordinates, a column for every variable, with its unit."""
    frame = data.to_dataframe().reset_index()
    units = {str(name): str(data[name].attrs.get("units", "")) for name in frame.columns if name in data.variables}
    return frame.rename(columns={name: f"{name} [{unit}]" for name, unit in units.items() if unit})


def _long(data: xr.Dataset) -> pd.DataFrame:
    """A row for every number: name of the quantity, coordinates, value and unit."""
    import pandas as pd

    frames = []
    for name, variable in data.data_vars.items():
        series = variable.to_series() if variable.dims else pd.Series([variable.item()])
        series = series.rename_axis(index={name: f"name of {name}" for name in ("quantity", "value", "unit")})
        frame = series.rename("value").reset_index() if variable.dims else series.to_frame("value")
        frames.append(frame.assign(quantity=str(name), unit=str(variable.attrs.get("units", ""))))
    joined = pd.concat(frames, ignore_index=True)
    coordinates = [name for name in joined.columns if name not in ("quantity", "value", "unit")]
    return joined[["quantity", *coordinates, "value", "unit"]]
