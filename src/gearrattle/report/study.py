"""A study as one page: what came out in a sentence, then its figures, and the tables behind them.

``fill_study`` writes study.html and figures/ into a folder. What stands on the page its kind says (``study_pages``).
The page has no script and loads nothing.

Takes the Dataset of a study and the messages of its failed cases.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from markupsafe import Markup

from gearrattle.plots.numerals import unbroken
from gearrattle.report.ink import fill_figures
from gearrattle.report.provenance import now, versions
from gearrattle.report.study_pages import page_of
from gearrattle.report.templates import templates

if TYPE_CHECKING:
    import xarray as xr

_HERE = Path(__file__).parent


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
    drawn = fill_figures(kind.charts(data), folder)
    environment = templates()
    page = environment.get_template("study.html.j2").render(
        brand="study",
        title=title,
        summary=unbroken(kind.summary(data)),
        setting=unbroken(f"{kind.setting(data)} {cost}".strip()),
        counts=kind.counts(data),
        figures=[(chart, f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}") for chart, svg in drawn],
        sections=kind.sections(data, messages),
        created=now(),
        version=versions().get("gearrattle", ""),
        style=Markup((_HERE / "page.css").read_text(encoding="utf-8")),
    )
    (folder / "study.html").write_text(page, encoding="utf-8")
