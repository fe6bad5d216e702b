"""Churning of a gear that dips into the oil.

    T = 1/2 rho Omega^2 R^3 S_m C_m,      S_m = R^2 (2 t - sin 2 t) + D b t + 2 Z t H b / (pi cos alpha cos beta)

with the immersed surface S_m, cos t = 1 - h/R, and for Re = Omega R b / nu, Fr = Omega^2 R / g

    C_m = 1.366 (h/D)^0.45 (V_0/D^3)^0.1 Fr^-0.6 Re^-0.21                     Re < 6000
    C_m = 3.644 (h/D)^0.1 (V_0/D^3)^-0.35 Fr^-0.88 (b/D)^0.85                  Re > 9000

and a straight line in Re between the two (C. Changenet, P. Velex, J. Mech. Design 129 (2007) 128). The surface follows
from the geometry; the coefficients are quoted from memory of the paper and **unchecked**.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import acos, cos, pi, radians, sin
from typing import Annotated, Any, ClassVar

from gearrattle.model import units
from gearrattle.model.drag_parts.drag_part import Drag, DragPart
from gearrattle.model.oil import Oil
from gearrattle.model.table import Breach
from gearrattle.model.value_kinds import Choice, Count, Quantity, value_of

_GRAVITY = 9.80665  # m/s^2
_LAMINAR = 6000.0  # Re, up to which the first law holds
_TURBULENT = 9000.0  # Re, from which the second law holds
_SPLASH = 3.0  # m/s
_TWENTY_DEGREES = radians(20.0)

Length = Annotated[float, Quantity(units.LENGTH, "positive")]


class Churning(DragPart):
    """A gear that dips into the oil sump."""

    acts_between: ClassVar[bool] = False
    source: ClassVar[str] = "Changenet and Velex, J. Mech. Design 129 (2007) 128; coefficients unchecked"
    is_checked: ClassVar[bool] = False
    law_error: ClassVar[str] = "a factor of 5 to 15 between authors"
    kind: Annotated[str, Choice(("churning",))]
    """"churning"."""
    depth: Length
    """h, how deep the gear dips [m]."""
    oil_volume: Annotated[float, Quantity(units.VOLUME, "positive")]
    """V_0, oil in the sump [m^3]."""
    pitch_diameter: Length
    """D [m]."""
    face_width: Length
    """b [m]."""
    teeth: Annotated[int, Count(1)]
    """Z, number of teeth."""
    tooth_height: Length
    """H [m]; 2.25 times the module, mostly."""
    pressure_angle: Annotated[float, Quantity(units.ANGLE, "non-negative")] = _TWENTY_DEGREES
    """alpha [rad]; default: 20 degrees."""
    helix_angle: Annotated[float, Quantity(units.ANGLE, "non-negative")] = 0.0
    """beta [rad]."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: the whole gear is below the oil level, or angles are impossible for a tooth."""
        yield from super().rules(table, dimensionless)
        depth = value_of(cls, table, "depth", dimensionless)
        diameter = value_of(cls, table, "pitch_diameter", dimensionless)
        if depth is not None and diameter is not None and depth > diameter:
            yield Breach(("depth",), table["depth"], "must not be more than pitch_diameter: the gear would be covered")
        for key in ("pressure_angle", "helix_angle"):
            angle = value_of(cls, table, key, dimensionless)
            if angle is not None and angle >= 0.5 * pi:
                yield Breach((key,), table[key], "must be less than 90 degrees")

    def law(self, speed: float, oil: Oil | None, /) -> Drag:
        """Return torque and slope at a speed [rad/s]."""
        assert oil is not None
        radius = 0.5 * self.pitch_diameter
        inertia_force = 0.5 * oil.mass_density() * radius**3 * self.immersed_surface  # of Omega^2 C_m
        # powers of Omega of C_m: -1.41 below, -1.76 above, the line in Re between
        slow = self._laminar(speed, oil)
        fast = self._turbulent(speed)
        share = min(1.0, max(0.0, (self._reynolds(speed, oil) - _LAMINAR) / (_TURBULENT - _LAMINAR)))
        coefficient = (1.0 - share) * slow + share * fast
        slope_of_coefficient = ((1.0 - share) * -1.41 * slow + share * -1.76 * fast) / speed
        if 0.0 < share < 1.0:
            slope_of_coefficient += (fast - slow) * self._reynolds(1.0, oil) / (_TURBULENT - _LAMINAR)
        torque = inertia_force * speed**2 * coefficient
        return Drag(torque, 2.0 * torque / speed + inertia_force * speed**2 * slope_of_coefficient)

    def limits(self, speed: float, oil: Oil | None, /) -> Iterator[str]:  # noqa: ARG002
        """Yield a note if the gear is too slow to splash."""
        edge = 0.5 * self.pitch_diameter * speed
        if edge < _SPLASH:
            yield f"its rim moves at {edge:.3g} m/s; oil is splashed from about {_SPLASH:g} m/s, and the law ends there"

    @property
    def immersed_surface(self) -> float:
        """S_m [m^2]."""
        radius = 0.5 * self.pitch_diameter
        t = acos(1.0 - self.depth / radius)
        sides = radius**2 * (2.0 * t - sin(2.0 * t))
        rim = self.pitch_diameter * self.face_width * t
        cosines = cos(self.pressure_angle) * cos(self.helix_angle)
        flanks = 2.0 * self.teeth * t * self.tooth_height * self.face_width / (pi * cosines)
        return sides + rim + flanks

    def _reynolds(self, speed: float, oil: Oil) -> float:
        return speed * 0.5 * self.pitch_diameter * self.face_width / oil.kinematic_viscosity()

    def _froude(self, speed: float) -> float:
        return speed**2 * 0.5 * self.pitch_diameter / _GRAVITY

    def _laminar(self, speed: float, oil: Oil) -> float:
        depth = self.depth / self.pitch_diameter
        volume = self.oil_volume / self.pitch_diameter**3
        flow = self._froude(speed) ** -0.6 * self._reynolds(speed, oil) ** -0.21
        return float(1.366 * depth**0.45 * volume**0.1 * flow)

    def _turbulent(self, speed: float) -> float:
        depth = self.depth / self.pitch_diameter
        volume = self.oil_volume / self.pitch_diameter**3
        width = self.face_width / self.pitch_diameter
        return float(3.644 * depth**0.1 * volume**-0.35 * self._froude(speed) ** -0.88 * width**0.85)
