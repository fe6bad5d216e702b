"""The diffs of docs/howto/extend.md still apply, and what they add passes the laws of its table."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.architecture.places import DOCS

ROOT = DOCS.parent
FOLDER = DOCS / "howto" / "extend"
LAWS = {
    "component": ["tests/model/test_components.py", "tests/workbench/test_drawing.py"],
    "algorithm": ["tests/engine/solvers/test_one_step.py"],
    "quantity": ["tests/quantities/test_vectors.py", "tests/quantities/test_metric_chunks.py"],
}
COPIED = ("src", "tests", "docs", "examples", "benchmarks", "pyproject.toml", "README.md")


def _apply(part: str, tree: Path, *options: str) -> None:
    environment = {**os.environ, "GIT_CEILING_DIRECTORIES": str(tree.parent)}
    command = ["git", "apply", *options, str(FOLDER / f"{part}.diff")]
    done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_diff_has_its_laws() -> None:
    assert {path.stem for path in FOLDER.glob("*.diff")} == set(LAWS)


@pytest.mark.parametrize("part", LAWS)
def test_the_diff_applies(part: str) -> None:
    _apply(part, ROOT, "--check")


@pytest.mark.long
@pytest.mark.parametrize("part", LAWS)
def test_what_the_diff_adds_passes_the_laws(part: str, tmp_path: Path) -> None:
    for name in COPIED:
        ignored = shutil.ignore_patterns("_build", "__pycache__")
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, tmp_path / name, **({"ignore": ignored} if copy is shutil.copytree else {}))  # type: ignore[operator]
    _apply(part, tmp_path)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path / "src"), str(tmp_path)])}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *LAWS[part]]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-4000:]
