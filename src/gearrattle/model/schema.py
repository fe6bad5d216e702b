"""JSON Schemas of files, from the same classes that read them: editors complete and check as one types.

Takes ``Model``, or another table of a file; gives a dictionary to the command line.
"""

from __future__ import annotations

from typing import Any

from gearrattle.json_types import Json
from gearrattle.model.model import Model
from gearrattle.model.table import Table


def json_schema() -> dict[str, Json]:
    """Return the JSON Schema (draft 2020-12) of a model file.

    Examples
    --------
    >>> from gearrattle.model import json_schema
    >>> sorted(json_schema()["required"])
    ['excitation', 'inertia', 'schema']
    """
    return schema_of(Model, "gearrattle model file")


def schema_of(table: type[Table], title: str) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a file that a table reads."""
    schema = _without_null(table.model_json_schema(by_alias=True, mode="validation"))
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": title}


def _without_null(node: Any) -> Any:
    """Return a schema in which a key that may be left out is not said to be null, which TOML has not."""
    if isinstance(node, list):
        return [_without_null(item) for item in node]
    if not isinstance(node, dict):
        return node
    kept = {key: _without_null(item) for key, item in node.items() if item is not None}
    options = [option for option in kept.get("anyOf", ()) if option != {"type": "null"}]
    if len(options) == 1:
        del kept["anyOf"]
        return options[0] | kept
    return kept | {"anyOf": options} if options else kept
