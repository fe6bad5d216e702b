"""Compiled code is unpickled, so it is kept only where nobody else can write."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from gearrattle.files import private_folder

FOLDER = "import gearrattle.engine.kernels._jit as jit; print(jit._folder())"


def used(home: Path, temporary: Path) -> tuple[str, str]:
    """Return the cache folder and the warnings of a new process."""
    environment = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    environment |= {"HOME": str(home), "TMPDIR": str(temporary), "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", FOLDER], env=environment, capture_output=True, text=True, check=True)
    return done.stdout.strip(), done.stderr


def test_the_folder_is_the_user_s_own_and_closed_to_others(tmp_path: Path) -> None:
    folder, said = used(tmp_path / "home", tmp_path)
    assert Path(folder).is_relative_to(tmp_path / "home" / ".cache" / "gearrattle")
    assert stat.S_IMODE(os.stat(folder).st_mode) == 0o700
    assert said == ""


def test_without_a_home_a_private_folder_below_the_temporary_one_serves(tmp_path: Path) -> None:
    folder, _ = used(Path("/dev/null"), tmp_path)
    assert Path(folder).parent == tmp_path / f"gearrattle-{os.geteuid()}"
    assert stat.S_IMODE(os.stat(folder).st_mode) == 0o700


def test_a_link_planted_in_the_temporary_folder_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "planted").mkdir()
    (tmp_path / f"gearrattle-{os.geteuid()}").symlink_to(tmp_path / "planted")
    folder, said = used(Path("/dev/null"), tmp_path)
    assert folder == ""
    assert "compiled code is not kept" in said
    assert list((tmp_path / "planted").iterdir()) == []


def test_a_folder_that_others_can_write_is_closed(tmp_path: Path) -> None:
    (tmp_path / "parent" / "folder").mkdir(parents=True)
    (tmp_path / "parent" / "folder").chmod(0o777)
    assert private_folder(tmp_path / "parent" / "folder")
    assert stat.S_IMODE((tmp_path / "parent" / "folder").stat().st_mode) == 0o700
    (tmp_path / "parent" / "folder" / "planted").touch()
    assert private_folder(tmp_path / "parent" / "folder")
    (tmp_path / "parent" / "folder").chmod(0o777)
    assert not private_folder(tmp_path / "parent" / "folder")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_a_folder_of_somebody_else_is_not_used(tmp_path: Path) -> None:
    (tmp_path / "parent" / "folder").mkdir(parents=True)
    os.chown(tmp_path / "parent", 12345, 12345)
    assert not private_folder(tmp_path / "parent" / "folder")
