"""The pages of studies, by the kind of study."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearrattle.report.study_pages.basins_page import PAGE as BASINS
from gearrattle.report.study_pages.bifurcation_page import PAGE as BIFURCATION
from gearrattle.report.study_pages.conditions_page import PAGE as CONDITIONS
from gearrattle.report.study_pages.grid_page import PAGE as GRID
from gearrattle.report.study_pages.optimization_page import PAGE as OPTIMIZATION
from gearrattle.report.study_pages.study_page import StudyPage

if TYPE_CHECKING:
    import xarray as xr

PAGES: dict[str, StudyPage] = {
    "grid": GRID,
    "bifurcation": BIFURCATION,
    "basins": BASINS,
    "conditions": CONDITIONS,
    "optimization": OPTIMIZATION,
}
"""Name of the kind -> page."""

__all__ = ["PAGES", "StudyPage", "page_of"]


def page_of(data: xr.Dataset) -> StudyPage:
    """Return the page of a Dataset's kind, its attribute ``kind``; a grid's where it has none."""
    return PAGES[str(data.attrs.get("kind", "grid"))]
