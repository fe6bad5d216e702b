"""``gearrattle screen``: the table, the page, a study file, wrong input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.cli import main
from tests.studies.test_screening import DRAG, PAIR, RATIO, RIGID

STUDY = """
schema = 1
name = "the pair over speed"
model = "pair.toml"
outputs = ["regime"]
[fixed]
"inertia.wheel.drag_torque" = 1.0
"torque.0.mean" = 1.25
[axis]
"excitation.speed" = ["600 rpm", "900 rpm"]
"torque.0.harmonics.0.amplitude" = [1.0, 2.0, 4.0]
"""


@pytest.fixture
def pair(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("pair.toml").write_text(PAIR, encoding="utf-8")
    Path("study.toml").write_text(STUDY, encoding="utf-8")
    return "pair.toml"


def test_the_table_tells_the_closed_form(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A rigid pair lifts off from the factor 1 / RIGID on, at every speed."""
    loads = [0.5 / RIGID, 0.9 / RIGID, 1.1 / RIGID, 2.0 / RIGID]
    words = ",".join(f"{factor:.6f}" for factor in loads)
    assert main(["screen", pair, "--speeds", "300:1200 rpm", "--count", "4", "--loads", words]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[3].split()[:3] == ["mesh", "wheel", "shaft"]
    assert "8 of 16" in lines[3]
    assert sorted(path.name for path in Path().iterdir()) == ["pair.toml", "study.toml"]
    assert "In 8 of 16 cases no clearance crosses a corner" in lines[0]


def test_the_page_and_its_numbers(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["screen", pair, "--speeds", "400,800 rpm", "--loads", "0.1,10", "-o", "out"]
    assert main(words) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "page: out/report.html"
    assert sorted(path.name for path in Path("out").iterdir()) == [
        "figures",
        "report.html",
        "results.nc",
        "summary.json",
    ]
    assert {path.stem for path in Path("out/figures").glob("*.svg")} == {"screening", "screening_separation"}
    page = Path("out/report.html").read_text(encoding="utf-8")
    for said in (
        "Which gears lift off",
        "speed [rpm]",
        "load factor",
        "Thresholds",
        "a driven shaft and a loose gear",
    ):
        assert said in page
    assert 'id="screening-data"' in page
    assert "default-src 'none'" in page
    with xr.open_dataset("out/results.nc", engine="h5netcdf") as kept:
        expected = gr.screen(gr.load(pair), ["400 rpm", "800 rpm"], [0.1, 10.0])
        xr.testing.assert_allclose(kept, expected)
        assert kept.speed.attrs["units"] == "rad/s"
    content = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))
    assert content["gears"][0]["lifts"] == 2
    assert content["gears"][0]["load"] == 10.0
    assert content["lift_ratio"] == expected.lift_ratio.values.tolist()


def test_a_study_file_is_screened_with_its_fixed_values(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Twice the drag, half the ratio, times 1/2, 1, 2 of the model's torque."""
    assert main(["screen", "study.toml", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    ratios = np.array(printed["separation_ratio"])[:, :, 0]
    assert ratios == pytest.approx(np.tile(0.5 * RIGID * np.array([0.5, 1.0, 2.0]), (2, 1)), rel=2e-3)
    assert printed["axes"]["torque.0.harmonics.0.amplitude"] == [1.0, 2.0, 4.0]
    assert printed["axes"]["speed"] == pytest.approx([600.0 * np.pi / 30.0, 900.0 * np.pi / 30.0])


def test_simulations_stand_beside_the_threshold(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = [
        "screen",
        pair,
        "--speeds",
        "80",
        "--load",
        f"inertia.wheel.drag_torque={DRAG},{DRAG / 8} N*m",
        "--load",
        f"torque.0.mean={DRAG * RATIO},{DRAG * RATIO / 8}",
        "--simulate",
        "--workers",
        "1",
        "--cycles",
        "50",
        "--discard",
        "40",
    ]
    assert RIGID < 0.8  # holds with its drag
    assert 8.0 * RIGID > 1.2  # lifts off with an eighth
    assert main([*words, "--json"]) == 0
    (gear,) = json.loads(capsys.readouterr().out)["gears"]
    assert (gear["lifts"], gear["rattles"], gear["judged"], gear["agree"]) == (1, 1, 2, 2)


def test_a_check_simulates_the_cases_near_the_border(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Of four loads the two about the threshold are run: the forecast holds, and the table says so."""
    loads = ",".join(f"{factor / RIGID:.6f}" for factor in (0.3, 0.8, 1.2, 3.0))
    words = ["screen", pair, "--speeds", "80", "--loads", loads, "--check", "--points", "2", "--workers", "1"]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert "of 1 said quiet 1 ran quiet, of 1 said to lift off 1 rattled" in out
    assert out.count("  right") == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["pair.toml", "--speeds", "fast"], "excitation.speed"),
        (["pair.toml", "--speeds", "1:2:3"], "must be LOW:HIGH"),
        (["pair.toml", "--speeds", "80,90", "--count", "3"], "--count"),
        (["pair.toml", "--loads", "much"], "must be factors"),
        (["pair.toml", "--loads=-1"], "factors of zero or more"),
        (["pair.toml", "--loads", "1", "--load", "torque.0.mean=1"], "leave one of them out"),
        (["pair.toml", "--load", "torque.0.mean"], "must be NAME=VALUE"),
        (["pair.toml", "--load", "torque.0.mean=1 kg"], "torque.0.mean"),
        (["pair.toml", "--cycles", "9"], "add --simulate"),
        (["pair.toml", "--workers", "2"], "add --simulate"),
        (["pair.toml", "--points", "2"], "add --check"),
        (["pair.toml", "--check", "--points", "0"], "whole number"),
        (["pair.toml", "--check", "--simulate"], "every case"),
        (["pair.toml", "-o", "pair.toml"], "must be a folder, or a file that ends in .nc, .csv, .pdf, .pptx or .xlsx"),
        (["study.toml", "--speeds", "80"], "says its speeds and loads itself"),
        (["nowhere.toml"], "nowhere.toml"),
        (["out"], "out"),
    ],
)
def test_bad_input_is_refused(pair: str, words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("out").mkdir()
    before = sorted(path.name for path in Path().iterdir())
    assert main(["screen", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert sorted(path.name for path in Path().iterdir()) == before


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"excitation.speed" = ["600 rpm", "900 rpm"]', "", "axis of excitation.speed alone"),
        (
            "[fixed]",
            '[vary]\n"inertia.wheel.J" = { distribution = "normal", mean = 1e-3, deviation = 1e-4 }\n[fixed]',
            "nothing that scatters",
        ),
        ("[axis]", '[axis]\n"inertia.wheel.J" = [1e-3]', "one axis of loads"),
        (
            'outputs = ["regime"]\n[fixed]',
            'kind = "basins"\ncycles = 9\n[over]\n"deflection.mesh" = { from = 0, to = 1, count = 3 }\n[fixed]',
            "basins",
        ),
    ],
)
def test_other_studies_are_refused(
    pair: str, old: str, new: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text = STUDY.replace(old, new, 1)
    assert text != STUDY
    if "basins" in new:
        text = text.split("[axis]", maxsplit=1)[0]
    Path("study.toml").write_text(text, encoding="utf-8")
    assert main(["screen", "study.toml"]) == 2
    assert said in capsys.readouterr().err
