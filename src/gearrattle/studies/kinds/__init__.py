"""Kinds of studies, by their names in study files."""

from __future__ import annotations

from gearrattle.errors import ModelError, Problem
from gearrattle.model.table import did_you_mean, listed, shown
from gearrattle.studies.kinds.basins_kind import BasinsSpec
from gearrattle.studies.kinds.bifurcation_kind import BifurcationSpec
from gearrattle.studies.kinds.conditions_kind import ConditionsSpec
from gearrattle.studies.kinds.grid_kind import GridSpec
from gearrattle.studies.kinds.optimization_kind import OptimizationSpec
from gearrattle.studies.kinds.study_kind import StudySpec

KINDS: dict[str, type[StudySpec]] = {
    "grid": GridSpec,
    "bifurcation": BifurcationSpec,
    "basins": BasinsSpec,
    "conditions": ConditionsSpec,
    "optimization": OptimizationSpec,
}
"""Kind in the file -> what it may hold."""

__all__ = ["KINDS", "StudySpec", "kind_named"]


def kind_named(name: object, location: str) -> type[StudySpec]:
    """Return a kind by its name. ModelError: there is no such kind."""
    if not isinstance(name, str) or name not in KINDS:
        rule = f"there is no such kind of study; there are {listed(list(KINDS))}"
        remedy = did_you_mean(name, tuple(KINDS)) if isinstance(name, str) else ""
        raise ModelError(Problem(location, shown(name), rule, remedy))
    return KINDS[name]
