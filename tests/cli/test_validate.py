"""``gearrattle validate``: the table, the page, JSON, wrong input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.plots.validation_figures import validation_charts
from tests.measured.validation import made


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, str]:
    monkeypatch.chdir(tmp_path)
    Path("wheel.toml").write_text(made.MODEL, encoding="utf-8")
    gr.write(made.record(gain=1.1, delay=0.0123), "rig.h5")
    return "wheel.toml", "rig.h5"


def test_the_table_and_the_verdict(files: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", *files]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "look first at a" in lines[0]
    assert lines[2].split()[:2] == ["channel", "level"]
    assert lines[4].split()[:6] == ["a", "rms", "rad/s^2", "4.189", "3.808", "9.09"]
    assert sorted(path.name for path in Path().iterdir()) == ["rig.h5", "wheel.toml"]


def test_the_page_needs_nothing_else(files: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", *files, "-o", "out", "--calibration", "2", "--noise", "a=0.01"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "page: out/report.html"
    page = Path("out/report.html").read_text(encoding="utf-8")
    for words in ("Verdict", "Levels", "Error budget", "Mean cycles", "Orders", "Spectra", "Power in bands", "rig.h5"):
        assert words in page
    assert "http:" not in page
    assert "https:" not in page
    assert "<script" not in page
    content = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))
    level = content["pairs"][0]["levels"][1]
    assert level["sigma"] == pytest.approx(100.0 / 11.0, rel=1e-3)
    budget = {entry["source"]: entry["value"] for entry in level["budget"]}
    assert budget["calibration"] == pytest.approx(2.0 / 1.1, rel=1e-3)  # of the simulated level, in % of the measured
    figures = {path.stem for path in Path("out/figures").glob("*.svg")}
    assert figures == {"sigma", "budget", "cycles", "orders", "spectra", "bands"}


def test_uncertain_parameters_have_their_tables(files: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    """The rms goes as 1 / J: a per cent of one is a per cent of the other, and ln 1.1 takes 9.5 of them."""
    words = ["--uncertain", "inertia.wheel.J=0.02", "--uncertain", "torque.0.harmonics.0.amplitude=0.1", "--draws", "8"]
    assert main(["validate", *files, *words, "-o", "out"]) == 0
    out = capsys.readouterr().out
    row = next(line.split() for line in out.splitlines() if line.startswith("inertia.wheel.J"))
    assert float(row[1]) == pytest.approx(-1.0 / 1.1, rel=0.02)
    page = Path("out/report.html").read_text(encoding="utf-8")
    for title in ("Parameters, each alone", "Parameters, all together", "Which go together"):
        assert title in page
    content = json.loads(Path("out/summary.json").read_text(encoding="utf-8"))["parameters"]
    assert content["parameters"][0]["effects"][1]["needed"] == pytest.approx(-9.53, rel=0.02)
    assert content["stated"] == [[1.0, 0.0], [0.0, 1.0]]


def test_json_and_a_saved_run_and_a_mapping(files: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    made.run().save("wheel.nc")
    Path("measurement.toml").write_text(
        'schema = 1\nfile = "rig.h5"\n[[channel]]\nname = "b"\nsource = "a"\nquantity = "acceleration"\nof = "wheel"\n',
        encoding="utf-8",
    )
    assert main(["validate", "wheel.nc", "measurement.toml", "--json", "--clock", "phase"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["clock"]["delay"] == pytest.approx(0.0123, abs=1e-8)
    assert printed["pairs"][0]["name"] == "b"


def test_figures_are_drawn_by_both_renderers() -> None:
    actual = gr.validate(made.run(), made.record(gain=1.1))
    charts = validation_charts(actual)
    assert [chart.key for chart in charts] == ["sigma", "budget", "cycles", "orders", "spectra", "bands"]
    for chart in charts:
        assert json.dumps(chart_json(chart), allow_nan=False)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--match", "a"), '--match: found "a"; must be NAME=VALUE'),
        (("--threshold", "gear=1"), "thresholds: found gear"),
        (("--highest", "1e6"), "band"),
        (("--clock", "sun"), "clock"),
        (("--cycles", "6"), "wheel, exact: found"),
        (("--uncertain", "inertia.wheel.J=9"), "parameters: inertia.wheel.J"),
    ],
)
def test_wrong_input_is_told_and_writes_nothing(
    files: tuple[str, str], words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["validate", *files, "-o", "out", *words]) == 2
    assert said in capsys.readouterr().err
    assert not Path("out").exists()


def test_missing_files(files: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", files[0], "nothing.csv", "-o", "out"]) == 2
    assert "nothing.csv" in capsys.readouterr().err
    assert main(["validate", "nothing.toml", files[1], "-o", "out"]) == 2
    assert "nothing.toml" in capsys.readouterr().err
    assert not Path("out").exists()
