"""Results of jobs on disk: the files that ``gr.save`` writes, and files for the page of the workbench.

    result/         report.html, summary.json, results.nc, figures/: the files for the user
    view.json       sections and tables for the page
    motions.json    for branches of periodic motions: the motions at their points
    traces/         for a run: the index of its histories, and its impacts
    partial/        for a running study: the cases computed so far, which ``gr.open_study`` opens; for branches that are
                    being followed: so_far.json, the view of the branches so far

``keep`` is called once, by the process that computed the result; the server then only reads files. Missing files (of a
job of an earlier version, or of a motion that the user put into the folder) are made from results.nc when needed.
"""

from __future__ import annotations

import json
import threading
import time
from functools import lru_cache
from pathlib import Path
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.json_types import json_value
from gearrattle.measured.readers import format_of
from gearrattle.orbits import Branch
from gearrattle.pipeline import Findings
from gearrattle.report.page import figure_sections
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.chart_files import read_charts
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.presentation import Presentation
from gearrattle.report.result_kinds import presentation_of
from gearrattle.report.saved import SUMMARY, save
from gearrattle.report.static_figures import CHARTS
from gearrattle.result import KIND
from gearrattle.results import Run, open_run
from gearrattle.studies import open_study
from gearrattle.workbench.editing import edited
from gearrattle.workbench.job_files import reading, stored_json, stored_object, stored_text
from gearrattle.workbench.traces import Hits, RunFile, write_index
from gearrattle.workbench.views import motions_json, section_json, view_of
from gearrattle.workbench.workspace_folder import NotThereError
from gearrattle.writing import whole

RESULT = "result"
VIEW = "view.json"
TRACES = "traces"
PARTIAL = "partial"
MOTIONS = "motions.json"
"""Names in the folder of a job."""
_SO_FAR = "so_far.json"
_PAUSE = 0.4  # s, least time between two partial views
_SHARE = 0.1  # largest share of the computing time for partial views


def keep(result: Any, folder: Path) -> None:
    """Save a result into the folder of a job, and what the page shows of it."""
    presentation = presentation_of(result)
    save(presentation, folder / RESULT)
    _write_json(view_of(presentation), folder / VIEW)
    shown = presentation.result
    motion = shown.motion if isinstance(shown, Findings) else shown
    if isinstance(motion, Run):
        _write_traces(motion, folder)
    if isinstance(shown, Branch):
        _write_json(motions_json(shown), folder / MOTIONS)


def _write_json(content: dict[str, Any] | None, target: Path) -> None:
    with whole(target) as path:
        path.write_text(json.dumps(json_value(content), ensure_ascii=False, allow_nan=False), encoding="utf-8")


def _write_traces(run: Run, folder: Path) -> None:
    target = folder / TRACES
    target.mkdir(exist_ok=True)
    write_index(RunFile(folder / RESULT / "results.nc"), target)
    Hits.of_run(run).write(target)


class Growing:
    """Writes the view of a partial result, so rarely that this takes at most ``_SHARE`` of the computing time."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._next = 0.0

    def __call__(self, result: Any) -> None:
        """Write it, unless it was written a moment ago."""
        begin = time.monotonic()
        if begin < self._next:
            return
        self._folder.mkdir(exist_ok=True)
        _write_json(_seen(presentation_of(result)), self._folder / _SO_FAR)
        end = time.monotonic()
        self._next = end + max(_PAUSE, (end - begin) / _SHARE)


def _seen(presentation: Presentation[Any]) -> dict[str, Any]:
    """Return the view of a result, and its figures by key."""
    charts = {chart.key: chart_json(chart) for chart in presentation.charts()}
    return {"view": view_of(presentation), "charts": charts}


def read_view(folder: Path) -> dict[str, Any]:
    """Return the view of a job's result."""
    if not (folder / VIEW).is_file():
        path = folder / RESULT / "results.nc"
        is_run = path.is_file() and format_of(path) == "run"
        _write_json(view_of(presentation_of(run_of(folder))) if is_run else _plain_view(folder), folder / VIEW)
    return stored_object(folder / VIEW)


