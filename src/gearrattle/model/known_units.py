"""The most frequent unit symbols in SI: exact factor, and powers of kg, m, s and rad.

pint has the same values, but takes half a second to import and to read its file of units. It converts all other units.
"""

from __future__ import annotations

from fractions import Fraction

Exponents = tuple[int, int, int, int]
"""Powers of kg, m, s and rad."""

_PI = Fraction("3.1415926535897932384626433832795028841971693993751")
_POUND = Fraction("0.45359237")
_GRAVITY = Fraction("9.80665")
_MICRO = Fraction(1, 10**6)

_MASS = (1, 0, 0, 0)
_LENGTH = (0, 1, 0, 0)
_TIME = (0, 0, 1, 0)
_ANGLE = (0, 0, 0, 1)
_FORCE = (1, 1, -2, 0)
_RATE = (0, 0, -1, 0)
_SPEED = (0, 0, -1, 1)
_PRESSURE = (1, -1, -2, 0)
_ENERGY = (1, 2, -2, 0)

_SYMBOLS: tuple[tuple[str, Fraction | int, Exponents], ...] = (
    ("kg kilogram", 1, _MASS),
    ("g gram", Fraction(1, 1000), _MASS),
    ("t", 1000, _MASS),
    ("lb", _POUND, _MASS),
    ("m meter metre", 1, _LENGTH),
    ("cm", Fraction(1, 100), _LENGTH),
    ("mm", Fraction(1, 1000), _LENGTH),
    ("um µm μm", _MICRO, _LENGTH),
    ("in inch", Fraction("0.0254"), _LENGTH),
    ("ft", Fraction("0.3048"), _LENGTH),
    ("s second", 1, _TIME),
    ("ms", Fraction(1, 1000), _TIME),
    ("us µs μs", _MICRO, _TIME),
    ("min", 60, _TIME),
    ("h", 3600, _TIME),
    ("rad radian", 1, _ANGLE),
    ("mrad", Fraction(1, 1000), _ANGLE),
    ("deg degree °", _PI / 180, _ANGLE),
    ("turn revolution", 2 * _PI, _ANGLE),
    ("N newton", 1, _FORCE),
    ("mN", Fraction(1, 1000), _FORCE),
    ("kN", 1000, _FORCE),
    ("MN", 10**6, _FORCE),
    ("lbf", _POUND * _GRAVITY, _FORCE),
    ("Hz hertz", 1, _RATE),
    ("kHz", 1000, _RATE),
    ("rpm", _PI / 30, _SPEED),
    ("Pa pascal", 1, _PRESSURE),
    ("kPa", 1000, _PRESSURE),
    ("MPa", 10**6, _PRESSURE),
    ("bar", 10**5, _PRESSURE),
    ("J joule", 1, _ENERGY),
    ("mJ", Fraction(1, 1000), _ENERGY),
    ("uJ µJ μJ", _MICRO, _ENERGY),
)

KNOWN_UNITS: dict[str, tuple[Fraction, Exponents]] = {
    name: (Fraction(factor), exponents) for names, factor, exponents in _SYMBOLS for name in names.split()
}
"""Factor and powers by symbol or name."""
