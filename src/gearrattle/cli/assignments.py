"""Options of the form NAME=NUMBER, NAME=NUMBER,NUMBER,..., NAME="1 N*m",... or NAME=WORD, which may be repeated.

Takes words; gives numbers and words by name.
"""

from __future__ import annotations

from collections.abc import Sequence

from gearrattle.errors import ModelError, Problem


def numbers(option: str, entries: Sequence[str]) -> dict[str, float]:
    """Return the numbers by name.

    Parameters
    ----------
    option
        its name, for messages.
    entries
        words of the form NAME=NUMBER.

    Raises
    ------
    ModelError
        a word of another form.
    """
    return {name: _number(option, text) for name, text in _pairs(option, entries)}


def labels(option: str, entries: Sequence[str]) -> dict[str, int]:
    """Return whole numbers by name, such as the labels of regions.

    Parameters
    ----------
    option
        its name, for messages.
    entries
        words of the form NAME=WHOLE NUMBER.

    Raises
    ------
    ModelError
        a word of another form.
    """
    return {name: _label(option, text) for name, text in _pairs(option, entries)}


def lists(option: str, entries: Sequence[str]) -> dict[str, list[float]]:
    """Return lists of numbers by name.

    Parameters
    ----------
    option
        its name, for messages.
    entries
        words of the form NAME=NUMBER,NUMBER,...

    Raises
    ------
    ModelError
        a word of another form.
    """
    return {name: [_number(option, part) for part in text.split(",")] for name, text in _pairs(option, entries)}


def texts(option: str, entries: Sequence[str]) -> dict[str, list[float | str]]:
    """Return lists by name: numbers, and quantities with their units as text.

    Parameters
    ----------
    option
        its name, for messages.
    entries
        words of the form NAME=VALUE,VALUE,...

    Raises
    ------
    ModelError
        a word of another form.
    """
    return {name: [_value(part.strip()) for part in text.split(",")] for name, text in _pairs(option, entries)}


def words(option: str, entries: Sequence[str]) -> dict[str, str]:
    """Return the words by name.

    Parameters
    ----------
    option
        its name, for messages.
    entries
        words of the form NAME=WORD.

    Raises
    ------
    ModelError
        a word of another form.
    """
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


def _value(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


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
