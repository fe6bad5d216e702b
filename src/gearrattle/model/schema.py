"""JSON Schemas of files, made from the classes that read them: editors complete and check files with them."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from itertools import pairwise
from typing import Any

from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import core_schema

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
    schema = _without_null(table.model_json_schema(by_alias=True, schema_generator=_Described))
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": title}


def key_docs(table: type[Table]) -> dict[str, str]:
    """Return what stands below every key of a table's class, by key.

    pydantic would read this when it makes the class, at every start; here it is read when somebody asks.
    """
    docs: dict[str, str] = {}
    for part in reversed(table.__mro__):
        if not issubclass(part, Table):
            continue
        body = ast.parse(textwrap.dedent(inspect.getsource(part))).body[0]
        assert isinstance(body, ast.ClassDef)
        for line, below in pairwise(body.body):
            match line, below:
                case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(words))):
                    docs[name] = inspect.cleandoc(words)
    return {info.alias or name: docs[name] for name, info in table.model_fields.items() if name in docs}


class _Described(GenerateJsonSchema):
    """Every key is described by what stands below it."""

    def model_schema(self, schema: core_schema.ModelSchema) -> dict[str, Any]:
        """Return the schema of a table, with the words for its keys."""
        made = super().model_schema(schema)
        if "description" in made:  # that of the class: its first paragraph is about the table, the rest about Python
            made["description"] = _for_editors(" ".join(made["description"].partition("\n\n")[0].split()))
        for key, words in key_docs(schema["cls"]).items():
            value = made["properties"][key]
            value["description"] = _for_editors(words, _value_words(value))
        return made


def _value_words(value: dict[str, Any]) -> str:
    """Return what a kind of value says of itself: number, unit, bound; empty if nothing."""
    options = [option for option in value.get("anyOf", ()) if option != {"type": "null"}]
    return str(value.get("description") or (options[0].get("description", "") if len(options) == 1 else ""))


def _for_editors(words: str, value_words: str = "") -> str:
    """Return the words on a key as the author of a file reads them: no None, which TOML has not, and no Sphinx."""
    plain = re.sub(r"\bNone\b", "left out", words).replace("``", "`")
    return f"{plain} Written as {value_words}." if value_words else plain


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
