"""``figures``: the figures of a result as matplotlib figures, which can be changed and saved for print."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gearrattle.errors import ModelError, Problem
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.typeset import Style, matplotlib_figure
from gearrattle.report.plots.typeset.print_files import DPI, checked_dpi, known_formats, saved
from gearrattle.report.result_charts import charts_of
from gearrattle.writing import Staging

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Figures(Mapping[str, "Figure"]):
    """Figures by name, drawn at the first access and then kept.

    Attributes
    ----------
    titles
        titles of the figures, by name.
    captions
        explanations of the figures, by name: drafts of captions.

    Examples
    --------
    >>> gr.figures(gr.modes(gr.example("case3")), width="single").titles
    {'campbell': 'Campbell diagram'}
    """

    def __init__(self, charts: Sequence[Chart], style: Style) -> None:
        self._charts = {chart.key: chart for chart in charts}
        self._style = style
        self._made: dict[str, Figure] = {}
        self.titles = {chart.key: chart.title for chart in charts}
        self.captions = {chart.key: chart.caption for chart in charts}

    def __getitem__(self, name: str) -> Figure:
        """Return a matplotlib figure; pyplot does not know it, so it need not be closed."""
        if name not in self._made:
            self._made[name] = matplotlib_figure(self._charts[name], self._style)
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._charts)

    def __len__(self) -> int:
        return len(self._charts)

    def __repr__(self) -> str:
        return f"Figures({', '.join(self)})"

    def save(
        self,
        folder: str | os.PathLike[str],
        formats: str | Sequence[str] = "pdf",
        *,
        dpi: float = DPI,
        only: Sequence[str] | None = None,
    ) -> list[Path]:
        """Save figures in their current state as NAME.FORMAT into a folder; the same figure gives the same bytes.

        Parameters
        ----------
        folder
            the folder, which need not exist; other files in it remain.
        formats
            one or several of "pdf", "eps", "svg", "png", "tiff".
        dpi
            pixels per inch of PNG and TIFF, and of pictures inside the other formats; 72 to 2400.
        only
            names of the figures to save; None: all.

        Returns
        -------
        list[Path]
            The files.

        Raises
        ------
        ModelError
            unknown format, resolution out of range, or unknown name of a figure.
        OSError
            the folder cannot be written; nothing has changed then.
        """
        kinds = known_formats(formats)
        resolution = checked_dpi(dpi)
        names = self.named(only)
        with Staging(folder) as staging:
            files = [Path(f"{name}.{kind}") for name in names for kind in kinds]
            for file in files:
                (staging.path / file).write_bytes(self._saved(file, resolution))
            staging.commit()
        return [staging.destination / file for file in files]

    def named(self, only: Sequence[str] | None) -> list[str]:
        """Return the names in ``only``, or all names for None; ModelError for a name that no figure has."""
        wrong = [name for name in only or () if name not in self._charts]
        if wrong:
            listed_names = ", ".join(f'"{name}"' for name in wrong)
            raise ModelError(Problem("only", listed_names, "must be names of its figures", ", ".join(self)))
        return list(self) if only is None else [name for name in self if name in set(only)]

    def _saved(self, file: Path, dpi: float) -> bytes:
        name = file.name.rpartition(".")[0]
        kind = file.suffix[1:]
        return saved(self[name], kind, dpi=dpi, title=self.titles[name], subject=self.captions[name])


def figures(
    result: object,
    *,
    width: float | str = "double",
    font: str = "sans",
    size: float = 8.0,
    style: str | os.PathLike[str] | None = None,
) -> Figures:
    """Draw every figure of a result for print, with matplotlib.

    Parameters
    ----------
    result
        the returned object of a function of gearrattle (a run, study, comparison, ...); or a folder that a command or
        ``save`` wrote; or a motion or labelled data saved as a file (.nc).
    width
        width of the figures: "single" (85 mm) or "double" (175 mm), a quantity such as "3.5 inch", or a number [mm];
        60 to 500 mm.
    font
        "sans", "serif", or the name of an installed family.
    size
        of the letters [pt], 5 to 14.
    style
        matplotlib style file, or name of a style, laid over gearrattle's own.

    Returns
    -------
    Figures
        Figures by name. They do not depend on the settings of matplotlib's current session.

    Raises
    ------
    ModelError
        a result without figures; a width, font, size or style that is not valid.

    Examples
    --------
    >>> figures = gr.figures(gr.modes(gr.example("case3")))
    >>> list(figures)
    ['campbell']
    """
    how = Style(width, font, size, style)
    return Figures(charts_of(result), how)
