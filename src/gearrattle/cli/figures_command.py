"""``gearrattle figures``: figures of a result for print, of a stated width, in the formats journals take."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from gearrattle.cli.background import watched
from gearrattle.cli.shared_options import Json, OutputPath, Words
from gearrattle.errors import ModelError, NotInstalled
from gearrattle.json_types import json_text
from gearrattle.wording import columns
from gearrattle.writing import Staging

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.report.figures import Figures


@Parameter(name="*")
@dataclass(frozen=True)
class Look:
    """How the figures look."""

    width: Annotated[str, Parameter(help='"single" (85 mm), "double" (175 mm), or a length such as "3.5 inch".')] = (
        "double"
    )
    font: Annotated[str, Parameter(help='"sans", "serif", or the name of an installed family.')] = "sans"
    size: Annotated[float, Parameter(help="Of the letters [pt].")] = 8.0
    style: Annotated[Path | None, Parameter(help="matplotlib style file, laid over gearrattle's own.")] = None


_LOOK = Look()


def figures(
    source: Path,
    /,
    *,
    output: OutputPath = None,
    formats: Annotated[str, Parameter(name="--as")] = "pdf",
    only: Words = (),
    look: Look = _LOOK,
    dpi: float = 300.0,
    json: Json = False,
) -> None:
    """Draw the figures of a result for print; nothing is computed again.

    Parameters
    ----------
    source
        Folder that a command wrote (run, study, screen, compare, ...), or a file that one saved (.nc): a motion, a
        study, a screening, spectra, orders, metrics.
    output
        Folder for the files, NAME.FORMAT each, all or nothing; default: the source's name with "-figures", here.
    formats
        "pdf", "eps", "svg", "png", "tiff", or several, parted by commas.
    only
        Name of a figure. May be repeated. Default: all.
    dpi
        Points an inch of PNG and TIFF, and of maps inside the others.
    """
    from gearrattle.report.plots.typeset.print_files import checked_dpi, known_formats

    with _as_options():
        how = {"style": look_of(look), "kinds": known_formats(formats), "dpi": checked_dpi(dpi)}
    folder = output or Path(f"{source.absolute().name.removesuffix(source.suffix)}-figures")

    def work(watch: Watch) -> Figures:
        from gearrattle.report.figures import Figures
        from gearrattle.report.result_charts import charts_of

        watch.enter("drawing")
        drawings = Figures(charts_of(source), how["style"])
        with _as_options():
            names = drawings.named(only or None)
        for done, name in enumerate(names):
            drawings.save(staging.path, how["kinds"], dpi=how["dpi"], only=[name])
            watch((done + 1) / len(names))
        return drawings

    with Staging(folder) as staging:
        drawings = watched(work)
        staging.commit()
    _print_figures(drawings, drawings.named(only or None), (folder, how["kinds"]), json=json)


def look_of(look: Look) -> Any:
    """Return the style from the options; ModelError for an option out of range."""
    from gearrattle.report.plots.typeset import Style

    return Style(look.width, look.font, look.size, look.style)


@contextmanager
def _as_options() -> Iterator[None]:
    """Context in which errors name the options instead of the arguments."""
    from dataclasses import replace

    try:
        yield
    except NotInstalled:
        raise
    except ModelError as error:
        names = {"format": "--as"}
        renamed = [replace(problem, place=names.get(problem.place, f"--{problem.place}")) for problem in error.problems]
        raise ModelError(renamed) from None


def _print_figures(drawings: Figures, names: list[str], where: tuple[Path, list[str]], *, json: bool) -> None:
    """Print what was drawn."""
    folder, kinds = where
    rows = []
    for name in names:
        width, height = (25.4 * float(length) for length in drawings[name].get_size_inches())
        files = [str(folder / f"{name}.{kind}") for kind in kinds]
        rows.append(
            {
                "name": name,
                "title": drawings.titles[name],
                "caption": drawings.captions[name],
                "width": width,
                "height": height,
                "files": files,
            }
        )
    if json:
        print(json_text({"output": str(folder), "figures": rows}))
        return
    cells = [(str(row["name"]), str(row["title"]), f"{row['width']:.0f} x {row['height']:.0f}") for row in rows]
    print(columns(("figure", "shows", "mm"), cells))
    print(f"figures: {folder}", file=sys.stdout)
