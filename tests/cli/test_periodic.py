"""``gearrattle periodic`` and ``gearrattle continue``: answers, pages, files, JSON, wrong input."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.cli.continuation import _ends
from tests.architecture.places import EXAMPLES

AMPLITUDE = "torque.0.harmonics.0.amplitude"


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
    assert out.startswith("2 branches over torque amplitude on gear, order 1 from 3.6 to 6.3: ")
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
    ("text", "ends"),
    [
        ("300:2000 rpm", ("300 rpm", "2000 rpm")),
        ("300 rpm:2000 rpm", ("300 rpm", "2000 rpm")),
        ("0.3:1.6", (0.3, 1.6)),
        ("2:0", (2.0, 0.0)),
    ],
)
def test_ranges_are_read(text: str, ends: tuple[float | str, float | str]) -> None:
    assert _ends(text) == ends


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


def test_no_motion_is_a_failure_that_says_what_to_try(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["periodic", str(EXAMPLES / "manual_transmission.toml"), "--start", "static"]) == 1
    assert "another start" in capsys.readouterr().err
