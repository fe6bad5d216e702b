"""HTTP interface to the results of a job: view, figures, histories, impacts, sound, files."""

from __future__ import annotations

import math
import re
import zipfile
from collections.abc import Callable
from contextlib import ExitStack
from functools import wraps
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route

from gearrattle.errors import ModelError, Problem
from gearrattle.report.plots.interactive import chart_json
from gearrattle.workbench import kept_results
from gearrattle.workbench.channel_spectrum import best_shift, density
from gearrattle.workbench.differences import differences
from gearrattle.workbench.job_files import reading, stored_text
from gearrattle.workbench.job_inputs import INPUTS, NAME, copy_inputs, files_of, moved
from gearrattle.workbench.jobs.job_record import read_job
from gearrattle.workbench.jobs.task_options import check_options
from gearrattle.workbench.jobs.tasks import TASKS
from gearrattle.workbench.routes.json_answers import answering
from gearrattle.workbench.script import script
from gearrattle.workbench.traces import InMemory, Source, described, packed
from gearrattle.workbench.workspace_folder import Folder, NotThereError
from gearrattle.writing import Staging, temporary_folder

_NAME = re.compile(r"[A-Za-z0-9_.-]{1,120}")
_FIGURE_TYPES = {"svg": "image/svg+xml", "pdf": "application/pdf"}
_POINTS = (16, 20_000)
_MOST_CHANNELS = 64
_MOST_JOBS = 12
_MOST_ALIGNED = 1_000_000  # samples of a run that are looked through for the best shift
_BINARY = "application/octet-stream"


def _folder(request: Request) -> Path:
    """Return the folder of the job that is asked for."""
    return _job_folder(request, str(request.path_params["job"]))


def _job_folder(request: Request, job: str) -> Path:
    folder: Path = request.app.state.folder.job(job)
    return folder


def _file(path: Path, media_type: str, name: str = "") -> Response:
    if not path.is_file():
        raise NotThereError(Problem(path.name, "", "there is no such file", "wait until the job is done"))
    return FileResponse(path, media_type=media_type, filename=name or None)


def _view(request: Request) -> Any:
    return kept_results.read_view(_folder(request))


def _partial(request: Request) -> Any:
    return kept_results.partial_view(_folder(request))


def _motions(request: Request) -> Any:
    return kept_results.motions_of(_folder(request))


def _model_of_motion(request: Request) -> Response:
    text = kept_results.model_of_motion(_folder(request), int(request.path_params["point"]))
    return Response(text, media_type="application/toml")


def _figure(request: Request) -> Any:
    """Send a figure as it stands in the result, as data, or drawn for print."""
    folder = _folder(request)
    name = str(request.path_params["name"])
    form = str(request.path_params["form"])
    if not _NAME.fullmatch(name) or form not in (*_FIGURE_TYPES, "json"):
        raise NotThereError(Problem("figure", f"{name}.{form}"[:120], "there is no such figure", "svg, pdf or json"))
    if form == "svg":
        return _file(folder / kept_results.RESULT / "figures" / f"{name}.svg", _FIGURE_TYPES[form])
    chart = next((chart for chart in kept_results.charts_of_job(folder) if chart.key == name), None)
    if chart is None:
        raise NotThereError(Problem("figure", name, "there is no such figure", ""))
    if form == "json":
        return chart_json(chart)
    from gearrattle.report.plots.typeset import matplotlib_figure
    from gearrattle.report.plots.typeset.print_files import saved

    content = saved(matplotlib_figure(chart), form, title=chart.title, subject=chart.caption)
    headers = {"content-disposition": f'attachment; filename="{name}.{form}"'}
    return Response(content, media_type=_FIGURE_TYPES[form], headers=headers)


def _number(request: Request, name: str, default: float) -> float:
    text = request.query_params.get(name)
    try:
        value = default if text is None else float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ModelError(Problem(name, str(text)[:40], "must be a number"))
    return value


