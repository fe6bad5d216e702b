"""The shelf of kinds of studies, by their names in study files.

Takes the word of a file; gives a Kind.
"""

from __future__ import annotations

from gearrattle.studies.kinds.base import Kind, Study
from gearrattle.studies.kinds.basins import BASINS
from gearrattle.studies.kinds.bifurcation import BIFURCATION
from gearrattle.studies.kinds.grid import GRID
from gearrattle.studies.kinds.optimization import OPTIMIZATION

KINDS: dict[str, Kind] = {kind.name: kind for kind in (GRID, BIFURCATION, BASINS, OPTIMIZATION)}
"""Name -> kind."""

__all__ = ["KINDS", "Kind", "Study"]
