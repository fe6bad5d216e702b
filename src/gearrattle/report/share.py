"""``share``: a result as one file to hand over: page, model, numbers, tables, and a script that repeats it.

A result that a command has saved is shared as it is; nothing is computed again but the verdict on a motion.
"""

from __future__ import annotations

import os
import stat
import zipfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model.model_file import readable_text
from gearrattle.report.documents import document_of
from gearrattle.report.documents.page_as_pdf import print_page
from gearrattle.report.presentation import RESULT_ENDINGS, Presentation
from gearrattle.report.provenance import versions
from gearrattle.report.result_charts import saved_presentation
from gearrattle.report.result_kinds import presentation_of
from gearrattle.report.saved import NUMBERS, PAGE, check_target, fill
from gearrattle.wording import listed
from gearrattle.writing import Staging, sweep, temporary_folder

ENDINGS = (".zip", *(ending for ending in RESULT_ENDINGS if document_of(ending, ())))
"""Endings of the files that ``share`` writes."""
_MOST_FILES = 10_000
_MODEL = "model.toml"
_TABLES = "tables.xlsx"
_SCRIPT = "repeat.py"
_CONTENTS = {
    PAGE: "the page; it needs no network and no other file",
    "figures": "its figures as SVG",
    "summary.json": "the answer for programs, in SI",
    NUMBERS: "all numbers with units, netCDF-4 (xarray, MATLAB: ncread)",
    _MODEL: "the model with the settings of the run",
    _TABLES: "the tables of the page for Excel",
    _SCRIPT: "computes the motion again and compares it: python repeat.py",
}
_REPEATED = '''"""Computes the motion of this folder again, and compares it with the stored one.

    pip install "gearrattle=={version}"
    python repeat.py
"""

import numpy as np

import gearrattle as gr

stored = gr.open_run("results.nc")
repeated = gr.simulate(gr.load("model.toml"))
print("stored:  ", gr.criteria(stored).sentence)
print("repeated:", gr.criteria(repeated).sentence)
for name in ("angle", "velocity"):
    before = stored.data[name].values
    after = repeated.data[name].values
    largest = np.abs(before).max()
    if np.array_equal(before, after):
        print(f"{{name}}: equal to the last bit")
    else:
        first = stored.data.sizes["time"] // stored.trajectory.cycles
        of_first = np.abs(after - before)[:first].max() / largest
        print(f"{{name}}: differs by {{of_first:.1e}} of its largest value in the first cycle,", end=" ")
        print(f"by {{np.abs(after - before).max() / largest:.1e}} in all: rounding of another machine grows in impacts")
'''


def share(source: object, path: str | os.PathLike[str]) -> Path:
    """Write a result, or what a command has saved of one, as one file to hand over.

    Parameters
    ----------
    source
        a result; or the path of a folder that a command wrote, or of a file that one saved (.nc).
    path
        a file that ends in .zip (a folder with page, figures, numbers, model, tables for Excel where openpyxl is
        installed, and for a motion a script that repeats it), .pdf (the page), .pptx (slides) or .xlsx (tables).

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ModelError
        the source is no result, or holds too little for such a file; another ending.
    NotInstalled
        the library that writes the format.
    OSError
        the path cannot be written; nothing has changed then.

    Examples
    --------
    >>> import gearrattle as gr
    >>> run = gr.simulate(gr.example("case3"), cycles=2, discard=1)
    >>> gr.share(run, "case3.zip").name
    'case3.zip'
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in ENDINGS:
        raise ModelError(Problem("path", f'"{target}"', f"must end in {listed(ENDINGS, 'or')}"))
    inputs = [Path(source)] if isinstance(source, str | os.PathLike) else []
    check_target(target, ENDINGS, "path", inputs)
    presentation, folder = _opened(source)
    document = document_of(suffix, ())
    with Staging(target.parent) as staging:
        path_while_written = staging.path / target.name
        if document is None:
            _write_archive(presentation, folder, path_while_written)
        elif folder is None or suffix != ".pdf" or not print_page(folder / PAGE, path_while_written):
            document.write(_needed(presentation, source), path_while_written)
        staging.commit()
    return target


def _opened(source: object) -> tuple[Presentation[Any] | None, Path | None]:
    """Return the presentation of what is shared, if its numbers are enough for one, and the folder that holds it."""
    if not isinstance(source, str | os.PathLike):
        return presentation_of(source), None
    path = Path(source)
    if not path.is_dir():
        return saved_presentation(path), None
    sweep(path)  # the command that wrote it may have been killed while it replaced older results
    if not (path / PAGE).is_file():
        remedy = "give a folder that a command wrote with -o, or a file that one saved (.nc)"
        raise ModelError(Problem(str(path), "a folder", f"holds no {PAGE}", remedy))
    try:
        return saved_presentation(path / NUMBERS), path
    except ModelError:  # numbers from which the page cannot be made again: the page is there
        return None, path


def _needed(presentation: Presentation[Any] | None, source: object) -> Presentation[Any]:
    """Return the presentation; ModelError for a folder whose numbers are not enough to make one."""
    if presentation is None:
        remedy = "share it as .zip, or run the command again with -o and this ending"
        raise ModelError(Problem(str(source), "a folder", "holds too little to make this file of it", remedy))
    return presentation


def _write_archive(presentation: Presentation[Any] | None, folder: Path | None, path: Path) -> None:
    """Write a zip whose only folder has the name of the file."""
    with temporary_folder() as made:
        # page, figures, summary and numbers
        if presentation is not None and folder is None:
            fill(presentation, made)
        # model, tables and script
        if presentation is not None:
            _add_model_and_tables(presentation, made)
        files = dict(_files(made))
        stored = dict(_files(folder)) if folder is not None else {}
        names = sorted({*files, *stored})
        # all of them, and what they are
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, strict_timestamps=False) as archive:
            archive.writestr(f"{path.stem}/README.txt", _read_me(names))
            for name in names:
                archive.write(files.get(name) or stored[name], f"{path.stem}/{name}")


def _add_model_and_tables(presentation: Presentation[Any], folder: Path) -> None:
    """Write the model, the script that repeats a motion, and the tables, as far as there are some."""
    model = getattr(presentation.result, "model", None)
    if model is not None:
        (folder / _MODEL).write_text(readable_text(model), encoding="utf-8")
    if presentation.kind in ("run", "motion"):
        version = versions().get("gearrattle", "")
        (folder / _SCRIPT).write_text(_REPEATED.format(version=version), encoding="utf-8")
    document = document_of(".xlsx", ())
    if document is not None and find_spec("openpyxl") is not None:
        document.write(presentation, folder / _TABLES)


def _files(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield the regular files of a folder by their names in it; ModelError for more than ten thousand."""
    count = 0
    for parent, _, names in os.walk(folder):
        for name in names:
            path = Path(parent) / name
            if not stat.S_ISREG(path.lstat().st_mode):
                continue
            count += 1
            if count > _MOST_FILES:
                rule = f"has more than {_MOST_FILES} files"
                raise ModelError(Problem(str(folder), "a folder", rule, "share one of its results"))
            yield path.relative_to(folder).as_posix(), path


def _read_me(names: list[str]) -> str:
    """Return the text that says what the files are."""
    tops = {name.partition("/")[0] for name in names}
    rows = [f"{name:<14} {words}" for name, words in _CONTENTS.items() if name in tops]
    made = ", ".join(f"{name} {version}" for name, version in versions().items())
    return "\n".join(["A result of gearrattle.", "", *rows, "", f"Written with {made}.", ""])
