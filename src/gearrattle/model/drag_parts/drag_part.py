"""Base of the parts of a body's drag: each is a law of drag torque over speed and oil.

    T(|Omega_body - Omega_on|)  against the relative rotation,      c = dT / d Omega_rel

A part acts between its body and the body ``on``, or the housing ("ground"), at the relative mean speed. Its torque is a
mean torque of both, its slope the damping of the fluctuation. ``DRAG_PARTS`` in ``__init__.py`` lists all kinds.
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
    """Whether the law reads the oil."""
    acts_between: ClassVar[bool] = True
    """Whether it may act between two bodies; if not, on the housing alone."""
    source: ClassVar[str]
    """Where the law comes from."""
    is_checked: ClassVar[bool] = True
    """Whether its constants were compared with the source."""
    law_error: ClassVar[str]
    """How far the law may be from a measurement, in words."""
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
        """Return the part at another reference speed [rad/s], where its numbers are tables over it."""
        return self

    def limits(self, speed: float, oil: Oil | None, /) -> Iterator[str]:  # noqa: ARG002
        """Yield what of the law's range of validity a relative speed [rad/s] leaves."""
        return iter(())

    @property
    def noun(self) -> str:
        """What it is called."""
        return self.kind.replace("-", " ")

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: a law in SI in a dimensionless model, a body for a law of the housing alone."""
        if dimensionless and cls.needs_oil:
            yield Breach(("kind",), table.get("kind"), "a dimensionless model has no oil", 'use kind = "constant"')
        if not cls.acts_between and table.get("on", GROUND) != GROUND:
            rule = "acts against the oil in the housing, not on another body"
            yield Breach(("on",), table["on"], rule, "leave it out")
