"""``gearrattle import`` and ``gearrattle export``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import main


def test_a_model_goes_out_and_comes_back(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(model), "-o", "train.mo", "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["format"] == "modelica"
    assert "not compiled" in err
    assert main(["import", "train.mo", "-o", "back.toml"]) == 0
    assert "saved: back.toml" in capsys.readouterr().out
    names = [body.name for body in gr.load("back.toml").inertias]
    assert names == [body.name for body in gr.load(model).inertias]
    assert main(["check", "back.toml"]) == 0


def test_without_output_the_model_is_printed(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(model), "-o", "train.json", "--partial"]) == 0
    assert "left out: coupling.clutch" in capsys.readouterr().err
    assert main(["import", "train.json", "--speed", "900 rpm"]) == 0
    printed, _ = capsys.readouterr()
    assert gr.loads(printed).excitation.omega == pytest.approx(94.2477796)
    assert main(["import", "train.json", "--speed", "900 rpm", "--json"]) == 0
    assert gr.loads(json.loads(capsys.readouterr().out)["model"]) == gr.loads(printed)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["export", "train.toml", "-o", "a.json"], "cannot hold"),
        (["export", "train.toml", "-o", "a.txt"], "must end in"),
        (["export", "train.toml", "-o", "a.py", "--format", "c"], "must end in .c"),
        (["export", "train.toml", "-o", "a.npz", "--region", "clutch=9"], "region: clutch"),
        (["export", "train.toml", "-o", "train.toml"], "is the input file"),
        (["import", "missing.mo"], "missing.mo"),
        (["import", "train.toml"], "gr.load reads it"),
        (["import", "train.toml", "--format", "abc"], "format"),
        (["import", "train.toml", "--speed", "3 kg"], "speed"),
    ],
)
def test_what_does_not_go_is_one_message(
    words: list[str], message: str, model: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(path.name for path in model.parent.iterdir())
    assert main(words) == 2
    assert message in capsys.readouterr().err
    assert sorted(path.name for path in model.parent.iterdir()) == before
