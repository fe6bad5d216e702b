"""What most tests of commands begin with."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests import synthetic


@pytest.fixture
def model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A model file in an otherwise empty current folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "train.toml"
    path.write_text(synthetic.MODEL, encoding="utf-8")
    return path
