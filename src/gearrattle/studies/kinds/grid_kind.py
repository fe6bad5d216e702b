"""The kind "grid": all combinations of values, and values that scatter.

outputs = ["regime", "impacts per cycle"]
most = 2_000_000                         # cases allowed, if more than a million

[fixed]                                  # other values of the model, by path
"simulation.cycles" = 60

[axis]                                   # what is varied in order, all combinations
"mesh.gear.backlash" = { from = "0.02 mm", to = "0.2 mm", count = 10, spacing = "log" }
load = { "torque.0.mean" = [5, 10], "inertia.gear.drag_torque" = [0.5, 1.0] }    # together

[vary]                                   # what scatters
"coupling.clutch.stiffness" = { distribution = "normal", mean = 1500.0, deviation = 50.0 }

[sample]
count = 256                              # or half_width = 0.05, of a probability's 95 % interval
method = "sobol"                         # ... "saltelli", "saltelli-pairs"; "one-at-a-time" takes no count
seed = 7
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Annotated, Any, ClassVar

from pydantic import Field

from gearrattle.model.table import Breach
from gearrattle.model.value_kinds import Choice, Plain
from gearrattle.studies.kinds.study_kind import AnyValues, Names, Sample, StudySpec
from gearrattle.studies.probability import samples_needed
from gearrattle.studies.study import CASES, MOST, prepare
from gearrattle.studies.study_call import Study


class GridSample(Sample):
    """How scattering values are drawn."""

    half_width: Annotated[float, Plain("positive")] | None = None
    """Of a probability's 95 % interval, in place of a count."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], _dimensionless: bool, /) -> Iterator[Breach]:
        """Yield a breach where both a count and a half-width stand."""
        if {"count", "half_width"} <= set(table):
            rule = "count and half_width: one of them decides how many samples there are"
            yield Breach(("half_width",), table["half_width"], rule, "leave one of them out")


class GridSpec(StudySpec):
    """All combinations of values, and values that scatter."""

    prepare: ClassVar[Callable[..., Study]] = staticmethod(prepare)
    kind: Annotated[str, Choice(("grid",))] = "grid"
    """Kind of study."""
    options: ClassVar[frozenset[str]] = frozenset({"function"})
    outputs: Names = ()
    """What is kept of every case."""
    most: Annotated[int, CASES] = MOST
    """Cases allowed."""
    axis: AnyValues = Field(default_factory=dict)
    """What is varied in order, all combinations."""
    vary: AnyValues = Field(default_factory=dict)
    """What scatters."""
    sample: GridSample = GridSample()
    """How it is drawn."""

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of ``study``."""
        width = self.sample.half_width
        samples = self.sample.count if width is None else samples_needed(width)
        arguments = {"axes": self.axis, "vary": self.vary, "fixed": self.fixed, "samples": samples}
        return arguments | self.sample.stated("method", "seed") | self.stated("outputs", "most")
