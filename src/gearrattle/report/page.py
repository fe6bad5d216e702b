"""The content of a page: sections of sentences, figures and tables. ``written_page`` turns it into HTML.

Nothing that plots or renders is imported here, because a result on a terminal needs no figure.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

from gearrattle.report.tables import Table

if TYPE_CHECKING:
    from markupsafe import Markup

    from gearrattle.report.plots.chart import Chart


class SupportsHtml(Protocol):
    """HTML of a page, ``Markup`` or what makes it when the page is written."""

    def __html__(self) -> str:
        """Return it."""


@dataclass(frozen=True)
class Picture:
    """A drawing that is not a chart: file name without suffix, words, SVG; a wide drawing takes a whole row."""

    key: str
    words: str
    svg: bytes
    is_wide: bool = False


@dataclass(frozen=True)
class Section:
    """A part of a page. Empty attributes are left out; the order on the page is that of the attributes.

    Attributes
    ----------
    key
        anchor.
    lead
        the answer, in larger type.
    words
        paragraphs.
    notes
        items of a list.
    charts
        figures; figures of one group are shown in tabs.
    inlay
        HTML with its own script, after the figures of an interactive page.
    tables
        tables; tables without rows are left out.
    folds
        whether a long table is collapsed until the reader opens it.
    text
        title and text of a long text, which is collapsed until the reader opens it.
    """

    key: str
    title: str
    lead: str = ""
    words: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    charts: tuple[Chart, ...] = ()
    inlay: SupportsHtml | str = ""
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = ()
    in_columns: bool = False
    folds: bool = False
    text: tuple[str, str] | None = None

    @property
    def is_empty(self) -> bool:
        """Whether the section has only a heading."""
        charts = any(chart.panels for chart in self.charts)
        tables = any(table.rows for table in self.tables)
        return not (self.lead or self.words or self.notes or charts or self.pictures or tables or self.text)


@dataclass(frozen=True)
class Page:
    """The content of a page.

    Attributes
    ----------
    brand
        kind of result in one or two words.
    sections
        in reading order; empty ones are left out.
    is_interactive
        whether figures become interactive; their data and the scripts that draw them are then part of the page.
    script
        a script of this page alone, where its figures are not interactive.
    template
        ``page.html.j2``, or a template that extends it.
    values
        further variables of the template.
    """

    brand: str
    title: str
    sections: tuple[Section, ...]
    is_interactive: bool = False
    script: Markup | str = ""
    template: str = "page.html.j2"
    values: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Leave out empty sections."""
        object.__setattr__(self, "sections", tuple(section for section in self.sections if not section.is_empty))

    @property
    def charts(self) -> list[Chart]:
        """All figures, in reading order."""
        return [chart for section in self.sections for chart in section.charts]


def figure_sections(charts: Iterable[Chart]) -> tuple[Section, ...]:
    """Return a section for each figure, with its title."""
    return tuple(Section(chart.key, chart.title, charts=(chart,)) for chart in charts)


def notes_section(notes: tuple[str, ...]) -> tuple[Section, ...]:
    """Return a section with the notes; empty without notes."""
    return (Section("notes", "Notes", notes=notes),) if notes else ()
