"""``gearrattle metrics``: a table on stdout, notes on stderr, JSON for machines, exit code 2 for what is no motion."""

from __future__ import annotations

import json
from math import isfinite
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.cli import main


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("metrics") / "run.nc"
    gr.simulate(gr.load("examples/paper/case1.toml"), cycles=6, discard=3).save(path)
    return path


def test_a_table_with_units_and_notes(saved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Named metrics alone; what is not calibrated is told."""
    assert main(["metrics", str(saved), "--name", "separation", "--name", "rattle_level"]) == 0
    out, err = capsys.readouterr()
    margin = gr.metrics(gr.open_run(saved), names=["separation"]).value[1]
    assert f"{margin:.6g} dB" in out
    assert "force" not in out
    assert "not calibrated" in err


def test_json_holds_the_rows_of_the_table(saved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same values, NaN as null."""
    assert main(["metrics", str(saved), "--json", "--base-level", "40", "--kappa", "2"]) == 0
    rows = json.loads(capsys.readouterr().out)["metrics"]
    table = gr.metrics(gr.open_run(saved), base_level=40.0, kappa=2.0)
    assert [row["quantity"] for row in rows] == table.quantity.tolist()
    assert [row["value"] for row in rows] == [value if isfinite(value) else None for value in table.value]


def test_errors_of_sampling_stand_in_the_table_and_in_json(saved: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """None for what is exact, an estimate for the band above the engine orders; the verdict's entries have them too."""
    assert main(["metrics", str(saved), "--name", "loose_gear_motion"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].endswith("error of sampling")
    assert [line.split()[-1] for line in lines if "peak acceleration  " in line or "rms acceleration  " in line]
    assert sum("±" in line for line in lines if "above the engine orders" in line) == 2
    assert main(["metrics", str(saved), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["metrics"]
    assert {row["error"] for row in rows if row["quantity"] == "separation ratio"} == {0}
    assert all(row["error"] > 0 for row in rows if "above the engine orders" in row["quantity"])
    assert main(["criteria", str(saved), "--json"]) == 0
    entries = json.loads(capsys.readouterr().out)["entries"]
    assert {entry["error"] for entry in entries if entry["criterion"] == "transmissibility"} == {0}
    assert {entry["error"] for entry in entries if entry["criterion"] == "spectrum"} == {None}


@pytest.mark.parametrize("argument", ["examples/paper/case1.toml", "examples", "nowhere.nc"])
def test_what_is_no_motion_is_refused(argument: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A model file, a folder, nothing."""
    assert main(["metrics", argument]) == 2
    assert argument in capsys.readouterr().err


def test_a_measured_file_is_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Speeds over time from a CSV file, orders by hand: twice the amplitude is the peak to peak."""
    time = np.arange(800) * (0.2 * np.pi / 800)  # ten revolutions at 100 rad/s, peaks on samples
    speed = 100.0 + 1.5 * np.sin(2.0 * 100.0 * time)
    path = tmp_path / "rig.csv"
    rows = "\n".join(f"{t:.9f},{v:.12f}" for t, v in zip(time, speed, strict=True))
    path.write_text(f"time,n\n{rows}\n", encoding="utf-8")
    mapping = tmp_path / "rig.toml"
    mapping.write_text(
        """schema = 1
file = "rig.csv"

[[channel]]
name = "n"
quantity = "speed"
of = "input_shaft"
unit = "rad/s"
""",
        encoding="utf-8",
    )
    assert main(["metrics", str(mapping), "--order", "2", "--name", "irregularity", "--json"]) == 0
    actual = {row["quantity"]: row["value"] for row in json.loads(capsys.readouterr().out)["metrics"]}
    assert actual["peak-to-peak speed at order 2"] == pytest.approx(3.0, rel=1e-3)
    assert actual["irregularity"] == pytest.approx(0.03, rel=1e-3)
