"""What most tests of study files begin with."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.studies.drivelines import TOML


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, which holds a model file and nothing else."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.toml").write_text(TOML, encoding="utf-8")
    return tmp_path
