"""Common parts of presentations of labelled data: plain attributes, whether it has units, the name of its channel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.result import KIND

_AXES = ("frequency", "time", "speed")


def is_si(data: Any) -> bool:
    """Whether axes have units: rad/s, seconds, hertz; those of a dimensionless model have "1"."""
    units = (str(data.coords[name].attrs.get("units", "1")) for name in _AXES if name in data.coords)
    return any(unit != "1" for unit in units)


def numbers_in(data: Any, name: str) -> list[float]:
    """Return the numbers in an attribute; empty if it does not exist. netCDF stores a list of one as a number."""
    return [float(value) for value in np.atleast_1d(data.attrs.get(name, []))]


def channel_title(attributes: Mapping[Any, Any]) -> str:
    """Return the name of the channel, or of both channels, and their source."""
    pair = f" and {attributes['reference']}" if "reference" in attributes else ""
    return f"{attributes['channel']}{pair}, {' '.join(str(attributes['source']).split())}"


def plain_attributes(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Return attributes in JSON types, without the kind of result and the notes, which every summary has."""
    return {str(name): json_value(value) for name, value in attributes.items() if name not in (KIND, "format", "notes")}
