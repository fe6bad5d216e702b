"""Base class of results: title, sentence, notes, data, tables, figures, files.

A result has a title, a sentence with the answer, notes, its numbers as an xarray Dataset, tables and figures; it can be
saved and shown in a notebook. The class of a result holds the numbers and names its ``kind``. The texts, tables and
figures of every kind are defined in ``gearrattle.report``. That package registers itself here (``show_results_by``) by
a function that is called when a result is shown, so that a simulation does not import it.

DataFrames, Series and xarray objects can be results as well: ``attrs["result"]`` names their kind, and ``gr.figures``
and ``gr.save`` accept them like any other result.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import xarray as xr

KIND = "result"
"""Key in ``attrs`` that holds the kind of a result that is not a ``Result``, such as a DataFrame."""


class Table(Protocol):
    """A table of a result's page: names of the columns, rows of text, title, note."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    title: str
    note: str


class Chart(Protocol):
    """A figure of a result's page as plain data: its key, its title, and a text on how to read it."""

    key: str
    title: str
    caption: str


class View(Protocol):
    """A module that shows and saves results of every kind."""

    def presentation_of(self, result: Any) -> Any:
        """Return title, sentence, notes, data, tables and charts of a result."""

    def plain_text(self, result: Any) -> str:
        """Return sentence, tables and notes of a result as a terminal shows them."""

    def save(self, result: Any, path: str | os.PathLike[str]) -> Path:
        """Save a result as a file or a folder."""

    def notebook_view(self, result: Any) -> str:
        """Return a result as HTML for a notebook."""


def show_results_by(view: Callable[[], View]) -> None:
    """Register a function that returns the module that shows results; it is called when a result is shown."""
    Result._view = staticmethod(view)


class Result:
    """Base of every result: text, tables, figures, files.

    Attributes
    ----------
    kind
        name of the kind of result, which decides how it is shown.
    notes
        what the user must know about the numbers.

    Examples
    --------
    >>> import gearrattle as gr
    >>> modes = gr.modes(gr.example("case3"))
    >>> print(modes.sentence[:36])
    3 modes from 53.921 Hz to 5894.3 Hz,
    >>> modes.data.sizes["mode"]
    4
    """

    kind: ClassVar[str]
    shown_as: ClassVar[str] = ""
    """Name of the presentation, if it is not ``kind``."""
    _view: ClassVar[Callable[[], View]]

    def __init_subclass__(cls) -> None:
        """Keep the short ``repr``, because the one of a dataclass lists every number."""
        super().__init_subclass__()
        cls.__repr__ = cls.__repr__  # type: ignore[method-assign]

    def __repr__(self) -> str:
        return f"<{self.kind}: {self.sentence}>"

    @property
    def title(self) -> str:
        """Heading of the page of the result."""
        return str(self._presentation().title)

    @property
    def sentence(self) -> str:
        """The answer in one or two sentences."""
        return str(self._presentation().sentence)

    @property
    def data(self) -> xr.Dataset:
        """All numbers of the result with units and names, as in results.nc."""
        data: xr.Dataset = self._presentation().data()
        return data

    @property
    def report(self) -> str:
        """The answer in words and tables, with the notes, as text for a terminal."""
        return Result._view().plain_text(self)

    def tables(self) -> list[Table]:
        """Return the tables of the page, in reading order."""
        return list(self._presentation().tables())

    def charts(self) -> list[Chart]:
        """Return the figures of the page as plain data, in reading order; ``gr.figures`` draws them."""
        return list(self._presentation().charts())

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Save the result; if that fails, nothing changes on the disk.

        Parameters
        ----------
        path
            a file that ends in .nc (netCDF-4, all numbers) or .csv (a table of them); or a folder, which gets
            report.html, summary.json, results.nc and figures/. The folder need not exist.

        Returns
        -------
        Path
            The file, or the page in the folder.

        Raises
        ------
        ModelError
            another ending, or a folder with files that are not a page of gearrattle.
        OSError
            the path cannot be written.
        """
        return Result._view().save(self, path)

    def _repr_html_(self) -> str:
        """Return a short static view for notebooks: sentence, first tables, first figure; no script."""
        return Result._view().notebook_view(self)

    def _presentation(self) -> Any:
        return Result._view().presentation_of(self)