def motions_of(folder: Path) -> dict[str, Any] | None:
    """Return the motions at points of a job's branches, None if none can be shown; ModelError if the job keeps none."""
    path = folder / MOTIONS
    if not path.is_file():
        problem = Problem("motions", folder.name, "keeps no branches of motions", "run continuation again")
        raise NotThereError(problem)
    motions: dict[str, Any] | None = stored_json(path)
    return motions


def model_of_motion(folder: Path, point: int) -> str:
    """Return the model file of a job with the value of a point of its branches, started in the motion there."""
    motions = motions_of(folder)
    with reading(folder / MOTIONS):
        chosen = next((entry for entry in (motions or {}).get("points", ()) if entry["point"] == point), None)
        if motions is None or chosen is None:
            raise NotThereError(Problem("motion", f"{point}", "is no point whose motion is kept"))
        edits = [
            {"op": "set", "path": motions["path"], "value": chosen["value"]},
            {"op": "set", "path": ["simulation", "initial"], "value": chosen["start"]},
        ]
    return edited(stored_text(folder / "model.toml"), edits).text


def partial_view(folder: Path) -> dict[str, Any] | None:
    """Return the view of what is computed of a study or of branches, and its figures by key; None: there is none."""
    path = folder / PARTIAL / _SO_FAR
    if path.is_file():
        return stored_object(path)
    try:
        seen: dict[str, Any] = json_value(_seen(presentation_of(open_study(folder / PARTIAL))))
    except ModelError:
        return None
    return seen


def _plain_view(folder: Path) -> dict[str, Any]:
    """Return what summary.json and the figures hold of a result whose view was not written."""
    path = folder / RESULT / SUMMARY
    if not path.is_file():
        raise ModelError(Problem("job", folder.name, "has no result yet", "wait until it is done"))
    summary = stored_object(path)
    sections = [section_json(section) for section in figure_sections(charts_of_job(folder))]
    return {
        **{key: summary[key] for key in ("title", "sentence", "notes")},
        "kind": summary[KIND],
        "sections": sections,
    }


def run_of(folder: Path) -> Run:
    """Return the motion of a job; ModelError if its result is no motion."""
    path = folder / RESULT / "results.nc"
    if not path.is_file():
        raise ModelError(Problem("job", folder.name, "has no result yet", "wait until it is done"))
    return open_run(path)


def source_of(folder: Path) -> RunFile:
    """Return the histories of a job's run."""
    path = folder / RESULT / "results.nc"
    if not path.is_file():
        raise ModelError(Problem("job", folder.name, "has no result yet", "wait until it is done"))
    with reading(path):
        return _opened(path, path.stat().st_mtime_ns)


@lru_cache(8)
def _opened(path: Path, changed: int) -> RunFile:
    del changed  # part of the key: a folder that is filled anew is opened anew
    return RunFile(path, path.parents[1] / TRACES)


def impacts_of(folder: Path) -> Hits:
    """Return the impacts of a job's run."""
    if not (folder / TRACES / "impacts.npz").is_file():
        _write_traces(run_of(folder), folder)
    with reading(folder / TRACES / "impacts.npz"):
        return _hits(folder / TRACES, (folder / TRACES / "impacts.npz").stat().st_mtime_ns)


@lru_cache(8)
def _hits(folder: Path, changed: int) -> Hits:
    del changed
    return Hits.read(folder)


def charts_of_job(folder: Path) -> list[Chart]:
    """Return the figures of a job's result."""
    path = folder / RESULT / "figures" / CHARTS
    if not path.is_file():
        return []
    with _READING:  # a page asks for several figures at once: one thread reads the file, the others wait for it
        return _charts(path, path.stat().st_mtime_ns)


_READING = threading.Lock()


@lru_cache(8)
def _charts(path: Path, changed: int) -> list[Chart]:
    del changed
    return read_charts(path)
