"""The application in this process: the same checks and jobs without a socket."""

from __future__ import annotations

import ast
import asyncio
import inspect
import re
import socket
import threading
import time
from collections.abc import Callable, Iterator
from multiprocessing import Pipe
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import quote

import pytest

import gearrattle as gr
from gearrattle.errors import ModelError
from gearrattle.workbench.workspace_folder import Folder

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")

import httpx
import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import State
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from gearrattle.workbench.access import LARGEST, Access, Pace
from gearrattle.workbench.application import Limits, Server, all_routes, application
from gearrattle.workbench.jobs import worker
from gearrattle.workbench.jobs.job_record import ENDED, Job, read_jobs
from gearrattle.workbench.jobs.task_options import check_options
from gearrattle.workbench.jobs.tasks import TASKS, carry_out
from gearrattle.workbench.slider_run import CYCLES, live_view
from tests.workbench.server import MODEL

pytestmark = pytest.mark.compiled
BASE = "http://127.0.0.1:8765"
TOKEN = "the-token-of-the-start-address"


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("workspace")
    Job("run", "under way", id="under-way", state="running").write(Folder(folder).jobs)
    (Folder(folder).jobs / "damaged").mkdir()
    (Folder(folder).jobs / "damaged" / "job.json").write_text("{", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def client(root: Path) -> Iterator[TestClient]:
    app = Access(application(Folder(root), Limits(1, 8e9)), "127.0.0.1", TOKEN, "a long password")
    with TestClient(app, base_url=BASE, follow_redirects=False) as client:
        assert client.get(f"/?token={TOKEN}").status_code == 303
        yield client


def stranger(client: TestClient) -> TestClient:
    return TestClient(client.app, base_url=BASE, follow_redirects=False)


def ended(client: TestClient, job: str) -> dict[str, Any]:
    end = time.monotonic() + 600.0
    while (record := client.get(f"/api/jobs/{job}").json())["state"] not in ENDED:
        assert time.monotonic() < end
        time.sleep(0.02)
    return dict(record)


def request_of(path: str) -> str:
    """Return a path with something in the place of every parameter."""
    return re.sub(r"\{\w+(:path)?\}", "x", path)


@pytest.mark.parametrize("route", [route for route in all_routes() if isinstance(route, Route)], ids=str)
@pytest.mark.parametrize(
    "headers", [{}, {"cookie": "gearrattle-8765=x"}, {"authorization": "Bearer x"}], ids=["none", "cookie", "bearer"]
)
def test_no_route_answers_without_the_token(
    client: TestClient, monkeypatch: pytest.MonkeyPatch, route: Route, headers: dict[str, str]
) -> None:
    monkeypatch.setattr(Pace, "allows", lambda _: True)
    assert route.methods
    for method in ("GET", "HEAD", "OPTIONS", "POST", "PUT", "PATCH", "DELETE"):
        answer = stranger(client).request(method, request_of(route.path), headers=headers)
        assert answer.status_code == 401, method
    for method in route.methods:
        known = client.request(method, request_of(route.path))
        assert known.status_code not in (401, 405), method


def test_strangers_get_no_answer_and_the_password_opens(client: TestClient) -> None:
    other = stranger(client)
    assert other.get("/api/jobs").status_code == 401
    assert "start address" in other.get("/").text
    assert other.post("/api/session", data={"password": "wrong"}).status_code == 401
    assert other.post("/api/session", data={"password": "a long password"}).status_code == 303
    assert other.get("/api/jobs").status_code == 200
    bearer = {"authorization": f"Bearer {TOKEN}"}
    assert stranger(client).get("/api/jobs", headers=bearer).status_code == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "http://example.com"},
        {"host": "example.com:8765"},
        {"host": "127.0.0.1"},
        {"sec-fetch-site": "cross-site"},
    ],
)
def test_requests_from_elsewhere_are_refused(client: TestClient, headers: dict[str, str]) -> None:
    assert client.get("/api/jobs", headers=headers).status_code == 403


