"""The presentation of a kind of result: its words, tables, figures and numbers.

A kind of result has one class, derived from ``Presentation``, and one line in ``result_kinds``. The class defines the
content of the page (``sections``), of the terminal (``answer``), of summary.json (``content``) and of results.nc
(``data``). Pages, files, command line, notebooks and figures for print are made from these in the same way for all
kinds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from gearrattle.model.schema_line import with_schema_line
from gearrattle.report.numbers import Arrays, write_csv, write_netcdf
from gearrattle.report.page import Page, Section, figure_sections, notes_section
from gearrattle.report.provenance import now
from gearrattle.report.tables import Table

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.model import Model
    from gearrattle.report.plots.chart import Chart

R = TypeVar("R")

RESULT_ENDINGS = (".nc", ".csv", ".pdf", ".pptx", ".xlsx")
"""Endings of files that every result is saved as: its numbers, and documents."""
PRINT_ENDINGS = (".pdf", ".eps", ".png", ".tiff")
FIGURE_ENDINGS = (".svg", *PRINT_ENDINGS)
"""Endings of files with the figure of a result that has exactly one."""
ONE_FIGURE_ENDINGS = tuple(dict.fromkeys((*RESULT_ENDINGS, *FIGURE_ENDINGS)))
"""Endings of files that a result with exactly one figure is saved as; .pdf is the figure."""


class Presentation(Generic[R]):
    """Base class of all presentations; the class of a kind overrides some of its methods.

    Attributes
    ----------
    kind
        name of the kind of result, in ``result_kinds`` and on the page.
    endings
        endings of single files that can be written; a path with another ending is a folder.
    is_interactive
        whether the figures of the page become interactive.
    is_data
        whether the result is its Dataset, so that a saved Dataset can be presented again.
    folder
        final folder of the file that is being written.
    """

    kind: ClassVar[str]
    endings: ClassVar[tuple[str, ...]] = RESULT_ENDINGS
    is_interactive: ClassVar[bool] = False
    is_data: ClassVar[bool] = False

    folder: Path = Path()

    def __init__(self, result: R) -> None:
        self.result = result

    @property
    def title(self) -> str:
        """Heading of the page: the model or the source of the result."""
        raise NotImplementedError

    @property
    def sentence(self) -> str:
        """The answer in one or two sentences."""
        raise NotImplementedError

    @property
    def further(self) -> tuple[str, ...]:
        """Further sentences for the terminal, one per line; by default none."""
        return ()

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user must know about the numbers; for labelled data, a list or the lines of a text in ``attrs``."""
        attributes = getattr(self.result, "attrs", None)
        notes = getattr(self.result, "notes", ()) if attributes is None else attributes.get("notes", ())
        return tuple(notes.splitlines() if isinstance(notes, str) else notes)

    def sections(self) -> tuple[Section, ...]:
        """Return the sections of the page, in reading order; by default sentence and answer, figures, notes."""
        summary = Section("summary", "Summary", self.sentence, tables=self.answer())
        figures = figure_sections(self.figures())
        return summary, *figures, *notes_section(self.notes)

    def figures(self) -> Sequence[Chart]:
        """Return the figures of the page, unless ``sections`` places them otherwise."""
        return ()

    def answer(self) -> tuple[Table, ...]:
        """Return the tables that a terminal and a notebook show."""
        return ()

    @cached_property
    def created(self) -> str:
        """Time of the first presentation: UTC, ISO 8601."""
        return now()

    def content(self) -> Mapping[str, Any]:
        """Return the content of summary.json: numbers [SI], texts, lists and mappings, by name."""
        raise NotImplementedError

    def numbers(self) -> xr.Dataset | Arrays:
        """Return every number with names and units: the Dataset of the result, or arrays for a Dataset."""
        raise NotImplementedError

    def data(self) -> xr.Dataset:
        """Return every number as a Dataset with names and units."""
        numbers = self.numbers()
        return numbers.dataset() if isinstance(numbers, Arrays) else numbers

    def tables(self) -> list[Table]:
        """Return all tables of the page that have rows."""
        return [table for section in self.sections() for table in section.tables if table.rows]

    def charts(self) -> list[Chart]:
        """Return all figures that have something to show, in reading order."""
        return [chart for section in self.sections() for chart in section.charts if chart.panels]

    def page(self) -> Page:
        """Return the page."""
        return Page(self.kind, self.title, self.sections(), is_interactive=self.is_interactive)

    def accompany(self, folder: Path) -> None:
        """Write files other than figures into the folder of the page; by default none."""

    def write(self, path: Path) -> None:
        """Write a new file, of one of the ``endings``."""
        if path.suffix == ".csv":
            write_csv(self.data(), path)
        elif path.suffix == ".nc":
            write_netcdf(self.numbers(), path, self.kind)
        else:
            self._write_figure(path)

    def _write_figure(self, path: Path) -> None:
        from gearrattle.report.plots.svg_charts import draw
        from gearrattle.report.plots.typeset import matplotlib_figure
        from gearrattle.report.plots.typeset.print_files import saved

        (chart,) = self.charts()
        if path.suffix == ".svg":
            path.write_bytes(draw(chart, legend=True))
        else:
            path.write_bytes(saved(matplotlib_figure(chart), path.suffix[1:], title=chart.title, subject=chart.caption))


class ModelPresentation(Presentation[R]):
    """Base of the presentations of results that hold a model, which ``.toml`` saves."""

    endings = (*RESULT_ENDINGS, ".toml")

    @property
    def title(self) -> str:
        """The name of the model."""
        return self.model.name or "Driveline"

    def model_text(self) -> str:
        """Return the model file."""
        from gearrattle.model.model_file import text_of

        return text_of(self.model)

    @property
    def model(self) -> Model:
        """The model to save; by default the result's."""
        model: Model = getattr(self.result, "model")  # noqa: B009 - the type of the result is that of the kind
        return model

    def write(self, path: Path) -> None:
        """Write a new file, of one of the ``endings``."""
        if path.suffix == ".toml":
            path.write_text(with_schema_line(self.model_text(), self.folder), encoding="utf-8")
        else:
            super().write(path)
