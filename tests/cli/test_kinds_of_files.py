"""A file of another kind is one error that says what it is and what takes it."""

from __future__ import annotations

from pathlib import Path

import pytest

from gearrattle.cli import main

EXAMPLES = Path(__file__).parents[2] / "examples"
MODEL, STUDY = EXAMPLES / "paper" / "case3.toml", EXAMPLES / "studies" / "quiet_idle.toml"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["study", str(MODEL), "-o", "out"], "found a model file; a study file is needed (gearrattle run takes it)"),
        (["run", str(STUDY), "-o", "out"], "found a study file; a model file is needed (gearrattle study takes it)"),
        (["check", str(STUDY)], "found a study file; a model file is needed (gearrattle study takes it)"),
        (["metrics", str(MODEL)], "found a model file; a mapping file is needed (gearrattle run takes it)"),
        (
            ["fit", str(MODEL), str(MODEL), "--free", "coupling.clutch.stiffness"],
            "found a model file; a data file is needed",
        ),
    ],
)
def test_a_file_of_another_kind_is_one_error(
    words: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line
    assert list(tmp_path.iterdir()) == []
