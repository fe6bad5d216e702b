"""``gearrattle periodic`` and ``gearrattle continue``: answers, pages, files, JSON, wrong input."""

from __future__ import annotations

import json
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.cli.shared_options import ends_in
from tests.architecture.places import EXAMPLES
from tests.cli.test_interruption import PROGRAM

AMPLITUDE = "torque.0.harmonics.0.amplitude"
SPEED = ["continue", "backlash.toml", "--path", "excitation.speed", "--range"]
SECOND = ["--second", "torque.0.mean", "--second-range"]


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copy(EXAMPLES / "rattle_oscillator.toml", "gear.toml")
    shutil.copy(EXAMPLES / "backlash_oscillator.toml", "backlash.toml")


def test_one_motion(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["periodic", "gear.toml", "-o", "out"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("A stable motion that repeats after 1 T (1): no rattle; the largest multiplier has")
    assert printed.splitlines()[-1] == "page: out/report.html"
    page = Path("out/report.html").read_text(encoding="utf-8")
    for words in ("Phase plane", "Multipliers", "State at the start of a period", "halved after"):
        assert words in page


def test_one_motion_as_json_is_the_summary(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["periodic", "gear.toml", "--start", "static", "-o", "begin.toml", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert (content["result"], content["cycles"], content["stable"]) == ("periodic motion", 1, True)
    assert content["output"] == "begin.toml"
    assert gr.load("begin.toml").simulation.initial.angle == tuple(content["state"]["angle"])


def test_every_motion_is_a_row(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["periodic", "backlash.toml", "--every", "-o", "all"]) == 0
    out = capsys.readouterr().out
    assert out.splitlines()[0] == "3 motions repeat: 2 stable, 1 unstable."
    assert [line.split()[3] for line in out.splitlines()[3:6]] == ["stable", "unstable", "stable"]
    assert Path("all/report.html").is_file()
    summary = json.loads(Path("all/summary.json").read_text(encoding="utf-8"))
    assert len(summary["motions"]) == 3


@pytest.mark.slow
def test_a_branch(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["continue", "gear.toml", "--path", AMPLITUDE, "--range", "3.6:6.3"]
    assert main([*words, "--step-limit", "0.2", "-o", "out"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("Over torque amplitude on gear, order 1 from 3.6 to 6.3: one stable motion from 3.6 to ")
    assert "Going up the motion jumps at 6.1866. Going down the motion jumps at 3.6932." in out
    page = Path("out/report.html").read_text(encoding="utf-8")
    for said in ("Highest and lowest deflection", "Largest multiplier", "Phase planes", "grazing"):
        assert said in page
    assert main([*words, "--json", "-o", "branch.csv"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert [event["kind"] for event in content["events"]] == ["grazing", "fold", "grazing", "fold", "period doubling"]
    assert Path("branch.csv").read_text(encoding="utf-8").startswith("point,branch,cycles,value")


@pytest.mark.slow
def test_a_map_over_two_values(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["continue", "gear.toml", "--path", AMPLITUDE, "--range", "5.9:6.3", "--start", "linear"]
    words += ["--second", "torque.0.mean", "--second-range", "7.4:7.6", "--across", "4", "--up", "1"]
    assert main([*words, "--json", "-o", "map"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["result"] == "map of motions"
    assert len(content["code"][0]) == 4
    assert {border["kind"] for border in content["borders"]} == {"grazing", "fold"}
    assert "Map of motions" in Path("map/report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([*SPEED, "0.9:0.9"], "--range: found [0.9, 0.9]"),
        ([*SPEED, "0.9:0.8", "--rate", "5 rpm"], "--rate: found"),
        ([*SPEED, "0.9:0.8", "--scatter", "foo=3"], "--scatter: found foo"),
        ([*SPEED, "0.9:0.8", "--second", "excitation.speed", "--second-range", "0.5:0.9"], "--second: found"),
    ],
)
def test_what_is_wrong_with_an_option_is_told_by_its_name(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 2
    assert f"error: {message}" in capsys.readouterr().err


@pytest.mark.slow
def test_an_event_over_a_second_value(capsys: pytest.CaptureFixture[str]) -> None:
    words = [*SPEED, "0.6:0.9", "--start", "linear", "--second", "torque.0.mean", "--second-range", "0.09:0.11"]
    assert main([*words, "--boundary", "1", "--json", "-o", "out"]) == 0
    content = json.loads(capsys.readouterr().out)
    branch = gr.continuation(gr.load("backlash.toml"), "excitation.speed", (0.6, 0.9), start="linear")
    curve = branch.boundary(1, "torque.0.mean", (0.09, 0.11))
    assert (content["result"], content["kind"]) == ("event boundary", "fold")
    assert content["curve"]["value"] == curve["value"].values.tolist()
    assert "Event over two values" in Path("out/report.html").read_text(encoding="utf-8")
    assert main([*words, "--boundary", "99"]) == 2
    assert "--boundary: found 99; must be a whole number from 0 to" in capsys.readouterr().err


@pytest.mark.slow
def test_events_scatter_under_tolerances(capsys: pytest.CaptureFixture[str]) -> None:
    tolerances = {"coupling.mesh.stiffness": 0.02, "torque.0.mean": 0.01}
    words = [*SPEED, "0.6:0.9", *(word for path, one in tolerances.items() for word in ("--scatter", f"{path}={one}"))]
    assert main([*words, "-o", "branch.nc"]) == 0
    assert "standard deviation" in capsys.readouterr().out
    branch = gr.continuation(gr.load("backlash.toml"), "excitation.speed", (0.6, 0.9))
    smooth = branch.events.index[branch.events["kind"].isin(["fold", "grazing"])].tolist()
    with xr.open_dataset("branch.nc") as data:
        deviation = data["event_deviation"].values
    assert deviation[smooth].tolist() == [branch.scatter(row, tolerances) for row in smooth]
    assert np.isnan(np.delete(deviation, smooth)).all()


@pytest.mark.parametrize(
    ("text", "ends"),
    [
        ("300:2000 rpm", ("300 rpm", "2000 rpm")),
        ("300 rpm:2000 rpm", ("300 rpm", "2000 rpm")),
        ("0.3:1.6", (0.3, 1.6)),
        ("2:0", (2.0, 0.0)),
    ],
)
def test_ranges_are_read(text: str, ends: tuple[float | str, float | str]) -> None:
    assert ends_in(text) == ends


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["periodic", "none.toml"], "none.toml"),
        (["periodic", "gear.toml", "--cycles", "0"], "cycles"),
        (["periodic", "gear.toml", "--every", "--start", "static"], "--start"),
        (["periodic", "gear.toml", "-o", "gear.toml"], "is read and would be lost"),
        (["continue", "gear.toml", "--path", AMPLITUDE, "--range", "6"], "must be two values"),
        (["continue", "gear.toml", "--path", AMPLITUDE, "--range", "6:6"], "two different values"),
        (["continue", "gear.toml", "--path", AMPLITUDE, "--range", "6:7", "--second", "torque.0.mean"], "both or none"),
        (["continue", "gear.toml", "--path", "torque.3.mean", "--range", "6:7"], "torque.3"),
        (["continue", "gear.toml", "--path", AMPLITUDE, "--range", "6:7", "--step-limit", "x"], "x"),
        (["continue", "gear.toml", "--path", AMPLITUDE, "--range", "6:7", "--step-limit", "0"], "--step-limit"),
    ],
    ids=" ".join,
)
def test_bad_usage_is_told_and_writes_nothing(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(Path().iterdir())
    assert main(words) == 2
    err = capsys.readouterr().err
    assert re.search("^error: ", err, re.MULTILINE)
    assert message in err
    assert sorted(Path().iterdir()) == before


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([*SPEED, "0.6:0.9", "--boundary", "1"], "--boundary: plays no part without --second"),
        ([*SPEED, "0.6:0.9", "--across", "9"], "--across: plays no part without --second"),
        ([*SPEED, "0.6:0.9", *SECOND, "0.05:0.5", "--up", "9", "--boundary", "1"], "--up: plays no part with --bound"),
        ([*SPEED, "0.6:0.9", *SECOND, "0.05:0.5", "--up", "0"], "--up: found 0"),
        ([*SPEED, "0.6:0.9", *SECOND, "0.05:0.5", "--boundary", "-1"], "--boundary: found -1"),
        ([*SPEED, "0.6:0.9", *SECOND, "0.05:0.5", "--rate", "1e-3"], "--rate: plays no part with --second"),
        ([*SPEED, "0.6:0.9", *SECOND, "0.2:0.5"], "must contain the model's own torque.0.mean, 0.1"),
        ([*SPEED, "0.6:0.9", *SECOND, "nan:0.5"], "torque.0.mean: found nan; must be a finite number"),
        ([*SPEED, "0.6:0.9", "--scatter", "torque.0.mean"], '--scatter: found "torque.0.mean"; must be NAME=VALUE'),
        ([*SPEED, "0.6:0.9", "--scatter", "torque.0.mean=-1"], "must not be negative"),
        ([*SPEED, "0.6:0.9", "--scatter", "torque.0.mea=1"], 'did you mean "torque.0.mean"?'),
        ([*SPEED, "0.6:0.9", "--scatter", "torque.0.mean=1", "--rate", "1e-3"], "--scatter: plays no part with --rate"),
        ([*SPEED, "0.6:0.9", "--rate", "fast"], "rate: found"),
    ],
    ids=" ".join,
)
def test_options_are_refused_before_a_motion_is_sought(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("periodic", "continuation"):
        monkeypatch.setattr(gr, name, None)
    assert main(words) == 2
    assert message in capsys.readouterr().err


def test_no_motion_is_a_failure_that_says_what_to_try(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["periodic", str(EXAMPLES / "manual_transmission.toml"), "--start", "static"]) == 1
    assert "another start" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--path", "speed", "--range", "1:2"], 'did you mean "excitation.speed"?'),
        (["--path", "coupling.driveshaft.name", "--range", "1:2"], "leads to no number"),
        (["--path", "torque.engine.mean", "--range", "1:2"], "(0 on engine, 1 on vehicle)"),
        (["--path", "coupling.driveshaft.clearance", "--range", "1 deg:2"], "one end has a unit, the other none"),
        (["--path", "coupling.driveshaft.clearance", "--range", "1:2:3 deg"], "must be two values"),
        (["--path", "excitation.speed", "--range", "25:35rpm", "--step-limit", "1"], "has no unit"),
        (["--path", "excitation.speed", "--range", "25:35rpm", "--rate", "100 rpm/s"], "found 100 rpm/s"),
    ],
)
def test_a_value_that_is_none_is_refused_before_motions_are_followed(
    options: list[str], words: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gr, "continuation", lambda *_, **__: pytest.fail("motions were followed"))
    assert main(["continue", str(EXAMPLES / "driveline_lash.toml"), *options]) == 2
    assert words in capsys.readouterr().err


def test_a_range_may_begin_with_a_minus(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--path", "torque.1.mean", "--range", "-300:-290 N*m"]
    assert main(["continue", str(EXAMPLES / "driveline_lash.toml"), *options]) == 0
    assert "from −300 to −290 N m" in capsys.readouterr().out


def test_where_no_motion_is_found_an_exact_run_says_what_the_driveline_does(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def nothing(*_: object, **__: object) -> None:
        raise gr.ConvergenceError("no motion was found")

    monkeypatch.setattr(gr, "periodic", nothing)
    assert main(["periodic", "gear.toml"]) == 0
    assert capsys.readouterr().out.startswith("A stable motion that repeats after 1 T (1): no rattle")
    # the run repeats, but its periodic motion is not found either
    monkeypatch.setattr("gearrattle.orbits.settled_motion.settled_orbit", lambda *_: None)
    assert main(["periodic", "gear.toml", "-o", "out", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert (content["result"], content["cycles"], content["verdict"]) == ("settled motion", 1, "quiet")
    assert content["sentence"].startswith("After 64 periods the motion about repeats every 1 period. It is quiet.")
    assert Path("out/report.html").is_file()
    assert main(["periodic", "gear.toml", "-o", "begin.toml"]) == 0
    assert gr.load("begin.toml").simulation.initial is not None
    # who asks for a number of periods wants that motion or none
    assert main(["periodic", "gear.toml", "--cycles", "1"]) == 1
    assert "no motion was found" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["periodic", "gear.toml", "--within", "5 rpm"], "--within"),
        (["periodic", "gear.toml", "--every", "--within", "-1"], "--within"),
        ([*SPEED, "0.5:0.7", "--within", "soon"], "--within"),
        ([*SPEED, "0.5:0.7", "--narrow", "-1"], "--narrow"),
        ([*SPEED, "0.5:0.7", *SECOND, "0.1:0.2", "--within", "9"], "--within"),
        ([*SPEED, "0.6:0.9", "--rate", "1e-4", "--within", "9"], "--within"),
    ],
)
def test_a_time_without_sense_is_refused(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    assert message in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_ctrl_c_leaves_a_page_with_what_was_known(tmp_path: Path) -> None:
    """A gearbox of which no branch can be followed: pressed once the first motions are known."""
    shutil.copy(Path(__file__).parents[1] / "orbits" / "six_speed.toml", "six.toml")
    words = ["continue", "six.toml", "--path", "excitation.speed", "--range", "2400:3000 rpm", "--within", "600"]
    command = [*PROGRAM, *words, "-o", "out"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if "motions known at" in line:
                process.send_signal(signal.SIGINT)
                break
        printed, errors = process.communicate(timeout=120)
    assert process.returncode == 130
    assert errors.splitlines()[-1] == "interrupted: what was known by then is shown"
    assert printed.startswith("Over speed from 2400 to 3000 rpm, as far as the time sufficed: ")
    notes = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))["notes"]
    assert any("stopped before all jumps were narrowed" in note for note in notes)
    assert Path("out/report.html").is_file()
