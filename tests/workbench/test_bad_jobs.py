"""One bad job, a workspace that somebody else has made, a disk that is full: none of them spoils another job."""

from __future__ import annotations

import contextlib
import errno
import io
import json
import os
import resource
import shutil
import subprocess
import tempfile
import threading
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from gearrattle.cli import main
from gearrattle.errors import ModelError
from gearrattle.workbench.jobs.job_record import NAME, Job, read_job, read_jobs
from gearrattle.workbench.jobs.queue import Jobs
from gearrattle.workbench.jobs.task_options import check_options
from gearrattle.workbench.jobs.worker import Reserve
from gearrattle.workbench.workspace_folder import Folder
from gearrattle.writing import PREFIX
from tests.workbench.jobs import client
from tests.workbench.server import MODEL, Server, serving

pytest.importorskip("starlette")

from starlette.applications import Starlette
from starlette.routing import Route
from starlette.testclient import TestClient

from gearrattle.workbench.routes import result_routes
from gearrattle.workbench.routes.json_answers import JsonAnswer, answering, json_object
from gearrattle.workbench.routes.result_routes import _PATHS

pytestmark = pytest.mark.compiled
LINUX = pytest.mark.skipif(not hasattr(resource, "prlimit"), reason="the limits of another process are set on Linux")

RECORDS = {
    "NaN among options": b'{"task": "run", "options": {"cycles": NaN}}',
    "infinite among options": b'{"task": "run", "options": {"cycles": 1e999}}',
    "half a surrogate pair": b'{"task": "run", "name": "\\ud800"}',
    "number for a time": b'{"task": "run", "created": 5}',
    "text for a time": b'{"task": "run", "created": "yesterday"}',
    "time without a zone": b'{"task": "run", "created": "2026-01-01T00:00:00"}',
    "list for a time": b'{"task": "run", "started": []}',
    "text for options": b'{"task": "run", "options": "cycles"}',
    "unknown task": b'{"task": "fly"}',
    "no task": b'{"name": "nothing"}',
    "unknown state": b'{"task": "run", "state": "flying"}',
    "list for a state": b'{"task": "run", "state": []}',
    "number for a name": b'{"task": "run", "name": 3}',
    "object for a parent": b'{"task": "run", "parent": {}}',
    "progress beyond one": b'{"task": "run", "progress": {"fraction": 7, "text": ""}}',
    "problems that are none": b'{"task": "run", "problems": [3]}',
    "no JSON": b"{",
    "no text": b"\xff\xfe",
    "empty": b"",
    "a list": b"[]",
    "nested deeply": b'{"task": "run", "options": {"a": ' + b"[" * 5000 + b"]" * 5000 + b"}}",
}


def listed(root: Path) -> dict[str, dict[str, Any]]:
    """The list of jobs as a new server sends it, by id."""
    jobs = Jobs(Folder(root), 0, 1e9, Reserve())
    answer = JsonAnswer([job.to_dict() for job in jobs.all()])
    jobs.close()
    return {job["id"]: job for job in json.loads(answer.body)}


def planted(root: Path, name: str) -> Path:
    folder = Folder(root).jobs / name
    folder.mkdir(parents=True)
    return folder


def test_a_record_that_cannot_be_read_is_one_broken_row_with_its_reason(tmp_path: Path) -> None:
    Job("run", "sound", id="sound", state="done").write(Folder(tmp_path).jobs)
    for number, record in enumerate(RECORDS.values()):
        (planted(tmp_path, f"bad{number}") / NAME).write_bytes(record)
    planted(tmp_path, "no-record")
    jobs = listed(tmp_path)
    assert jobs.pop("sound")["state"] == "done"
    assert set(jobs) == {f"bad{number}" for number in range(len(RECORDS))}
    for job in jobs.values():
        assert job["state"] == "broken"
        assert job["problems"][0]["rule"]
        assert job["problems"][0]["remedy"]
    for number, record in enumerate(RECORDS.values()):  # the evidence stays until the run is deleted
        assert (Folder(tmp_path).jobs / f"bad{number}" / NAME).read_bytes() == record