def test_on_a_network_addresses_are_hosts_and_names_are_not(root: Path) -> None:
    app = Access(lambda *_: None, "0.0.0.0", TOKEN)  # type: ignore[arg-type,return-value]
    scope = {"server": ("10.0.0.7", 8765)}
    assert [app._is_here(scope, host) for host in ("10.0.0.7:8765", "localhost:8765", "[::1]:8765")] == [True] * 3
    assert [app._is_here(scope, host) for host in ("example.com:8765", "10.0.0.7", "")] == [False] * 3


def test_large_bodies_and_fast_strangers_are_refused(client: TestClient) -> None:
    assert client.put("/api/files/a.csv", content=b"0" * (LARGEST + 1)).status_code == 413
    parts = (b"0" * 1_000_000 for _ in range(21))
    assert client.put("/api/files/a.csv", content=parts).status_code == 413
    assert client.get("/api/files").json() == []
    pace = Pace(3, 0.0)
    assert [pace.allows() for _ in range(5)] == [True, True, True, False, False]


def test_sockets_need_an_origin_and_the_token(client: TestClient) -> None:
    for headers in ({}, {"origin": "http://example.com"}):
        with pytest.raises(WebSocketDisconnect), client.websocket_connect("/api/events", headers=headers):
            pass
    with client.websocket_connect(
        f"{BASE.replace('http', 'ws')}/api/events", headers={"origin": BASE, "host": "127.0.0.1:8765"}
    ) as wire:
        job = client.post("/api/jobs", json={"task": "modes", "text": MODEL}).json()
        states = []
        while not states or states[-1] not in ENDED:
            message = wire.receive_json()
            if message["job"]["id"] == job["id"]:
                states.append(message["job"]["state"])
    assert states[-1] == "done"


def test_jobs_of_an_ended_server_are_broken_and_damaged_records_are_left_alone(client: TestClient, root: Path) -> None:
    jobs = client.get("/api/jobs").json()
    kept = read_jobs(Folder(root).jobs)
    assert {job.name: job.state for job in kept}["under way"] == "broken"
    assert {job["id"] for job in jobs} == {job.id for job in kept}


def test_a_job_from_its_start_to_its_removal(client: TestClient, root: Path) -> None:
    first = ended(client, client.post("/api/jobs", json={"task": "run", "text": MODEL, "name": "a"}).json()["id"])
    assert first["state"] == "done"
    assert client.get(f"/api/jobs/{first['id']}/view").status_code == 200
    assert client.patch(f"/api/jobs/{first['id']}", json={"name": "b"}).json()["name"] == "b"
    wrong = ended(
        client,
        client.post("/api/jobs", json={"task": "run", "text": MODEL, "options": {"algorithm": "none"}}).json()["id"],
    )
    assert wrong["state"] == "failed"
    assert "algorithm" in wrong["problems"][0]["place"]
    long = {"cycles": 400_000, "samples_per_cycle": 2, "discard": 0}
    running, waiting = (
        client.post("/api/jobs", json={"task": "run", "text": MODEL, "options": long}).json() for _ in range(2)
    )
    assert client.delete(f"/api/jobs/{waiting['id']}").status_code == 400
    for job in (waiting, running):
        client.post(f"/api/jobs/{job['id']}/cancel")
    assert [ended(client, job["id"])["state"] for job in (running, waiting)] == ["cancelled"] * 2
    assert client.delete(f"/api/jobs/{first['id']}").status_code == 200
    assert not (Folder(root).jobs / first["id"]).exists()
    assert client.get(f"/api/jobs/{first['id']}").status_code == 404


def test_wrong_requests_are_problems(client: TestClient) -> None:
    for body in (
        b"[",
        b"[]",
        b'{"task": "run", "text": 1}',
        b'{"task": "run", "text": "x", "options": []}',
        b'{"task": "fly", "text": "x"}',
    ):
        answer = client.post("/api/jobs", content=body)
        assert answer.status_code == 400
        assert answer.json()["problems"][0]["rule"]
    assert client.get("/api/nothing").status_code == 404
    assert client.delete("/api/jobs").status_code == 405


