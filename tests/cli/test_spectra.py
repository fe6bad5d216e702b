"""``gearrattle spectra``: peaks with limits, the folder of numbers and figures, every kind of source, wrong input."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr
from scipy import signal

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.recording import Channel, Recording

EXAMPLES = Path(__file__).parents[2] / "examples"
CASE = EXAMPLES / "paper" / "case3.toml"
RATE = 2000.0
RNG = np.random.default_rng(3)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A torque, and an acceleration three times as large beside a line at 200 Hz."""
    time = np.arange(40_000) / RATE
    torque = RNG.standard_normal(time.size)
    shaken = 3.0 * torque + 5.0 * np.sin(2.0 * np.pi * 200.0 * time)
    channels = (
        Channel("T", "torque", "hub", "N m", torque),
        Channel("a", "acceleration", "hub", "rad/s^2", shaken),
    )
    path = tmp_path_factory.mktemp("rig") / "rig.h5"
    gr.write(Recording(time, channels, "rig"), path)
    return str(path)


def test_the_highest_peak_is_the_line(rig: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Its power is 25 / 2 within the three bins that a Hann window spreads it over, above the noise."""
    assert main(["spectra", rig, "--channel", "a", "--resolution", "5 Hz", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    peak = max(printed["peaks"], key=lambda row: row["psd"])
    assert peak["frequency"] == 200.0
    assert 1.5 * 5.0 * peak["psd"] == pytest.approx(12.5 + 9.0 * 1.5 * 5.0 / (0.5 * RATE), rel=0.05)
    assert peak["psd_low"] < peak["psd"] < peak["psd_high"]
    assert printed["rms"] == pytest.approx(np.sqrt(9.0 + 12.5), rel=0.02)
    assert printed["units_of"]["psd"] == "(rad/s^2)^2/Hz"
    assert "reference" not in printed


def test_two_signals_on_the_terminal(rig: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["spectra", rig, "--channel", "a", "--against", "T", "--resolution", "5 Hz"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].split()[:3] == ["Hz", "density", "[(rad/s^2)^2/Hz]"]
    quiet = next(line for line in lines[3:-1] if not line.startswith("200"))
    assert " 3 ± " in quiet  # three times the torque, to four digits
    assert re.search(r"Coherence with T stands above what chance gives \(0\.0\d+\)", lines[0])
    assert re.search(r"independent averages of \d+ segments, bins of 5 Hz\.$", lines[-1])


@pytest.mark.slow
def test_the_folder_holds_numbers_and_figures(rig: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "out"
    words = ["spectra", rig, "--channel", "a", "--against", "torque.hub", "--resolution", "10 Hz", "-o", str(target)]
    assert main([*words, "--model", str(CASE)]) == 0
    assert f"page: {target / 'report.html'}" in capsys.readouterr().out
    assert {path.name for path in target.iterdir()} == {"report.html", "results.nc", "summary.json", "figures"}
    assert main([*words[:-1], str(tmp_path / "out.csv"), "--model", str(CASE)]) == 0
    assert {path.stem for path in (target / "figures").glob("*.svg")} == {
        "psd",
        "reference_psd",
        "cross",
        "response",
        "coherence",
    }
    expected = gr.spectra(gr.read(rig), "a", "T", resolution="10 Hz")
    with xr.open_dataset(target / "results.nc", engine="h5netcdf") as kept:
        xr.testing.assert_equal(kept, expected)
    rows = list(csv.reader((tmp_path / "out.csv").read_text().splitlines()))
    assert rows[0][0] == "frequency [Hz]"
    assert rows[0][1:] == [f"{name} [{variable.attrs['units']}]" for name, variable in expected.data_vars.items()]
    table = np.array([[cell or "nan" for cell in row] for row in rows[1:]], dtype=np.float64)
    for column, name in enumerate(expected.data_vars, start=1):
        assert np.array_equal(table[:, column], expected[name].values, equal_nan=True)
    drawn = (target / "figures" / "psd.svg").read_text(encoding="utf-8")
    ElementTree.fromstring(drawn)
    assert "frequency, Hz" in drawn
    assert "(rad/s²)²/Hz" in drawn
    assert ">f1<" in drawn  # of the model
    assert "Transfer function" in (target / "figures" / "response.svg").read_text(encoding="utf-8")


def written(path: Path) -> str:
    """A page without its scripts, every blank an ordinary one."""
    page = path.read_text(encoding="utf-8").replace("\u00a0", " ")
    return re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)


def test_the_page_says_what_scipy_says(rig: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["spectra", rig, "--channel", "a", "--against", "T", "--resolution", "10 Hz", "-o", str(tmp_path / "out")]
    assert main(words) == 0
    assert f"page: {tmp_path / 'out' / 'report.html'}" in capsys.readouterr().out
    page = written(tmp_path / "out" / "report.html")
    record = gr.read(rig)
    t, a = (next(c for c in record.channels if c.name == name).values for name in "Ta")
    how = {"fs": RATE, "nperseg": 300, "detrend": "constant"}  # a Hann window's bin is 1.5 of the lines' distances wide
    frequency, density = signal.welch(a, **how)
    explained = signal.coherence(a, t, **how)[1]
    share = float(np.sum((density * explained)[1:]) / np.sum(density[1:]))
    (said,) = re.findall(r"weighted by it ([0-9]+) % of the power", page)
    assert float(said) == pytest.approx(100.0 * share, abs=1.5)
    (below,) = re.findall(r"90 % of its power lies below ([0-9.]+) Hz", page)
    rising = np.cumsum(density[1:]) / np.sum(density[1:])
    assert float(below) == pytest.approx(frequency[1:][np.searchsorted(rising, 0.9)], abs=15.0)
    (highest,) = re.findall(r"its density is highest at ([0-9.]+) Hz", page)
    assert float(highest) == pytest.approx(200.0, abs=10.0)
    for title in ("Spectral density of the reference", "Cross density", "Transfer function", "Coherence"):
        assert f"<h2>{title}</h2>" in page
    assert not re.findall(r'(?:src|href)="(?!data:|#)', page)
    assert not re.search(r"\bnan\b", page)


def test_the_page_of_one_signal_names_no_other(rig: str, tmp_path: Path) -> None:
    assert main(["spectra", rig, "--channel", "a", "-o", str(tmp_path)]) == 0
    page = written(tmp_path / "report.html")
    assert "Coherence" not in page
    assert "Spectral density" in page
    assert list(gr.figures(tmp_path)) == ["psd"]


def test_models_and_runs_are_sources(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A model is simulated with the settings given; a saved run of the same settings says the same."""
    words = ["--channel", "acceleration.hub", "--json"]
    assert main(["spectra", str(CASE), *words, "--cycles", "30", "--discard", "6"]) == 0
    simulated = json.loads(capsys.readouterr().out)
    gr.simulate(gr.load(CASE), cycles=30, discard=6).save(tmp_path / "run.nc")
    assert main(["spectra", str(tmp_path / "run.nc"), *words]) == 0
    assert json.loads(capsys.readouterr().out)["peaks"] == simulated["peaks"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--channel", "b"], "a"),
        (["--channel", "a", "--against", "b"], "b"),
        (["--channel", "a", "--resolution", "fast"], "resolution"),
        (["--channel", "a", "--resolution", "0.01 Hz"], "needs 100 s of a record"),
        (["--channel", "a", "--window", "round"], "hann"),
        (["--channel", "a", "--overlap", "1"], "overlap"),
        (["--channel", "a", "--level", "2"], "level"),
        (["--channel", "a", "--cycles", "20"], "give a model file"),
        (["--channel", "a", "--model", "nowhere.toml"], "nowhere.toml"),
    ],
)
def test_bad_input_is_refused(
    rig: str, words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["spectra", rig, *words, "-o", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err
    assert list(tmp_path.iterdir()) == []


def test_a_missing_file_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["spectra", "nowhere.csv", "--channel", "a"]) == 2
    assert "nowhere.csv" in capsys.readouterr().err


def test_a_channel_that_no_run_has_is_refused_before_it_is_simulated(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def simulated(*_: object, **__: object) -> None:
        raise AssertionError

    monkeypatch.setattr("gearrattle.simulate", simulated)
    assert main(["spectra", str(CASE), "--channel", "acceleration.hob"]) == 2
    assert "acceleration.hub" in capsys.readouterr().err
