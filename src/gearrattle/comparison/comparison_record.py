"""Base of the records of every comparison: frozen fields that turn into JSON types."""

from __future__ import annotations

from typing import Any

from gearrattle.json_types import Json, json_value


class Record:
    """Base of the results of comparisons, all of them frozen dataclasses."""

    def to_dict(self) -> dict[str, Json]:
        """Return the fields in JSON types; numbers that are not finite become None."""
        converted: dict[str, Any] = json_value(self)
        return converted
