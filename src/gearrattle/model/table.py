"""Base of all tables of a model file: frozen, without unknown keys, with every breach reported at once.

A pydantic class checks its fields one by one and its cross-field rules only if all fields are sound. Here both are
collected: each ``Table`` may have ``rules`` on the table as written. The breaches of rules and fields are raised as one
error, each with its rule and remedy.
"""

from __future__ import annotations

import difflib
import json
from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import islice
from typing import Any, NamedTuple, Self, cast

from pydantic import BaseModel, ConfigDict, ModelWrapValidatorHandler, ValidationError, ValidationInfo, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from gearrattle.json_types import TomlTable

Location = tuple[int | str, ...]
BREACH = "breach"
NO_TABLE = "must be a table of keys and values"
_MOST_LISTED = 12
_LONGEST_GUESS = 80
_MOST_GUESSES = 100
_MEANT = 'did you mean "%s"?'


class Breach(NamedTuple):
    """A rule broken inside a table: where (relative to the table), the value, the rule, the remedy.

    ``place`` and ``value_there`` are of a fault in another file that the table names.
    """

    location: Location
    value: object
    rule: str
    remedy: str = ""
    place: str = ""
    value_there: str = ""

    def details(self) -> InitErrorDetails:
        """Return the breach in the form pydantic collects."""
        error = breach(self.rule, self.remedy, place=self.place, value=self.value_there)
        return InitErrorDetails(type=error, loc=self.location, input=self.value)


def breach(rule: str, remedy: str = "", *, place: str = "", value: str = "") -> PydanticCustomError:
    """Return the error a field's validator raises; with a place of its own if the fault lies in another file."""
    elsewhere = {"place": place, "value": value} if place else {}
    return PydanticCustomError(BREACH, "{rule}", {"rule": rule, "remedy": remedy, **elsewhere})


def did_you_mean(word: object, options: Collection[str]) -> str:
    """Return ``'did you mean "..."?'`` for the closest option, or an empty text if none is close."""
    if not isinstance(word, str) or len(word) > _LONGEST_GUESS or len(options) > _MOST_GUESSES:
        return ""
    by_lower = {option.lower(): option for option in options}
    close = difflib.get_close_matches(word.lower(), list(by_lower), n=1, cutoff=0.6)
    return _MEANT % by_lower[close[0]] if close else ""


def listed(options: Iterable[str]) -> str:
    """Return words joined by commas; the long tail is cut."""
    words = list(islice(options, _MOST_LISTED + 1))
    return ", ".join(words[:_MOST_LISTED]) + (", ..." if len(words) > _MOST_LISTED else "")


def shown(value: object) -> str:
    """Return a value as it would stand in a model file, shortened to one readable line."""
    if isinstance(value, str):
        text = json.dumps(value[:60] + ("..." if len(value) > 60 else ""), ensure_ascii=False)
        return "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in text)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "{ " + listed(f"{key} = ..." for key in value) + " }" if value else "{}"
    if isinstance(value, (list, tuple)):
        inner = ", ".join(shown(item) for item in value[:4]) + (", ..." if len(value) > 4 else "")
        return f"[{inner}]"
    if isinstance(value, int) and value.bit_length() > 256:
        return "a whole number of more than 77 digits"
    text = str(value)
    return text if len(text) <= 60 else text[:60] + "..."


