"""Data files of a model are those that the command line reads: relative to the file of the model, wherever that is."""

from __future__ import annotations

import io
import json
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gearrattle as gr

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")

from starlette.testclient import TestClient

from gearrattle.files import allowed_root
from gearrattle.report.result_kinds import presentation_of
from gearrattle.workbench.job_inputs import copy_inputs, model_of
from gearrattle.workbench.jobs.job_record import ENDED
from gearrattle.workbench.slider_run import live_view
from gearrattle.workbench.workspace_folder import Folder
from tests.workbench.jobs import client as client_of
from tests.workbench.server import serving

pytestmark = pytest.mark.compiled
ENGINE = """schema = 1
name = "engine"
inertia = [{ name = "a", J = 0.05, drag = 0.5 }, { name = "b", J = 0.002, drag = 0.01 }]
excitation = { speed = 80.0 }
simulation = { cycles = 4, discard = 1, samples_per_cycle = 64 }

# one spring to ground, and a gap
[[coupling]]
name = "shaft"
between = ["a", "ground"]
stiffness = 300.0
damping = 1.0

[[coupling]]
name = "gap"
between = ["a", "b"]
stiffness = 400.0
damping = 0.05
clearance = 0.01

[[torque]]
on = "a"
[torque.engine]
cylinders = 4
bore = "80 mm"
stroke = "80 mm"
rod = "140 mm"
orders = 4
pressure = { file = "DATA", angle = "angle", value = "pressure" }
"""
"""A model that reads a file; its motions repeat, so that every task can be asked."""


