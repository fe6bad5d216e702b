"""``gearrattle study`` with files of other kinds: from the file to the page, refusals, and Ctrl-C within a sweep."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import main
from tests.architecture.places import EXAMPLES

BIFURCATION = """
schema = 1
model = "rattle_oscillator.toml"
kind = "bifurcation"
cycles = 40
discard = 20
[sweep]
"torque.0.harmonics.0.amplitude" = { from = 1.0, to = 7.0, count = COUNT }
"""

BASINS = """
schema = 1
model = "rattle_oscillator.toml"
kind = "basins"
cycles = 80
discard = 60
[over]
"deflection.flanks" = { from = -0.5, to = 0.7, count = 6 }
"rate.flanks" = { from = -4.0, to = 4.0, count = 6 }
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    shutil.copy(EXAMPLES / "rattle_oscillator.toml", tmp_path)
    return tmp_path


def test_a_bifurcation_from_its_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "over.toml").write_text(BIFURCATION.replace("COUNT", "5"), encoding="utf-8")
    assert main(["study", "over.toml", "--workers", "1"]) == 0
    out, err = capsys.readouterr()
    assert out.splitlines()[0] == "10 done"
    assert "2 sweeps of 5 values" in err
    actual = gr.open_study("over-study")
    assert actual.attrs["kind"] == "bifurcation"
    assert set(actual["motions"].dims) == {"torque.0.harmonics.0.amplitude"}
    assert "Bifurcation diagram" in Path("over-study/report.html").read_text(encoding="utf-8")
    assert main(["study", "over.toml", "--resume", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["outcomes"]["done"] == 10
    assert printed["swept"] == "torque.0.harmonics.0.amplitude"
    assert {entry["sweep"] for entry in printed["stretches"]} == {"up", "down"}
    assert sum(entry["values"] for entry in printed["stretches"]) == 10
    assert gr.open_study("over-study").identical(actual)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("[sweep]", "[swept]", 'did you mean "sweep"'),
        ("[sweep]", "[[sweep]]", "begin it with [sweep], not [[sweep]]"),
        ("[sweep]", '[sweep]\n"inertia.gear.drag" = [0.5, 0.6]', "one value is swept"),
        ("cycles = 40", 'cycles = "40"', "over.toml:5: cycles"),
        ("cycles = 40", "samples = 40", "unknown key"),
        ("discard = 20", "phase = true", "must be a plain number"),
        ("to = 7.0", "to = 0.5", "ascend"),
        ("torque.0", "torque.1", "torque goes by index"),
    ],
)
def test_wrong_files_are_refused_before_anything_runs(
    folder: Path, old: str, new: str, match: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = BIFURCATION.replace("COUNT", "5").replace(old, new)
    (folder / "over.toml").write_text(text, encoding="utf-8")
    assert main(["study", "over.toml"]) == 2
    assert match in capsys.readouterr().err
    assert not Path("over-study").exists()


def test_basins_from_their_file(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "rest.toml").write_text(BASINS, encoding="utf-8")
    assert main(["study", "rest.toml", "--workers", "1"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "36 done"
    actual = gr.open_study("rest-study")
    for share in actual["share"].values.tolist():
        assert any(f"{100.0 * share:.3g} %" in line for line in lines)
    assert actual.attrs["kind"] == "basins"
    assert actual["basin"].shape == (6, 6)
    page = Path("rest-study/report.html").read_text(encoding="utf-8")
    assert "A motion that does not rattle is reached from" in page
    drawn = BASINS.replace(", count = 6", "") + '[sample]\ncount = 20\nmethod = "random"\nseed = 3\n'
    (folder / "drawn.toml").write_text(drawn, encoding="utf-8")
    assert main(["study", "drawn.toml", "--workers", "1"]) == 0
    assert "95\u00a0% interval" in Path("drawn-study/report.html").read_text(encoding="utf-8")
    for old, new, match in (
        ("[over]", "[ower]", 'did you mean "over"'),
        (", count = 6", "", "needs count"),
        ("-0.5", '"1 mm"', "finite"),
    ):
        (folder / "wrong.toml").write_text(BASINS.replace(old, new), encoding="utf-8")
        capsys.readouterr()
        assert main(["study", "wrong.toml"]) == 2
        assert match in capsys.readouterr().err
    assert not Path("wrong-study").exists()


def test_a_function_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "over.toml").write_text(BIFURCATION.replace("COUNT", "5"), encoding="utf-8")
    assert main(["study", "over.toml", "--function", "tests.studies.drivelines:loudness"]) == 2
    assert "takes no function" in capsys.readouterr().err


def stopped(by: signal.Signals, count: int) -> tuple[subprocess.Popen[bytes], str]:
    """Begin a bifurcation of two sweeps, and stop it once a sweep has kept how far it has come."""
    text = BIFURCATION.replace("COUNT", str(count)).replace("cycles = 40", "cycles = 80")
    Path("over.toml").write_text(text, encoding="utf-8")
    often = "from gearrattle.studies import diagram; diagram._KEEP_EVERY = 0.02; from gearrattle.cli import main; "
    words = ["study", "over.toml", "--workers", "1", "-o", "killed"]
    command = [sys.executable, "-c", f"{often}import sys; sys.exit(main({words!r}))"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 400.0  # a machine that compiles everything first
    while time.monotonic() < deadline and not list(Path("killed/done").glob("0*.part")):
        time.sleep(0.02)
    os.kill(process.pid, by)
    return process, process.communicate()[1].decode()


@pytest.mark.long
@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGKILL])
def test_stopped_within_a_sweep_it_goes_on_to_the_same_bits(folder: Path, by: signal.Signals) -> None:
    for count in (60, 1500):  # on a busy machine short sweeps end before the signal is heard
        process, reported = stopped(by, count)
        if list(Path("killed/done").glob("0*.part")):
            break
        shutil.rmtree("killed")
    assert list(Path("killed/done").glob("0*.part")), reported
    if by == signal.SIGINT:
        assert process.returncode == 130
        assert "interrupted: 0 of 2 chunks are kept in killed; --resume goes on" in reported
    assert main(["study", "over.toml", "--resume", "-o", "killed", "--workers", "1"]) == 0
    assert main(["study", "over.toml", "-o", "whole", "--workers", "1"]) == 0
    assert gr.open_study("killed").identical(gr.open_study("whole"))
