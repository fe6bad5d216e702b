"""``gearrattle orders``."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.recording import Channel, Recording

EXAMPLES = Path(__file__).parents[2] / "examples"
CASE = EXAMPLES / "paper" / "case3.toml"


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> str:
    time = np.arange(20_000) / 2000.0
    angle = 2.0 * np.pi * (10.0 * time + time**2)
    channels = (
        Channel("a", "acceleration", "hub", "rad/s^2", 3.0 * np.sin(2.0 * angle) + 0.5 * np.sin(4.0 * angle)),
        Channel("n", "speed", "", "rad/s", 2.0 * np.pi * (10.0 + 2.0 * time)),
    )
    path = tmp_path_factory.mktemp("rig") / "rig.h5"
    gr.write(Recording(time, channels, "rig"), path)
    return str(path)


def test_it_prints_the_strongest_orders(rig: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["orders", rig, "a"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("Order 2 is the largest: ")
    assert lines[2].split()[:2] == ["order", "largest"]
    assert [line.split()[0] for line in lines[3:5]] == ["2", "4"]
    assert float(lines[3].split()[1]) == pytest.approx(3.0, rel=1e-3)


def test_chosen_orders_as_json_and_their_numbers_as_a_file(
    rig: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "cuts.nc"
    assert main(["orders", rig, "acceleration.hub", "--order", "4", "--order", "2", "--json", "-o", str(target)]) == 0
    actual = json.loads(capsys.readouterr().out)
    assert [row["order"] for row in actual["orders"]] == [2.0, 4.0]
    assert [row["amplitude"] for row in actual["orders"]] == pytest.approx([3.0, 0.5], rel=1e-6)
    with xr.open_dataset(target, engine="h5netcdf") as kept:
        assert kept.amplitude.sel(order=4.0).values == pytest.approx(0.5, rel=1e-6)
        assert kept.amplitude.attrs["units"] == "rad/s^2"


def test_spectra_are_drawn_with_the_lines_of_a_model(
    rig: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "map.svg"
    assert main(["orders", rig, "a", "--spectra", "--model", str(CASE), "--resolution", "4 Hz", "-o", str(target)]) == 0
    assert "saved:" in capsys.readouterr().out
    text = target.read_text(encoding="utf-8")
    assert "<image" in text
    assert "order 1" in text
    assert [path.name for path in tmp_path.iterdir()] == ["map.svg"]


def test_a_map_of_orders_has_the_natural_frequencies_of_a_model(
    rig: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "orders.svg"
    assert main(["orders", rig, "a", "--highest", "12", "--model", str(CASE), "-o", str(target)]) == 0
    text = target.read_text(encoding="utf-8")
    assert "falling lines: natural frequencies" in text.lower()
    assert ">f1<" in text
    assert "order 1" in text
    assert main(["orders", rig, "a", "--highest", "12", "-o", str(target)]) == 0
    assert "natural frequencies" not in target.read_text(encoding="utf-8")
    capsys.readouterr()


def test_a_saved_run_knows_its_shaft(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "run.nc"
    gr.simulate(gr.load(CASE), cycles=30, discard=10).save(path)
    assert main(["orders", str(path), "velocity.flywheel", "--order", "1", "--json"]) == 0
    actual = json.loads(capsys.readouterr().out)
    assert actual["shaft"] == "the reference shaft"
    assert actual["orders"][0]["speed"] == pytest.approx(gr.load(CASE).excitation.omega)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["a", "-o", "map.jpg"], ".nc, .csv, .pdf, .pptx, .xlsx, .svg"),
        (["b"], "a, n"),
        (["a", "--spectra", "--highest", "4"], "maps of orders"),
        (["a", "--order", "2", "--highest", "9"], "maps"),
        (["a", "--highest", "90"], "at most"),
        (["a", "--speed", "x"], "no channel and no speed"),
    ],
)
def test_bad_input_is_refused(rig: str, words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["orders", rig, *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert said in err


def test_a_missing_file_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["orders", "nowhere.csv", "a"]) == 2
    assert "nowhere.csv" in capsys.readouterr().err
