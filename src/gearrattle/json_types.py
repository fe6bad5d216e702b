"""Values of results in the types that JSON has, and their text."""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

Json: TypeAlias = "Mapping[str, Json] | Sequence[Json] | str | float | bool | None"
"""The types of JSON: objects, arrays, texts, numbers, true, false and null."""

TomlTable: TypeAlias = dict[str, Any]
"""A table of a file, as ``tomllib`` reads it; its content is checked against the schema, not by the type checker."""


def json_value(value: object) -> Any:
    """Return a value in JSON types: arrays become lists, dataclasses objects, numbers that are not finite None.

    Examples
    --------
    >>> json_value({"ratio": float("inf"), "levels": (1.5, 2)})
    {'ratio': None, 'levels': [1.5, 2]}
    """
    import numpy as np  # imported here: reading a model file needs these types, but not NumPy

    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {entry.name: json_value(getattr(value, entry.name)) for entry in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): json_value(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return json_value(value.tolist())
    if isinstance(value, list | tuple):
        return [json_value(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def parsed_json(content: bytes | str) -> Any:
    """Return the value of a JSON text from outside, if it can be written as JSON again: finite numbers, Unicode text.

    Raises
    ------
    ValueError
        the text is not JSON; holds NaN, an infinite or very large whole number, or half of a surrogate pair; or is
        nested more than 64 levels deep.

    Examples
    --------
    >>> from gearrattle.json_types import parsed_json
    >>> parsed_json('{"cycles": NaN}')
    Traceback (most recent call last):
        ...
    ValueError: NaN is no number of JSON
    """
    try:
        value = json.loads(content, parse_constant=_refuse_constant)
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None
    pending: list[tuple[Any, int]] = [(value, 0)]
    while pending:
        item, depth = pending.pop()
        if depth > _DEEPEST:
            raise ValueError(_TOO_DEEP)
        if isinstance(item, dict):
            pending += [(part, depth + 1) for pair in item.items() for part in pair]
        elif isinstance(item, list):
            pending += [(part, depth + 1) for part in item]
        elif isinstance(item, str) and not item.isascii():
            item.encode()  # a UnicodeEncodeError is a ValueError
        elif isinstance(item, int | float) and not abs(item) <= sys.float_info.max:
            raise ValueError("a number is too large")
    return value


_DEEPEST = 64  # levels
_TOO_DEEP = f"it is nested more than {_DEEPEST} deep"


def _refuse_constant(word: str) -> float:
    raise ValueError(f"{word} is no number of JSON")


def json_text(value: object) -> str:
    """Return a value as indented JSON text, converted by ``json_value``."""
    return json.dumps(json_value(value), indent=2, ensure_ascii=False, allow_nan=False)
