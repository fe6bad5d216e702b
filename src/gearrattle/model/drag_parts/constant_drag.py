"""A constant drag torque and its slope, the same for any speed and oil."""

from __future__ import annotations

from typing import Annotated, ClassVar

from gearrattle.model import units
from gearrattle.model.drag_parts.drag_part import Drag, DragPart
from gearrattle.model.oil import Oil
from gearrattle.model.over_speed import AtSpeed, OverSpeed
from gearrattle.model.value_kinds import Choice, Quantity


class ConstantDrag(DragPart):
    """A drag that is known as it is."""

    needs_oil: ClassVar[bool] = False
    source: ClassVar[str] = "the model file"
    law_error: ClassVar[str] = "that of whoever measured it"
    kind: Annotated[str, Choice(("constant",))]
    """"constant"."""
    torque: Annotated[float, OverSpeed(units.TORQUE, "non-negative")] = 0.0
    """Drag torque [N m]; may be a table over speed."""
    slope: Annotated[float, Quantity(units.TORSIONAL_DAMPING)] = 0.0
    """Its change with the relative speed [N m s/rad]; negative where it falls."""

    def law(self, speed: float, oil: Oil | None, /) -> Drag:  # noqa: ARG002
        """Return the numbers of the file."""
        return Drag(float(self.torque), self.slope)

    def at_reference(self, omega: float, /) -> ConstantDrag:
        """Return the drag at another reference speed [rad/s]."""
        if not isinstance(self.torque, AtSpeed):
            return self
        return self.model_copy(update={"torque": self.torque.at(omega)})
