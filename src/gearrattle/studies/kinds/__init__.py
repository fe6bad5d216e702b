"""The shelf of kinds of studies, by their names in study files.

Takes the word of a file; gives the class that reads it.
"""

from __future__ import annotations

from gearrattle.studies.kinds.base import Study, StudySpec
from gearrattle.studies.kinds.basins import BasinsSpec
from gearrattle.studies.kinds.bifurcation import BifurcationSpec
from gearrattle.studies.kinds.grid import GridSpec
from gearrattle.studies.kinds.optimization import OptimizationSpec

KINDS: dict[str, type[StudySpec]] = {
    "grid": GridSpec,
    "bifurcation": BifurcationSpec,
    "basins": BasinsSpec,
    "optimization": OptimizationSpec,
}
"""Kind in the file -> what it may hold."""

__all__ = ["KINDS", "Study", "StudySpec"]