class Table(BaseModel):
    """Base of all tables: immutable, closed to unknown keys, complete in its complaints."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield the breaches of rules between keys, from the table as written; fields check themselves."""
        del table, dimensionless
        return iter(())

    @classmethod
    def keys(cls) -> tuple[str, ...]:
        """Return the keys this table may have, in order."""
        return tuple(info.alias or name for name, info in cls.model_fields.items())

    def stated(self, *keys: str) -> TomlTable:
        """Return the values of those keys that the file has."""
        return {key: getattr(self, key) for key in keys if key in self.model_fields_set}

    def to_plain(self, *, at_speed: bool = False) -> TomlTable:
        """Return the table as plain dictionaries, lists and numbers, with the keys that were given; tables over speed
        as their values ``at_speed`` of the model on request.
        """
        keys_set = self.model_fields_set
        return {
            info.alias or name: _plain(getattr(self, name), at_speed=at_speed)
            for name, info in type(self).model_fields.items()
            if name in keys_set
        }

    @model_validator(mode="wrap")
    @classmethod
    def _complain_at_once(cls, data: Any, handler: ModelWrapValidatorHandler[Self], info: ValidationInfo) -> Self:
        """Collect the breaches of fields and of rules into one error."""
        errors: list[InitErrorDetails] = []
        result: Self | None = None
        try:
            result = handler(data)
        except ValidationError as error:
            entries = cast(list[dict[str, Any]], error.errors(include_url=False))
            errors = [cls._restate(entry) for entry in _without_misspelt(entries, cls.keys())]
        if isinstance(data, Mapping):
            context = info.context or {}
            errors += [item.details() for item in cls.rules(data, bool(context.get("dimensionless", False)))]
        if errors or result is None:
            raise ValidationError.from_exception_data(cls.__name__, errors)
        return result

    @classmethod
    def _restate(cls, entry: dict[str, Any]) -> InitErrorDetails:
        """Put one pydantic error in the words of this project."""
        kind = entry["type"]
        location = entry["loc"]
        value = entry["input"]
        context = entry.get("ctx", {})
        remedy = ""
        if kind == BREACH:
            elsewhere = (context.get("place", ""), context.get("value", ""))
            remedy = context["remedy"] or _brackets(location, value, context["rule"])
            return Breach(location, value, context["rule"], remedy, *elsewhere).details()
        if kind == "missing":
            rule = "this key is required"
            value = ...
        elif kind == "extra_forbidden":
            rule = f"unknown key; allowed are {listed(cls.keys())}"
            remedy = did_you_mean(location[-1], cls.keys())
        elif kind in {"model_type", "dict_type", "model_attributes_type"}:
            rule = NO_TABLE
            remedy = _brackets(location, value, rule)
        elif kind in {"tuple_type", "list_type"}:
            rule, remedy = _array_rule(location, value)
        else:
            rule = str(entry["msg"])
        return Breach(location, value, rule, remedy).details()


def _without_misspelt(entries: list[dict[str, Any]], keys: Collection[str]) -> list[dict[str, Any]]:
    """Return the errors of a table without those of missing keys that stand there misspelt."""
    unknown = [entry["loc"][0] for entry in entries if entry["type"] == "extra_forbidden" and len(entry["loc"]) == 1]
    meant = {did_you_mean(key, keys) for key in unknown}
    return [
        entry
        for entry in entries
        if entry["type"] != "missing" or len(entry["loc"]) != 1 or _MEANT % entry["loc"][0] not in meant
    ]


def _plain(value: Any, *, at_speed: bool) -> Any:
    """Return a value without tables of our own classes."""
    if isinstance(value, Table):
        return value.to_plain(at_speed=at_speed)
    if isinstance(value, tuple):
        return [_plain(item, at_speed=at_speed) for item in value]
    if isinstance(value, float) and type(value) is not float and at_speed:
        return float(value)
    return value.to_plain() if hasattr(value, "to_plain") else value


def _brackets(location: Location, value: object, rule: str) -> str:
    """Say that a table is begun with single brackets."""
    is_array = rule == NO_TABLE and isinstance(value, (list, tuple)) and len(value) > 0
    return f"begin it with [{location[-1]}], not [[{location[-1]}]]" if is_array and location else ""


def _array_rule(location: Location, value: object) -> tuple[str, str]:
    """Say that an array was expected; a single table means that double brackets were forgotten."""
    if len(location) == 1 and isinstance(value, Mapping):
        return "must be an array of tables", f"write [[{location[0]}]] with double brackets"
    return "must be an array", "write it in square brackets"
