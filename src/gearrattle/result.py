"""Base class of results: title, sentence, notes, data, tables, figures, files.

A result has a title, one sentence that says what came out, notes, its numbers as an xarray Dataset, tables and figures;
it saves itself, and a notebook shows it. The class of a result holds the numbers and names its ``kind``; words, tables
and figures of a kind are defined once, in ``gearrattle.report.kinds``. That package is imported by its name when a
result is shown, so that a simulation does not load it.

DataFrames, Series and xarray objects are results as well: ``attrs["result"]`` names their kind, and ``gr.figures`` and
``gr.save`` take them as any other.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from pathlib import Path

    import xarray as xr

    from gearrattle.report.plots.chart import Chart
    from gearrattle.report.tables import Table

KIND = "result"
"""Key in ``attrs`` of what is no ``Result``, with the kind."""


class Result:
    """Base of every answer: words, tables, figures, files.

    Attributes
    ----------
    kind
        of result; how it is shown stands in ``gearrattle.report.kinds`` under this name.
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
    """Name under which it is shown, where its kind says something else."""

    @property
    def title(self) -> str:
        """Heading of its page."""
        return str(self._presentation().title)

    @property
    def sentence(self) -> str:
        """What came out, in a sentence or two."""
        return str(self._presentation().sentence)

    @property
    def data(self) -> xr.Dataset:
        """Every number of it, with units and names: what results.nc holds."""
        data: xr.Dataset = self._presentation().data()
        return data

    @property
    def report(self) -> str:
        """The answer in words and tables, as a terminal shows it, and the notes."""
        presentation = self._presentation()
        text = str(import_module("gearrattle.report.text").plain_text(presentation))
        return "\n".join([text, *(f"note: {note}" for note in presentation.notes)])

    def tables(self) -> list[Table]:
        """Return the tables of its page, in reading order."""
        return list(self._presentation().tables())

    def charts(self) -> list[Chart]:
        """Return the figures of its page as plain data, in reading order; ``gr.figures`` draws them."""
        return list(self._presentation().charts())

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Save the result, whole or not at all.

        Parameters
        ----------
        path
            a file that ends in .nc (netCDF-4, all numbers) or .csv (a table of them); or a folder, which gets
            report.html, summary.json, results.nc and figures/. It need not exist.

        Returns
        -------
        Path
            The file, or the page in the folder.

        Raises
        ------
        ModelError
            another ending, or a folder that holds something else than a page of gearrattle.
        OSError
            it cannot be written; then nothing has changed.
        """
        written: Path = import_module("gearrattle.report.saved").save(self, path)
        return written

    def _repr_html_(self) -> str:
        """Return a short static view for notebooks: sentence, first tables, first figure; no script."""
        return str(import_module("gearrattle.report.notebook_view").notebook_view(self))

    def _presentation(self) -> Any:
        return import_module("gearrattle.report.kinds").presentation_of(self)
