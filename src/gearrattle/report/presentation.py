"""The presentation of a kind of result: its words, tables and figures, and its content for machines.

A kind of result has one class, derived from ``Presentation``, and one line in ``kinds``. It says what stands on the
page (``sections``), what the terminal shows (``answer``), what summary.json holds (``content``) and what results.nc
holds (``data``). Page, files, command line, notebooks and figures for print are made from these for all kinds alike.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from gearrattle.report.numbers import Arrays, write_csv, write_netcdf
from gearrattle.report.page import Page, Section, figure_sections, notes_section
from gearrattle.report.provenance import now
from gearrattle.report.tables import Table

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.model import Model
    from gearrattle.report.plots.chart import Chart

R = TypeVar("R")

NUMBER_ENDINGS = (".nc", ".csv")
"""Of files that hold the numbers of a result."""
FIGURE_ENDINGS = (".svg", ".pdf", ".eps", ".png", ".tiff")
"""Of files that hold the figure of a result that has one."""


class Presentation(Generic[R]):
    """Base of all presentations; a kind overrides what it has more of.

    Attributes
    ----------
    kind
        of result, its name in ``kinds`` and on the page.
    endings
        of the files that can be written of it alone; without one of them a path is a folder.
    is_interactive
        whether the figures of its page become interactive.
    is_data
        whether the result is its Dataset, so that a saved one can be presented again.
    folder
        where the file that is written will stand.
    """

    kind: ClassVar[str]
    endings: ClassVar[tuple[str, ...]] = NUMBER_ENDINGS
    is_interactive: ClassVar[bool] = False
    is_data: ClassVar[bool] = False

    folder: Path = Path()

    def __init__(self, result: R) -> None:
        self.result = result

    @property
    def title(self) -> str:
        """Heading: what the result is of."""
        raise NotImplementedError

    @property
    def sentence(self) -> str:
        """What came out, in a sentence or two."""
        raise NotImplementedError

    @property
    def further(self) -> tuple[str, ...]:
        """Sentences that a terminal shows below the first, a line each; by default none."""
        return ()

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user must know about the numbers; of labelled data a list or lines in ``attrs``."""
        attributes = getattr(self.result, "attrs", None)
        notes = getattr(self.result, "notes", ()) if attributes is None else attributes.get("notes", ())
        return tuple(notes.splitlines() if isinstance(notes, str) else notes)

    def sections(self) -> tuple[Section, ...]:
        """Return what stands on the page, in reading order; by default sentence and answer, figures, notes."""
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
        """When it was presented first: UTC, ISO 8601."""
        return now()

    def content(self) -> Mapping[str, Any]:
        """Return everything for machines: numbers, text, lists and mappings in SI units, by name."""
        raise NotImplementedError

    def numbers(self) -> xr.Dataset | Arrays:
        """Return every number with names and units: the result's Dataset, or arrays for one."""
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
        """Write what stands next to the page and is no figure, into the folder of the page; by default nothing."""

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

    endings = (*NUMBER_ENDINGS, ".toml")

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
            path.write_text(self.model_text(), encoding="utf-8")
        else:
            super().write(path)
