"""Loaded rolling bearings: the frictional moment of the SKF catalogue (2012) without seals and drag losses.

    M = phi_ish phi_rs G_rr (nu n)^0.6 + G_sl mu_sl                                                          [N mm]
    phi_ish = 1 / (1 + 1.84e-9 (n d_m)^1.28 nu^0.64)                              inlet shear heating
    phi_rs  = exp(-K_rs nu n (d + D) sqrt(K_Z / (2 (D - d))))                     replenishment, starvation
    mu_sl   = phi_bl mu_bl + (1 - phi_bl) mu_EHL,    phi_bl = exp(-2.6e-8 (n nu)^1.4 d_m)

nu in mm^2/s, n in 1/min, lengths in mm, loads in N. G_rr and G_sl follow from d_m = (d + D)/2, the loads and
coefficients of the series. Of the catalogue's tables only those of deep-groove ball bearings and of cylindrical roller
bearings of the series 4 were at hand, so there are no other types.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import exp, pi, radians, sin, sqrt
from typing import Annotated, Any, ClassVar, NamedTuple

from gearrattle.model import units
from gearrattle.model.drag_parts.drag_part import Drag, DragPart
from gearrattle.model.oil import Oil
from gearrattle.model.table import Breach, breach
from gearrattle.model.value_kinds import Choice, Count, Plain, Quantity, value_of

_R2 = 1.7  # of all deep-groove series
_FLOODED = "flooded"
_REPLENISHMENT = {"oil-bath": 3e-8, "injection": 3e-8, "oil-air": 6e-8, "grease": 6e-8, _FLOODED: 0.0}
"""K_rs by the way the oil comes; a flooded bearing does not starve."""


class _Row(NamedTuple):
    """Coefficients of a deep-groove series for G_rr and G_sl."""

    r1: float
    s1: float
    s2: float


_DEEP_GROOVE = {
    "60": _Row(4.1e-7, 3.73e-3, 14.6),
    "62": _Row(3.9e-7, 3.23e-3, 36.5),
    "63": _Row(3.7e-7, 2.84e-3, 92.8),
    "64": _Row(3.6e-7, 2.43e-3, 198.0),
    "160": _Row(4.3e-7, 4.63e-3, 4.25),
    "618": _Row(4.7e-7, 6.50e-3, 0.78),
    "619": _Row(4.3e-7, 4.75e-3, 3.6),
}
_CYLINDRICAL = "cylindrical-4"
_CYLINDRICAL_ROW = _Row(1e-6, 0.16, 0.0015)


@dataclass(frozen=True)
class _Series(Choice):
    """A series of bearings."""

    def read(self, value: Any, _dimensionless: bool, /) -> str:
        """Return the series; of another one say why there is none."""
        if not isinstance(value, str) or value not in self.options:
            words = ", ".join(f'"{option}"' for option in self.options)
            reason = 'the coefficients of other types are not known here: use kind = "rolling-bearing"'
            raise breach(f"must be one of {words}", reason)
        return value


class SkfBearing(DragPart):
    """A loaded deep-groove ball bearing, or a cylindrical roller bearing of the series 4."""

    source: ClassVar[str] = "SKF catalogue (2012), rolling and sliding; without seals and drag losses in the bath"
    law_error: ClassVar[str] = "a factor of 2 to 3 at light load; extrapolated below 1 % of the dynamic rating"
    kind: Annotated[str, Choice(("skf-bearing",))]
    """"skf-bearing"."""
    series: Annotated[str, _Series((*_DEEP_GROOVE, _CYLINDRICAL))]
    """First figures of the designation: "62" of 6206; "cylindrical-4" of NU, NJ, NUP 4.."""
    bore: Annotated[float, Quantity(units.LENGTH, "positive")]
    """d, inner diameter [m]."""
    outer_diameter: Annotated[float, Quantity(units.LENGTH, "positive")]
    """D, outer diameter [m]."""
    radial_load: Annotated[float, Quantity(units.FORCE, "non-negative")] = 0.0
    """F_r, on one bearing [N]."""
    axial_load: Annotated[float, Quantity(units.FORCE, "non-negative")] = 0.0
    """F_a, on one bearing [N]."""
    static_rating: Annotated[float, Quantity(units.FORCE, "positive")] | None = None
    """C_0, basic static load rating [N]; needed for a deep-groove bearing with axial load."""
    lubrication: Annotated[str, Choice(tuple(_REPLENISHMENT))] = "oil-bath"
    """How the oil comes to it."""
    friction: Annotated[float, Plain("non-negative")] | None = None
    """mu_EHL, friction of a full film; default: 0.02 of cylindrical rollers, else 0.05, that of mineral oil (0.04 of
    synthetic oil, 0.1 of transmission fluid)."""
    boundary_friction: Annotated[float, Plain("non-negative")] = 0.15
    """mu_bl, friction without a film."""
    number: Annotated[int, Count(1)] = 1
    """Number of bearings side by side."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: a bore not smaller than the outer diameter, no load, axial load without C_0."""
        yield from super().rules(table, dimensionless)
        bore = value_of(cls, table, "bore", dimensionless)
        outer = value_of(cls, table, "outer_diameter", dimensionless)
        if bore is not None and outer is not None and bore >= outer:
            yield Breach(("bore",), table["bore"], "must be smaller than outer_diameter")
        radial = value_of(cls, table, "radial_load", dimensionless)
        axial = value_of(cls, table, "axial_load", dimensionless)
        if radial == 0.0 and axial == 0.0:
            rule = "the law has no torque without load: radial_load or axial_load must be there"
            yield Breach((), table, rule, 'of an unloaded bearing use kind = "rolling-bearing"')
        if axial and table.get("series") in _DEEP_GROOVE and "static_rating" not in table:
            yield Breach(("axial_load",), table["axial_load"], "of a deep-groove bearing needs static_rating, C_0")

    def law(self, speed: float, oil: Oil | None, /) -> Drag:
        """Return torque and slope at a relative speed [rad/s]."""
        assert oil is not None
        nu = 1e6 * oil.kinematic_viscosity()  # mm^2/s
        n = speed * 30.0 / pi  # 1/min
        rolling, sliding = self._load_variables()
        d_m = self._mean_diameter

        # rolling, with its slope over ln n
        heating = 1.84e-9 * (n * d_m) ** 1.28 * nu**0.64
        shear = 1.0 / (1.0 + heating)
        starvation = self._starvation * nu * n
        rolls = shear * exp(-starvation) * rolling * (nu * n) ** 0.6
        rolls_slope = rolls * (0.6 - 1.28 * heating * shear - starvation)

        # sliding, likewise
        film = 2.6e-8 * (n * nu) ** 1.4 * d_m
        boundary = exp(-film)
        slides = sliding * (boundary * self.boundary_friction + (1.0 - boundary) * self._friction)
        slides_slope = -1.4 * film * boundary * sliding * (self.boundary_friction - self._friction)

        torque = 1e-3 * self.number * (rolls + slides)
        return Drag(torque, 1e-3 * self.number * (rolls_slope + slides_slope) / speed)

    def _load_variables(self) -> tuple[float, float]:
        """Return G_rr and G_sl, for loads in N and diameters in mm."""
        d_m = self._mean_diameter
        radial = self.radial_load
        axial = self.axial_load
        if self.series == _CYLINDRICAL:
            row = _CYLINDRICAL_ROW
            return row.r1 * d_m**2.41 * radial**0.31, row.s1 * d_m**0.9 * axial + row.s2 * d_m * radial
        row = _DEEP_GROOVE[self.series]
        if not axial:
            return row.r1 * d_m**1.96 * radial**0.54, row.s1 * d_m**-0.26 * radial ** (5.0 / 3.0)
        assert self.static_rating is not None
        contact = sin(radians(24.6 * (axial / self.static_rating) ** 0.24))
        rolling = row.r1 * d_m**1.96 * (radial + _R2 * axial / contact) ** 0.54
        sliding = row.s1 * d_m**-0.145 * (radial**5 + row.s2 * d_m**1.5 * axial**4 / contact) ** (1.0 / 3.0)
        return rolling, sliding

    @property
    def _starvation(self) -> float:
        """K_rs (d + D) sqrt(K_Z / (2 (D - d)))."""
        geometry = 5.1 if self.series == _CYLINDRICAL else 3.1  # K_Z
        inner = 1e3 * self.bore
        outer = 1e3 * self.outer_diameter
        return _REPLENISHMENT[self.lubrication] * (inner + outer) * sqrt(geometry / (2.0 * (outer - inner)))

    @property
    def _friction(self) -> float:
        if self.friction is not None:
            return self.friction
        return 0.02 if self.series == _CYLINDRICAL else 0.05

    @property
    def _mean_diameter(self) -> float:
        """d_m [mm]."""
        return 0.5e3 * (self.bore + self.outer_diameter)
