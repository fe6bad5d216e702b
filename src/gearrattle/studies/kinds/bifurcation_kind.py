"""The kind "bifurcation": the settled motion against one value, swept up and down.

direction = "both"                       # or "up", "down"
cycles = 300                             # at every value; the model's without
discard = 250
phase = 0.25                             # of the period, at which the motion is seen
section = ["deflection.gear"]            # what is kept; deflection and rate of every clearance without
tolerance = 1e-6
outputs = ["verdict", "regime"]

[sweep]                                  # one value, ascending; or several together under a name
"torque.0.harmonics.0.amplitude" = { from = 1.0, to = 12.0, count = 100 }

[axis]                                   # further axes: a sweep for every combination
"inertia.gear.drag" = [0.4, 0.6]

[fixed]
"mesh.gear.backlash" = "0.1 mm"
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from gearrattle.model.table import Breach, listed
from gearrattle.model.value_kinds import Choice
from gearrattle.studies.bifurcation_study import DIRECTIONS, prepare
from gearrattle.studies.kinds.study_kind import AnyValues, SectionSpec
from gearrattle.studies.study_call import Study


class BifurcationSpec(SectionSpec):
    """The settled motion against one value, swept up and down."""

    prepare: ClassVar[Callable[..., Study]] = staticmethod(prepare)
    kind: Annotated[str, Choice(("bifurcation",))]
    """Kind of study."""
    direction: Annotated[str, DIRECTIONS] = "both"
    """"both", "up" or "down"."""
    axis: AnyValues = Field(default_factory=dict)
    """Further axes: a sweep for every combination."""
    sweep: AnyValues
    """One value, ascending; or several together under a name."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield a breach where none or more than one value is swept."""
        swept = table.get("sweep")
        if isinstance(swept, Mapping) and len(swept) != 1:
            remedy = "put the others into [axis], or several together under one name"
            rule = f"one value is swept, neither none nor more; there are {listed(swept) or 'none'}"
            yield Breach(("sweep",), swept, rule, remedy)

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of ``bifurcation``."""
        ((path, values),) = self.sweep.items()
        swept = {"path": path, "values": values, "axes": self.axis}
        return super().arguments() | swept | self.stated("direction")
