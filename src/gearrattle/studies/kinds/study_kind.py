"""Base of the kinds of studies: the form of the study file, and the function that checks and prepares the study.

A study file says ``kind = "..."``; its keys besides name, model and kind are those of the kind. ``prepare`` takes the
model and the arguments that the kind reads from the file, and returns a study that states its cost and carries itself
out, by any scheduler, into a folder from which it can be resumed.

To add a kind: its file with a class derived from ``StudySpec``, one line in the table in ``__init__``, its page in
``report/study_pages`` with one line there, and its test page. The tests over the table cover every kind that is listed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, ClassVar

from pydantic import Field

from gearrattle.model.table import Table
from gearrattle.model.value_kinds import SEED, AnyTable, Count, Plain, SchemaVersion, Text, Texts
from gearrattle.studies.designs import SAMPLES
from gearrattle.studies.poincare_sections import NEARNESS
from gearrattle.studies.study_call import Study

AnyValues = Annotated[Mapping[str, Any], AnyTable()]
"""A table by paths of the model, or by outputs; what may stand in it depends on the model."""
Seed = Annotated[int, SEED]
Names = Annotated[Sequence[str], Texts('["verdict"]')]


class StudySpec(Table):
    """What a study file says, of any kind; a kind is a class derived from it."""

    prepare: ClassVar[Callable[..., Study]]
    """Takes the model as ``model``, ``arguments()`` and the options; refuses with ModelError."""
    options: ClassVar[frozenset[str]] = frozenset()
    """Options of the command line that ``prepare`` takes as well: "function"."""
    schema_version: Annotated[int, Field(alias="schema"), SchemaVersion()] = 1
    """Version of the file format."""
    name: Annotated[str, Text()] = ""
    """Name of the study; without it, that of the file."""
    kind: str
    """Kind of study."""
    model: Annotated[str, Text()]
    """The model file, in the folder of this one."""
    fixed: AnyValues = Field(default_factory=dict)
    """Other values of the model, by path."""

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of ``prepare`` besides the model.

        ModelError: values that are sound by themselves and have no meaning together.
        """
        raise NotImplementedError


class SectionSpec(StudySpec):
    """What a study of settled motions says, seen once a period."""

    cycles: Annotated[int, Count(1)] | None = None
    """Of every motion; the model's without."""
    discard: Annotated[int, Count()] | None = None
    """Cycles left out at the start of every motion."""
    phase: Annotated[float, Plain()] = 0.0
    """Of the period, at which the motion is seen."""
    section: Annotated[list[str], Texts('["deflection.gear"]')] | None = None
    """What is kept; deflection and rate of every clearance without."""
    tolerance: Annotated[float, NEARNESS] | None = None
    """A motion that repeats this well is settled."""
    outputs: Names = ()
    """What is kept of every settled motion."""

    def arguments(self) -> dict[str, Any]:
        """Return the arguments that these studies have in common."""
        return self.stated("cycles", "discard", "phase", "section", "tolerance", "outputs", "fixed")


class Sample(Table):
    """How values are drawn."""

    count: Annotated[int, SAMPLES] = 0
    """How many."""
    method: Annotated[str, Text()] = "sobol"
    """How they are spread."""
    seed: Seed = 0
    """Of the random numbers."""
