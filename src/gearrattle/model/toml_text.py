"""A model's tables as TOML text: the inverse of reading.

Numbers are written with the fewest digits that give the same double, so what is read back is equal.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any


def toml_text(tables: Mapping[str, Any]) -> str:
    """Return tables as a TOML document: plain keys first, then tables and arrays of tables, in their order."""
    blocks = ["\n".join(_lines({key: value for key, value in tables.items() if not _is_block(value)}))]
    for key, value in tables.items():
        if isinstance(value, Mapping):
            blocks.append("\n".join([f"[{key}]", *_lines(value)]))
        elif _is_block(value):
            blocks += ["\n".join([f"[[{key}]]", *_lines(row)]) for row in value]
    return "\n\n".join(blocks) + "\n"


def _is_block(value: Any) -> bool:
    """Whether a value is a table or a non-empty array of tables, which get headers of their own."""
    is_array = isinstance(value, (list, tuple)) and bool(value) and isinstance(value[0], Mapping)
    return is_array or isinstance(value, Mapping)


def _lines(table: Mapping[str, Any]) -> Iterator[str]:
    """Yield ``key = value`` lines; an array of tables takes one line per entry."""
    for key, value in table.items():
        if value is None:
            continue
        if _is_block(value) and not isinstance(value, Mapping):
            yield f"{key} = ["
            yield from (f"  {value_text(row)}," for row in value)
            yield "]"
        else:
            yield f"{key} = {value_text(value)}"


def value_text(value: Any) -> str:
    """Return one value as it stands in a file."""
    if isinstance(value, Mapping):
        inner = ", ".join(f"{key} = {value_text(item)}" for key, item in value.items() if item is not None)
        return "{ " + inner + " }" if inner else "{}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(value_text(item) for item in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value)
