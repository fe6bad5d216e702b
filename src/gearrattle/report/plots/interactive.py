"""Charts as plain data for ``browser/plot.js``, which draws them on pages, in notebooks and in the workbench.

Arrays travel as base64 of little-endian numbers: float32 where only a level is read (``{"f4": ...}``), float64 on the
x axis, whose spacing can be fine against its size (``{"f8": ...}``). Equally spaced numbers are ``first``, ``step``
and ``count``.
"""

from __future__ import annotations

from base64 import b64encode
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.report.plots.chart import Chart
from gearrattle.trajectory import Array

_LEVELS = ("y", "heights", "base", "values")
"""Arrays of a chart of which seven digits are enough."""


def chart_json(chart: Chart) -> dict[str, Any]:
    """Return a figure as data in JSON types: its nouns as objects, its arrays packed."""
    written: dict[str, Any] = _written(chart)
    return {**written, "rows": chart.rows}


def _written(value: Any, name: str = "") -> Any:
    if is_dataclass(value):
        return {field.name: _written(getattr(value, field.name), field.name) for field in fields(value)}
    if isinstance(value, np.ndarray):
        return _packed(value, "f4") if name in _LEVELS else _spaced(value) or _packed(value, "f8")
    if isinstance(value, tuple | list):
        return [_written(entry) for entry in value]
    return json_value(value)


def _packed(values: Array, kind: str) -> dict[str, Any]:
    content = b64encode(np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()).decode("ascii")
    return {kind: content, "shape": list(values.shape)}


def _spaced(values: Array) -> dict[str, Any]:
    """Return first, step and count of equally spaced numbers; nothing of others."""
    steps = np.diff(values)
    if values.size < 3 or not np.isfinite(steps).all():
        return {}
    length = float(values[-1] - values[0])
    if float(np.ptp(steps)) > 1e-9 * abs(length) / values.size:
        return {}
    return {"first": float(values[0]), "step": length / (values.size - 1), "count": values.size}
