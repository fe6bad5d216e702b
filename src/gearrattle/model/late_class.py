"""Keys whose classes are imported only when a file has them, because most files do not and the import takes time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

if TYPE_CHECKING:
    from pydantic import TypeAdapter


@dataclass(frozen=True)
class LateClass:
    """The type of a key, by the name of an annotation in a module."""

    module: str
    name: str

    @property
    def annotation(self) -> Any:
        """Return the annotation; its module is imported."""
        return getattr(import_module(self.module), self.name)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def check(value: Any, info: ValidationInfo) -> Any:
            return _adapter(self).validate_python(value, context=info.context)

        return core_schema.with_info_plain_validator_function(check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return handler(_adapter(self).core_schema)


@cache
def _adapter(key: LateClass) -> TypeAdapter[Any]:
    """Return what reads the annotation."""
    from pydantic import TypeAdapter

    return TypeAdapter(key.annotation)
