"""Results as files for machines: JSON and netCDF, each with the name of its format.

Takes contents in JSON types, and Datasets; writes files.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearrattle.formats import format_name
from gearrattle.json_types import json_text

if TYPE_CHECKING:
    import xarray as xr


def write_json(content: Mapping[str, Any], path: Path, kind: str) -> None:
    """Write what ``json_value`` takes; its first key is the format, that of ``kind`` (``formats.FORMATS``)."""
    path.write_text(json_text({"format": format_name(kind), **content}) + "\n", encoding="utf-8")


def write_netcdf(data: xr.Dataset, path: Path, kind: str) -> None:
    """Write a Dataset; its attribute ``format`` is that of ``kind`` (``formats.FORMATS``)."""
    data.assign_attrs(format=format_name(kind)).to_netcdf(path, engine="h5netcdf")
