"""Options of the form NAME=NUMBER, NAME=NUMBER,NUMBER,..., NAME="1 N*m",... or NAME=WORD, which may be repeated.

If the name is a path of the model, the value x3 means three times the value in the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from gearrattle.errors import ModelError, Problem

if TYPE_CHECKING:
    from gearrattle.model import Factor


def numbers(option: str, entries: Sequence[str]) -> dict[str, float]:
    """Return numbers by name from words NAME=NUMBER; ModelError with the option's name for another form."""
    return {name: _number(option, text) for name, text in _pairs(option, entries)}


def labels(option: str, entries: Sequence[str]) -> dict[str, int]:
    """Return whole numbers by name, such as labels of regions, from words NAME=WHOLE NUMBER; ModelError for another
    form.
    """
    return {name: _label(option, text) for name, text in _pairs(option, entries)}


def lists(option: str, entries: Sequence[str]) -> dict[str, list[float]]:
    """Return lists of numbers by name from words NAME=NUMBER,NUMBER,...; ModelError for another form."""
    return {name: [_number(option, part) for part in text.split(",")] for name, text in _pairs(option, entries)}


def texts(option: str, entries: Sequence[str]) -> dict[str, list[float | str | Factor]]:
    """Return lists by name from words NAME=VALUE,VALUE,...: numbers, factors such as x3, and quantities with units as
    text; ModelError for another form.
    """
    return {name: [value_in(part.strip()) for part in text.split(",")] for name, text in _pairs(option, entries)}


def changes(option: str, entries: Sequence[str]) -> dict[str, Any]:
    """Return values of a model by path, as ``Model.with_`` takes them, from words PATH=VALUE; ModelError for another
    form. A value is written as in a model file, where the quotes of a text may be left out, or is a factor, x3.
    """
    return {path: _as_in_file(text.strip()) for path, text in _pairs(option, entries)}


def value_in(text: str) -> float | str | Factor:
    """Return a word as a factor (x3), else as a number, else as text."""
    from gearrattle.model.factors import factor

    times = _float(text[1:]) if text.startswith("x") else None
    number = _float(text) if times is None else None
    return factor(times) if times is not None else text if number is None else number


def words(option: str, entries: Sequence[str]) -> dict[str, str]:
    """Return words by name from NAME=WORD; ModelError for another form."""
    return dict(_pairs(option, entries))


def _pairs(option: str, entries: Sequence[str]) -> list[tuple[str, str]]:
    """Split words of the form NAME=VALUE."""
    pairs = [text.partition("=") for text in entries]
    wrong = [
        text for text, (name, equals, value) in zip(entries, pairs, strict=True) if not (name and equals and value)
    ]
    if wrong:
        _refuse(option, wrong[0], "must be NAME=VALUE")
    names = [name for name, _, _ in pairs]
    twice = next((text for index, text in enumerate(entries) if names[index] in names[:index]), None)
    if twice is not None:
        _refuse(option, twice, f"{twice.partition('=')[0]} has a value already: give each name once")
    return [(name, value) for name, _, value in pairs]


def _as_in_file(text: str) -> Any:
    """Return the value of a word as in a model file: a number, whole or not, a list, a table, a text; or a factor."""
    import tomllib

    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return value_in(text)


def _float(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _number(option: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        _refuse(option, text, "must be a number")
        raise


def _label(option: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        _refuse(option, text, "must be a whole number")
        raise


def _refuse(option: str, text: str, rule: str) -> None:
    raise ModelError(Problem(option, f'"{text}"', rule))