def trace(peak: float) -> str:
    """Return the pressure in a cylinder over a cycle, as a CSV file."""
    angle = np.arange(0.0, 721.0, 10.0)
    pressure = 1.0 + peak * np.exp(-(((angle - 30.0) / 40.0) ** 2))
    pressure[-1] = pressure[0]
    rows = "\n".join(f"{a:g},{p:.6g}" for a, p in zip(angle, pressure, strict=True))
    return f"angle [deg],pressure [bar]\n{rows}\n"


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace with the same name of a data file in the folder and in a subfolder, of different content."""
    root = tmp_path_factory.mktemp("workspace").resolve()
    (root / "rigs").mkdir()
    (root / "rigs" / "idle.toml").write_text(ENGINE.replace("DATA", "pressure.csv"), encoding="utf-8")
    (root / "rigs" / "pressure.csv").write_text(trace(20.0), encoding="utf-8")
    (root / "pressure.csv").write_text(trace(5.0), encoding="utf-8")
    (root / "rigs" / "data.toml").write_text(
        '[[response]]\nfile = "response.csv"\ntorque_on = "a"\nat = "b"\n', encoding="utf-8"
    )
    (root / "rigs" / "response.csv").write_text(RESPONSE, encoding="utf-8")
    return root


def _response() -> str:
    """Return the frequency response of b by a torque on a, with a stiffer gap, as a CSV file."""
    hertz = np.linspace(5.0, 100.0, 40)
    rows = []
    for omega in 2.0 * np.pi * hertz:
        stiffness = np.array([[750.0, -450.0], [-450.0, 450.0]])
        matrix = stiffness - omega**2 * np.diag([0.05, 0.002])
        value = np.linalg.solve(matrix + 1j * omega * np.diag([1.5, 0.01]), [1.0, 0.0])[1]
        rows.append(f"{omega / (2.0 * np.pi):.9g},{value.real:.9g},{value.imag:.9g}")
    return "\n".join(["frequency [Hz],real [rad/(N*m)],imag [rad/(N*m)]", *rows, ""])


RESPONSE = _response()


@pytest.fixture(scope="module")
def client(root: Path) -> Iterator[TestClient]:
    with client_of(root) as client:
        yield client


def done(client: TestClient, request: dict[str, Any]) -> dict[str, Any]:
    """Start a job, and wait for its end."""
    answer = client.post("/api/jobs", json=request)
    assert answer.status_code == 201, answer.text
    end = time.monotonic() + 600.0
    while (record := client.get(f"/api/jobs/{answer.json()['id']}").json())["state"] not in ENDED:
        assert time.monotonic() < end
        time.sleep(0.02)
    return dict(record)


SPEEDS = {"path": "excitation.speed", "range": [79.0, 80.0]}
FREE = ["coupling.gap.stiffness"]
TASKS: list[tuple[str, dict[str, Any], Callable[[gr.Model, Path], Any]]] = [
    ("run", {}, lambda model, _: gr.run(model)),
    (
        "study",
        {"axes": {"excitation.speed": [70.0, 80.0]}},
        lambda model, _: gr.study(model, {"excitation.speed": [70.0, 80.0]}, workers=1),
    ),
    ("compare", {"algorithms": ["rk4"]}, lambda model, _: gr.compare(model, ["rk4"])),
    ("continuation", SPEEDS, lambda model, _: gr.continuation(model, SPEEDS["path"], SPEEDS["range"])),
    (
        "fit",
        {"data": "rigs/data.toml", "free": FREE, "starts": 2},
        lambda model, root: gr.identification.fit(model, root / "rigs" / "data.toml", FREE, starts=2),
    ),
]
"""Every kind of job, and what the same call gives on the model as the command line reads it."""


@pytest.mark.slow
@pytest.mark.parametrize(("task", "options", "call"), TASKS, ids=[row[0] for row in TASKS])
def test_a_job_reads_what_the_command_line_reads(
    client: TestClient, root: Path, task: str, options: dict[str, Any], call: Callable[[gr.Model, Path], Any]
) -> None:
    job = done(client, {"task": task, "file": "rigs/idle.toml", "options": options})
    assert job["problems"] == []
    assert job["file"] == "rigs/idle.toml"
    inputs = Folder(root).job(job["id"]) / "inputs"
    assert (inputs / "pressure.csv").read_text(encoding="utf-8") == trace(20.0)
    expected = presentation_of(call(gr.load(root / "rigs" / "idle.toml"), root))
    if task != "compare":  # its sentence tells times
        assert job["sentence"] == expected.sentence
    assert client.get(f"/api/jobs/{job['id']}/view").json()["title"] == expected.title


def test_check_edit_and_sliders_read_it_as_well(client: TestClient, root: Path) -> None:
    text = ENGINE.replace("DATA", "only_here.csv")
    (root / "rigs" / "only_here.csv").write_text(trace(20.0), encoding="utf-8")
    for file, count in (("rigs/idle.toml", 0), ("", 1)):
        assert len(client.post("/api/check", json={"text": text, "file": file}).json()["problems"]) == count
        edits = [{"op": "set", "path": "coupling.gap.clearance", "value": 0.02}]
        edited = client.post("/api/edit", json={"text": text, "file": file, "edits": edits}).json()
        assert len(edited["problems"]) == count
        live = client.post("/api/live", json={"text": text, "file": file, "values": {}})
        assert live.status_code == (400 if count else 200)
    expected = live_view(gr.load(root / "rigs" / "idle.toml"), {})["verdict"]
    text = (root / "rigs" / "idle.toml").read_text(encoding="utf-8")
    answer = client.post("/api/live", json={"text": text, "file": "rigs/idle.toml", "values": {}}).json()
    assert answer["verdict"]["sentence"] == expected["sentence"]


def test_a_child_reads_what_its_parent_read(client: TestClient, root: Path) -> None:
    parent = done(client, {"task": "modes", "file": "rigs/idle.toml"})
    text = client.get(f"/api/jobs/{parent['id']}/model.toml").text
    child = done(client, {"task": "modes", "text": text, "parent": parent["id"]})
    assert (child["state"], child["file"], child["data_files"]) == ("done", "rigs/idle.toml", ["pressure.csv"])
    assert client.post("/api/jobs", json={"task": "run", "text": text, "file": "../idle.toml"}).status_code == 400


def test_a_data_file_from_elsewhere_in_the_folder_is_named_anew(root: Path, tmp_path: Path) -> None:
    """Comments of the model stay, and names that are taken are not used twice."""
    text = ENGINE.replace("DATA", "../pressure.csv").replace("[torque.engine]", "[torque.engine]  # four cylinders")
    names = copy_inputs(tmp_path / "inputs", Folder(root), text, "rigs/idle.toml")
    assert names == ["data/pressure.csv"]
    handed = (tmp_path / "inputs" / "model.toml").read_text(encoding="utf-8")
    assert handed == text.replace("../pressure.csv", "data/pressure.csv")
    here, there = gr.load(tmp_path / "inputs" / "model.toml"), model_of(text, Folder(root), "rigs/idle.toml")
    np.testing.assert_array_equal(gr.simulate(here).trajectory.deflection, gr.simulate(there).trajectory.deflection)


@pytest.mark.slow
@pytest.mark.parametrize("task", [pytest.param("run", marks=pytest.mark.long), "fit"])
def test_what_is_handed_over_runs_in_an_empty_folder(client: TestClient, root: Path, tmp_path: Path, task: str) -> None:
    """The data are those of the job, whatever has become of the files since."""
    options = next(options for name, options, _ in TASKS if name == task)
    text = ENGINE.replace("DATA", "../shared/pressure.csv")
    (root / "shared").mkdir(exist_ok=True)
    (root / "shared" / "pressure.csv").write_text(trace(20.0), encoding="utf-8")
    job = done(client, {"task": task, "text": text, "file": "rigs/idle.toml", "options": options})
    (root / "shared" / "pressure.csv").write_text(trace(1.0), encoding="utf-8")
    content = client.get(f"/api/jobs/{job['id']}/script.zip").content
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(tmp_path)
    data = ["data/pressure.csv", *(["measured/rigs/data.toml", "measured/rigs/response.csv"] if task == "fit" else [])]
    assert sorted(archive.namelist()) == sorted(["model.toml", "script.py", *data])
    assert job["data_files"] == data
    ran = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, check=True, capture_output=True, text=True)
    assert job["sentence"] in ran.stdout or task == "fit"
    again = json.loads((tmp_path / "result" / "summary.json").read_text(encoding="utf-8"))
    kept = json.loads((Folder(root).job(job["id"]) / "result" / "summary.json").read_text(encoding="utf-8"))
    assert again["sentence"] == kept["sentence"]
    assert set(zipfile.ZipFile(io.BytesIO(client.get(f"/api/jobs/{job['id']}/model.zip").content)).namelist()) == {
        "model.toml",
        *data,
    }


def test_files_outside_the_folder_are_brought_in(root: Path, tmp_path: Path) -> None:
    """Where ``--root`` allows them; the file of the option that names one is changed in that alone."""
    outside = tmp_path / "rig"
    outside.mkdir()
    for name, content in (("pressure.csv", trace(20.0)), ("response.csv", RESPONSE)):
        (outside / name).write_text(content, encoding="utf-8")
    text = (root / "rigs" / "data.toml").read_text(encoding="utf-8")
    (root / "outside.toml").write_text(f"# of the rig\n{text.replace('response.csv', str(outside / 'response.csv'))}")
    model = ENGINE.replace("DATA", str(outside / "pressure.csv"))
    inputs = tmp_path / "inputs"
    with pytest.raises(gr.ModelError, match="lies outside"):
        copy_inputs(inputs, Folder(root), model, "", ["outside.toml"])
    with allowed_root(outside):
        names = copy_inputs(inputs, Folder(root), model, "", ["outside.toml"])
    assert names == ["data/pressure.csv", "data/response.csv", "measured/outside.toml"]
    assert gr.load(inputs / "model.toml").name == "engine"
    handed = (inputs / "measured" / "outside.toml").read_text(encoding="utf-8")
    assert handed == f"# of the rig\n{text.replace('response.csv', '../data/response.csv')}"


@pytest.mark.long
def test_processes_that_compute_know_the_folder_of_root(tmp_path: Path) -> None:
    """``gearrattle --root DIR serve``: what a check allows, a job and a slider read."""
    outside, workspace = tmp_path / "rig", tmp_path / "workspace"
    outside.mkdir()
    workspace.mkdir()
    (outside / "pressure.csv").write_text(trace(20.0), encoding="utf-8")
    text = ENGINE.replace("DATA", str(outside / "pressure.csv"))
    with serving(workspace, "--root", str(outside)) as server:
        assert server.client.post("/api/check", json={"text": text}).json()["problems"] == []
        assert server.client.post("/api/live", json={"text": text, "values": {}}).status_code == 200
        job = server.ended(server.job(task="modes", text=text)["id"])
    assert (job["state"], job["data_files"]) == ("done", ["data/pressure.csv"])
