"""Plurals, articles and lists in English sentences, numbers with their units, and text in columns."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence

_SILENT_H = ("hour", "honest", "heir")
_Y_SOUND = ("uni", "use", "eu", "one")
_NARROWEST = 24  # characters
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def counted(number: float, noun: str, plural: str | None = None) -> str:
    """Return a number with its noun: "1 impact", "2 impacts", "0 impacts", "0.5 cycles"."""
    shown = f"{number:.3g}" if isinstance(number, float) else str(number)
    return f"{shown} {noun_of(number, noun, plural)}"


def noun_of(number: float, noun: str, plural: str | None = None) -> str:
    """Return a noun in the singular if the number is shown as 1, else its plural, by default with an s."""
    return noun if f"{number:.3g}" == "1" else plural or f"{noun}s"


def with_article(noun: str) -> str:
    """Return a noun with "a" or "an", by the sound of its begin: "an acceleration", "a unit", "an hour"."""
    word = noun.lower()
    vowel = word.startswith(("a", "e", "i", "o", "u", *_SILENT_H)) and not word.startswith(_Y_SOUND)
    return f"{'an' if vowel else 'a'} {noun}"


def listed(names: Sequence[str], last: str = "and") -> str:
    """Return names as a list in a sentence: "a", "a and b", "a, b and c"; ``last`` is the word before the last name."""
    return f" {last} ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def prefixed(largest: float, unit: str) -> tuple[float, str]:
    """Return factor and unit with the SI prefix that suits magnitudes up to ``largest``; no prefix for the empty unit,
    for ``"1"`` and for units in kg.
    """
    if unit in ("", "1") or unit.startswith("kg") or not 0.0 < largest < math.inf:
        return 1.0, unit
    if largest >= 2e7 and unit.startswith("N"):
        return 1e-6, f"M{unit}"
    if largest >= 2e4 and unit.startswith("N"):
        return 1e-3, f"k{unit}"
    for step, prefix in _PREFIXES:
        if largest >= 0.5 * step:
            return 1.0 / step, f"{prefix}{unit}"
    return 1.0, unit


def numeral(value: float, digits: int = 4, *, times: str = " × ") -> str:
    """Write a number with ``digits`` significant digits: plain from 0.001 to 100 000, otherwise as mantissa and power
    of ten, e.g. ``"1.5 × 10⁻⁷"``; NaN becomes a dash.
    """
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0.0 else "−∞"
    if value == 0.0:
        return "0"
    rounded = float(f"{value:.{digits - 1}e}")
    if 1e-3 <= abs(rounded) < 1e5:
        places = max(0, digits - 1 - math.floor(math.log10(abs(rounded))))
        text = f"{rounded:.{places}f}"
        return (text.rstrip("0").rstrip(".") if "." in text else text).replace("-", "−")
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    short = mantissa.rstrip("0").rstrip(".").replace("-", "−")
    raised = f"10{str(int(power)).translate(_RAISED)}"
    return raised if short == "1" else f"{short}{times}{raised}"


def quantity(value: float | None, unit: str = "", digits: int = 4) -> str:
    """Write a number with its unit; a dash for None and NaN; the unit ``"1"`` is not written."""
    if value is None or math.isnan(value):
        return "–"
    return f"{numeral(value, digits)} {unit}" if unit and unit != "1" else numeral(value, digits)


def engineering(value: float | None, unit: str, digits: int = 3) -> str:
    """Write a number with its unit and an SI prefix; a dash for None and NaN."""
    if value is None or math.isnan(value):
        return "–"
    factor, scaled = prefixed(abs(value), unit)
    return quantity(value * factor, scaled, digits)


def measured(value: float, unit: str, digits: int = 9, largest: float | None = None) -> str:
    """Return a number with its unit for messages, with the SI prefix that suits ``largest`` (None: the number)."""
    factor, scaled = prefixed(abs(value) if largest is None else largest, unit)
    return f"{value * factor:.{digits}g} {scaled}".rstrip()


def columns(
    head: Sequence[str], rows: Iterable[Sequence[str]], words: Collection[int] = (0,), width: int | None = None
) -> str:
    """Return a table as lines: columns with the indices ``words`` aligned left, the others right, two spaces between.

    If lines are longer than ``width`` characters, cells of words are wrapped, in columns of at least 24 characters.
    None: no limit.
    """
    table = [*([list(head)] if any(head) else []), *(list(row) for row in rows)]
    widths = _widths(table)
    if width is not None and sum(widths) + 2 * (len(widths) - 1) > width:
        table = _wrapped(table, words, width)
        widths = _widths(table)
    lines = (
        "  ".join(cell.ljust(widths[k]) if k in words else cell.rjust(widths[k]) for k, cell in enumerate(row))
        for row in table
    )
    return "\n".join(line.rstrip() for line in lines)


def _widths(table: Sequence[Sequence[str]]) -> list[int]:
    return [max(map(len, column)) for column in zip(*table, strict=True)]


def _wrapped(table: Sequence[Sequence[str]], words: Collection[int], width: int) -> list[list[str]]:
    """Return the table with its widest columns of words wrapped, in more rows, so that the lines fit the width."""
    from textwrap import wrap

    limits = _widths(table)
    while sum(limits) + 2 * (len(limits) - 1) > width:
        widest = max(words, key=limits.__getitem__, default=None)
        if widest is None or limits[widest] <= _NARROWEST:
            break
        limits[widest] -= 1
    rows = []
    for row in table:
        parts = [
            wrap(cell, limits[k], break_long_words=False, break_on_hyphens=False) if k in words else [cell]
            for k, cell in enumerate(row)
        ]
        height = max(map(len, parts))
        rows += [[*line] for line in zip(*(part + [""] * (height - len(part)) for part in parts), strict=True)]
    return rows
