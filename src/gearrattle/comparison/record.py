"""What every comparison returns is a record: frozen fields that turn into JSON types.

Takes frozen dataclasses; gives dictionaries to reports and files.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np


class Record:
    """Base of the results of comparisons, all of them frozen dataclasses."""

    def to_dict(self) -> dict[str, Any]:
        """Return the fields in JSON types; numbers that are not finite become None."""
        converted: dict[str, Any] = plain(self)
        return converted


def plain(value: Any) -> Any:
    """Return a value of a record in JSON types."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
