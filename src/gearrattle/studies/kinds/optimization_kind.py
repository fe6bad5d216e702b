"""The kind "optimization": values found within ranges, outputs small or large, others within limits.

population = 32                          # designs of a generation
generations = 20
seed = 0
outputs = ["regime"]                     # kept besides

[variable]                               # what may change, and from where to where
"coupling.damper.stages.0.stiffness" = { from = "0.2 N*m/deg", to = "2 N*m/deg", spacing = "log" }

[objective]                              # "min" or "max"; an output of several parts by part and output
"second_mesh: largest impact energy" = "min"

[constraint]                             # below, above, or both; SI
"second_mesh: impacts per cycle" = { below = 20.0 }

[fixed]
"simulation.cycles" = 60
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar

from pydantic import Field

from gearrattle.model.value_kinds import Choice
from gearrattle.studies.kinds.study_kind import AnyValues, Names, Seed, StudySpec
from gearrattle.studies.optimization import DESIGNS, TIMES, prepare
from gearrattle.studies.study_call import Study


class OptimizationSpec(StudySpec):
    """Values found within ranges, outputs small or large, others within limits."""

    prepare: ClassVar[Callable[..., Study]] = staticmethod(prepare)
    kind: Annotated[str, Choice(("optimization",))]
    """Kind of study."""
    options: ClassVar[frozenset[str]] = frozenset({"function"})
    population: Annotated[int, DESIGNS] | None = None
    """Designs of a generation."""
    generations: Annotated[int, TIMES] | None = None
    """How many generations."""
    seed: Seed = 0
    """Of the random numbers."""
    outputs: Names = ()
    """What is kept besides."""
    variable: AnyValues
    """What may change, and from where to where."""
    objective: AnyValues
    """"min" or "max" by output."""
    constraint: AnyValues = Field(default_factory=dict)
    """Limits by output: below, above, or both."""

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of ``optimize``."""
        arguments = {"variables": self.variable, "objectives": self.objective, "constraints": self.constraint}
        return arguments | self.stated("population", "generations", "seed", "outputs", "fixed")
