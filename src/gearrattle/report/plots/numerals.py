"""Numbers on a page: digits in groups, columns with one unit, no line break before a unit.

``wording`` writes a single number with its unit and prefix, for pages and sentences.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from gearrattle.wording import engineering, numeral, prefixed, quantity

__all__ = ["UNBROKEN", "engineering", "engineering_column", "grouped", "numeral", "quantity", "unbroken"]

UNBROKEN = "\u00a0"
"""A blank without line break."""
_BEFORE_UNIT = re.compile(r"(?<=[\d⁰¹²³⁴⁵⁶⁷⁸⁹]) (?=[%×±]|[kMmµn]?(?:N|m|s|g|rad|rpm|Hz|dB|T)\b)|(?<=[×±]) (?=\d)")
# no line ends at the hyphen of 1e-14
_EXPONENT = re.compile(r"(?<=\de-)(?=\d)")
_JOINER = "\u2060"


def grouped(number: int) -> str:
    """Write a whole number in groups of three, between which no line is broken."""
    return f"{number:,}".replace(",", UNBROKEN)


def unbroken(text: str) -> str:
    """Return text whose lines are not broken between a number and its unit, nor within a power of ten."""
    return _EXPONENT.sub(_JOINER, _BEFORE_UNIT.sub(UNBROKEN, text))


def engineering_column(values: Iterable[float], unit: str, digits: int = 3) -> list[str]:
    """Write numbers with their unit and one SI prefix, that of the largest; a dash for NaN."""
    numbers = list(values)
    factor, scaled = prefixed(max((abs(value) for value in numbers if math.isfinite(value)), default=0.0), unit)
    return [quantity(value * factor, scaled, digits) for value in numbers]
