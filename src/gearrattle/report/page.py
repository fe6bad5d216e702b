"""A page: sections of sentences, figures and tables, and the folder that it stands in.

Every result has one template (``page.html.j2``); the report of a run extends it (``run_report.html.j2``). A page needs
nothing else: no network, no folder beside it. Every figure is in it as SVG, which is shown without JavaScript and
printed. On a page that is interactive it is there a second time as data, which plotly.js, inlined once, turns into a
plot when the figure scrolls into view. A page forbids itself to load anything from elsewhere.

Takes what a page says and shows; writes HTML, JSON and figures.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from markupsafe import Markup

from gearrattle.plots.chart import Chart
from gearrattle.report.ink import fill_figures
from gearrattle.report.live_figures import page_script, plotly_script
from gearrattle.report.provenance import now, versions
from gearrattle.report.tables import Table
from gearrattle.report.templates import templates

_HERE = Path(__file__).parent


@dataclass(frozen=True)
class Picture:
    """A drawing that is no chart: file name without suffix, words, SVG; a wide one has a row of its own."""

    key: str
    words: str
    svg: bytes
    is_wide: bool = False


@dataclass(frozen=True)
class Section:
    """A part of a page. What is empty is left out; the order is that of the attributes.

    Attributes:
        key: anchor.
        title: heading.
        lead: the answer, in larger type.
        words: paragraphs.
        notes: items of a list.
        charts: figures; several of one group are chosen by tabs.
        pictures: drawings, side by side.
        tables: those without rows are left out.
        in_columns: whether tables stand side by side.
        folds: whether a long table is folded until it is opened.
        text: a title and a long text, folded.
    """

    key: str
    title: str
    lead: str = ""
    words: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    charts: tuple[Chart, ...] = ()
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()
    in_columns: bool = False
    folds: bool = False
    text: tuple[str, str] | None = None


@dataclass(frozen=True)
class Page:
    """What a page says and shows.

    Attributes:
        brand: what kind of result it is, in a word or two.
        title: heading.
        sections: in reading order.
        is_interactive: whether figures become interactive plots; plotly.js is then part of the page (4 MB).
        template: the page's own, or one that extends it.
        values: what that one needs besides.
    """

    brand: str
    title: str
    sections: tuple[Section, ...]
    is_interactive: bool = False
    template: str = "page.html.j2"
    values: Mapping[str, Any] = field(default_factory=dict)

    @property
    def charts(self) -> list[Chart]:
        """All figures, in reading order."""
        return [chart for section in self.sections for chart in section.charts]


def fill_page(page: Page, folder: Path) -> None:
    """Write a page and figures/ into an existing folder that holds neither.

    Args:
        page: what it says and shows.
        folder: to write into.
    """
    drawn = fill_figures(page.charts, folder)
    for section in page.sections:
        for picture in section.pictures:
            (folder / "figures" / f"{picture.key}.svg").write_bytes(picture.svg)
    template = templates().get_template(page.template)
    html = template.render(
        page=page,
        svg={chart.key: svg for chart, svg in drawn},
        created=now(),
        version=versions().get("gearrattle", ""),
        style=Markup((_HERE / "page.css").read_text(encoding="utf-8")),
        script=page_script() if page.is_interactive else "",
        plotly=plotly_script() if page.is_interactive else "",
        **page.values,
    )
    (folder / "report.html").write_text(html, encoding="utf-8")


def notes_section(notes: tuple[str, ...]) -> tuple[Section, ...]:
    """Return the section of what is noted; none if nothing is."""
    return (Section("notes", "Notes", notes=notes),) if notes else ()
