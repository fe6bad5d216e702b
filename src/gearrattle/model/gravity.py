"""The weight of bodies with a mass."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import pi
from typing import Annotated, Any

from gearrattle.model import units
from gearrattle.model.table import Breach, Table
from gearrattle.model.value_kinds import Quantity


class Gravity(Table):
    """The ``[gravity]`` table: a weight ``m g`` pulls on every body with a mass; without the table none does."""

    direction: Annotated[float, Quantity(units.ANGLE)] = -0.5 * pi
    """Angle of the direction down, from x towards y [rad]; default -90 deg: y points up."""
    acceleration: Annotated[float, Quantity(units.ACCELERATION, "positive")] = 9.81
    """Acceleration of free fall g [m/s^2]; a dimensionless model must state it."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield a breach of a dimensionless model without its acceleration."""
        if dimensionless and table.get("acceleration") is None:
            yield Breach(("acceleration",), ..., "9.81 m/s^2 is no number of a dimensionless model", "state it")
