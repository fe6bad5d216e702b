"""The page's interface: what a client sends to it, and what somebody left in the folder of a job.

The laws, each in a sentence:

- check: any body is answered by 200, or by 4xx and problems.
- edit: the same, and a text that has no problems after its edits is TOML.
- job: the same by 201, nothing of a refused job is left, and the list of jobs can still be sent.
- name of a job, live: the same as check, and the list of jobs can still be sent.
- record of a job: the list can be sent and holds every sound job, whatever is in the record of another one.
- result of a job: what the page asks for is answered by 200, or by 4xx and problems.
- options: a task ends with a result or an error of ours, whatever its options.

An answer is JSON that a browser reads: NaN is none. Nothing is simulated.

Takes nothing; gives targets.
"""

from __future__ import annotations

import asyncio
import json
import tomllib
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from unittest.mock import patch

from gearrattle.errors import GearRattleError, ModelError, Problem
from tests.fuzz.mutations import Kind
from tests.fuzz.target import NO_MOTION, SMALL, LawError, Target, small_run

_JOBS = "/api/jobs"
_PATH = "coupling.joint.stiffness"
_AXIS = {_PATH: {"from": 700.0, "to": 800.0, "count": 3}}
TASKS: Mapping[str, dict[str, Any]] = {
    "run": {"cycles": 3, "discard": 1, "initial": "steady"},
    "simulate": {"algorithm": "rk4", "step": "1 ms", "tolerance": 1e-9, "samples_per_cycle": 8, "audit": False},
    "advise": {"up_to": "100 Hz"},
    "modes": {"contact_ratio": {"joint": 0.5}, "with_damping": True},
    "equilibrium": {},
    "stiffness": {"region": {"joint": 0}},
    "reduce": {"up_to": "40 Hz", "keep": ["joint"]},
    "compare": {"algorithms": ["exact", "rk4"]},
    "study": {"axes": {_PATH: [700.0, 800.0]}, "outputs": ["TR rms", "verdict"]},
    "bifurcation": {"path": _PATH, "values": [700.0, 800.0]},
    "basins": {"over": {"deflection.joint": [0.0, 0.01], "rate.joint": [0.0, 1.0]}, "cycles": 3, "discard": 1},
    "screen": {"speeds": {"from": "700 rpm", "to": "900 rpm", "count": 2}, "simulate": False},
    "periodic": {"cycles": 1, "start": "linear", "every": False},
    "continuation": {"path": _PATH, "range": [700.0, 800.0], "step_limit": 50.0},
    "validate": {"measurement": "rig.csv", "band": [1.0, 30.0], "draws": 3, "match": {}},
    "fit": {"data": "d.toml", "free": [_PATH], "starts": 1, "seed": 0},
}
"""Task -> options that it may have."""
EDITS: tuple[list[dict[str, Any]], ...] = (
    [{"op": "set", "path": "inertia.engine.J", "value": 0.3}],
    [{"op": "set", "path": ["torque", 0, "harmonics", 0, "order"], "typed": "2"}],
    [{"op": "set", "path": "coupling.joint.clearance", "typed": "0.5 deg"}, {"op": "delete", "path": "torque.0.mean"}],
    [{"op": "add", "table": "inertia", "value": {"name": "hub", "J": 0.1}}],
    [{"op": "add", "table": ["torque", 0, "harmonics"], "value": {"order": 2, "amplitude": 1.0}}],
    [{"op": "rename", "table": "inertia", "name": "wheel", "to": "disc"}, {"op": "delete", "path": "inertia.disc"}],
    [{"op": "begin", "path": "mesh", "option": 0}, {"op": "begin", "path": ["torque", 0, "harmonics"]}],
    [{"op": "set", "path": ["simulation", "initial"], "value": {"angle": [0.0, 0.1], "velocity": [0.0, 1.0]}}],
)


