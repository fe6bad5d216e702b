"""``check`` shows the drag of every body by part."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.model.drag_points import drag_points
from gearrattle.model.examples import example_files

MODEL = os.fspath(example_files()["idle_rattle_oil"])


def test_parts_torques_and_sums_are_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", MODEL]) == 0
    out = capsys.readouterr()
    points = drag_points(gr.load(Path(MODEL)))
    assert "Drag by parts, oil at 40 °C (30.8 mm²/s" in out.out
    assert out.out.count("needle bearing") == 2
    assert f"{points[3].torque:.4g}" in out.out
    assert out.err.count("churning is by Changenet and Velex") == 1


def test_json_has_every_part_by_its_path(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", MODEL, "--json", "--set", "oil.temperature=0"]) == 0
    answer = json.loads(capsys.readouterr().out)
    cold = drag_points(gr.load(Path(MODEL)).with_({"oil.temperature": 0}))
    assert [part["path"] for part in answer["drag_parts"]] == [point.path for point in cold]
    assert [part["torque"] for part in answer["drag_parts"]] == [point.torque for point in cold]


def test_a_model_without_parts_has_no_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", os.fspath(example_files()["case3"])]) == 0
    assert "Drag" not in capsys.readouterr().out
