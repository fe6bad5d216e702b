"""``gearrattle examples`` lists what comes with the package, and copies it whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import gearrattle as gr
from gearrattle.cli import main

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_all_examples_are_copied_and_load_where_they_are(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "copied"
    assert main(["examples", "-o", str(folder), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert {"name": "case3", "title": gr.example("case3").name} in printed["models"]
    endings = (".toml", ".py", ".csv", ".json")
    names = {path.relative_to(EXAMPLES) for path in EXAMPLES.rglob("*") if path.suffix in endings}
    assert {path.relative_to(folder) for path in folder.rglob("*") if path.is_file()} == names
    assert gr.load(folder / "measured_flywheel.toml") == gr.example("measured_flywheel")  # names a file of its folder


def test_the_list_names_every_model(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["examples"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == sorted(
        path.stem for path in (*EXAMPLES.glob("*.toml"), *EXAMPLES.glob("paper/*.toml"))
    )


def test_a_folder_that_holds_something_is_left_as_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.toml").write_text("", encoding="utf-8")
    assert main(["examples", "-o", str(tmp_path)]) == 2
    assert "is not empty" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]
