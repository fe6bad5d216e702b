"""Base of drag parts: a drag part is a law for the drag torque of a body over speed and oil.

    T(|Omega_body - Omega_on|)  against the relative rotation,      c = dT / d Omega_rel

A part acts between its body and the body ``on``, or the housing ("ground"), at their relative mean speed. The torque is
a mean torque on both bodies; the slope is the damping of their fluctuation. ``DRAG_PARTS`` in ``__init__.py`` lists all
kinds.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

from gearrattle.model import units
from gearrattle.model.oil import Oil
from gearrattle.model.table import Breach, Table
from gearrattle.model.value_kinds import GROUND, Name, Plain, Quantity


class Drag(NamedTuple):
    """A drag torque [N m] and its slope over the relative speed [N m s/rad]."""

    torque: float
    slope: float


class DragPart(Table):
    """One part of the drag of a body."""

    needs_oil: ClassVar[bool] = True
    """Whether the law depends on the oil."""
    acts_between: ClassVar[bool] = True
    """Whether the part may act between two bodies; if not, it acts against the housing only."""
    source: ClassVar[str]
    """Source of the law."""
    is_checked: ClassVar[bool] = True
    """Whether its constants were compared with the source."""
    law_error: ClassVar[str]
    """Usual error of the law against measurements, in words."""
    kind: str
    """Which law."""
    on: Name = GROUND
    """Body against which it acts; "ground", the housing, by default."""
    relative_speed: Annotated[float, Quantity(units.ANGULAR_VELOCITY)] | None = None
    """Mean speed of the body less that of ``on`` [rad/s], in place of what the radii say: for shafts whose mean speed
    the model does not settle."""
    factor: Annotated[float, Plain("non-negative")] = 1.0
    """The law is multiplied by this: what a measurement says, or a fit."""

    def at(self, speed: float, oil: Oil | None, /) -> Drag:
        """Return torque and slope at a relative speed > 0 [rad/s]."""
        law = self.law(speed, oil)
        return Drag(self.factor * law.torque, self.factor * law.slope)

    def law(self, speed: float, oil: Oil | None, /) -> Drag:
        """Return torque and slope of the law itself at a relative speed > 0 [rad/s]."""
        raise NotImplementedError

    def at_reference(self, omega: float, /) -> DragPart:  # noqa: ARG002
        """Return the part at another reference speed [rad/s], with its tables over speed evaluated there."""
        return self

    def limits(self, speed: float, oil: Oil | None, /) -> Iterator[str]:  # noqa: ARG002
        """Yield notes on a relative speed [rad/s] outside the range of validity of the law."""
        return iter(())

    @property
    def noun(self) -> str:
        """Name of the part in words."""
        return self.kind.replace("-", " ")

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: a law in SI in a dimensionless model; ``on`` for a law that acts against the housing only."""
        if dimensionless and cls.needs_oil:
            yield Breach(("kind",), table.get("kind"), "a dimensionless model has no oil", 'use kind = "constant"')
        if not cls.acts_between and table.get("on", GROUND) != GROUND:
            rule = "acts against the oil in the housing, not on another body"
            yield Breach(("on",), table["on"], rule, "leave it out")