async def _at_once(work: Callable[..., Any], *arguments: Any) -> Any:
    """Do in this thread what the server does in one of its own: the time of an input can be bounded."""
    return work(*arguments)


@cache
def _runner() -> asyncio.Runner:
    return asyncio.Runner()


Application = Callable[[Any, Any, Any], Awaitable[None]]


def answer_of(app: Application, method: str, path: str, content: bytes = b"") -> tuple[int, str, bytes]:
    """Return status, type and body of what the page answers."""
    sent: list[dict[str, Any]] = []

    coming = [{"type": "http.request", "body": content, "more_body": False}]

    async def receive() -> dict[str, Any]:
        return coming.pop() if coming else {"type": "http.disconnect"}

    async def send(message: dict[str, Any]) -> None:
        sent.append(message)

    scope = {"type": "http", "method": method, "path": path, "raw_path": path.encode(), "query_string": b""}
    scope |= {"headers": [], "root_path": "", "server": ("127.0.0.1", 1), "scheme": "http", "http_version": "1.1"}

    async def ask() -> None:
        await app(scope, receive, send)

    _runner().run(ask())
    headers = dict(sent[0].get("headers", ()))
    body = b"".join(message.get("body", b"") for message in sent[1:])
    return int(sent[0]["status"]), headers.get(b"content-type", b"").decode(), body


def _no_number(word: str) -> None:
    raise LawError(f"{word} in an answer")


def asked(app: Application, method: str, path: str, content: bytes = b"") -> Any:
    """Return what the page answers: JSON, or None where it is something else.

    Raises
    ------
    ModelError
        the page refuses, with problems.
    LawError
        the answer breaks the law.
    """
    status, kind, body = answer_of(app, method, path, content)
    if status >= 500:
        raise LawError(f"{status} to {method}: {body[:120].decode(errors='replace')}")
    value = json.loads(body, parse_constant=_no_number) if kind == "application/json" else None
    if status >= 400:
        if not isinstance(value, dict) or not value.get("problems"):
            raise LawError(f"{status} to {method} without problems")
        raise ModelError(Problem("request", "", f"{status}: {value['problems'][0]['rule']}"))
    return value


class _Here:
    """In the place of a process that computes: what it would answer, computed in this one."""

    def ask(self, what: str, content: dict[str, Any], progress: Any = None) -> Any:
        """Return the answer to a request."""
        from gearrattle.workbench.jobs import worker

        del progress
        try:
            return worker._REQUESTS[what](content, lambda _: None)
        except ModelError as error:
            raise worker.FailedError(error.problems) from error
        except (GearRattleError, MemoryError, OSError) as error:
            raise worker.FailedError(Problem("computation", "", f"{error}")) from error

    def start(self) -> None:
        """Nothing is to be started."""

    def end(self) -> None:
        """Nothing is to be ended."""


def page_of(root: Path) -> Any:
    """Return the application of a folder; nothing is computed by it."""
    from gearrattle.workbench.application import Limits, application
    from gearrattle.workbench.jobs.latest_answers import Newest
    from gearrattle.workbench.jobs.queue import Jobs
    from gearrattle.workbench.jobs.worker import Reserve, WarmProcess
    from gearrattle.workbench.workspace_folder import Folder

    folder = Folder(root.resolve())
    app = application(folder, Limits(1, 8e9))
    app.state.jobs = Jobs(folder, 0, 8e9, Reserve())
    with patch.object(WarmProcess, "start"):
        app.state.newest = Newest(folder, 8e9, Reserve())
    app.state.newest._process = _Here()
    return app


@contextmanager
def _in_this_thread() -> Iterator[None]:
    """Compute answers in this thread, and simulate nothing."""
    with ExitStack() as stack:
        stack.enter_context(patch("gearrattle.workbench.routes.json_answers.run_in_threadpool", _at_once))
        stack.enter_context(patch("gearrattle.workbench.application.run_in_threadpool", _at_once))
        stack.enter_context(patch("gearrattle.workbench.slider_run.simulate", side_effect=NO_MOTION))
        yield


