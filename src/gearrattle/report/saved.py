"""Results as files: a file of numbers, or a folder with page, summary, numbers and figures; complete or not at all."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.formats import format_name
from gearrattle.json_types import json_text
from gearrattle.report.documents import document_of
from gearrattle.report.plots.typeset.style import check_matplotlib
from gearrattle.report.presentation import FIGURE_ENDINGS, PRINT_ENDINGS, RESULT_ENDINGS, Presentation
from gearrattle.report.provenance import versions
from gearrattle.result import KIND
from gearrattle.wording import listed
from gearrattle.writing import Staging, is_left, sweep

PAGE = "report.html"
SUMMARY = "summary.json"
NUMBERS = "results.nc"
FIGURES = "figures"
"""Names of the files and the folder in the folder of a result."""
_OTHERS = (".html", ".json", ".jpg", ".txt", ".h5", ".hdf5", ".npz", ".mat", ".toml", ".zarr", ".wav")
_FILE_ENDINGS = (*RESULT_ENDINGS, *FIGURE_ENDINGS, *_OTHERS)
"""Endings of files; a path with such an ending is not taken as a folder."""
_OLD_PAGES = ("compare.html", "modes.html", "reproduction.html", "study.html")


def save(result: object, path: str | os.PathLike[str]) -> Path:
    """Save a result of any kind; if that fails, nothing changes on the disk.

    Parameters
    ----------
    result
        returned object of a function of gearrattle: a result, Dataset, DataArray, DataFrame or Series.
    path
        a file that ends in .nc (netCDF-4, all numbers), .csv (a table of them), .pdf (the page), .pptx (slides), .xlsx
        (tables) or another ending of this kind of result (.toml for a result with a model, .svg and .pdf for a single
        figure); or a folder, which gets report.html,
        summary.json, results.nc and figures/. The folder need not exist.

    Returns
    -------
    Path
        The file, or the page in the folder.

    Raises
    ------
    ModelError
        not a result of gearrattle, another ending, or a folder with files that are not a page of gearrattle.
    OSError
        the path cannot be written.

    Examples
    --------
    >>> import gearrattle as gr
    >>> page = gr.save(gr.modes(gr.example("case3")), "case3-modes")
    >>> page.name
    'report.html'
    """
    from gearrattle.report.result_kinds import presentation_of

    presentation = presentation_of(result)
    target = Path(path)
    check_target(target, presentation.endings, "path")
    with destination(target, presentation.endings) as staging:
        written = put_into(presentation, target, staging)
        staging.commit()
    return written


def check_target(path: Path, endings: Sequence[str], option: str, inputs: Sequence[Path] = ()) -> None:
    """Refuse a path to which the result cannot be saved, before anything is computed.

    ``option`` is the name of the option with this path, for the message. ModelError for another ending, for a folder or
    one of the inputs at the path of a file, and for a file at the path of a folder; NotInstalled for a document or a
    figure for print without what draws it.
    """
    suffix = path.suffix.lower()
    if suffix in endings:
        if path.is_dir():
            raise ModelError(Problem(option, f'"{path}"', "is a folder; a file is needed"))
        if path.parent.exists() and not path.parent.is_dir():
            raise ModelError(Problem(option, f'"{path}"', "lies below a file; a folder is needed"))
        document = document_of(suffix, endings)
        if document is not None:
            document.check(option, f'"{path}"')
        elif suffix in PRINT_ENDINGS:
            check_matplotlib(option, f'"{path}"')
    elif suffix in _FILE_ENDINGS and not path.is_dir():
        rule = f"must be a folder, or a file that ends in {listed(endings, 'or')}"
        raise ModelError(Problem(option, f'"{path}"', rule))
    if any(path.exists() and file.exists() and path.samefile(file) for file in inputs):
        raise ModelError(Problem(option, f'"{path}"', "is read and would be lost", "choose another name"))


def destination(path: Path, endings: Sequence[str]) -> Staging:
    """Return the staging folder for a result, whose path ``check_target`` has checked."""
    return Staging(path.parent) if path.suffix.lower() in endings else result_folder(path)


def put_into(presentation: Presentation[Any], path: Path, staging: Staging) -> Path:
    """Write a result into an open ``destination``, and return the final path of the file or page."""
    if path.suffix.lower() in presentation.endings:
        presentation.folder = path.parent
        document = document_of(path.suffix.lower(), presentation.endings)
        if document is None:
            presentation.write(staging.path / path.name)
        else:
            document.write(presentation, staging.path / path.name)
        return path
    fill(presentation, staging.path)
    return path / PAGE


def fill(presentation: Presentation[Any], folder: Path) -> None:
    """Write all files of a result into an existing empty folder."""
    from gearrattle.report.written_page import fill_page

    fill_page(presentation.page(), folder)
    write_json(summary(presentation), folder / SUMMARY)
    presentation.write(folder / NUMBERS)
    presentation.accompany(folder)


def summary(presentation: Presentation[Any]) -> dict[str, Any]:
    """Return the content of summary.json, which a command prints with --json."""
    return {
        "format": format_name("summary"),
        KIND: presentation.kind,
        "title": presentation.title,
        "sentence": presentation.sentence,
        **presentation.content(),
        "notes": list(presentation.notes),
        "versions": versions(),
        "created": presentation.created,
    }


def result_folder(folder: str | os.PathLike[str]) -> Staging:
    """Return the staging folder for a result, before anything is computed.

    The files of a result have common names and could replace files of the user. Therefore the folder must be new, empty
    or hold an earlier page of gearrattle with its figures; otherwise ModelError.
    """
    path = Path(folder)
    sweep(path)  # completes the replacement of a page if the program was killed meanwhile
    names = sorted(item.name for item in path.iterdir() if not is_left(item.name)) if path.is_dir() else []
    has_page = (path / FIGURES).is_dir() and not set(names).isdisjoint((PAGE, *_OLD_PAGES))
    if names and not has_page:
        shown = [*names[:3], f"{len(names) - 3} more"] if len(names) > 4 else names
        rule = f"is not empty and holds no page of gearrattle: {listed(shown)}"
        raise ModelError(Problem(str(path), "", rule, "give a new or an empty folder"))
    return Staging(path)


def write_json(content: Mapping[str, Any], path: Path) -> None:
    """Write a mapping as JSON, converted by ``json_value``."""
    path.write_text(json_text(content) + "\n", encoding="utf-8")
