"""The kind "basins": which settled motion every initial state leads to.

cycles = 300                             # of every motion; the model's without
discard = 250
phase = 0.0                              # of the period, at which the motion is seen
section = ["deflection.gear"]            # what is kept; deflection and rate of every clearance without
tolerance = 1e-6                         # a motion that repeats this well is settled
same = 1e-3                              # settled motions nearer than this are one
outputs = ["verdict", "regime"]
most = 2_000_000                         # initial states allowed, if more than a million

[over]                                   # initial values: a grid, all combinations
"deflection.gear" = { from = "-0.05 mm", to = "0.05 mm", count = 40 }
"rate.gear" = { from = -0.05, to = 0.05, count = 40 }

[sample]                                 # or drawn from a box, without counts above
count = 1000
method = "sobol"
seed = 1

[fixed]
"torque.0.mean" = 5.0
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar

from gearrattle.model.value_kinds import Choice
from gearrattle.studies.basins_study import prepare
from gearrattle.studies.kinds.study_kind import AnyValues, Sample, SectionSpec
from gearrattle.studies.poincare_sections import NEARNESS
from gearrattle.studies.study import CASES, MOST
from gearrattle.studies.study_call import Study


class BasinsSpec(SectionSpec):
    """Which settled motion every initial state leads to."""

    prepare: ClassVar[Callable[..., Study]] = staticmethod(prepare)
    kind: Annotated[str, Choice(("basins",))]
    """Kind of study."""
    same: Annotated[float, NEARNESS] | None = None
    """Settled motions nearer than this are one."""
    most: Annotated[int, CASES] = MOST
    """Initial states allowed."""
    over: AnyValues
    """Initial values: a grid, all combinations; or a box."""
    sample: Sample = Sample()
    """How they are drawn from a box."""

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of ``basins``."""
        drawn = {"samples": self.sample.count, **self.sample.stated("method", "seed")}
        return super().arguments() | self.stated("same", "most", "over") | drawn