def test_what_is_kept_of_a_job_is_what_it_says(tmp_path: Path) -> None:
    job = Job("study", "µ", "parent", {"axes": {"mesh.gear.backlash": [1e-4, "0.2 mm"]}}, sentence="half \\ud800")
    job.write(tmp_path)
    assert read_job(tmp_path / job.id) == job
    assert read_jobs(tmp_path) == [job]


@pytest.mark.parametrize("record", RECORDS.values(), ids=RECORDS)
def test_nothing_of_a_bad_record_is_an_internal_error(tmp_path: Path, record: bytes) -> None:
    folder = planted(tmp_path, "bad")
    (folder / NAME).write_bytes(record)
    (folder / "model.toml").write_text(MODEL, encoding="utf-8")
    before = set(Path(tempfile.gettempdir()).glob("*.zip"))
    page = client(tmp_path)
    for path in ("script.py", "script.zip", "archive.zip", "model.zip"):
        assert 400 <= page.get(f"/api/jobs/bad/{path}").status_code < 500
    assert set(Path(tempfile.gettempdir()).glob("*.zip")) == before


@pytest.fixture(scope="module")
def damaged(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with jobs whose files are replaced one by one."""
    root = tmp_path_factory.mktemp("damaged")
    for job in ("first", "second", "continuation", "holes"):
        shutil.copytree(Folder(finished).jobs / job, Folder(root).jobs / job)
    return root


CONTENTS = [
    b"",
    b"\0" * 100,
    b"{}",
    b"[]",
    b'{"kind": NaN}',
    b'{"sections": 3, "points": 3}',
    b"PK\3\4",
    b"\x89HDF\r\n",
]


def test_no_damaged_file_of_a_job_is_an_internal_error(damaged: Path) -> None:
    page = client(damaged)
    refused = 0
    for job in ("first", "continuation", "holes"):
        folder = Folder(damaged).jobs / job
        for file in sorted(path for path in folder.rglob("*") if path.is_file() and path.suffix != ".svg"):
            sound = file.read_bytes()
            for content in [*CONTENTS, sound[: len(sound) // 2], sound[:-20], sound[:100] + b"\xff\xff" + sound[102:]]:
                file.write_bytes(content)
                for address in addresses(job):
                    status = page.get(address).status_code
                    assert status < 500, (file, content, address)
                    refused += status >= 400
            file.write_bytes(sound)
    assert refused > 100


def addresses(job: str) -> list[str]:
    """What can be asked of a job."""
    parts = {"job": job, "name": "phase_plane", "form": "json", "point": "0"}
    queries = {
        "trace": "?channel=velocity.output_gear",
        "spectrum": "?channel=velocity.output_gear",
        "impacts": "?from=0&to=1",
    }
    paths = [path.replace(":int", "").format(**parts) for path in _PATHS if path.startswith("/api/jobs/")]
    return [path + queries.get(path.rpartition("/")[2], "") for path in paths] + [f"/api/compare?jobs={job},second"]


def links(outside: Path) -> dict[str, Any]:
    """What somebody may have planted in the folder of a job: a name, and how it is made."""
    return {
        "inputs": lambda path: path.symlink_to("/etc"),
        "inputs/passwd": lambda path: path.symlink_to("/etc/passwd"),
        "model.toml": lambda path: path.symlink_to(outside),
        "result": lambda path: path.symlink_to(outside.parent),
        "result/report.html": lambda path: path.symlink_to(outside),
        "view.json": lambda path: path.symlink_to(outside),
        "traces": lambda path: path.symlink_to(path),
        "job.json": os.mkfifo,
        "view.json.pipe": os.mkfifo,
    }


@pytest.mark.parametrize("name", links(Path()))
def test_no_link_and_no_pipe_in_the_folder_of_a_job_is_read(tmp_path: Path, name: str) -> None:
    outside = tmp_path / "outside" / "secret.txt"
    outside.parent.mkdir()
    outside.write_text("secret", encoding="utf-8")
    root = tmp_path / "workspace"
    folder = planted(root, "bad")
    Job("run", id="bad", state="done").write(Folder(root).jobs)
    (folder / "model.toml").write_text(MODEL, encoding="utf-8")
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.unlink(missing_ok=True)
    links(outside)[name](path)
    assert listed(root)["bad"]["state"] == "broken"
    page = client(root)
    for address in addresses("bad"):
        answer = page.get(address)
        assert 400 <= answer.status_code < 500, address
        assert "secret" not in answer.text
    jobs = Jobs(Folder(root), 0, 1e9, Reserve())
    jobs.delete("bad")
    assert not os.path.lexists(folder)
    assert outside.read_text(encoding="utf-8") == "secret"


def test_a_job_that_is_a_link_is_a_broken_row_and_its_removal_leaves_what_it_leads_to(tmp_path: Path) -> None:
    root = tmp_path / "workspace"
    other = tmp_path / "other"
    Job("run", id="other", state="done").write(tmp_path)
    Folder(root).jobs.mkdir(parents=True)
    (Folder(root).jobs / "bad").symlink_to(other)
    assert listed(root)["bad"]["state"] == "broken"
    assert client(root).get("/api/jobs/bad/model.toml").status_code == 400
    Jobs(Folder(root), 0, 1e9, Reserve()).delete("bad")
    assert (other / NAME).is_file()
    assert listed(root) == {}


def _make_deep(folder: Path) -> None:
    with contextlib.chdir(folder):
        for _ in range(1500):
            os.mkdir("d")
            os.chdir("d")


def _make_immovable(folder: Path) -> None:
    """What a killed program had begun to move into the folder, and a file in the way of what it replaces."""
    hidden = folder / ".gearrattle-abc"
    (hidden / "new").mkdir(parents=True)
    (hidden / "new" / "model.toml").write_text("new", encoding="utf-8")
    (hidden / "old").write_text("in the way", encoding="utf-8")


@pytest.mark.parametrize("make", [_make_deep, _make_immovable])
@pytest.mark.parametrize("where", [".", ".gearrattle/jobs/bad"])
def test_no_folder_keeps_the_server_from_its_start(tmp_path: Path, make: Callable[[Path], None], where: str) -> None:
    for name in ("bad", "sound"):
        Job("run", id=name, state="done").write(Folder(tmp_path).jobs)
    (tmp_path / "model.toml").write_text(MODEL, encoding="utf-8")
    make(tmp_path / where)
    jobs = Jobs(Folder(tmp_path), 0, 1e9, Reserve())
    assert jobs.get("sound").state == "done"
    page = client(tmp_path)
    assert [entry["path"] for entry in page.get("/api/files").json()] == ["model.toml"]
    for address in addresses("bad"):
        assert page.get(address).status_code < 500, address
    with contextlib.suppress(ModelError):  # folders nested too deep are not removed wholly
        jobs.delete("bad")
    assert os.path.lexists(Folder(tmp_path).jobs / "bad") == ("bad" in {job.id for job in jobs.all()})
    subprocess.run(["rm", "-r", tmp_path / "d", Folder(tmp_path).jobs], stderr=subprocess.DEVNULL, check=False)


def test_a_time_or_a_name_that_no_zip_can_say_is_no_internal_error(tmp_path: Path) -> None:
    for name in ("old", "odd"):
        Job("run", id=name, state="done").write(Folder(tmp_path).jobs)
        inputs = planted(tmp_path, f"{name}/inputs")
        (inputs / "model.toml").write_text(MODEL, encoding="utf-8")
    os.utime(Folder(tmp_path).jobs / "old" / "inputs" / "model.toml", (0, 0))
    Path(os.fsdecode(os.fsencode(Folder(tmp_path).jobs) + b"/odd/inputs/\xff.csv")).touch()
    page = client(tmp_path)
    assert page.get("/api/jobs/old/model.zip").status_code == 200
    assert page.get("/api/jobs/odd/model.zip").status_code == 400


def test_nothing_of_a_record_becomes_code_but_options_of_its_task(tmp_path: Path) -> None:
    folder = planted(tmp_path, "bad")
    (folder / "model.toml").write_text(MODEL, encoding="utf-8")
    (folder / NAME).write_text(json.dumps({"task": "run", "options": {"cycles=print(1), discard": 1}}))
    answer = client(tmp_path).get("/api/jobs/bad/script.py")
    assert answer.status_code == 400
    assert "is no option" in answer.json()["problems"][0]["rule"]


def test_a_large_record_is_one_broken_row_and_large_options_are_refused(tmp_path: Path) -> None:
    (planted(tmp_path, "bad") / NAME).write_text(json.dumps({"task": "run", "name": "x" * 3_000_000}))
    assert "larger than" in listed(tmp_path)["bad"]["problems"][0]["rule"]
    with pytest.raises(ModelError, match="longer than 1 MB"):
        check_options("study", {"axes": {"mesh.gear.backlash": [1e-4] * 300_000}})


def test_a_large_body_is_refused_before_it_is_read_and_read_beside_the_server() -> None:
    with pytest.raises(ModelError, match="has at most 4 MB"):
        json_object(b'{"a": [' + b"[]," * 2_000_000 + b"1]}")
    threads: list[str] = []

    def body(_content: bytes) -> None:
        threads.append(threading.current_thread().name)

    page = TestClient(Starlette(routes=[Route("/", answering(lambda *_: {}, body), methods=["POST"])]))
    assert page.post("/").status_code == 200
    assert threads == ["AnyIO worker thread"]


def test_inputs_are_made_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = planted(tmp_path, "earlier")  # of a version that kept no inputs
    Job("run", id="earlier", state="done").write(Folder(tmp_path).jobs)
    (folder / "model.toml").write_text(MODEL, encoding="utf-8")

    def half(target: Path, *_: Any) -> None:
        (target / "half").write_text("half", encoding="utf-8")
        raise OSError(errno.ENOSPC, "No space left on device")

    page = client(tmp_path)
    with monkeypatch.context() as context:
        context.setattr(result_routes, "copy_inputs", half)
        assert page.get("/api/jobs/earlier/model.zip").status_code == 507
    answer = page.get("/api/jobs/earlier/model.zip")
    assert answer.status_code == 200
    assert zipfile.ZipFile(io.BytesIO(answer.content)).namelist() == ["model.toml"]


def test_a_record_that_cannot_be_written_fails_no_other_job(tmp_path: Path) -> None:
    jobs = Jobs(Folder(tmp_path), 0, 1e9, Reserve())
    bad = jobs.submit(Job("run"), MODEL)
    sound = jobs.submit(Job("run"), MODEL)
    record = jobs.path(bad.id) / NAME
    record.unlink()
    record.mkdir()  # no file takes its place
    jobs.cancel(bad.id)
    assert jobs._write(sound) is None
    assert read_job(jobs.path(sound.id)) == sound
    assert list(jobs._unwritten) == [bad.id]


@pytest.mark.parametrize("name", [".gearrattle", ".gearrattle/jobs"])
def test_the_hidden_folder_is_no_link(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    outside = tmp_path / "outside"
    outside.mkdir()
    path = tmp_path / "workspace" / name
    path.parent.mkdir(parents=True)
    path.symlink_to(outside)
    assert main(["serve", str(tmp_path / "workspace")]) == 2
    assert "is a link" in capsys.readouterr().err
    assert list(outside.iterdir()) == []


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with serving(tmp_path_factory.mktemp("workspace")) as running:
        yield running


BODIES = [
    b'{"task": "run", "text": "x", "options": {"cycles": NaN}}',
    b'{"task": "run", "text": "x", "options": {"cycles": 1e999}}',
    b'{"task": "run", "text": "x", "name": "\\ud800"}',
    b'{"task": "run", "text": "\\udfff"}',
    b'{"task": "run", "text": "x", "options": "cycles"}',
    b'{"task": 3, "text": "x"}',
    b'{"task": "run", "text": "x", "options": {"a": ' + b"[" * 90 + b"]" * 90 + b"}}",
]


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("path", ["/api/jobs", "/api/live", "/api/check", "/api/edit"])
def test_bad_values_are_refused_at_the_door(server: Server, path: str, body: bytes) -> None:
    answer = server.client.post(path, content=body.replace(b'"x"', json.dumps(MODEL).encode()))
    if path == "/api/jobs" or b"NaN" in body or b"\\u" in body:
        assert answer.status_code == 400
        assert answer.json()["problems"][0]["rule"]
    assert answer.status_code < 500
    assert server.client.get("/api/jobs").status_code == 200


@LINUX
def test_a_full_disk_fails_what_it_fails_and_the_queue_goes_on(server: Server) -> None:
    """A file may have no byte, as on a disk that is full; what computes keeps the limits that it had."""
    first = server.job(options={"cycles": 400_000, "samples_per_cycle": 2, "discard": 0})
    server.until(first["id"], "running")
    waiting = server.job()
    limits = resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE)
    resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (0, limits[1]))
    answers = [
        server.client.post("/api/jobs", json={"task": "run", "text": MODEL}),
        server.client.patch(f"/api/jobs/{waiting['id']}", json={"name": "other"}),
        server.client.put("/api/files/a.toml", content=MODEL.encode()),
    ]
    for answer in answers:
        assert answer.status_code == 507
        assert "takes no more" in answer.json()["problems"][0]["rule"]
    assert server.state(waiting["id"])["name"] == "gap"
    server.client.post(f"/api/jobs/{first['id']}/cancel")
    assert server.ended(first["id"])["state"] == "cancelled"
    failed = server.ended(waiting["id"])
    assert failed["state"] == "failed"
    assert "takes no more" in failed["problems"][0]["rule"]
    resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, limits)
    assert server.ended(server.job()["id"])["state"] == "done"
    root = Path(os.readlink(f"/proc/{server.process.pid}/cwd"))
    kept = {job.id: job.state for job in read_jobs(Folder(root).jobs)}
    assert kept[first["id"]] == "cancelled"
    assert kept[waiting["id"]] == "failed"
    assert len(kept) == len(server.client.get("/api/jobs").json())


def test_a_job_that_is_cancelled_at_once_is_cancelled(server: Server) -> None:
    long = {"cycles": 400_000, "samples_per_cycle": 2, "discard": 0}
    for number in range(20):
        job = server.job(options=long)
        time.sleep(0.002 * (number % 5))
        server.client.post(f"/api/jobs/{job['id']}/cancel")
        assert server.ended(job["id"])["state"] == "cancelled"
    assert server.ended(server.job()["id"])["state"] == "done"


@LINUX
def test_a_job_that_is_cancelled_while_it_writes_leaves_no_hidden_folder(server: Server) -> None:
    root = Path(os.readlink(f"/proc/{server.process.pid}/cwd"))
    job = server.job()
    folder = Folder(root).job(job["id"])
    end = time.monotonic() + 60.0
    while not list(folder.glob(f"{PREFIX}*/content")) and server.state(job["id"])["state"] != "done":
        assert time.monotonic() < end
    server.client.post(f"/api/jobs/{job['id']}/cancel")
    assert server.ended(job["id"])["state"] == "cancelled"
    assert list(folder.rglob(f"{PREFIX}*")) == []


def test_what_a_killed_server_has_left_is_removed(tmp_path: Path) -> None:
    for folder in (
        tmp_path,
        Folder(tmp_path).jobs.parent,
        planted(tmp_path, "job"),
        planted(tmp_path, "job2") / "result",
    ):
        hidden = folder / ".gearrattle-abc" / "content"
        hidden.mkdir(parents=True)
        (hidden / "half.nc").write_bytes(b"half")
    with serving(tmp_path) as server:
        assert server.client.get("/api/jobs").json() == []
        assert [str(path) for path in tmp_path.rglob(".gearrattle-*")] == []


@pytest.mark.parametrize("words", [("--workers", "-3"), ("--workers", "0"), ("--memory", "nan"), ("--memory", "-1")])
def test_numbers_that_no_server_can_have_are_refused(
    tmp_path: Path, words: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["serve", str(tmp_path), *words]) == 2
    assert words[0] in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_unreadable_names_of_jobs_are_no_jobs(tmp_path: Path) -> None:
    with pytest.raises(ModelError):
        read_job(tmp_path / "none")