def _workspace(folder: Path) -> None:
    """Fill a workspace with a model, a measured file, and a job that is done."""
    from gearrattle.workbench.jobs.job_record import Job
    from gearrattle.workbench.kept_results import keep
    from gearrattle.workbench.workspace_folder import Folder

    (folder / "m.toml").write_text(SMALL)
    rows = "".join(f"{k / 100}, {k % 7}\n" for k in range(100))
    (folder / "rig.csv").write_text(f"t [s], velocity.wheel [rad/s]\n{rows}")
    (folder / "d.toml").write_text('schema = 1\n[[mode]]\nnumber = 2\nfrequency = "20 Hz"\nrelative_error = 0.01\n')
    for key in ("sound", "other"):
        Job("run", key, id=key, state="done", options={"cycles": 2}).write(Folder(folder).jobs)
        job = Folder(folder).job(key)
        (job / "model.toml").write_text(SMALL)
        keep(small_run(), job)


_PAGES: dict[Path, Any] = {}
"""The application of the last folder: one that lives as long as a target is attacked."""


def _page_beside(path: Path) -> Any:
    """Return the application of the folder of a file, made once."""
    if path.parent not in _PAGES:
        _PAGES.clear()
        _PAGES[path.parent] = page_of(path.parent)
    return _PAGES[path.parent]


def _list(app: Any) -> list[dict[str, Any]]:
    """Return the list of jobs, which must always be sent and hold the sound one."""
    try:
        jobs: list[dict[str, Any]] = asked(app, "GET", _JOBS)
    except GearRattleError as error:
        raise LawError(f"the list of jobs: {error}"[:120]) from error
    if "sound" not in [job.get("id") for job in jobs]:
        raise LawError("the list of jobs lacks a sound one")
    return jobs


def _check(path: Path) -> None:
    asked(_page_beside(path), "POST", "/api/check", path.read_bytes())


def _edit(path: Path) -> None:
    answer = asked(_page_beside(path), "POST", "/api/edit", path.read_bytes())
    if not answer["problems"]:
        tomllib.loads(answer["text"])


def _live(path: Path) -> None:
    try:
        asked(_page_beside(path), "POST", "/api/live", path.read_bytes())
    except ModelError as error:
        if "not simulated" not in str(error):
            raise


@contextmanager
def _submitted(app: Any, body: bytes) -> Iterator[dict[str, Any]]:
    """Submit a job, and remove it in the end; the list of jobs can be sent whatever became of it."""
    try:
        job = asked(app, "POST", _JOBS, body)
    finally:
        _list(app)
    try:
        yield job
    finally:
        asked(app, "POST", f"{_JOBS}/{job['id']}/cancel")
        asked(app, "DELETE", f"{_JOBS}/{job['id']}")


def _submit(path: Path) -> None:
    with _submitted(_page_beside(path), path.read_bytes()):
        pass


def _rename(path: Path) -> None:
    app = _page_beside(path)
    try:
        asked(app, "PATCH", f"{_JOBS}/sound", path.read_bytes())
    finally:
        _list(app)


_OF_RECORD = ("", "/partial", "/motions", "/script.py", "/model.toml", "/script.zip", "/model.zip")
_OF_RESULT = ("/view", "/traces", "/trace", "/impacts")


def _answered(app: Any, those: tuple[str, ...]) -> int:
    """Ask for parts of a job: values, or problems; return how many were refused."""
    refused = 0
    for what in those:
        try:
            asked(app, "GET", f"{_JOBS}/other{what}")
        except ModelError:
            refused += 1
    return refused


