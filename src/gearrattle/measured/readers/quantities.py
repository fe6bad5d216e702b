"""Quantities of channels, and the factors of their units to SI.

The units are those of a model file, with angle as a dimension. Other spellings of measuring systems (``Nm``, ``1/min``,
``g``) are understood in measured files only.
"""

from __future__ import annotations

from gearrattle.model import units
from gearrattle.model.units import Dimension, UnitError
from gearrattle.recording import QUANTITIES

ANGULAR_ACCELERATION = Dimension("angular acceleration", "rad/s^2", (0, 0, -2, 1), "100 rad/s^2")
ACCELERATION = Dimension(
    "acceleration", "m/s^2", (0, 1, -2, 0), "10 m/s^2", hint="g is gram: gravity is g_n, as in 1 g_n"
)
FORCE = Dimension("force", "N", (1, 1, -2, 0), "10 N")

DIMENSIONS: dict[str, tuple[Dimension, ...]] = {
    "angle": (units.ANGLE,),
    "velocity": (units.ANGULAR_VELOCITY,),
    "acceleration": (ANGULAR_ACCELERATION,),
    "deflection": (units.ANGLE, units.LENGTH),
    "force": (units.TORQUE, FORCE),
    "torque": (units.TORQUE,),
    "surface acceleration": (ACCELERATION,),
    "sound pressure": (units.PRESSURE,),
    "speed": (units.ANGULAR_VELOCITY,),
    "shaft angle": (units.ANGLE,),
    "pulses": (),
}
"""What each quantity may be measured in; pulses in anything."""
assert tuple(DIMENSIONS) == QUANTITIES

_GUESSES = ("angle", "velocity", "acceleration", "torque", "surface acceleration", "sound pressure")
_SPELLINGS = {
    "Nm": "N*m",
    "N.m": "N*m",
    "kNm": "kN*m",
    "1/min": "rpm",
    "min-1": "rpm",
    "min^-1": "rpm",
    "U/min": "rpm",
    "rev/min": "rpm",
    "r/min": "rpm",
    "RPM": "rpm",
    "m/s2": "m/s^2",
    "m/s**2": "m/s^2",
    "rad/s2": "rad/s^2",
    "degree": "deg",
    "Deg": "deg",
    "Grad": "deg",
    "Upm": "rpm",
    "g": "g_n",
    "gn": "g_n",
}
_NONE = ("", "-", "1", "[-]", "none", "no_units")


def factor(unit: str, quantity: str) -> tuple[float, str]:
    """Return the factor of a unit to SI, and the SI unit; UnitError for one unknown or of the wrong dimension."""
    options = DIMENSIONS[quantity]
    if not options:
        return 1.0, unit or "1"
    if unit.strip() in _NONE:
        raise UnitError(f"needs its unit of {options[0].name}", f'such as unit = "{options[0].si}"')
    failures = []
    for dimension in options:
        try:
            return units.convert(f"1 {_spelt(unit)}", dimension), dimension.si
        except UnitError as error:
            failures.append(error)
    if len(options) > 1:
        either = " or ".join(f"{dimension.name} ({dimension.si})" for dimension in options)
        raise UnitError(f"must be a unit of {either}; {unit} is not", failures[0].remedy)
    raise failures[0]


def guess(unit: str) -> str:
    """Return the quantity that a unit alone determines; empty where it determines none."""
    for quantity in _GUESSES:
        try:
            factor(unit, quantity)
        except UnitError:
            continue
        return quantity
    return ""


def _spelt(unit: str) -> str:
    """Return a unit as ``model.units`` spells it."""
    text = unit.strip().replace("µ", "u").replace("μ", "u")
    return _SPELLINGS.get(text, text)
