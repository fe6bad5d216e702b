"""Rolling and needle bearings: the no-load and the load torque of Palmgren.

    M_0 = 1e-7 f_0 (nu n)^(2/3) d_m^3  for nu n >= 2000,  else 160e-7 f_0 d_m^3,      M_1 = f_1 P d_m      [N mm]

nu in mm^2/s, n in 1/min (of the rings, relative), d_m = (d + D)/2 in mm, P in N: A. Palmgren, Grundlagen der
Waelzlagertechnik (1964); f_0 and f_1 by type of bearing after M. Jungnickel (2010). At nu n = 2000 the printed law
decreases by 0.8 %; here the larger of the two branches is used, so that the torque never decreases with speed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import pi
from typing import Annotated, Any, ClassVar, NamedTuple

from gearrattle.model import units
from gearrattle.model.drag_parts.drag_part import Drag, DragPart
from gearrattle.model.oil import Oil
from gearrattle.model.table import Breach
from gearrattle.model.value_kinds import Choice, Count, Plain, Quantity, value_of

_SLOW = 160.0  # (nu n)^(2/3) below nu n = 2000


class _Type(NamedTuple):
    """Coefficients of a type of bearing: f_0 in an oil bath and with grease, f_1 at a tenth of its dynamic load."""

    f0: float
    f0_grease: float
    f1: float


_TYPES = {
    "deep-groove": _Type(2.0, 1.0, 0.00022),
    "angular-contact": _Type(3.3, 2.0, 0.00046),
    "tapered": _Type(6.0, 6.0, 0.00040),
    "cylindrical": _Type(3.0, 0.8, 0.00030),
    "cylindrical-full": _Type(5.0, 5.0, 0.00055),
    "needle": _Type(12.0, 12.0, 0.0020),
    "axial-needle": _Type(5.0, 14.0, 0.0015),
}
_LUBRICATION = {"oil-bath": 1.0, "injection": 2.0, "oil-air": 0.5}
"""Factor on f_0 of an oil bath; an oil bath around a vertical shaft is like injection."""
_GREASE = "grease"


class RollingBearing(DragPart):
    """A rolling bearing between a body and its shaft, or the housing."""

    source: ClassVar[str] = "Palmgren 1964, f_0 and f_1 after Jungnickel 2010"
    law_error: ClassVar[str] = "a factor of 2 to 3 without load, of 4 for needles"
    kind: Annotated[str, Choice(("rolling-bearing", "needle-bearing"))]
    """"rolling-bearing" or "needle-bearing"."""
    type: Annotated[str, Choice(tuple(_TYPES))] | None = None
    """Type of bearing; default: "needle" of a needle bearing, else "deep-groove"."""
    bore: Annotated[float, Quantity(units.LENGTH, "positive")] | None = None
    """d, inner diameter [m]."""
    outer_diameter: Annotated[float, Quantity(units.LENGTH, "positive")] | None = None
    """D, outer diameter [m]."""
    mean_diameter: Annotated[float, Quantity(units.LENGTH, "positive")] | None = None
    """d_m [m], in place of the two."""
    lubrication: Annotated[str, Choice((*_LUBRICATION, _GREASE))] = "oil-bath"
    """How the oil comes to it: it multiplies f_0."""
    load: Annotated[float, Quantity(units.FORCE, "non-negative")] = 0.0
    """P, load on one bearing [N]: of an idler, little more than its weight."""
    f0: Annotated[float, Plain("non-negative")] | None = None
    """f_0, in place of that of the type and its lubrication."""
    f1: Annotated[float, Plain("non-negative")] | None = None
    """f_1, in place of that of the type."""
    number: Annotated[int, Count(1)] = 1
    """Number of bearings side by side."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: no diameter or too many, a bore not smaller than the outer diameter."""
        yield from super().rules(table, dimensionless)
        has_both = "bore" in table and "outer_diameter" in table
        has_one = "bore" in table or "outer_diameter" in table
        if has_one == ("mean_diameter" in table) or has_one != has_both:
            rule = "either bore and outer_diameter, or mean_diameter must be there"
            yield Breach((), table, rule, 'such as bore = "30 mm", outer_diameter = "35 mm"')
        bore = value_of(cls, table, "bore", dimensionless)
        outer = value_of(cls, table, "outer_diameter", dimensionless)
        if bore is not None and outer is not None and bore >= outer:
            yield Breach(("bore",), table["bore"], "must be smaller than outer_diameter")

    def law(self, speed: float, oil: Oil | None, /) -> Drag:
        """Return torque and slope at a relative speed [rad/s]."""
        assert oil is not None
        diameter = 1e3 * self._mean_diameter  # mm
        flow = self._flow(speed, oil)
        size = 1e-10 * self._f0 * diameter**3  # N m
        loaded = 1e-3 * self._f1 * self.load * diameter
        power = flow ** (2.0 / 3.0)
        no_load = size * max(_SLOW, power)
        slope = 2.0 / 3.0 * no_load / speed if power > _SLOW else 0.0
        return Drag(self.number * (no_load + loaded), self.number * slope)

    @staticmethod
    def _flow(speed: float, oil: Oil) -> float:
        """Return nu n [mm^2/s 1/min]."""
        return 1e6 * oil.kinematic_viscosity() * speed * 30.0 / pi

    @property
    def _kind_of_bearing(self) -> _Type:
        return _TYPES[self.type or ("needle" if self.kind == "needle-bearing" else "deep-groove")]

    @property
    def _f0(self) -> float:
        if self.f0 is not None:
            return self.f0
        if self.lubrication == _GREASE:
            return self._kind_of_bearing.f0_grease
        return _LUBRICATION[self.lubrication] * self._kind_of_bearing.f0

    @property
    def _f1(self) -> float:
        return self._kind_of_bearing.f1 if self.f1 is None else self.f1

    @property
    def _mean_diameter(self) -> float:
        if self.mean_diameter is not None:
            return self.mean_diameter
        assert self.bore is not None
        assert self.outer_diameter is not None
        return 0.5 * (self.bore + self.outer_diameter)
