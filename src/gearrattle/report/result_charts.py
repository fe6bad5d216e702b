"""The charts of a result, which are those of its page.

A folder written by a command has its charts in figures/charts.npz, which can be read without knowing the kind of
result.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused, opened_hdf5
from gearrattle.formats import check_format
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.chart_files import read_charts
from gearrattle.report.presentation import Presentation
from gearrattle.report.result_kinds import PRESENTATIONS, presentation_class, presentation_of
from gearrattle.report.static_figures import CHARTS
from gearrattle.result import KIND
from gearrattle.results import open_run
from gearrattle.writing import sweep

_RULE = "must be a folder that a command wrote, or a file that one saved (.nc)"


def charts_of(result: Any) -> list[Chart]:
    """Return the figures of a result, of a folder written by a command, or of a saved file (.nc) of data or a motion.

    ModelError if it is none of these or its kind has no figures; OSError if a file cannot be read.
    """
    if isinstance(result, str | os.PathLike):
        path = Path(result)
        if not path.exists():
            raise ModelError(Problem(str(path), "", "does not exist", _RULE))
        return _stored(path) if path.is_dir() or path.suffix.lower() == ".npz" else _of_file(path)
    return _drawn(presentation_of(result), "figures")


def _drawn(presentation: Presentation[Any], location: object) -> list[Chart]:
    charts = presentation.charts()
    if not charts:
        raise ModelError(Problem(f"{location}", presentation.kind, "has no figures", "its tables hold the numbers"))
    return charts


def _of_file(path: Path) -> list[Chart]:
    """Return the charts of a saved file, which may be damaged in any way."""
    presentation = saved_presentation(path)
    try:
        return _drawn(presentation, path)
    except (ModelError, MemoryError):
        raise
    except Exception as error:
        words = " ".join(str(error).split())[:120] or type(error).__name__
        rule = f"cannot be drawn as {presentation.kind}: it is damaged, or was changed"
        raise ModelError(Problem(str(path), words, rule, "save it again")) from None


def _stored(path: Path) -> list[Chart]:
    """Return the charts of a folder of a result, or of the file that holds them."""
    if not path.is_dir():
        return read_charts(path)
    sweep(path)  # the command that wrote it may have been killed while it replaced older results
    kept = path / "figures" / CHARTS
    if not kept.is_file():
        remedy = "run the command again; of a run give results.nc instead"
        raise ModelError(Problem(str(path), "a folder", f"holds no figures/{CHARTS}", remedy))
    return read_charts(kept)


def saved_presentation(path: Path) -> Presentation[Any]:
    """Return the presentation of a saved motion, or of saved labelled data; ModelError for any other file."""
    import xarray as xr

    from gearrattle.measured.readers import format_of

    # refuse what is no file of results
    if path.suffix.lower() != ".nc":
        raise ModelError(Problem(str(path), path.suffix or "no ending", _RULE))
    # a saved motion
    if format_of(path) == "run":
        return presentation_of(open_run(path))
    # a saved Dataset
    try:
        opened_hdf5(path).close()
        with xr.open_dataset(path, engine="h5netcdf") as opened:
            data = opened.load()
    except Refused as error:
        raise ModelError(Problem(str(path), "", error.rule, error.remedy)) from None
    except MemoryError:
        raise
    except Exception as error:  # for a damaged file, h5py and the readers of its parts raise many types
        words = " ".join(str(error).split())[:120] or type(error).__name__
        raise ModelError(Problem(str(path), words, _RULE)) from None
    # the kind of result, and whether its Dataset is all of it
    check_format(data.attrs.pop("format", ""), path, "result")
    kind = str(data.attrs.get(KIND, ""))
    if kind not in PRESENTATIONS:
        raise ModelError(Problem(str(path), f'"{kind}"', "is no kind of result", "run the command that saved it again"))
    if not presentation_class(kind).is_data:
        rule = "is saved as numbers, from which its figures cannot be drawn"
        raise ModelError(Problem(str(path), kind, rule, "save it into a folder, and give that"))
    return presentation_class(kind)(data)
