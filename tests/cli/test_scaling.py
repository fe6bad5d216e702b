"""``gearrattle scale`` and ``gearrattle stiffness``."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import main

EXAMPLES = Path(__file__).parents[2] / "examples"
CASE = str(EXAMPLES / "paper" / "case3.toml")


def test_scale_prints_coefficients_and_conditions(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scale", CASE, "--contact-ratio", "clutch=0.1"]) == 0
    out, _ = capsys.readouterr()
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line}
    assert rows["eta_12"] == ["3.33333"]
    assert rows["dimensional"] == ["1.715e+09", "332.1"]
    assert rows["torsional"] == ["1.097e+05", "332.1"]


def test_scale_writes_a_model_that_loads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["scale", CASE, "-o", "new.toml", "--json"]) == 0
    actual = json.loads(capsys.readouterr().out)
    assert actual["coefficients"]["Omega2_34"] == pytest.approx(160000 / 3)
    assert gr.load("new.toml") == gr.nondimensionalize(gr.load(CASE)).model
    assert [path.name for path in tmp_path.iterdir()] == ["new.toml"]
    assert main(["scale", "new.toml"]) == 2
    assert "no dimensions" in capsys.readouterr().err


def test_stiffness_tells_of_an_unstable_step(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stiffness", CASE, "--contact-ratio", "clutch=0.1", "--step", "85.333333 us"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("R_lambda 332.107 (mild)")
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line}
    assert rows["rk4"] == ["8.5333e-05", "3.16", "1.6881", "7.9838e-05"]
    assert "rk4: a step multiplies a mode by 1.688: unstable" in err


def test_stiffness_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stiffness", CASE, "--json"]) == 0
    actual = json.loads(capsys.readouterr().out)
    assert actual["r_lambda"] == pytest.approx(109.304, abs=1e-3)
    assert len(actual["regions"]) == 8
    assert {step["algorithm"] for step in actual["steps"]} == {"rk2", "rk4"}
    assert set(actual["over"]["r_lambda"]) == {"clutch", "spline", "gear"}


@pytest.mark.parametrize("word", ["clutch", "clutch=x", "clutch=2", "nothing=0.5"])
def test_a_wrong_ratio_is_refused(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stiffness", CASE, "--contact-ratio", word]) == 2
    assert re.search("^error: ", capsys.readouterr().err, re.MULTILINE)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("measured_flywheel", "a torque or a motion over time, or a sweep, needs exact"),
        ("run_up", "a torque or a motion over time, or a sweep, needs exact"),
        ("clutch_friction", "friction, clipped contact damping and alternation need exact; the model has damper"),
    ],
)
def test_stiffness_says_why_it_judges_no_fixed_step(name: str, reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stiffness", str(EXAMPLES / f"{name}.toml")]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("R_lambda ")
    assert f"note: no fixed step is judged: {reason}" in err


def test_stiffness_of_the_regions_visited(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stiffness", CASE, "--visited", "--json"]) == 0
    actual = json.loads(capsys.readouterr().out)
    assert sum(region["share"] for region in actual["regions"]) == pytest.approx(1.0)
    assert len(actual["regions"]) > 8  # coast sides among them
    assert main(["stiffness", CASE, "--visited"]) == 0
    assert "share of time" in capsys.readouterr().out
