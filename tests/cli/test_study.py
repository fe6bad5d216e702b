"""``gearrattle study``: from a file to results, refusals, killing and going on."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.studies.study_store import Store
from tests.studies.clusters import dask, full_once
from tests.studies.drivelines import TOML

STUDY = """
schema = 1
model = "two.toml"
outputs = ["regime", "impacts per cycle"]
[axis]
"coupling.joint.clearance" = { from = 0.005, to = 0.02, count = COUNT, spacing = "log" }
"torque.0.mean" = [0.3, 0.6]
"""


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.toml").write_text(TOML, encoding="utf-8")
    path = tmp_path / "gaps.toml"
    path.write_text(STUDY.replace("COUNT", "3"), encoding="utf-8")
    return path


def test_a_study_from_its_file(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", str(study), "--workers", "1"]) == 0
    out, err = capsys.readouterr()
    folder = Path("gaps-study")
    lines = out.splitlines()
    assert lines[0] == "6 done"
    assert lines[1].startswith("joint is ")
    assert lines[-2:] == [f"page: {folder / 'report.html'}", f"results: {folder / 'results.zarr'}"]
    counts = next(line.split() for line in lines if line.startswith("joint ") and "is" not in line.split())
    codes = gr.open_study("gaps-study")["regime"].values
    assert [int(word) for word in counts[1:]] == [int((codes == code).sum()) for code in range(3)]
    assert "coupling.joint" not in out.replace(str(folder), "")
    assert "6 cases, about" in err
    assert dict(gr.open_study("gaps-study").sizes) == {"coupling.joint.clearance": 3, "torque.0.mean": 2, "part": 1}
    assert main(["study", str(study)]) == 2
    assert "holds a study already" in capsys.readouterr().err
    assert main(["study", str(study), "--resume", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["outcomes"]["done"] == 6
    assert sum(printed["counts"]["joint"].values()) == 6
    assert printed["units"] == {"coupling.joint.clearance": "rad", "torque.0.mean": "N m"}
    assert len(printed["boundary"]) == gr.studies.regime_boundary(gr.open_study("gaps-study")).sizes.get("crossing", 0)


def test_the_page_is_written_whole_or_not_at_all(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["study", str(study), "--workers", "1"]) == 0
    folder = Path("gaps-study")
    first = (folder / "report.html").read_bytes()
    assert sorted(p.name for p in (folder / "figures").glob("*.svg")) == ["map-impacts-per-cycle.svg", "map.svg"]
    monkeypatch.setattr("gearrattle.report.written_page.versions", lambda: {}["broken"])
    assert main(["study", str(study), "--resume"]) != 0
    assert (folder / "report.html").read_bytes() == first
    monkeypatch.undo()
    monkeypatch.chdir(study.parent)
    (folder / "report.html").unlink()
    (folder / "figures" / "map.svg").write_text("old", encoding="utf-8")
    assert main(["study", str(study), "--resume"]) == 0
    assert "joint is" in (folder / "report.html").read_text(encoding="utf-8")
    assert "old" not in (folder / "figures" / "map.svg").read_text(encoding="utf-8")[:4]
    names = sorted(path.name for path in folder.iterdir())
    assert names == [".lock", "done", "figures", "report.html", "results.zarr", "study.json", "summary.json"]


def test_an_estimate_writes_nothing(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(Path().iterdir())
    assert main(["study", str(study), "--estimate"]) == 0
    assert "6 cases, about" in capsys.readouterr().out
    assert main(["study", str(study), "--estimate", "--json", "--workers", "2"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert (printed["cases"], printed["workers"]) == (6, 2)
    assert 0.0 < printed["case_seconds"] < printed["seconds"]
    assert sorted(Path().iterdir()) == before


def test_the_memory_of_the_process_is_no_place_for_results(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", str(study), "-o", "memory://gone"]) == 2
    assert "is gone when the command ends" in capsys.readouterr().err


@pytest.mark.long
def test_a_lost_cluster_is_told_in_one_line(study: Path) -> None:
    pytest.importorskip("distributed")
    study.write_text(STUDY.replace("COUNT", "64"), encoding="utf-8")
    Path("dask").mkdir()
    root = Path(__file__).parents[2]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(root / "src"), str(root)])}
    with dask(Path("dask").absolute(), 1) as cluster:
        command = [sys.executable, "-m", "gearrattle", "study", str(study), "--scheduler", cluster.address, "-o", "cut"]
        command += ["--function", "tests.studies.clusters:slow"]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
        deadline = time.monotonic() + 200.0
        while time.monotonic() < deadline and not list(Path("cut/done").glob("*.json")):
            time.sleep(0.05)
        cluster.scheduler.kill()
        reported = process.communicate(timeout=100.0)[1]
    assert process.returncode == 1
    assert "Traceback" not in reported
    assert "ERROR" not in reported
    (line,) = [line for line in reported.splitlines() if line.startswith("error:")]
    assert "has gone, or has dropped the study" in line
    assert "--resume goes on" in line


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ('outputs = ["regime"', 'output = ["regime"', 'did you mean "outputs"'),
        ('"regime"', '"regimes"', 'did you mean "regime"'),
        ("joint.clearance", "join.clearance", "join"),
        ("from = 0.005", 'from = "5 kg"', "clearance"),
        ("count = 3", "count = 3000000", "6000000 cases (3000000 x 2), more than the 1000000 allowed"),
        ("two.toml", "three.toml", "no such file"),
        ("schema = 1", "schema = 2", "reads schema 1 only"),
        ("schema = 1", "schema =", "gaps.toml:2"),
    ],
)
def test_wrong_files_are_refused_before_anything_runs(
    study: Path, old: str, new: str, match: str, capsys: pytest.CaptureFixture[str]
) -> None:
    study.write_text(study.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    assert main(["study", str(study)]) == 2
    assert match in capsys.readouterr().err
    assert sorted(path.name for path in Path().iterdir()) == ["gaps.toml", "two.toml"]


def test_a_function_is_named_on_the_command_line_only(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", str(study), "--function", "tests.studies.drivelines:loudness", "--workers", "1"]) == 0
    assert "largest speed" in gr.open_study("gaps-study")
    for wrong in ("nothing", "nothing:here", "tests.studies.drivelines:TOML"):
        assert main(["study", str(study), "--function", wrong, "-o", "other"]) == 2
    assert not Path("other").exists()


def test_a_full_disk_is_told_with_what_is_kept_and_resuming_gives_the_same(
    study: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study.write_text(STUDY.replace("COUNT", "16"), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Store, "keep", full_once(Store.keep))
        assert main(["study", str(study), "--scheduler", "threads", "--workers", "2"]) == 1
    message = capsys.readouterr().err
    assert "error: the disk is full; " in message
    assert "chunks are kept in gaps-study; --resume goes on when there is space again" in message
    assert main(["study", str(study), "--scheduler", "threads", "--resume"]) == 0
    assert main(["study", str(study), "--workers", "1", "-o", "whole"]) == 0
    assert gr.open_study("gaps-study").identical(gr.open_study("whole"))


@pytest.mark.slow
def test_a_cluster_is_named_by_its_address(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("distributed")
    Path("dask").mkdir()
    with dask(Path("dask").absolute(), 1) as cluster:
        assert main(["study", str(study), "--scheduler", cluster.address, "-o", "cluster"]) == 0
    assert main(["study", str(study), "--workers", "1", "-o", "whole"]) == 0
    assert gr.open_study("cluster").identical(gr.open_study("whole"))
    assert main(["study", str(study), "--scheduler", "slurm", "-o", "other"]) == 2
    assert "must be one of local, threads, tcp://HOST:PORT" in capsys.readouterr().err
    assert not Path("other").exists()


@pytest.mark.long
def test_killed_outright_it_goes_on_to_the_same_bits(study: Path) -> None:
    study.write_text(STUDY.replace("COUNT", "200"), encoding="utf-8")
    command = [sys.executable, "-m", "gearrattle", "study", str(study), "--workers", "2", "-o"]
    killed = subprocess.Popen([*command, "killed"], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 120.0
    while time.monotonic() < deadline and not list(Path("killed/done").glob("*.json")):
        time.sleep(0.02)
    os.kill(killed.pid, signal.SIGKILL)
    killed.wait()
    assert int((gr.open_study("killed")["outcome"] == 1).sum()) < 400
    assert main(["study", str(study), "--resume", "-o", "killed", "--workers", "1"]) == 0
    assert main(["study", str(study), "-o", "whole", "--workers", "1"]) == 0
    assert gr.open_study("killed").equals(gr.open_study("whole"))
    deadline = time.monotonic() + 20.0
    while time.monotonic() < deadline and _orphans(killed.pid):
        time.sleep(0.1)
    assert not _orphans(killed.pid)


def _orphans(parent: int) -> list[str]:
    """Workers of a process that is no more: their command line names its pipe."""
    actual = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            words = (entry / "cmdline").read_bytes().decode(errors="replace")
        except OSError:
            continue
        if "spawn_main" in words and f"parent_pid={parent}" in words:
            actual.append(entry.name)
    return actual
