"""``gearrattle figures``."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.recording import Channel, Recording
from tests import synthetic


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run") / "out"
    synthetic.findings("double-sided").save(folder)
    return folder


@pytest.mark.slow
def test_a_folder_becomes_files_of_the_width_asked_for(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["figures", str(folder), "--width", "3.5 inch", "--only", "force", "--only", "impacts"]) == 0
    printed = capsys.readouterr().out
    assert "figures: out-figures" in printed
    assert re.search(r"force +Clearances +89 x \d+", printed)
    assert sorted(path.name for path in Path("out-figures").iterdir()) == ["force.pdf", "impacts.pdf"]
    raw = Path("out-figures/force.pdf").read_bytes()
    (width,) = re.findall(rb"/MediaBox \[ ?0 0 ([\d.]+)", raw)
    assert float(width) == pytest.approx(3.5 * 72.0, abs=0.01)


def test_json_tells_files_and_captions(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "print"
    words = ["--as", "png,svg", "--dpi", "72", "--font", "serif", "--size", "7", "--only", "force", "--json"]
    assert main(["figures", str(folder), "-o", str(target), *words]) == 0
    (actual,) = json.loads(capsys.readouterr().out)["figures"]
    assert actual["name"] == "force"
    assert actual["caption"].endswith(".")
    assert actual["width"] == pytest.approx(175.0)
    assert actual["files"] == [str(target / "force.png"), str(target / "force.svg")]
    assert (target / "force.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--width", "85"], '--width: found "85"; must be a length from 60 to 500 mm'),
        (["--width", "10 mm", "--font", "no font"], '--font: found "no font"'),
        (["--as", "docx"], '--as: found "docx"; must be pdf, eps, svg, png or tiff'),
        (["--as", "pgf"], "LaTeX"),
        (["--dpi", "3"], "--dpi: found 3.0"),
        (["--size", "40"], "--size: found 40.0"),
        (["--style", "nothing.mplstyle"], "--style"),
        (["--only", "nope"], '--only: found "nope"; must be names of its figures (deflection'),
    ],
)
def test_what_is_wrong_is_refused_and_nothing_written(
    words: list[str], message: str, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["figures", str(folder), "-o", str(tmp_path / "out"), *words]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_source_without_figures_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["figures", str(tmp_path / "none")]) == 2
    assert "does not exist" in capsys.readouterr().err
    assert main(["figures", str(tmp_path)]) == 2
    assert "holds no figures/charts.npz" in capsys.readouterr().err


def test_a_saved_map_keeps_the_lines_drawn_over_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    time = np.arange(20_000) / 2000.0
    angle = 2.0 * np.pi * (10.0 * time + time**2)
    channels = (
        Channel("a", "acceleration", "hub", "rad/s^2", 3.0 * np.sin(2.0 * angle)),
        Channel("n", "speed", "", "rad/s", 2.0 * np.pi * (10.0 + 2.0 * time)),
    )
    gr.write(Recording(time, channels, "rig"), tmp_path / "rig.h5")
    case = Path(__file__).parents[2] / "examples" / "paper" / "case3.toml"
    for words in ([], ["--spectra", "--speed-step", "20 rpm"], ["--spectra"]):
        saved = tmp_path / "map.nc"
        values = ["orders", str(tmp_path / "rig.h5"), "a", *words, "--model", str(case), "-o", str(saved)]
        assert main(values) == 0
        (figure,) = gr.figures(saved).values()
        drawn = {line.get_label() for line in figure.axes[0].lines}
        assert any(str(label).startswith(("order", "natural", "f1")) for label in drawn), drawn
        with xr.open_dataset(saved, engine="h5netcdf") as kept:
            assert kept.sizes["speed" if "--speed-step" in words else "time"] > 3
    capsys.readouterr()
    assert main(["figures", str(saved), "-o", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "waterfall.pdf").read_bytes().startswith(b"%PDF")