def test_files_are_written_whole_and_never_over_what_is_newer(client: TestClient, root: Path) -> None:
    assert client.put("/api/files/models/idle.toml", content=MODEL).status_code == 200
    answer = client.get("/api/files/models/idle.toml")
    assert answer.text == MODEL
    tag = answer.headers["etag"]
    assert client.put("/api/files/models/idle.toml", content="schema = 1", headers={"if-match": tag}).status_code == 200
    assert client.put("/api/files/models/idle.toml", content=MODEL, headers={"if-match": tag}).status_code == 412
    assert client.put("/api/files/models/idle.toml", content=MODEL, headers={"if-none-match": "*"}).status_code == 412
    assert client.get("/api/files/models/idle.toml").text == "schema = 1"
    assert client.put("/api/files/gone.toml", content=MODEL, headers={"if-match": tag}).status_code == 412
    first = client.put("/api/files/new.toml", content=MODEL, headers={"if-none-match": "*"})
    assert first.headers["etag"] == tag
    (root / "new.toml").unlink()
    assert client.put("/api/files/models", content=MODEL).status_code == 400
    assert client.put("/api/files/..%2Fx.toml", content=MODEL).status_code == 400
    assert client.get("/api/files/none.toml").status_code == 404
    assert [entry["path"] for entry in client.get("/api/files").json()] == ["models/idle.toml"]
    job = client.post("/api/jobs", json={"task": "modes", "file": "models/idle.toml"})
    assert job.status_code == 400
    with pytest.raises(ModelError, match="must name a file within"):
        Folder(root).path("a/../../b")


def fitting(data: Any) -> dict[str, Any]:
    """A request for a fit."""
    return {"json": {"task": "fit", "text": MODEL, "options": {"data": data, "free": []}}}


OUTSIDE = ["../x.toml", "a/../../x.toml", "/etc/x.toml", "up/x.toml", ".gearrattle/x.toml", "..\\x.toml", "\0.toml"]
NAMED: list[tuple[str, str, Callable[[str], dict[str, Any]]]] = [
    ("POST", "/api/check", lambda name: {"json": {"text": MODEL, "file": name}}),
    ("POST", "/api/edit", lambda name: {"json": {"text": MODEL, "edits": [], "file": name}}),
    ("POST", "/api/live", lambda name: {"json": {"text": MODEL, "values": {}, "file": name}}),
    ("POST", "/api/jobs", lambda name: {"json": {"task": "run", "file": name}}),
    ("POST", "/api/jobs", lambda name: {"json": {"task": "run", "text": MODEL, "file": name}}),
    (
        "POST",
        "/api/jobs",
        lambda name: {"json": {"task": "validate", "text": MODEL, "options": {"measurement": name}}},
    ),
    ("POST", "/api/jobs", fitting),
    ("POST", "/api/jobs", lambda name: fitting({"recording": {"file": name}})),
    ("POST", "/api/jobs", lambda name: fitting({"response": [{"file": name}]})),
    ("GET", "/api/files/{name}", lambda _: {}),
    ("PUT", "/api/files/{name}", lambda _: {"content": MODEL}),
    ("GET", "/api/measured", lambda name: {"params": {"file": name}}),
    ("GET", "/api/measured/trace", lambda name: {"params": {"file": name, "channel": "x"}}),
    ("GET", "/api/measured/spectrum", lambda name: {"params": {"file": name, "channel": "x"}}),
    ("GET", "/api/measured/shift", lambda name: {"params": {"file": name, "job": "under-way"}}),
]
"""Every request that names a file."""


@pytest.mark.parametrize(("method", "path", "content"), NAMED)
def test_no_name_leads_out_of_the_folder(
    client: TestClient, root: Path, method: str, path: str, content: Callable[[str], dict[str, Any]]
) -> None:
    (root.parent / "x.toml").write_text("secret", encoding="utf-8")
    if not (root / "up").exists():
        (root / "up").symlink_to(root.parent)
    for name in OUTSIDE:
        answer = client.request(method, path.format(name=quote(name, safe="")), **content(name))
        assert answer.status_code == 400, name
        (problem,) = answer.json()["problems"]
        assert problem["rule"].startswith("must name a file within the folder"), name
    assert (root.parent / "x.toml").read_text(encoding="utf-8") == "secret"


