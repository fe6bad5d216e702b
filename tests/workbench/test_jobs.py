"""Jobs: computed in processes of their own, cancelled, crashed, and kept when the server is killed."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

import gearrattle as gr
from gearrattle import processes

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")

from websockets.sync.client import connect

from gearrattle.cli import main
from gearrattle.workbench.jobs.worker import EndedError, Reserve, WarmProcess, _ended
from gearrattle.workbench.workspace_folder import Folder
from tests.workbench.server import MODEL, Server, serving

pytestmark = pytest.mark.compiled
LONG = {"cycles": 400_000, "samples_per_cycle": 2, "discard": 0}


@pytest.fixture
def server(empty_server: Server) -> Server:
    return empty_server


def children(process: int) -> list[int]:
    tasks = Path(f"/proc/{process}/task").iterdir()
    return [int(word) for task in tasks for word in (task / "children").read_text(encoding="ascii").split()]


def command(process: int) -> bytes:
    return Path(f"/proc/{process}/cmdline").read_bytes()


def template_of(process: int) -> int:
    """The process that those which compute are forked from."""
    (template,) = [child for child in children(process) if b"forkserver" in command(child)]
    return template


def test_a_run_gives_the_numbers_of_the_call(server: Server) -> None:
    job = server.ended(server.job(name="first")["id"])
    assert job["state"] == "done"
    assert job["name"] == "first"
    assert job["sentence"] == gr.run(gr.loads(MODEL)).sentence
    assert server.client.get(f"/api/jobs/{job['id']}/view").status_code == 200
    assert server.client.get(f"/api/jobs/{job['id']}/model.toml").text == MODEL


def test_what_is_wrong_is_said_before_anything_runs(server: Server) -> None:
    known = len(server.client.get("/api/jobs").json())
    for request, expected_place, remedy in (
        ({"text": MODEL.replace("stiffness", "stifness")}, "model.toml:4", "did you mean"),
        ({"options": {"cyles": 3}}, "options.cyles", "did you mean"),
        ({"task": "fly"}, "task", ""),
        ({"text": 3}, "text", ""),
        ({"task": "validate", "options": {"measurement": "../rig.csv"}}, "file", "hidden"),
    ):
        answer = server.client.post("/api/jobs", json={"task": "run", "text": MODEL, **request})
        assert answer.status_code == 400
        problem = answer.json()["problems"][0]
        assert expected_place in problem["place"]
        assert remedy in problem["remedy"]
    assert server.client.post("/api/jobs", content=b"[").status_code == 400
    assert len(server.client.get("/api/jobs").json()) == known


def test_what_fails_says_why(server: Server) -> None:
    job = server.ended(server.job(options={"algorithm": "none"})["id"])
    assert job["state"] == "failed"
    assert job["problems"][0]["rule"]


def test_a_socket_tells_of_every_change(server: Server) -> None:
    cookie = f"gearrattle-{server.port}={server.token}"
    headers = {"Cookie": cookie}
    with connect(f"ws://127.0.0.1:{server.port}/api/events", origin=server.address, additional_headers=headers) as wire:  # type: ignore[arg-type]
        job = server.job()
        states: list[str] = []
        while not states or states[-1] != "done":
            message: dict[str, Any] = json.loads(wire.recv(60.0))
            if message.get("job", {}).get("id") == job["id"]:
                states.append(message["job"]["state"])
        assert states[0] == "waiting"
        assert "running" in states
        server.client.delete(f"/api/jobs/{job['id']}")
        assert json.loads(wire.recv(60.0)) == {"deleted": job["id"]}


def test_cancelled_jobs_end_and_the_next_one_runs(server: Server) -> None:
    first, second = server.job(options=LONG), server.job(options=LONG)
    server.until(first["id"], "running")
    assert server.state(second["id"])["state"] == "waiting"
    assert server.client.delete(f"/api/jobs/{first['id']}").status_code == 400
    for job in (second, first):
        server.client.post(f"/api/jobs/{job['id']}/cancel")
    assert [server.ended(job["id"])["state"] for job in (first, second)] == ["cancelled", "cancelled"]
    assert server.ended(server.job()["id"])["state"] == "done"


def test_a_crash_of_a_job_is_its_own(server: Server) -> None:
    job = server.job(options=LONG)
    while not server.state(job["id"])["progress"]["fraction"]:  # not before its process computes
        time.sleep(0.02)
    for child in children(template_of(server.process.pid)):
        os.kill(child, signal.SIGKILL)
    assert server.ended(job["id"])["state"] == "failed"
    assert "signal 9" in server.state(job["id"])["problems"][0]["rule"]
    assert server.ended(server.job()["id"])["state"] == "done"


@pytest.mark.long
def test_what_processes_are_forked_from_is_made_anew(server: Server) -> None:
    job = server.job(options=LONG)
    server.until(job["id"], "running")
    template = template_of(server.process.pid)
    computing = children(template)
    os.kill(template, signal.SIGKILL)
    assert server.ended(job["id"])["state"] == "failed"
    assert server.ended(server.job()["id"])["state"] == "done"
    assert template_of(server.process.pid) != template
    _wait_for_the_end_of(computing)


def _wait_for_the_end_of(processes: list[int]) -> None:
    end = time.monotonic() + 60.0
    while any(Path(f"/proc/{process}").exists() for process in processes):
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.long
def test_another_process_is_warm_when_one_is_lost(tmp_path: Path) -> None:
    reserve = Reserve()
    process = WarmProcess(8e9, reserve)
    question = {"text": MODEL, "values": {}, "folder": Folder(tmp_path), "file": "", "roots": ()}
    process.start()
    first = process.ask("live", question)
    lost = process.start().result()[0].pid
    assert reserve._process is not None
    spare = reserve._process.result()[0].pid
    process.end()
    process.start()
    assert process.ask("live", question) == first
    assert process.start().result()[0].pid == spare != lost
    reserve.close()
    process.end()
    reserve.fill()
    assert reserve._process is None or _ended(reserve._process)


@pytest.mark.long
def test_where_nothing_is_forked_processes_are_spawned(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    question = {"text": MODEL, "values": {}, "folder": Folder(tmp_path), "file": "", "roots": ()}
    answers = []
    for platform in (sys.platform, "darwin"):
        monkeypatch.setattr(processes.sys, "platform", platform)
        process = WarmProcess(8e9, reserve := Reserve())
        process.start()
        answers.append(process.ask("live", question))
        is_forked = children(os.getpid()).count(process.start().result()[0].pid or 0) == 0
        assert is_forked == (platform == "linux")
        process.end()
        reserve.close()
    assert answers[0] == answers[1]


def test_a_process_that_is_ended_before_it_is_warm_fails_at_once(tmp_path: Path) -> None:
    process = WarmProcess(8e9, Reserve())
    question = {"text": MODEL, "values": {}, "folder": Folder(tmp_path), "file": "", "roots": ()}
    started = process._started = Future()  # of a process that never comes
    threading.Timer(0.1, process.end).start()
    with pytest.raises(EndedError, match="before it was warm"):
        process.ask("live", question)
    assert started.cancelled()


def test_names_parents_and_removal(server: Server) -> None:
    first = server.ended(server.job()["id"])
    child = server.ended(server.job(parent=first["id"])["id"])
    assert child["parent"] == first["id"]
    assert server.client.patch(f"/api/jobs/{child['id']}", json={"name": " narrow gap "}).json()["name"] == "narrow gap"
    assert server.client.delete(f"/api/jobs/{child['id']}").status_code == 200
    assert server.client.get(f"/api/jobs/{child['id']}").status_code == 404


def test_of_answers_that_follow_a_slider_the_newest_wins(server: Server) -> None:
    statuses: dict[int, int] = {}

    def ask(number: int) -> None:
        values = {"coupling.gap.clearance": f"{0.5 + 0.01 * number} deg"}
        with server.client.__class__(base_url=server.address, cookies=server.client.cookies, timeout=600.0) as client:
            answer = client.post("/api/live", json={"text": MODEL, "values": values, "sequence": number})
        statuses[number] = answer.status_code
        if answer.status_code == 200:
            assert answer.json()["sequence"] == number

    threads = []
    for number in range(20):
        threads.append(threading.Thread(target=ask, args=(number,)))
        threads[-1].start()
    for thread in threads:
        thread.join()
    assert set(statuses.values()) <= {200, 409}
    assert 200 in statuses.values()
    wrong = server.client.post("/api/live", json={"text": MODEL, "values": {"coupling.gap.clearance": "1 kg"}})
    assert wrong.status_code == 400


@pytest.mark.long
def test_a_killed_server_loses_no_run_that_has_ended(tmp_path: Path) -> None:
    with serving(tmp_path) as server:
        done = server.ended(server.job(name="kept")["id"])
        view = server.client.get(f"/api/jobs/{done['id']}/view").json()
        running = server.job(options=LONG)
        waiting = server.job()
        server.until(running["id"], "running")
        template = template_of(server.process.pid)
        computing = [template, *children(template)]
        server.process.kill()
        server.process.wait(10)
        _wait_for_the_end_of(computing)
    with serving(tmp_path) as server:
        assert server.state(done["id"]) == done
        assert server.client.get(f"/api/jobs/{done['id']}/view").json() == view
        assert [server.state(job["id"])["state"] for job in (running, waiting)] == ["broken", "broken"]
        assert server.state(running["id"])["problems"][0]["remedy"] == "start it again"


@pytest.mark.long
def test_a_job_that_takes_too_much_memory_ends_and_the_server_does_not(tmp_path: Path) -> None:
    with serving(tmp_path, "--memory", "0.05") as server:
        job = server.ended(server.job()["id"])
        assert job["state"] == "failed"
        assert "memory" in job["problems"][0]["rule"]
        assert server.client.get("/api/jobs").status_code == 200


@pytest.mark.long
def test_a_server_ends_without_a_fault_whatever_is_under_way(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    statuses: list[int] = []
    with serving(tmp_path) as server:
        headers = {"Cookie": f"gearrattle-{server.port}={server.token}"}
        client = server.client.__class__(base_url=server.address, cookies=server.client.cookies, timeout=600.0)
        body = {"text": MODEL, "values": {}}
        asking = threading.Thread(target=lambda: statuses.append(client.post("/api/live", json=body).status_code))
        with connect(
            server.address.replace("http", "ws") + "/api/events", origin=server.address, additional_headers=headers
        ):  # type: ignore[arg-type]
            asking.start()
            server.job(options=LONG)
            server.process.send_signal(signal.SIGINT)
            assert server.process.wait(60) == 130
        asking.join()
        client.close()
    assert statuses[0] in (200, 500)
    assert capfd.readouterr().err.splitlines() == ["interrupted: nothing was written"]


def test_a_folder_has_one_server_at_a_time(server: Server, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", os.readlink(f"/proc/{server.process.pid}/cwd")]) == 2
    assert "another program writes into it" in capsys.readouterr().err


def test_what_cannot_be_served_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", str(tmp_path / "none")]) == 2
    assert "must be a folder" in capsys.readouterr().err
    assert main(["serve", str(tmp_path), "--host", "0.0.0.0"]) == 2
    assert "GEARRATTLE_PASSWORD" in capsys.readouterr().err
    assert main(["serve", str(tmp_path), "--port", "99999"]) == 2
    assert "--port" in capsys.readouterr().err


@pytest.mark.long
def test_a_password_opens_a_server_that_others_reach(tmp_path: Path) -> None:
    with serving(tmp_path, "--host", "0.0.0.0", GEARRATTLE_PASSWORD="a long password") as server:
        address = f"http://127.0.0.1:{server.port}"
        with server.client.__class__(base_url=address) as client:
            assert "password" in client.get("/").text
            assert client.post("/api/session", data={"password": "wrong"}).status_code == 401
            assert client.get("/api/jobs").status_code == 401
            assert client.post("/api/session", data={"password": "a long password"}).status_code == 303
            assert client.get("/api/jobs").status_code == 200
