"""Radial shaft seals: ``P = 7.69e-6 d^2 n`` W with d in mm and n in 1/min, so T = 7.343e-5 d^2 N m at any speed.

The form of ISO/TR 14179-2 for one lip.
"""

from __future__ import annotations

from math import pi
from typing import Annotated, ClassVar

from gearrattle.model import units
from gearrattle.model.drag_parts.drag_part import Drag, DragPart
from gearrattle.model.oil import Oil
from gearrattle.model.value_kinds import Choice, Quantity

_POWER = 7.69e-6  # W min/mm^2


class ShaftSeal(DragPart):
    """A radial shaft seal."""

    needs_oil: ClassVar[bool] = False
    source: ClassVar[str] = "ISO/TR 14179-2, as quoted in public code"
    law_error: ClassVar[str] = "a factor of 2, more when cold"
    kind: Annotated[str, Choice(("shaft-seal",))]
    """"shaft-seal"."""
    shaft_diameter: Annotated[float, Quantity(units.LENGTH, "positive")]
    """d [m]."""

    def law(self, speed: float, oil: Oil | None, /) -> Drag:  # noqa: ARG002
        """Return the torque; it has no slope."""
        return Drag(_POWER * 30.0 / pi * (1e3 * self.shaft_diameter) ** 2, 0.0)