def _trace(request: Request, source: Source) -> Response:
    """Send times and values of channels over a window."""
    names = request.query_params.getlist("channel")[:_MOST_CHANNELS]
    begin = _number(request, "from", source.start)
    end = _number(request, "to", source.start + source.step * (source.count - 1))
    points = int(np.clip(_number(request, "points", 2000), *_POINTS))
    if not begin < end:
        raise ModelError(Problem("from", f"{begin:g}", f"must be less than to ({end:g})"))
    return Response(packed([source.trace(name, begin, end, points) for name in names]), media_type=_BINARY)


def _job_channels(request: Request) -> Any:
    folder = _folder(request)
    return described(kept_results.source_of(folder), kept_results.impacts_of(folder))


def _job_trace(request: Request) -> Response:
    return _trace(request, kept_results.source_of(_folder(request)))


def _impacts(request: Request) -> Response:
    """Send impacts of a window: time, clearance, velocity, energy and count of every mark."""
    hits = kept_results.impacts_of(_folder(request))
    most = int(np.clip(_number(request, "points", 1000), *_POINTS))
    marks = hits.within(_number(request, "from", 0.0), _number(request, "to", 0.0), most)
    arrays = (marks.time, marks.clearance, marks.velocity, marks.energy, marks.count)
    return Response(packed([arrays]), media_type=_BINARY)


def _spectrum(request: Request) -> Any:
    channel = request.query_params.get("channel", "")
    return density(kept_results.run_of(_folder(request)), channel)


def _sound(request: Request) -> Response:
    """Send the sound of a run, at a gain or at its own peak."""
    from gearrattle.workbench.sounds import sound_of

    gain = _number(request, "gain", 0.0) if "gain" in request.query_params else None
    sound = sound_of(_folder(request), _elements(request), gain)
    return Response(sound.wav(sound.names[0], 24), media_type="audio/wav")


def _sounds(request: Request) -> Any:
    """Send the gain that the sounds of several runs share."""
    from gearrattle.workbench.sounds import at_one_gain

    jobs = _jobs_asked_for(request)
    return {"jobs": jobs, **at_one_gain([_job_folder(request, job) for job in jobs], _elements(request))}


def _elements(request: Request) -> list[str] | None:
    """Return the elements that are to be heard; None for all."""
    return request.query_params.getlist("element") or None


def _jobs_asked_for(request: Request) -> list[str]:
    """Return the jobs that are compared."""
    return [job for job in request.query_params.get("jobs", "").split(",") if job][:_MOST_JOBS]


def _report(request: Request) -> Response:
    return _file(_folder(request) / kept_results.RESULT / "report.html", "text/html", "report.html")


def _model(request: Request) -> Response:
    return _file(_folder(request) / "model.toml", "application/toml", "model.toml")


def _script_text(folder: Path) -> str:
    job = read_job(folder)
    check_options(job.task, job.options)  # their names become code, and the record may be somebody else's
    options = moved(job.options, TASKS[job.task].files)
    return script(job.task, options, job.name, version("gearrattle"))


def _script(request: Request) -> Response:
    headers = {"content-disposition": 'attachment; filename="script.py"'}
    return Response(_script_text(_folder(request)), media_type="text/x-python; charset=utf-8", headers=headers)


def _inputs(folder: Path, workspace: Folder) -> Path:
    """Return the folder of inputs of a job; one of an earlier version has none yet."""
    if not (folder / INPUTS).is_dir():
        job = read_job(folder)
        others = files_of(job.options, TASKS[job.task].files)
        with Staging(folder / INPUTS) as staging:
            copy_inputs(staging.path, workspace, stored_text(folder / NAME), job.file, others)
            staging.commit()
    return folder / INPUTS


def _zipped(request: Request, what: str, *, has_script: bool = True, has_result: bool = False) -> Response:
    """Send what runs anywhere by itself: the model with its data files, script and result."""
    folder = _folder(request)
    with ExitStack() as stack, reading(folder / INPUTS):
        inputs = _inputs(folder, request.app.state.folder)
        files = [(file, file.relative_to(inputs)) for file in inputs.rglob("*")]
        if has_result:
            files += [(file, file.relative_to(folder)) for file in (folder / kept_results.RESULT).rglob("*")]
        target = stack.enter_context(temporary_folder()) / f"{what}.zip"
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=1, strict_timestamps=False) as archive:
            if has_script:
                archive.writestr("script.py", _script_text(folder))
            for file, name in sorted(files):
                if file.is_file():
                    archive.write(file, name)
        removal = BackgroundTask(stack.pop_all().close)
    return FileResponse(target, media_type="application/zip", filename=target.name, background=removal)


