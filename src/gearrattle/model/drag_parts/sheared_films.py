"""Oil films that are sheared between faces: open synchroniser cones and open wet clutch packs.

    cone:   T = x pi eta dOmega (r_o^4 - r_i^4) / (2 h sin alpha)
    plates: T = x N pi eta dOmega (r_o^4 - r_i^4) / (2 h)

Couette flow across the gap h, of which a share x is wetted; the integral over the radius is exact. Floating rings of a
multi-cone synchroniser are in series: the torque of all films is equal, and their relative speeds add up.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import pi, radians, sin
from typing import Annotated, Any, ClassVar

from gearrattle.model import units
from gearrattle.model.drag_parts.drag_part import Drag, DragPart
from gearrattle.model.oil import Oil
from gearrattle.model.table import Breach
from gearrattle.model.value_kinds import Choice, Count, Quantity, Ratio, value_of

_SIX_AND_A_HALF = radians(6.5)

Length = Annotated[float, Quantity(units.LENGTH, "positive")]


class SynchroniserCone(DragPart):
    """The cone of an open synchroniser."""

    source: ClassVar[str] = "Couette flow in a cone, exact for a full film of constant thickness"
    law_error: ClassVar[str] = "a factor of 2 and more: film and wetted share"
    kind: Annotated[str, Choice(("synchroniser",))]
    """"synchroniser"."""
    mean_radius: Length
    """Mean radius of the cone [m]."""
    length: Length
    """Length of the cone along its slope [m]."""
    gap: Length
    """h, film thickness normal to the cone [m]: axial play times sin(cone_angle)."""
    cone_angle: Annotated[float, Quantity(units.ANGLE, "positive")] = _SIX_AND_A_HALF
    """alpha, half the opening angle [rad]; default: 6.5 degrees."""
    wetted: Ratio = 1.0
    """x, share of the gap that oil fills."""
    films: Annotated[int, Count(1)] = 1
    """Films in series, of floating rings."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: an impossible cone angle, a wetted share above one."""
        yield from super().rules(table, dimensionless)
        angle = value_of(cls, table, "cone_angle", dimensionless)
        if angle is not None and angle >= 0.5 * pi:
            yield Breach(("cone_angle",), table["cone_angle"], "must be less than 90 degrees")
        yield from _wetted_breach(cls, table, dimensionless)

    def law(self, speed: float, oil: Oil | None, /) -> Drag:
        """Return torque and slope at a relative speed [rad/s]."""
        assert oil is not None
        slant = sin(self.cone_angle)
        half = 0.5 * self.length * slant
        ring = (self.mean_radius + half) ** 4 - (self.mean_radius - half) ** 4
        slope = self.wetted * pi * oil.dynamic_viscosity() * ring / (2.0 * self.gap * slant * self.films)
        return Drag(slope * speed, slope)


class ClutchPack(DragPart):
    """An open wet clutch or brake: plates with oil between them."""

    source: ClassVar[str] = "Couette flow between plates, up to the break-up of the film"
    law_error: ClassVar[str] = "a factor of 2 and more; air enters beyond a peak"
    kind: Annotated[str, Choice(("clutch-pack",))]
    """"clutch-pack"."""
    faces: Annotated[int, Count(1)]
    """N, wetted faces."""
    outer_radius: Length
    """r_o [m]."""
    inner_radius: Length
    """r_i [m]."""
    gap: Length
    """h, film thickness of one face [m]."""
    wetted: Ratio = 1.0
    """x, share of the gap that oil fills."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: an inner radius not below the outer one, a wetted share above one."""
        yield from super().rules(table, dimensionless)
        inner = value_of(cls, table, "inner_radius", dimensionless)
        outer = value_of(cls, table, "outer_radius", dimensionless)
        if inner is not None and outer is not None and inner >= outer:
            yield Breach(("inner_radius",), table["inner_radius"], "must be smaller than outer_radius")
        yield from _wetted_breach(cls, table, dimensionless)

    def law(self, speed: float, oil: Oil | None, /) -> Drag:
        """Return torque and slope at a relative speed [rad/s]."""
        assert oil is not None
        ring = self.outer_radius**4 - self.inner_radius**4
        slope = self.wetted * self.faces * pi * oil.dynamic_viscosity() * ring / (2.0 * self.gap)
        return Drag(slope * speed, slope)


def _wetted_breach(owner: type[DragPart], table: Mapping[str, Any], dimensionless: bool) -> Iterator[Breach]:
    """Yield the breach of a wetted share above one."""
    share = value_of(owner, table, "wetted", dimensionless)
    if share is not None and share > 1.0:
        yield Breach(("wetted",), table["wetted"], "must not be more than 1: it is a share")
