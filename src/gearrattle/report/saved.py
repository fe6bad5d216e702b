"""Results as files for machines: JSON and netCDF, each with the name of its format.

Takes contents in JSON types, and Datasets; writes files.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearrattle.formats import format_name

if TYPE_CHECKING:
    import xarray as xr


def write_json(content: Mapping[str, Any], path: Path, kind: str) -> None:
    """Write a content of JSON types; its first key is the format, that of ``kind`` (``formats.FORMATS``)."""
    text = json.dumps({"format": format_name(kind), **content}, indent=2, ensure_ascii=False, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8")


def write_netcdf(data: xr.Dataset, path: Path, kind: str) -> None:
    """Write a Dataset; its attribute ``format`` is that of ``kind`` (``formats.FORMATS``)."""
    data.assign_attrs(format=format_name(kind)).to_netcdf(path, engine="h5netcdf")
