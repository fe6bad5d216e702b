"""The units that a model file was written in: tables that go back to its author show numbers in them.

A model has all numbers in SI. Which unit each was written with is kept beside it, by path; it is no part of the model:
models that differ in it alone are equal. Numbers without a unit, and those of a dimensionless model, have none.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

from gearrattle.model.paths import inner_of

_ATTRIBUTE = "_written_units"
_QUANTITY = re.compile(r"\s*[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?\s*(?P<unit>[^\W\d_].*|°.*)", re.ASCII)
_NOTHING: Mapping[str, str] = MappingProxyType({})


def written_units(model: object) -> Mapping[str, str]:
    """Return the units of a model's numbers as they were written, by path."""
    units: Mapping[str, str] = vars(model).get(_ATTRIBUTE, _NOTHING)
    return units


def keep_written_units(model: object, tables: Mapping[str, Any], before: Mapping[str, str] = _NOTHING) -> None:
    """Keep the units of the tables as written beside the model that was read from them; they replace those of the model
    it was made from.
    """
    vars(model)[_ATTRIBUTE] = {**before, **dict(_units_in(tables, ""))}


def _units_in(node: Any, prefix: str) -> Iterator[tuple[str, str]]:
    """Yield path and unit of every text that is a number with a unit."""
    if isinstance(node, str):
        match = _QUANTITY.fullmatch(node)
        if match is not None:
            yield prefix, match["unit"].strip()
    elif isinstance(node, (list, tuple)) and node and isinstance(node[0], str):
        for index, entry in enumerate(node):
            yield from _units_in(entry, f"{prefix}.{index}")
    else:
        for name, below in inner_of(node, prefix):
            yield from _units_in(below, name)