def test_what_a_program_could_import_is_not_written(client: TestClient, root: Path) -> None:
    for name in ("signal.py", "a/sitecustomize.PY", "x.pth", "x.so", "report.html", "toml"):
        answer = client.put(f"/api/files/{name}", content=b"")
        assert (answer.status_code, answer.json()["problems"][0]["rule"][:15]) == (400, "must end in one")
        assert not (root / name).exists()


def test_every_example_opens(client: TestClient) -> None:
    for example in client.get("/api/examples").json():
        text = client.get(f"/api/examples/{example['name']}").json()["text"]
        assert gr.loads(text).name == example["title"]


def test_answers_make_no_syntax_trees(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    def parse(*_: object, **__: object) -> None:
        raise SystemError("Python 3.11 cannot do this in two threads")

    monkeypatch.setattr(ast, "parse", parse)
    assert client.get("/api/schema").json()["title"] == "gearrattle model file"
    assert client.get("/api/components").status_code == 200


def test_a_look_at_a_model_is_no_longer_than_its_record() -> None:
    model = gr.example("measured_flywheel")
    look, run = live_view(model, {})["verdict"], gr.run(model)
    assert model.simulation.cycles < CYCLES
    assert look["verdict"] == run.verdict.verdict
    assert look["sentence"].partition(":")[0] == run.verdict.sentence.partition(":")[0]  # the cycles judged


def test_a_look_at_an_event_sees_its_impacts() -> None:
    view = live_view(gr.example("tip_in"), {})
    assert view["verdict"]["headline"] == "Impacts on both sides"
    assert view["verdict"]["sentence"] == gr.run(gr.example("tip_in")).verdict.sentence


def test_what_follows_a_slider(client: TestClient) -> None:
    answer = client.post(
        "/api/live", json={"text": MODEL, "values": {"coupling.gap.clearance": "1 deg"}, "sequence": 7}
    )
    assert answer.status_code == 200
    assert answer.json()["sequence"] == 7
    assert (
        client.post("/api/live", json={"text": MODEL, "values": {"coupling.gap.clearance": "1 kg"}}).status_code == 400
    )


@pytest.mark.filterwarnings("error::pytest.PytestUnhandledThreadExceptionWarning")
def test_an_answer_that_the_end_of_the_server_cancels_is_not_logged_as_a_fault(
    capfd: pytest.CaptureFixture[str],
) -> None:
    begun, ending = threading.Event(), threading.Event()

    async def slow(request: Request) -> Response:
        begun.set()
        await run_in_threadpool(ending.wait, 60.0)
        return Response()

    async def wrong(request: Request) -> Response:
        raise ZeroDivisionError(request.url.path)

    app = Starlette(routes=[Route("/slow", slow), Route("/wrong", wrong)])
    with socket.create_server(("127.0.0.1", 0)) as listening:
        address = f"http://127.0.0.1:{listening.getsockname()[1]}"
        config = uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=0, lifespan="off")
        state = {"begun": asyncio.sleep(0), "newest": SimpleNamespace(close=ending.is_set)}
        server = Server(config, State({**state, "asked": asyncio.Event(), "ending": threading.Event()}))
        serving = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        serving.start()
        statuses: list[int] = []
        asking = threading.Thread(
            target=lambda: statuses.append(httpx.get(f"{address}/slow", timeout=60.0).status_code)
        )
        asking.start()
        assert begun.wait(60)
        assert httpx.get(f"{address}/wrong", timeout=60.0).status_code == 500
        server.should_exit = True
        asking.join(60)
        ending.set()
        serving.join(60)
    assert statuses == [500]
    errors = capfd.readouterr().err
    assert "ZeroDivisionError: /wrong" in errors
    assert "Cancel" not in errors


def test_tasks_call_public_functions_with_the_options_they_have(tmp_path: Path) -> None:
    assert all(callable(task.callable()) for task in TASKS.values())
    shares: list[float] = []
    model = gr.loads(MODEL)
    axes = {"coupling.gap.clearance": [0.01, 0.02]}
    study = carry_out("study", model, {"axes": axes}, (tmp_path, tmp_path / "partial"), shares.append)
    assert gr.open_study(tmp_path / "partial").sizes == study.sizes
    assert study.sizes["coupling.gap.clearance"] == 2
    assert shares[-1] == 1.0


