"""The numbers of a result as files: netCDF-4 and CSV.

Takes Datasets; writes files.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gearrattle.errors import ModelError, Problem
from gearrattle.formats import format_name
from gearrattle.result import KIND

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_LARGEST_TABLE = 20_000_000


def write_netcdf(data: xr.Dataset, path: Path, kind: str) -> None:
    """Write a Dataset with its format and kind of result."""
    attributes = {"format": format_name("result"), KIND: kind}
    data.assign_attrs(attributes).to_netcdf(path, engine="h5netcdf")


def write_csv(data: xr.Dataset, path: Path) -> None:
    """Write a Dataset as one table.

    Variables over the same dimensions are columns, their coordinates the first ones, units in the head. Otherwise every
    number has a row: quantity, coordinates, value, unit.

    Raises:
        ModelError: more than twenty million numbers.
    """
    rows = sum(int(variable.size) for variable in data.data_vars.values())
    if rows > _LARGEST_TABLE:
        raise ModelError(Problem("path", f'"{path.name}"', f"would be a table of {rows} numbers", "save it as .nc"))
    shapes = {variable.dims for variable in data.data_vars.values() if variable.dims}
    frame = _wide(data) if len(shapes) == 1 else _long(data)
    frame.to_csv(path, index=False)


def _wide(data: xr.Dataset) -> pd.DataFrame:
    """A row for every combination of coordinates, a column for every variable, with its unit."""
    frame = data.to_dataframe().reset_index()
    units = {str(name): str(data[name].attrs.get("units", "")) for name in frame.columns if name in data.variables}
    return frame.rename(columns={name: f"{name} [{unit}]" for name, unit in units.items() if unit})


def _long(data: xr.Dataset) -> pd.DataFrame:
    """A row for every number: what it is, its coordinates, its value and its unit."""
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
