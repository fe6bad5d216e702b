"""Conversion of quantities with units to SI numbers: ``"1.5 kN*m/rad"`` becomes 1500.0.

Two things are special here. First, *angle is a dimension*: radian and degree are not silently 1, so ``N*m`` is no
torsional stiffness and ``N*m/rad`` no torque. Second, conversion is exact: the decimal number and the unit's factor
are multiplied as fractions and rounded once, so ``"0.05 mm"`` is the same double as ``5e-05``.

The text is split by a small parser of our own (products, quotients, whole powers); pint supplies only the meaning of
a single symbol, from its registry with radian made a base unit. No text is ever evaluated. What nearly every file uses
stands in ``known_units``, as pint has it; pint is imported when the first other symbol occurs, not before.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from gearrattle.model.known_units import KNOWN_UNITS, Exponents
from gearrattle.wording import with_article

if TYPE_CHECKING:
    from pint import UnitRegistry


@dataclass(frozen=True)
class Dimension:
    """Dimension of a key's values: what it measures, and its SI unit.

    ``exponents`` are the powers of kg, m, s and rad; ``symbols``, if not empty, the only unit texts allowed.
    """

    name: str
    si: str
    exponents: Exponents
    example: str
    symbols: frozenset[str] = field(default=frozenset())
    hint: str = ""


MOMENT_OF_INERTIA = Dimension("moment of inertia", "kg*m^2", (1, 2, 0, 0), "0.3 kg*m^2")
TORQUE = Dimension("torque", "N*m", (1, 2, -2, 0), "10 N*m")
TORSIONAL_STIFFNESS = Dimension("torsional stiffness", "N*m/rad", (1, 2, -2, -1), "1.5 kN*m/rad")
TORSIONAL_DAMPING = Dimension("torsional damping", "N*m*s/rad", (1, 2, -1, -1), "0.2 N*m*s/rad")
ANGLE = Dimension("angle", "rad", (0, 0, 0, 1), "5 deg")
ANGULAR_VELOCITY = Dimension(
    "angular velocity", "rad/s", (0, 0, -1, 1), "1500 rpm", hint="Hz belongs to frequency; a speed is rpm or angle/time"
)
ANGULAR_ACCELERATION = Dimension("angular acceleration", "rad/s/s", (0, 0, -2, 1), "100 rpm/s")
FREQUENCY = Dimension(
    "frequency",
    "Hz",
    (0, 0, -1, 0),
    "25 Hz",
    symbols=frozenset({"Hz", "kHz"}),
    hint="rpm and rad/s belong to speed; a frequency is in Hz or kHz",
)
LENGTH = Dimension("length", "m", (0, 1, 0, 0), "0.1 mm")
LINEAR_STIFFNESS = Dimension("stiffness along the line of action", "N/m", (1, 0, -2, 0), "7.2e8 N/m")
LINEAR_DAMPING = Dimension("damping along the line of action", "N*s/m", (1, 0, -1, 0), "4500 N*s/m")
MASS = Dimension("mass", "kg", (1, 0, 0, 0), "0.8 kg")
LINE_SPEED = Dimension("speed along the line of action", "m/s", (0, 1, -1, 0), "1 mm/s")
ACCELERATION = Dimension("acceleration", "m/s^2", (0, 1, -2, 0), "9.81 m/s^2")
ENERGY = Dimension("energy", "J", (1, 2, -2, 0), "1 uJ")
PRESSURE = Dimension("pressure", "Pa", (1, -1, -2, 0), "60 bar")
TIME = Dimension("time", "s", (0, 0, 1, 0), "20 us")
KINEMATIC_VISCOSITY = Dimension("kinematic viscosity", "m^2/s", (0, 2, -1, 0), "75 mm^2/s", hint="1 cSt is 1 mm^2/s")
DENSITY = Dimension("density", "kg/m^3", (1, -3, 0, 0), "870 kg/m^3")
VOLUME = Dimension("volume", "m^3", (0, 3, 0, 0), "1500 cm^3", hint="1 l is 1000 cm^3")
FORCE = Dimension("force", "N", (1, 1, -2, 0), "8 N")
PRESSURE_PER_FORCE = Dimension("pressure per force", "Pa/N", (0, -2, 0, 0), "1 Pa/N")
TEMPERATURE = Dimension(
    "temperature",
    "degC",
    (0, 0, 0, 0),
    "40 degC",
    symbols=frozenset({"degC", "°C", "K"}),
    hint="a plain number is in degC",
)
"""Of what has a zero of its own: numbers are in degrees Celsius, in files and in the model."""

DIMENSIONS = {
    dimension.si: dimension
    for dimension in (
        TORQUE,
        TORSIONAL_STIFFNESS,
        ANGLE,
        ANGULAR_VELOCITY,
        ANGULAR_ACCELERATION,
        LENGTH,
        LINE_SPEED,
        ENERGY,
        TIME,
        FORCE,
    )
}
"""What results measure, by their SI unit."""

_ZERO_CELSIUS = Fraction("273.15")  # K
_BASE_UNITS = {"kilogram": 0, "meter": 1, "second": 2, "radian": 3}
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_TOKEN = re.compile(r"\s*(\*\*|[*/^()·⋅×]|[+-]?\d+|[^\W\d_]\w*|°|[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+)")
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_NOT_FINITE = re.compile(r"[+-]?(?:nan|inf|infinity)\b", re.ASCII | re.IGNORECASE)
NOT_FINITE = "must be a finite number, not beyond the range of a double"
_MOST_DIGITS = 600
"""Before and after the point: beyond all doubles in any unit, and few enough to count with exactly."""
_LONGEST = 100
_LARGEST_POWER = 4
_COMMON = (
    *("kg", "g", "m", "mm", "um", "N", "kN", "s", "ms", "us", "rad", "mrad", "deg", "rpm", "Hz", "kHz", "min"),
    *("inch", "ft", "lbf", "lb", "turn", "revolution", "degree", "newton", "meter", "second", "radian"),
)


def with_last_unit(texts: Sequence[str]) -> list[str]:
    """Return texts of one list or range, stripped; the unit of the last one holds for plain numbers before it.

    "800", "3000 rpm" is "800 rpm", "3000 rpm"; a list whose last text has no unit is left as it is.
    """
    stripped = [text.strip() for text in texts]
    number = _NUMBER.match(stripped[-1]) if stripped else None
    unit = stripped[-1][number.end() :].strip() if number else ""
    return [f"{text} {unit}" if unit and _NUMBER.fullmatch(text) else text for text in stripped]


class UnitError(ValueError):
    """A text that is no quantity of the dimension asked for: the rule it breaks and the remedy."""

    def __init__(self, rule: str, remedy: str = "") -> None:
        self.rule = rule
        self.remedy = remedy
        super().__init__(rule)


class _Measure(NamedTuple):
    """A unit in SI: exact factor, powers of kg, m, s, rad, and the symbols it is made of with their own powers."""

    factor: Fraction
    exponents: Exponents
    symbols: tuple[tuple[str, Exponents], ...]

    def naming(self, exponents: Exponents) -> str:
        """Return the first symbol that has these powers by itself; empty if there is none."""
        return next((name for name, own in self.symbols if own == exponents), "")


def convert(text: str, dimension: Dimension) -> float:
    """Convert a decimal number with a unit, such as ``"0.05 mm"``, to ``dimension.si``, correctly rounded; UnitError
    for no number, no unit, an unknown unit, the wrong dimension (angle included), or a value beyond a double's
    range.
    """
    number, unit = _split(text, dimension)
    if dimension.symbols and unit not in dimension.symbols:
        allowed = " or ".join(sorted(dimension.symbols))
        raise UnitError(f"must be {with_article(dimension.name)} in {allowed}", dimension.hint)
    if dimension is TEMPERATURE:
        return _rounded(number - _ZERO_CELSIUS if unit == "K" else number)
    measure = _measure(unit)
    if measure.exponents != dimension.exponents:
        raise _mismatch(unit, measure, dimension)
    if dimension is ANGULAR_VELOCITY and measure.naming(FREQUENCY.exponents):
        raise UnitError("must be rpm or an angle divided by a time", dimension.hint)
    if dimension is not ENERGY and (energy := measure.naming(ENERGY.exponents)):
        raise UnitError(
            f"must be {with_article(dimension.name)} in {dimension.si}; {energy} is a unit of energy",
            f'write it as in "{dimension.example}"',
        )
    return _rounded(number * measure.factor)


def _rounded(number: Fraction) -> float:
    """Return the nearest double; UnitError beyond its range."""
    try:
        return float(number)
    except OverflowError:
        raise UnitError(NOT_FINITE) from None


def _split(text: str, dimension: Dimension) -> tuple[Fraction, str]:
    """Split a text into its exact number and its unit."""
    example = f'write it as in "{dimension.example}"'
    stripped = text.strip()
    if len(stripped) > _LONGEST:
        raise UnitError(f"must be a number with a unit, at most {_LONGEST} characters", example)
    if _NOT_FINITE.match(stripped):
        raise UnitError(NOT_FINITE)
    match = _NUMBER.match(stripped)
    if match is None:
        raise UnitError(f"must begin with a decimal number, followed by a unit of {dimension.name}", example)
    unit = stripped[match.end() :].strip()
    if unit.startswith((",", "_")):
        raise UnitError("must be a number with a decimal point and no separators", example)
    if not unit:
        raise UnitError(
            f"must name a unit of {dimension.name}",
            f"write the plain number {stripped} without quotes if it is in {dimension.si}",
        )
    decimal = Decimal(match.group())
    if decimal and decimal.adjusted() > _MOST_DIGITS:
        raise UnitError(NOT_FINITE)
    is_nothing = decimal.adjusted() < -_MOST_DIGITS  # as of a number without a unit, which TOML reads as 0.0
    return Fraction(0 if is_nothing else decimal), unit


def _mismatch(unit: str, measure: _Measure, dimension: Dimension) -> UnitError:
    """Explain a unit of the wrong dimension."""
    angle = measure.exponents[3]
    wanted = dimension.exponents[3]
    example = _advice_newton(unit) or f'write it as in "{dimension.example}"'
    if measure.exponents[:3] == dimension.exponents[:3] and dimension is not ANGULAR_VELOCITY:
        if wanted and not angle:
            return UnitError(
                f"must be {with_article(dimension.name)} and name an angle unit, such as {dimension.si}", example
            )
        if angle and not wanted:
            return UnitError(
                f"must be {with_article(dimension.name)} in {dimension.si} and must not name an angle unit", example
            )
    return UnitError(
        f"must be {with_article(dimension.name)} ({dimension.si}); {unit} is not", dimension.hint or example
    )


@lru_cache(maxsize=1024)
def _measure(unit: str) -> _Measure:
    """Work out a unit text such as ``kN*m/rad``."""
    tokens = _tokens(unit)
    measure, rest = _product(tokens)
    if rest:
        raise UnitError(f"must have a unit that can be read; {unit!r} has a stray {rest[0]!r}", _advice(unit))
    return measure


def _tokens(unit: str) -> tuple[str, ...]:
    """Cut a unit text into symbols, operators and powers."""
    tokens: list[str] = []
    position = 0
    while position < len(unit):
        match = _TOKEN.match(unit, position)
        if match is None:
            raise UnitError(f"must have a unit that can be read; {unit!r} is none", _advice(unit))
        tokens.append(match.group(1))
        position = match.end()
    return tuple(tokens)


def _product(tokens: tuple[str, ...]) -> tuple[_Measure, tuple[str, ...]]:
    """Read factors joined by ``*``, ``/`` or blanks, from left to right, up to a closing bracket or the end."""
    result, rest = _power(tokens)
    while rest and rest[0] != ")":
        sign = -1 if rest[0] == "/" else 1
        factor, rest = _power(rest[1:] if rest[0] in {"*", "/", "·", "⋅", "×"} else rest)
        result = _multiply(result, factor, sign)
    return result, rest


def _power(tokens: tuple[str, ...]) -> tuple[_Measure, tuple[str, ...]]:
    """Read one symbol or bracket and the whole power after it."""
    if not tokens:
        raise UnitError("must have a complete unit; something is missing at its end")
    # base: a product in brackets, or one symbol
    head = tokens[0]
    rest = tokens[1:]
    if head == "(":
        base, rest = _product(rest)
        if not rest:
            raise UnitError("must have a unit with closed brackets")
        rest = rest[1:]
    elif head[0].isalpha() or head == "°":
        base = _symbol(head)
    else:
        remedy = "write a speed in rpm, a frequency in Hz" if head == "1" else ""
        raise UnitError(f"must have a unit that can be read; {head!r} stands where a unit symbol should", remedy)
    # exponent: after ^ or **, or as superscript digits
    exponent: str | None = None
    if rest and rest[0] in {"^", "**"}:
        exponent = rest[1] if len(rest) > 1 else ""
        rest = rest[2:]
    elif rest and rest[0][0] in "⁰¹²³⁴⁵⁶⁷⁸⁹⁻":
        exponent = rest[0].translate(_SUPERSCRIPTS)
        rest = rest[1:]
    if exponent is None:
        return base, rest
    # whole powers only
    if not re.fullmatch(r"[+-]?\d{1,2}", exponent, re.ASCII) or abs(int(exponent)) > _LARGEST_POWER:
        raise UnitError(f"must have whole powers between -{_LARGEST_POWER} and {_LARGEST_POWER} in its unit")
    return _raise(base, int(exponent)), rest


def _multiply(left: _Measure, right: _Measure, sign: int) -> _Measure:
    """Return ``left * right**sign``."""
    exponents = tuple(a + sign * b for a, b in zip(left.exponents, right.exponents, strict=True))
    factor = left.factor * right.factor if sign > 0 else left.factor / right.factor
    return _Measure(factor, (exponents[0], exponents[1], exponents[2], exponents[3]), left.symbols + right.symbols)


def _raise(base: _Measure, power: int) -> _Measure:
    """Return ``base**power``."""
    kg, m, s, rad = (power * exponent for exponent in base.exponents)
    return _Measure(base.factor**power, (kg, m, s, rad), base.symbols)


def _symbol(name: str) -> _Measure:
    """Look one unit symbol up."""
    factor, exponents = KNOWN_UNITS[name] if name in KNOWN_UNITS else _looked_up(name)
    return _Measure(factor, exponents, ((name, exponents),))


@lru_cache(maxsize=1024)
def _looked_up(name: str) -> tuple[Fraction, Exponents]:
    """Look one unit symbol up in pint's registry: its exact factor, and its powers."""
    from pint.errors import PintError

    registry = _registry()
    try:
        factor, base = registry.get_base_units(name)
        powers: Iterable[tuple[str, Any]] = base._units.items()  # unit and power; pint has no public view of them
        exponents = [0, 0, 0, 0]
        for unit, power in powers:
            exponents[_BASE_UNITS[unit]] = int(power)
        exact = Fraction(str(factor))
    except (PintError, KeyError, TypeError, ValueError, AttributeError):
        raise UnitError(f"must have a known unit; {name!r} is none", _advice(name)) from None
    return exact, (exponents[0], exponents[1], exponents[2], exponents[3])


@lru_cache(maxsize=1)
def _registry() -> UnitRegistry[Any]:
    """Build pint's registry in exact arithmetic, with radian a base unit."""
    from pint import UnitRegistry

    registry: UnitRegistry[Any] = UnitRegistry(non_int_type=Fraction, on_redefinition="ignore")
    registry.define("radian = [angle] = rad")
    return registry


def _advice_newton(unit: str) -> str:
    """Explain ``Nm``, which pint takes for a textile unit, and ``N.m``."""
    return "write N*m with an asterisk" if re.search(r"N\.?m", unit) else ""


def _advice(unit: str) -> str:
    """Suggest what a wrong unit text may have meant."""
    if newton := _advice_newton(unit):
        return newton
    if re.search(r"[A-Za-z]\d", unit):
        return "write a power with ^, as in kg*m^2"
    by_lower = {name.lower(): name for name in reversed(_COMMON)}
    close = difflib.get_close_matches(unit.lower(), list(by_lower), n=1, cutoff=0.6)
    return f'did you mean "{by_lower[close[0]]}"?' if close else ""