def _archive(request: Request) -> Response:
    return _zipped(request, str(request.path_params["job"]), has_result=True)


def _script_archive(request: Request) -> Response:
    return _zipped(request, "script")


def _model_archive(request: Request) -> Response:
    return _zipped(request, "model", has_script=False)


def _compare(request: Request) -> Any:
    jobs = _jobs_asked_for(request)
    folders = [_job_folder(request, job) for job in jobs]
    figures = [[chart.key for chart in kept_results.charts_of_job(folder)] for folder in folders]
    return {"jobs": jobs, **differences(folders), "figures": figures}


def _recording(request: Request) -> Any:
    """Read the measured file that is asked for, which must lie in the workspace folder."""
    from gearrattle.measured.read import read

    folder: Folder = request.app.state.folder
    return read(folder.file(request.query_params.get("file", "")), root=folder.root)


def _measured(request: Request) -> Any:
    return described(InMemory.of_recording(_recording(request)))


def _measured_trace(request: Request) -> Response:
    return _trace(request, InMemory.of_recording(_recording(request)))


def _measured_spectrum(request: Request) -> Any:
    return density(_recording(request), request.query_params.get("channel", ""))


def _shift(request: Request) -> Any:
    """Send the shift of time with which a measured channel agrees best with a simulated one."""
    recording = InMemory.of_recording(_recording(request))
    source = kept_results.source_of(_job_folder(request, request.query_params.get("job", "")))
    first = int(np.clip(round(source.discard * (source.period or 0.0) / source.step), 0, source.count - 2))
    last = min(source.count, first + _MOST_ALIGNED)
    times = source.times(np.arange(first, last)), recording.times(np.arange(recording.count))
    simulated = source.read(request.query_params.get("simulated", ""), first, last)
    measured = recording.read(request.query_params.get("measured", ""), 0, recording.count)
    return {"shift": best_shift((times[0], simulated), (times[1], measured))}


def _reading(endpoint: Callable[[Request], Any]) -> Callable[[Request], Any]:
    """Return an endpoint that reads the numbers of a run, and names the file if they are damaged."""

    @wraps(endpoint)
    def named(request: Request) -> Any:
        with reading(_folder(request) / kept_results.RESULT / "results.nc"):
            return endpoint(request)

    return named


_PATHS: dict[str, Callable[[Request], Any]] = {
    "/api/jobs/{job}/view": _view,
    "/api/jobs/{job}/partial": _partial,
    "/api/jobs/{job}/motions": _motions,
    "/api/jobs/{job}/motions/{point:int}/model.toml": _model_of_motion,
    "/api/jobs/{job}/figures/{name}.{form}": _figure,
    "/api/jobs/{job}/traces": _reading(_job_channels),
    "/api/jobs/{job}/trace": _reading(_job_trace),
    "/api/jobs/{job}/impacts": _reading(_impacts),
    "/api/jobs/{job}/spectrum": _reading(_spectrum),
    "/api/jobs/{job}/sound.wav": _reading(_sound),
    "/api/jobs/{job}/report.html": _report,
    "/api/jobs/{job}/script.py": _script,
    "/api/jobs/{job}/model.toml": _model,
    "/api/jobs/{job}/script.zip": _script_archive,
    "/api/jobs/{job}/model.zip": _model_archive,
    "/api/jobs/{job}/archive.zip": _archive,
    "/api/compare": _compare,
    "/api/sound": _sounds,
    "/api/measured": _measured,
    "/api/measured/trace": _measured_trace,
    "/api/measured/spectrum": _measured_spectrum,
    "/api/measured/shift": _shift,
}

ROUTES: list[BaseRoute] = [Route(path, answering(endpoint), methods=["GET"]) for path, endpoint in _PATHS.items()]
