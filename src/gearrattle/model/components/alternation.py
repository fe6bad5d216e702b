"""A mesh stiffness that alternates with the tooth pairs in contact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from gearrattle.model import units
from gearrattle.model.table import Breach, Table
from gearrattle.model.value_kinds import Plain, Quantity, Ratio, value_of


class Alternation(Table):
    """A mesh stiffness that alternates with the tooth pairs in contact, a rectangular wave over the mesh cycle."""

    order: Annotated[float, Plain("positive", "teeth times the ratio of speeds")]
    """Mesh cycles in a turn of the reference shaft: teeth times the ratio of speeds."""
    share: Ratio
    """Part of a cycle in which all pairs are in contact, between 0 and 1: the transverse contact ratio less 1, if that
    lies between 1 and 2."""
    fewer: Ratio
    """Stiffness with a pair less over that with all pairs, below 1."""
    phase: Annotated[float, Quantity(units.ANGLE)] = 0.0
    """Of the mesh cycle at t = 0 [rad]; a cycle begins with all pairs in contact."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: a share that is no part of a cycle, a stiffness that does not fall."""
        for key, low in (("share", True), ("fewer", False)):
            value = value_of(cls, table, key, dimensionless)
            if value is not None and (value >= 1.0 or (low and value == 0.0)):
                yield Breach((key,), table[key], "must be below 1" + (", and not 0" if low else ""), "such as 0.6")