def test_a_worker_answers_what_it_is_asked(tmp_path: Path) -> None:
    here, there = Pipe()
    folder = tmp_path / "job"
    folder.mkdir()
    (folder / "inputs").mkdir()
    (folder / "inputs" / "model.toml").write_text(MODEL, encoding="utf-8")
    content = {"folder": folder, "file": "", "task": "run", "options": {}}
    kind, sentence = worker._answer(there, "job", content)
    assert (kind, sentence) == ("done", gr.run(gr.loads(MODEL)).sentence)
    assert here.poll()
    assert here.recv()[0] == "progress"
    assert worker._answer(there, "job", content | {"options": {"cycles": -1}})[0] == "failed"
    assert worker._answer(there, "job", content | {"folder": tmp_path / "none"})[0] == "failed"
    assert worker._answer(there, "job", {})[1][0].place == "internal error"
    question = {"text": MODEL, "values": {}, "folder": Folder(tmp_path), "file": "", "roots": ()}
    kind, view = worker._answer(there, "live", question)
    assert kind == "done"
    assert view["verdict"]


@pytest.mark.parametrize("task", TASKS)
def test_an_option_is_of_a_kind_that_its_function_takes(task: str) -> None:
    """What no argument can be, an object of lists of objects, is refused; what is missing or unknown is named."""
    signature = inspect.signature(TASKS[task].callable())
    names = TASKS[task].options()
    required = {name for name in names if signature.parameters[name].default is inspect.Parameter.empty}
    with pytest.raises(gr.ModelError) as caught:
        check_options(task, {**{name: [[[{}]]] for name in names}, "fly": 1})
    assert {problem.place for problem in caught.value.problems} == {f"options.{name}" for name in [*names, "fly"]}
    if required:
        with pytest.raises(gr.ModelError, match="is missing"):
            check_options(task, {})
    else:
        check_options(task, {})


@pytest.mark.parametrize(
    ("task", "options"),
    [
        ("simulate", {"cycles": 20, "step": "1 us", "initial": {"angle": [0.0, 1]}, "tolerance": None, "audit": True}),
        ("study", {"axes": {"mesh.gear.backlash": ["0.1 mm", 2e-4]}, "outputs": ["hub: TR rms"], "most": 10}),
        ("conditions", {"temperature": [20, 80], "speed": {"path": "excitation.speed", "values": ["750 rpm"]}}),
        ("continuation", {"path": "excitation.speed", "range": [100, "1500 rpm"], "isolated": True}),
        ("bifurcation", {"path": "excitation.speed", "values": {"low": 1, "high": 2, "points": 3}}),
        ("compare", {"algorithms": ["rk4", "exact"]}),
        ("compare", {"algorithms": {"rk4": {"step": 1e-5}}}),
        ("screen", {"speeds": [100, "2000 rpm"], "loads": None, "check": 3}),
        ("validate", {"measurement": {"file": "a.csv"}, "band": [0, None], "clock": "clutch"}),
        ("fit", {"data": {"mode": [{"omega": 300.0}]}, "free": ["a.b"], "bounds": {"a.b": [1, "2 mm"]}}),
        ("threshold", {"path": "mesh.*.backlash", "range": [{"factor": 0.5}, {"factor": 2}], "until": "quiet"}),
        ("remedies", {"candidates": {"mesh.*.backlash": {"factor": [0.5, 2]}}, "pairs": False, "target": "half"}),
        ("reduce", {"up_to": "75 Hz", "check": "simulate"}),
    ],
)
def test_options_that_a_function_takes_pass(task: str, options: dict[str, Any]) -> None:
    check_options(task, options)


def test_a_server_that_ends_at_once_has_begun_nothing(tmp_path: Path) -> None:
    async def live_for_a_moment() -> Any:
        app = application(Folder(tmp_path), Limits(1, 8e9))
        async with app.router.lifespan_context(app):
            pass
        return app.state

    state = asyncio.run(live_for_a_moment())
    assert state.ending.is_set()
    assert not hasattr(state, "jobs")
    assert not hasattr(state, "importing")
