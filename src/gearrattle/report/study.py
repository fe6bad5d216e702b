"""A study as one page: what came out in a sentence, then its figures, and the tables behind them.

``fill_study`` writes study.html and figures/ into a folder. What stands on the page its kind says (``study_pages``).
The page has no script and loads nothing.

Takes the Dataset of a study and the messages of its failed cases.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from gearrattle.plots.numerals import unbroken
from gearrattle.report.page import Page, Section, fill_page
from gearrattle.report.study_pages import page_of

if TYPE_CHECKING:
    import xarray as xr


def fill_study(
    data: xr.Dataset, messages: Mapping[tuple[int, ...], str], folder: Path, *, title: str, cost: str
) -> None:
    """Write the page and the figures of a study into an existing folder.

    Args:
        data: what ``study`` or ``open_study`` returned.
        messages: why cases failed, by their place in the grid.
        folder: to write into; it holds neither study.html nor figures/.
        title: heading of the page.
        cost: a sentence on what it cost.
    """
    kind = page_of(data)
    setting = unbroken(f"{kind.setting(data)} {cost}".strip())
    summary = Section("summary", "Summary", unbroken(kind.summary(data)), (setting,), tables=(kind.counts(data),))
    figures = [Section(chart.key, chart.title, charts=(chart,)) for chart in kind.charts(data)]
    fill_page(Page("study", title, (summary, *figures, *kind.sections(data, messages))), folder, "study.html")
