"""The kinds of values a model file holds, each with its rule: quantities, plain numbers, counts, names, choices.

``Annotated[float, Quantity(TORQUE)]`` reads a plain SI number or a string with a unit and is a plain float after
that. The same object writes the value's part of the JSON Schema, so editors and the loader agree.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from numbers import Integral, Real
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, PydanticCustomError, PydanticUndefined, core_schema

from gearrattle.errors import ModelError, Problem
from gearrattle.model import units
from gearrattle.model.table import NO_TABLE, Table, breach, did_you_mean, listed, shown
from gearrattle.model.units import NOT_FINITE, Dimension, UnitError

Bound = Literal["finite", "non-negative", "positive"]
SMALLEST = 1e-30
LARGEST = 1e30
"""Of numbers in SI, or without a unit: within, products of five of them and their inverses stay finite."""
_NAME = re.compile(r"[A-Za-z0-9_-]+")
SCHEMA_VERSION = 1
"""Of every file that people write: models, studies, mappings, data."""
NEWER_SCHEMA = (
    f"this version of gearrattle reads schema {SCHEMA_VERSION} only",
    "the file was written for a newer gearrattle: update it",
)
"""Rule and remedy."""
GROUND = "ground"


class Reader:
    """A rule for one value: ``read`` returns the value or raises; subclasses also describe it to JSON Schema."""

    def read(self, value: Any, dimensionless: bool, /) -> Any:
        """Return the validated value; raise the breach of its rule."""
        raise NotImplementedError

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema of the value as written."""
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def check(value: Any, info: ValidationInfo) -> Any:
            return self.read(value, bool((info.context or {}).get("dimensionless", False)))

        return core_schema.with_info_plain_validator_function(check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return self.describe()


def _bounded(value: float, bound: Bound, remedy: str = "") -> float:
    """Return a finite value within its bound."""
    if not math.isfinite(value):
        raise breach(NOT_FINITE)
    if bound == "positive" and not value > 0.0:
        raise breach("must be greater than zero", remedy)
    if bound == "non-negative" and value < 0.0:
        raise breach("must not be negative", remedy)
    if abs(value) > LARGEST:
        raise breach(f"must not be larger than {LARGEST:g} in SI units", "check the number and its unit")
    if bound == "positive" and value < SMALLEST:
        raise breach(f"must not be smaller than {SMALLEST:g} in SI units", "check the number and its unit")
    return value


def _bounds_schema(bound: Bound) -> dict[str, Any]:
    """Return the JSON Schema of a number within its bound."""
    limits: dict[Bound, dict[str, Any]] = {
        "finite": {"minimum": -LARGEST},
        "non-negative": {"minimum": 0},
        "positive": {"minimum": SMALLEST},
    }
    return {"type": "number", **limits[bound], "maximum": LARGEST}


_BOUND_WORDS: dict[Bound, str] = {"finite": "", "non-negative": "; not negative", "positive": "; above 0"}


def _as_float(value: Real) -> float:
    """Return any real number, of numpy included, as a float."""
    try:
        return float(value)
    except OverflowError:
        raise breach(NOT_FINITE) from None


def _is_number(value: Any) -> bool:
    """Whether a value is a number and no truth value, which Python counts among them."""
    return isinstance(value, Real) and not isinstance(value, bool)


@dataclass(frozen=True)
class Quantity(Reader):
    """A physical quantity: a plain number in SI, or a string with a unit."""

    dimension: Dimension
    bound: Bound = "finite"

    def read(self, value: Any, dimensionless: bool, /) -> float:
        """Return the value in SI; plain numbers only in a dimensionless model."""
        if _is_number(value):
            return _bounded(_as_float(value), self.bound)
        name = self.dimension.name
        si = self.dimension.si
        if not isinstance(value, str):
            raise breach(f'must be a plain number ({si}) or a string with a unit, such as "{self.dimension.example}"')
        if dimensionless:
            raise breach(f"must be a plain number: this model is dimensionless, so its {name} has no unit")
        try:
            converted = units.convert(value, self.dimension)
        except UnitError as error:
            raise breach(error.rule, error.remedy) from None
        return _bounded(converted, self.bound)

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema: a number in SI or a string with a unit."""
        text = {"type": "string", "pattern": r"^\s*[+-]?(\d|\.\d)", "examples": [self.dimension.example]}
        words = f'a plain number in {self.dimension.si}, or a string with a unit such as "{self.dimension.example}"'
        return {"anyOf": [_bounds_schema(self.bound), text], "description": f"{words}{_BOUND_WORDS[self.bound]}"}


@dataclass(frozen=True)
class Plain(Reader):
    """A number that has no unit, such as an order or a ratio; ``remedy`` is what to do about one out of bounds."""

    bound: Bound = "finite"
    remedy: str = ""

    def read(self, value: Any, _dimensionless: bool, /) -> float:
        """Return the number."""
        if not _is_number(value):
            raise breach("must be a plain number without unit")
        return _bounded(_as_float(value), self.bound, self.remedy)

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema of the number."""
        return _bounds_schema(self.bound)


_ANY = 10**9
"""Largest whole number of a quantity that has no bound of its own: messages leave it out."""


@dataclass(frozen=True)
class Count(Reader):
    """A whole number not below ``least``."""

    least: int = 0
    most: int = _ANY

    def read(self, value: Any, _dimensionless: bool, /) -> int:
        """Return the whole number."""
        is_whole = isinstance(value, Integral) and not isinstance(value, bool)
        if is_whole and self.least <= int(value) <= self.most:
            return int(value)
        is_too_large = is_whole and int(value) > self.most
        upper = f" to {self.most}" if is_too_large or self.most < _ANY else ""
        raise breach(f"must be a whole number from {self.least}{upper}")

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema of the whole number."""
        return {"type": "integer", "minimum": self.least, "maximum": self.most}


SEED = Count(0, 2**63 - 1)
"""Of random numbers."""


class Flag(Reader):
    """Yes or no."""

    def read(self, value: Any, _dimensionless: bool, /) -> bool:
        """Return it; of numpy included."""
        is_numpy = str(getattr(value, "dtype", "")) == "bool" and not getattr(value, "shape", ())
        if not isinstance(value, bool) and not is_numpy:
            raise breach("must be true or false")
        return bool(value)

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema."""
        return {"type": "boolean"}


class Callback(Reader):
    """A function that a call calls as it works, or None; no value of a file."""

    def read(self, value: Any, _dimensionless: bool, /) -> Any:
        """Return it."""
        if value is not None and not callable(value):
            raise breach("must be a function, or None", "such as print")
        return value


FLAG = Flag()
CALLBACK = Callback()


class SchemaVersion(Reader):
    """Reads ``schema``: the version of the format of a TOML file."""

    def read(self, value: Any, _dimensionless: bool, /) -> int:
        """Return the version."""
        if isinstance(value, bool) or not isinstance(value, int) or value < 1:
            raise breach(f"must be the version of the file format: {SCHEMA_VERSION}")
        if is_newer_schema(value):
            raise breach(*NEWER_SCHEMA)
        return value

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema of the version."""
        return {"const": SCHEMA_VERSION}


def is_newer_schema(version: object) -> bool:
    """Whether a file was written for a later version of its format: then nothing else in it can be judged."""
    return isinstance(version, int) and version > SCHEMA_VERSION


@dataclass(frozen=True)
class Choice(Reader):
    """One word out of a few."""

    options: tuple[str, ...]

    def read(self, value: Any, _dimensionless: bool, /) -> str:
        """Return the word."""
        if not isinstance(value, str) or value not in self.options:
            words = " or ".join(f'"{option}"' for option in self.options)
            raise breach(f"must be {words}", did_you_mean(value, self.options))
        return value

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema of the choice."""
        return {"enum": list(self.options)}


@dataclass(frozen=True)
class Label(Reader):
    """The name of a part; with ``reserved`` words that it may not be."""

    reserved: tuple[str, ...] = ()

    def read(self, value: Any, _dimensionless: bool, /) -> str:
        """Return the name."""
        if not isinstance(value, str) or _NAME.fullmatch(value) is None:
            raise breach("must be a name of letters (a-z, A-Z), digits, _ and -, without dots or blanks")
        if value in self.reserved:
            raise breach(f"must not be one of the reserved names ({listed(self.reserved)})")
        return value

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema of the name."""
        banned = {"not": {"enum": list(self.reserved)}} if self.reserved else {}
        return {"type": "string", "pattern": r"^[A-Za-z0-9_-]+$", **banned}


@dataclass(frozen=True)
class Text(Reader):
    """Any text."""

    def read(self, value: Any, _dimensionless: bool, /) -> str:
        """Return the text."""
        if not isinstance(value, str):
            raise breach("must be a text in quotes")
        return value

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema of the text."""
        return {"type": "string"}


@dataclass(frozen=True)
class Texts(Reader):
    """A list of texts."""

    example: str

    def read(self, value: Any, _dimensionless: bool, /) -> list[str]:
        """Return the list."""
        if not isinstance(value, (list, tuple)) or not all(isinstance(item, str) for item in value):
            raise breach(f"must be a list of texts in quotes, such as {self.example}")
        return list(value)

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema of the list."""
        return {"type": "array", "items": {"type": "string"}}


@dataclass(frozen=True)
class AnyTable(Reader):
    """A table of keys and values, whatever they are."""

    def read(self, value: Any, _dimensionless: bool, /) -> Mapping[str, Any]:
        """Return the table."""
        if not isinstance(value, Mapping):
            raise breach(NO_TABLE)
        return value

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema of the table."""
        return {"type": "object", "additionalProperties": True}  # said, for editors warn of keys they do not know


def argument_problems(arguments: Mapping[str, tuple[Reader, Any]], *, dimensionless: bool = True) -> list[Problem]:
    """Return the problems of a call's arguments, each given by its name with its rule and value; if dimensionless,
    quantities are plain numbers only.
    """
    problems = []
    for name, (reader, value) in arguments.items():
        try:
            reader.read(value, dimensionless)
        except PydanticCustomError as error:
            context = error.context or {}
            problems.append(Problem(name, shown(value), context["rule"], context["remedy"]))
    return problems


def check_arguments(**arguments: tuple[Reader, Any]) -> None:
    """Refuse arguments of a call that break their rules (ModelError); see ``argument_problems``."""
    if problems := argument_problems(arguments):
        raise ModelError(problems)


def checked(reader: Reader, value: Any, name: str, *, dimensionless: bool = True) -> Any:
    """Return a value that obeys a rule, or raise a ModelError; see ``argument_problems``."""
    if problems := argument_problems({name: (reader, value)}, dimensionless=dimensionless):
        raise ModelError(problems)
    return reader.read(value, dimensionless)


def two(rule: str) -> BeforeValidator:
    """Return the check that a value is an array of exactly two; each entry is then checked by its own rule."""

    def check(value: Any) -> Any:
        if not isinstance(value, (list, tuple)) or len(value) != 2:
            raise breach(rule)
        return value

    return BeforeValidator(check)


def value_of(owner: type[Table], table: object, key: str, dimensionless: bool) -> Any:
    """Return a value as its field reads it: what a rule between keys judges, whether written with a unit or without.

    Parameters
    ----------
    table
        as written, or as read; None: there is none, and every key has its default.

    Returns
    -------
    Any
        The value; the default of a key that is absent, None of one without a default. None as well where the field
        refuses the value, and itself says so.
    """
    if table is not None and not isinstance(table, Mapping | Table):
        return None
    written = table.get(key) if isinstance(table, Mapping) else getattr(table, key, None)
    if written is None:
        default = owner.model_fields[key].default
        return None if default is PydanticUndefined else default
    try:
        return _reader(owner, key).read(written, dimensionless)
    except ValueError:
        return None


@cache
def _reader(owner: type[Table], key: str) -> Reader:
    """Return what reads a field."""
    info = owner.model_fields[key]
    optional = [part for member in get_args(info.annotation) for part in getattr(member, "__metadata__", ())]
    return next(part for part in (*info.metadata, *optional) if isinstance(part, Reader))


Name = Annotated[str, Label()]
Between = Annotated[tuple[Name, Name], two('must be two names, such as ["flywheel", "hub"]')]
Ratio = Annotated[float, Plain("non-negative")]
