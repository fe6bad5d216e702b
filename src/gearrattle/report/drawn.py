"""What charts belong to a result: those of its page, by what it is.

Every page takes its charts from a function of ``plots``; here stands which one is for which noun, once. A folder that a
command wrote keeps its charts in figures/charts.npz, so it need not be known what it holds.

Takes results, Datasets, files and folders; gives Charts.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearrattle.calls.campbell import Campbell
from gearrattle.comparison.rows import Comparison
from gearrattle.errors import ModelError, Problem
from gearrattle.files import Refused, opened_hdf5
from gearrattle.formats import check_format
from gearrattle.identification.loop_result import LoopFit
from gearrattle.pipeline import Findings, judged
from gearrattle.plots import charts
from gearrattle.plots.campbell import campbell_chart
from gearrattle.plots.chart import Chart
from gearrattle.plots.comparison import growth_of_errors
from gearrattle.plots.densities import spectra_charts
from gearrattle.plots.loop import loop_chart
from gearrattle.plots.order_maps import cuts_chart, map_chart
from gearrattle.plots.run_up_validation import run_up_charts
from gearrattle.plots.screening import screening_map
from gearrattle.plots.stored import read_charts
from gearrattle.plots.validation import validation_charts
from gearrattle.report.ink import CHARTS
from gearrattle.results import Run, open_run
from gearrattle.validation import RunUp, Validation
from gearrattle.writing import sweep

if TYPE_CHECKING:
    import xarray as xr

_REMEDY = "a run, a study, a screening, spectra, orders, a validation, a fitted loop, a folder that a command wrote"


def charts_of(result: Any) -> list[Chart]:
    """Return every figure of a result that has something to show.

    Args:
        result: a run or findings; the Dataset of a study, of ``screen``, ``spectra``, ``order_map``, ``order_cuts`` or
            ``waterfall``; what ``validate``, ``validate_run_up``, ``fit_loop`` or ``campbell`` returned; a folder that
            a command wrote; a file of one of the former (.nc).

    Raises:
        ModelError: it is none of these.
        OSError: a file cannot be read.
    """
    if isinstance(result, str | os.PathLike):
        return _of_path(Path(result))
    made = next((make for noun, make in _OF_NOUNS if isinstance(result, noun)), None) or _of_data(result)
    if made is None:
        raise ModelError(Problem("figures", type(result).__name__, "has no figures", _REMEDY))
    return [chart for chart in made(result) if chart is not None and chart.panels]


_OF_NOUNS: tuple[tuple[type, Callable[[Any], list[Chart]]], ...] = (
    (Findings, charts),
    (Run, lambda run: charts(judged(run))),
    (Validation, validation_charts),
    (RunUp, run_up_charts),
    (Comparison, lambda found: [growth_of_errors(found)]),
    (LoopFit, lambda found: [loop_chart(found)]),
    (Campbell, lambda found: [campbell_chart(found, si=found.units == "SI")]),
)


def _of_data(data: Any) -> Callable[[Any], list[Chart]] | None:
    """Return what draws a Dataset or a DataArray, told by its variables."""
    names = {str(name) for name in getattr(data, "data_vars", ())}
    if "separation_ratio" in names:
        return lambda found: [screening_map(found), screening_map(found, "separation_ratio")]
    if "psd" in names:
        return lambda found: spectra_charts(found, natural=_told(found, "natural_frequencies"))
    if "outcome" in names:
        from gearrattle.report.study_pages import page_of

        return lambda found: page_of(found).charts(found)
    if not names:  # a DataArray of two dimensions is a map itself
        return _map if set(getattr(data, "dims", ())) == {"time", "frequency"} else None
    if "amplitude" in names and "order" in data.dims:
        return _map_of if "window" in data.attrs else lambda found: [cuts_chart(found)]
    name = next(iter(names))
    return (lambda found: _map(found[name])) if set(data.dims) == {"time", "frequency"} else None


def _map_of(data: xr.Dataset) -> list[Chart]:
    amplitude = data["amplitude"]
    return _map(amplitude.assign_attrs({**data.attrs, **amplitude.attrs}))


def _map(data: xr.DataArray) -> list[Chart]:
    return [map_chart(data, orders=_told(data, "excited_orders"), natural=_told(data, "natural_frequencies"))]


def _told(data: Any, name: str) -> list[float]:
    """Return numbers that an attribute keeps; netCDF keeps a single one as a number."""
    import numpy as np

    return [float(value) for value in np.atleast_1d(data.attrs.get(name, []))]


def _of_path(path: Path) -> list[Chart]:
    """Return the charts of a folder or of a saved result."""
    from gearrattle.readers import format_of

    if not path.exists():
        raise ModelError(Problem(str(path), "", "does not exist"))
    if path.is_dir():
        sweep(path)  # the command that wrote it may have been killed while it replaced older results
        kept = path / "figures" / CHARTS
        if not kept.is_file():
            remedy = "run the command again; of a run give results.nc instead"
            raise ModelError(Problem(str(path), "a folder", f"holds no figures/{CHARTS}", remedy))
        return read_charts(kept)
    if path.suffix.lower() == ".npz":
        return read_charts(path)
    if path.suffix.lower() == ".nc" and format_of(path) == "run":
        return charts_of(open_run(path))
    return _of_netcdf(path)


def _of_netcdf(path: Path) -> list[Chart]:
    import xarray as xr

    rule = "must be a folder that a command wrote, or a file that one saved (.nc)"
    if path.suffix.lower() != ".nc":
        raise ModelError(Problem(str(path), path.suffix or "no ending", rule, _REMEDY))
    try:
        opened_hdf5(path).close()
        with xr.open_dataset(path, engine="h5netcdf") as opened:
            data = opened.load()
    except Refused as error:
        raise ModelError(Problem(str(path), "", error.rule, error.remedy)) from None
    except MemoryError:
        raise
    except Exception as error:  # a damaged file: h5py and what reads its parts complain in many ways
        words = " ".join(str(error).split())[:120] or type(error).__name__
        raise ModelError(Problem(str(path), words, rule, _REMEDY)) from None
    check_format(data.attrs.pop("format", ""), path, "orders", "spectra", "screening")
    if _of_data(data) is None:
        raise ModelError(Problem(str(path), ", ".join(map(str, data.data_vars)) or "empty", "has no figures", _REMEDY))
    return charts_of(data)
