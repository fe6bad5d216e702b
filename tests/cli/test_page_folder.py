"""Where a page is written: a folder of somebody else's is refused before anything is computed, and keeps its files."""

from __future__ import annotations

from pathlib import Path

import pytest

from gearrattle.cli import main
from tests.studies.drivelines import TOML


@pytest.fixture
def model(tmp_path: Path) -> Path:
    file = tmp_path / "two.toml"
    file.write_text(TOML, encoding="utf-8")
    return file


@pytest.mark.parametrize("command", ["run", "modes", "compare"])
def test_a_folder_of_somebody_else_is_refused(
    model: Path, tmp_path: Path, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other"
    (other / "figures").mkdir(parents=True)
    (other / "figures" / "photo.jpg").write_text("mine", encoding="utf-8")
    assert main([command, str(model), "-o", str(other)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "is not empty and holds no page of gearrattle: figures" in captured.err
    assert "give a new or an empty folder" in captured.err
    assert [path.name for path in other.rglob("*")] == ["figures", "photo.jpg"]


def test_an_empty_folder_and_one_with_a_page_are_taken(model: Path, tmp_path: Path) -> None:
    folder = tmp_path / "new"
    folder.mkdir()
    assert main(["modes", str(model), "-o", str(folder)]) == 0
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    assert main(["modes", str(model), "-o", str(folder)]) == 0
    assert (folder / "notes.txt").read_text(encoding="utf-8") == "mine"
