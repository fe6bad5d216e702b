"""The mapping that ``look`` writes is taken as it is by every command that takes a measured file."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.cli import main

COMMANDS = {
    "look": ["look", "{mapping}"],
    "orders": ["orders", "{mapping}"],
    "order cuts": ["orders", "{mapping}", "--order", "1"],
    "spectra": ["spectra", "{mapping}"],
    "metrics": ["metrics", "{mapping}", "--model", "case3.toml"],
    "validate": ["validate", "case3.toml", "{mapping}", "--draws", "2"],
    "fit": ["fit", "case3.toml", "{mapping}", "--free", "inertia.hub.J", "--starts", "1", "--cycles", "16"],
}


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a model, and with records of one and of three channels and the mappings that ``look`` wrote."""
    folder = tmp_path_factory.mktemp("rig")
    (folder / "case3.toml").write_text(gr.example("case3").with_({"simulation.discard": 6}).to_toml(), encoding="utf-8")
    run = gr.simulate(gr.example("case3"), cycles=30, discard=10, samples_per_cycle=128)
    data = run.data.isel(time=slice(10 * 128, None))
    time = data["time"].values - float(data["time"][0])
    speeds = (150.0 + data["velocity"]) * (30.0 / np.pi)
    channels = {"hub [rpm]": speeds.sel(inertia="hub"), "flywheel [rpm]": speeds.sel(inertia="flywheel")}
    channels["input_gear [rad/s^2]"] = data["acceleration"].sel(inertia="input_gear")
    for name, count in (("one", 1), ("three", 3)):
        heads = list(channels)[:count]
        table = np.column_stack([time, *(channels[head].values for head in heads)])
        header = ",".join(["t [s]", *heads])
        np.savetxt(folder / f"{name}.csv", table, delimiter=",", header=header, comments="")
        assert main(["look", str(folder / f"{name}.csv"), "-o", str(folder / f"{name}.toml")]) == 0
    return folder


@pytest.mark.parametrize("record", ["one", "three"])
@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_takes_it(
    command: str, record: str, rig: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(rig)
    words = [word.format(mapping=f"{record}.toml") for word in COMMANDS[command]]
    assert main([*words, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    if command in ("orders", "order cuts", "spectra") and record == "three":
        assert list(printed["results"]) == ["hub", "flywheel", "input_gear"]
        printed = printed["results"]["hub"]
    assert printed["sentence"]


def test_a_speed_with_its_mean_is_a_speed(rig: Path) -> None:
    assert [channel.quantity for channel in gr.read(rig / "three.toml").channels] == ["speed", "speed", "acceleration"]


def test_each_channel_has_a_folder_of_its_own(
    rig: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(rig)
    assert main(["spectra", "three.toml", "-o", str(tmp_path / "out")]) == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["flywheel", "hub", "input_gear"]
    assert (tmp_path / "out" / "hub" / "report.html").is_file()
    assert main(["spectra", "three.toml", "-o", str(tmp_path / "out.csv")]) == 2
    assert "is one file, and there are 3 channels" in capsys.readouterr().err
    assert main(["spectra", "one.toml", "-o", str(tmp_path / "out.csv")]) == 0


def test_a_run_needs_the_name_of_a_channel(
    rig: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(rig)
    assert main(["spectra", "case3.toml"]) == 2
    assert "must name a channel" in capsys.readouterr().err
