"""The oil: its viscosity over temperature by Walther's law, and its density.

    lg lg (nu + c) = A - B lg T,        nu in mm^2/s, T in K, c = 0.7

(ASTM D341; C. Walther, Erdoel und Teer 7 (1931) 382) through two points of a data sheet. Density falls in a straight
line, rho = rho_15 (1 + a (theta - 15)). A table of oils has data sheets whose source is named.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, NamedTuple

from gearrattle.model import units
from gearrattle.model.table import Breach, Table
from gearrattle.model.value_kinds import Choice, Plain, Quantity, two, value_of

ZERO_CELSIUS = 273.15
"""[K]."""
_SHIFT = 0.7  # c [mm^2/s]
_SQUARE_MM = 1e-6  # [m^2]
_THINNEST = 2.0  # [mm^2/s] down to which the law holds with this c
COLDEST = -60.0
HOTTEST = 250.0
"""Temperatures between which oils are taken [degC]."""
_REFERENCE = 15.0  # [degC] of the density
_MINERAL = -5.8e-4  # [1/K] slope of the density of mineral oils
_TYPICAL_DENSITY = 870.0


class DataSheet(NamedTuple):
    """Two viscosities of an oil [mm^2/s], its density at 15 degC [kg/m^3] if known, and who says so."""

    at_40: float
    at_100: float
    density: float | None
    source: str


_FILLER = "approval sheets of the maker, as collected in public code"
OILS = {
    "70w-75w-gl4": DataSheet(30.8, 5.9, 845.0, "Liqui Moly data sheet, oil of the VW ID.3 reducer"),
    "atf-mb-236.10": DataSheet(34.5, 7.4, None, _FILLER),
    "atf-mb-236.12": DataSheet(29.0, 6.3, None, _FILLER),
    "atf-mb-236.14": DataSheet(29.0, 6.5, None, _FILLER),
    "atf-mb-236.15": DataSheet(29.6, 6.0, None, _FILLER),
}
"""Oils by name."""

Temperature = Annotated[float, Quantity(units.TEMPERATURE)]


class ViscosityPoint(Table):
    """A kinematic viscosity of a data sheet."""

    temperature: Temperature
    """Temperature [degC]."""
    kinematic: Annotated[float, Quantity(units.KINEMATIC_VISCOSITY, "positive")]
    """Kinematic viscosity there [m^2/s]; 1 mm^2/s is 1 cSt."""


class Oil(Table):
    """The ``[oil]`` table: what the parts of the drag are computed with."""

    type: Annotated[str, Choice(tuple(OILS))] | None = None
    """A known oil, in place of ``viscosity``."""
    viscosity: (
        Annotated[tuple[ViscosityPoint, ViscosityPoint], two("must be two points of a data sheet, at two temperatures")]
        | None
    ) = None
    """Two points of a data sheet, mostly at 40 and 100 degC."""
    density: Annotated[float, Quantity(units.DENSITY, "positive")] | None = None
    """Density at 15 degC [kg/m^3]; default: that of the known oil, else 870."""
    density_slope: Annotated[float, Plain()] = _MINERAL
    """Relative change of the density with temperature [1/K]; default: that of mineral oils."""
    temperature: Temperature
    """Temperature of the oil [degC]."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: no viscosity or two of them, one that rises, a temperature of no oil."""
        if dimensionless:
            yield Breach((), table, "a dimensionless model has no oil", "give drag parts of the kind constant")
            return
        if ("type" in table) == ("viscosity" in table):
            remedy = 'such as viscosity = [{ temperature = "40 degC", kinematic = "75 mm^2/s" }, ...]'
            yield Breach((), table, f"either viscosity or type ({', '.join(OILS)}) must be there", remedy)
        yield from _temperature_breaches(("temperature",), value_of(cls, table, "temperature", dimensionless), table)
        rows = table.get("viscosity")
        rows = rows if isinstance(rows, list | tuple) else ()
        points = []
        for index, row in enumerate(rows):
            temperature = value_of(ViscosityPoint, row, "temperature", dimensionless)
            kinematic = value_of(ViscosityPoint, row, "kinematic", dimensionless)
            yield from _temperature_breaches(("viscosity", index, "temperature"), temperature, row)
            if temperature is not None and kinematic is not None:
                points.append((temperature, kinematic))
        if len(points) == 2:
            (cold, thick), (hot, thin) = sorted(points)
            if cold == hot or thin >= thick:
                rule = "the viscosity must fall from the lower to the higher temperature"
                yield Breach(("viscosity",), rows, rule, "take two points of the data sheet")

    @property
    def _points(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Two temperatures [degC] with their viscosities [mm^2/s], the colder first."""
        if self.type is not None:
            sheet = OILS[self.type]
            return (40.0, sheet.at_40), (100.0, sheet.at_100)
        assert self.viscosity is not None
        first, second = sorted((point.temperature, point.kinematic / _SQUARE_MM) for point in self.viscosity)
        return first, second

    def kinematic_viscosity(self, temperature: float | None = None) -> float:
        """Return nu by Walther's law [m^2/s] at a temperature [degC]; None: that of the oil."""
        (cold, thick), (hot, thin) = self._points
        coldest, hottest, asked = (
            math.log10(degrees + ZERO_CELSIUS)
            for degrees in (cold, hot, self.temperature if temperature is None else temperature)
        )
        first = math.log10(math.log10(thick + _SHIFT))
        second = math.log10(math.log10(thin + _SHIFT))
        height = first + (second - first) * (asked - coldest) / (hottest - coldest)
        return float((10.0 ** (10.0**height) - _SHIFT) * _SQUARE_MM)

    def mass_density(self, temperature: float | None = None) -> float:
        """Return the density [kg/m^3] at a temperature [degC]; None: that of the oil."""
        own = self.density
        if own is None and self.type is not None:
            own = OILS[self.type].density
        degrees = self.temperature if temperature is None else temperature
        reference = _TYPICAL_DENSITY if own is None else own
        return reference * (1.0 + self.density_slope * (degrees - _REFERENCE))

    def dynamic_viscosity(self, temperature: float | None = None) -> float:
        """Return eta = nu rho [Pa s] at a temperature [degC]; None: that of the oil."""
        return self.kinematic_viscosity(temperature) * self.mass_density(temperature)

    def notes(self) -> tuple[str, ...]:
        """Say where the oil is taken beyond its data."""
        notes = []
        (cold, _), (hot, _) = self._points
        if not cold <= self.temperature <= hot:
            notes.append(
                f"the viscosity at {self.temperature:g} degC is extrapolated from {cold:g} and {hot:g} degC: the "
                "constant of Walther's law alone moves it by 5 % at -20 degC, and cold multigrade oils are thinner "
                "where they are sheared"
            )
        if self.kinematic_viscosity() < _THINNEST * _SQUARE_MM:
            notes.append("the oil is thinner than 2 mm²/s, where Walther's law with the constant 0.7 ends")
        if self.density is None and (self.type is None or OILS[self.type].density is None):
            notes.append(f"oil.density is not there: {_TYPICAL_DENSITY:g} kg/m³ at 15 degC is assumed")
        return tuple(notes)


def _temperature_breaches(location: tuple[str | int, ...], degrees: float | None, table: object) -> Iterator[Breach]:
    """Yield the breach of a temperature that no gear oil has: kelvin without a unit, most likely."""
    if degrees is None or COLDEST <= degrees <= HOTTEST:
        return
    value = table.get("temperature") if isinstance(table, Mapping) else degrees
    rule = f"must lie between {COLDEST:g} and {HOTTEST:g} degC"
    yield Breach(location, value, rule, 'a plain number is in degC; write "313.15 K" for kelvin')
