"""Numbers as people read them: few digits, a true minus, powers of ten raised.

Takes floats; gives text to ticks, sketches and tables.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

from gearrattle.wording import prefixed

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
UNBROKEN = "\u00a0"
"""A blank at which no line is broken."""
_BEFORE_UNIT = re.compile(r"(?<=[\d⁰¹²³⁴⁵⁶⁷⁸⁹]) (?=[%×±]|[kMmµn]?(?:N|m|s|g|rad|rpm|Hz|dB|T)\b)|(?<=[×±]) (?=\d)")
_EXPONENT, _JOINER = re.compile(r"(?<=\de-)(?=\d)"), "\u2060"  # no line ends at the hyphen of 1e-14


def numeral(value: float, digits: int = 4, *, times: str = " × ") -> str:
    """Write a number.

    Parameters
    ----------
    value
        any float; NaN becomes a dash.
    digits
        significant digits.
    times
        what stands between mantissa and power of ten.

    Returns
    -------
    str
        Plain notation from 0.001 to 100 000, mantissa and power of ten elsewhere, e.g. ``"1.5 × 10⁻⁷"``.
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


def grouped(number: int) -> str:
    """Write a whole number in groups of three, between which no line is broken."""
    return f"{number:,}".replace(",", UNBROKEN)


def unbroken(text: str) -> str:
    """Return text whose lines are not broken between a number and its unit, nor within a power of ten."""
    return _EXPONENT.sub(_JOINER, _BEFORE_UNIT.sub(UNBROKEN, text))


def quantity(value: float | None, unit: str = "", digits: int = 4) -> str:
    """Write a number with its unit; a dash for None and NaN; the unit ``"1"`` is not written."""
    if value is None or math.isnan(value):
        return "–"
    return f"{numeral(value, digits)} {unit}" if unit and unit != "1" else numeral(value, digits)


def engineering_column(values: Iterable[float], unit: str, digits: int = 3) -> list[str]:
    """Write numbers with their unit and one SI prefix, that of the largest; a dash for NaN."""
    numbers = list(values)
    factor, scaled = prefixed(max((abs(value) for value in numbers if math.isfinite(value)), default=0.0), unit)
    return [quantity(value * factor, scaled, digits) for value in numbers]


def engineering(value: float | None, unit: str, digits: int = 3) -> str:
    """Write a number with its unit and an SI prefix; a dash for None and NaN."""
    if value is None or math.isnan(value):
        return "–"
    factor, scaled = prefixed(abs(value), unit)
    return quantity(value * factor, scaled, digits)
