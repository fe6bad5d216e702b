"""Numbers read well and mean what they say."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gearrattle.report.plots.numerals import engineering, grouped, numeral, quantity, unbroken
from gearrattle.wording import prefixed

RAISED = "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"


def read(text: str) -> float:
    """Read a number back from its text."""
    plain = text.replace("−", "-").translate(str.maketrans(RAISED, "-0123456789"))
    if text[-1] not in RAISED:
        return float(plain)
    mantissa, power = plain.split(" × 10") if " × " in text else ("1", plain.removeprefix("10"))
    return float(mantissa) * 10.0 ** int(power)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (1.0, "1"),
        (-2.5, "−2.5"),
        (1234.5678, "1235"),
        (0.001, "0.001"),
        (99_999.9, "10⁵"),
        (1.5e-7, "1.5 × 10⁻⁷"),
        (-1e6, "−1 × 10⁶"),
        (math.nan, "–"),
        (math.inf, "∞"),
        (-math.inf, "−∞"),
    ],
)
def test_numeral(value: float, text: str) -> None:
    assert numeral(value) == text


@given(st.floats(-1e12, 1e12, allow_nan=False))
def test_numeral_means_the_rounded_value(value: float) -> None:
    assert read(numeral(value, 5)) == pytest.approx(value, rel=1e-4, abs=1e-300)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (5e-5, "m", "50 µm"),
        (0.165, "m/s", "165 mm/s"),
        (1.2, "rad/s", "1.2 rad/s"),
        (25_000.0, "N", "25 kN"),
        (7e-9, "m", "7 nm"),
        (0.25, "", "0.25"),
        (0.25, "1", "0.25"),
        (0.0, "m", "0 m"),
        (None, "m", "–"),
        (math.nan, "m", "–"),
    ],
)
def test_engineering(value: float | None, unit: str, text: str) -> None:
    assert engineering(value, unit) == text


def test_prefix_scales_the_value_and_names_it() -> None:
    assert prefixed(3e-5, "m") == (1e6, "µm")
    assert quantity(3.0, "kg m²") == "3 kg m²"


def test_no_line_is_broken_within_a_number() -> None:
    blank = "\u00a0"
    assert grouped(1234567) == f"1{blank}234{blank}567"
    assert unbroken("62 % of 1.5 × 10⁻⁷ N m at 600 rpm, 5 of them") == (
        f"62{blank}% of 1.5{blank}×{blank}10⁻⁷{blank}N m at 600{blank}rpm, 5 of them"
    )