def _record(path: Path) -> None:
    """Start a page over a damaged record."""
    app = page_of(path.parents[3])
    state = next((job["state"] for job in _list(app) if job["id"] == "other"), "broken")
    _answered(app, _OF_RECORD)
    with suppress(ModelError):
        asked(app, "PATCH", f"{_JOBS}/other", b'{"name": "another name"}')
    _list(app)
    if state == "broken":
        raise ModelError(Problem("job", "", "a broken record"))


def _result(path: Path, depth: int) -> None:
    app = page_of(path.parents[3 + depth])
    if _answered(app, _OF_RESULT):
        raise ModelError(Problem("job", "", "parts of its result are refused"))


def _carry_out(path: Path) -> None:
    """Submit a job, and do what its process does."""
    app = _page_beside(path)
    with _submitted(app, path.read_bytes()) as job:
        content = {"folder": app.state.jobs.path(job["id"]), **{key: job[key] for key in ("task", "options", "file")}}
        try:
            _Here().ask("job", content)
        except ModelError as error:
            if "not simulated" not in str(error):
                raise


@contextmanager
def _nothing_moves() -> Iterator[None]:
    """Have everything of a task prepared but its motions, in this thread."""
    of_runs = ("simulation.simulate.integrate", "studies.study.simulate", "studies.outputs.simulate")
    of_repeats = (
        "orbits.periodic_search.shooting.shoot",
        "orbits.periodic_search.settled_state",
        "orbits.periodic_search.every_orbit",
    )
    with ExitStack() as stack:
        stack.enter_context(_in_this_thread())
        for name in (*of_runs, *of_repeats, "studies.start_coordinates.prepare"):
            stack.enter_context(patch(f"gearrattle.{name}", side_effect=NO_MOTION))
        yield


def _body(**values: Any) -> bytes:
    return json.dumps(values).encode()


def _bodies(*those: Mapping[str, Any]) -> Callable[[Path], list[bytes]]:
    return lambda _: [_body(**one) for one in those]


def _kept(name: str) -> Callable[[Path], list[bytes]]:
    """Return what gives one file of the folder of a job."""

    def seeds(folder: Path) -> list[bytes]:
        _workspace(folder)
        return [(folder / ".gearrattle" / "jobs" / "other" / name).read_bytes()]

    return seeds


def targets() -> Iterator[Target]:
    """Yield the targets of this module."""
    if find_spec("starlette") is None or find_spec("uvicorn") is None:
        return
    page = partial(Target, kind="JSON", around=_workspace, while_open=_in_this_thread)
    started = [{"task": task, "text": SMALL, "name": task, "options": options} for task, options in TASKS.items()]
    live: dict[str, Any] = {"text": SMALL, "values": {_PATH: "700 N*m/rad", "torque.0.mean": 0.5}, "sequence": 3}
    yield page("workbench, check", "b.json", _bodies({"text": SMALL, "file": "m.toml"}, {"text": SMALL}), _check)
    yield page("workbench, edit", "b.json", _bodies(*({"text": SMALL, "edits": edits} for edits in EDITS)), _edit)
    yield page("workbench, job", "b.json", _bodies(*started, {**started[0], "parent": "sound"}), _submit)
    yield page("workbench, name of a job", "b.json", _bodies({"name": "another"}), _rename)
    yield page("workbench, live", "b.json", _bodies(live, {"text": SMALL, "file": "m.toml"}), _live)
    yield page(
        "workbench, options",
        "b.json",
        _bodies(*(body for body in started if body["task"] != "screen")),
        _carry_out,
        while_open=_nothing_moves,
    )
    folder = ".gearrattle/jobs/other"
    yield page("workbench, record of a job", f"{folder}/job.json", _kept("job.json"), _record)
    for name in ("view.json", "traces/impacts.npz"):
        run = partial(_result, depth=name.count("/"))
        kind: Kind = "JSON" if name.endswith("json") else "bytes"
        yield page(f"workbench, result of a job, {name}", f"{folder}/{name}", _kept(name), run, kind=kind)
