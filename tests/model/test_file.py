"""Files that are no model at all: each is one clear error, at once."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest
from tests.model.test_broken_files import SOUND

from gearrattle.errors import ModelError
from gearrattle.model import load, loads


def _only_problem(path: str | Path) -> str:
    with pytest.raises(ModelError) as caught:
        load(path)
    assert len(caught.value.problems) == 1
    return str(caught.value)


def test_loads_a_file_with_its_name_in_messages(tmp_path: Path) -> None:
    path = tmp_path / "car.toml"
    path.write_text(SOUND, encoding="utf-8")
    assert load(path) == load(str(path)) == loads(SOUND)
    path.write_text(SOUND.replace('"0.3 kg*m^2"', "-1"), encoding="utf-8")
    assert _only_problem(path).startswith(f"{path}:7: inertia.flywheel.J: found -1; ")


def test_byte_order_mark_and_windows_lines_are_read(tmp_path: Path) -> None:
    path = tmp_path / "car.toml"
    path.write_bytes(b"\xef\xbb\xbf" + SOUND.replace("\n", "\r\n").encode())
    assert load(path) == loads(SOUND)
    path.write_bytes(SOUND.replace("drag = 1.5e-4", "drag = -1").replace("\n", "\r\n").encode())
    assert f"{path}:8: " in _only_problem(path)


def test_missing_file_suggests_its_neighbour(tmp_path: Path) -> None:
    (tmp_path / "case3.toml").write_text(SOUND, encoding="utf-8")
    message = _only_problem(tmp_path / "case_3.toml")
    assert "no such file" in message
    assert "case3.toml" in message


def test_missing_folder(tmp_path: Path) -> None:
    assert "does not exist" in _only_problem(tmp_path / "nowhere" / "car.toml")


def test_folder_names_a_model_inside(tmp_path: Path) -> None:
    (tmp_path / "car.toml").write_text(SOUND, encoding="utf-8")
    message = _only_problem(tmp_path)
    assert "a folder" in message
    assert "car.toml" in message


def test_large_file_is_refused_without_parsing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "large.toml"
    path.write_bytes(b"#" * 10_000_000)
    monkeypatch.setattr("tomllib.loads", lambda _: pytest.fail("the file is parsed"))
    assert "at most 1 MB" in _only_problem(path)


def test_large_text_is_refused() -> None:
    with pytest.raises(ModelError, match="at most 1 MB"):
        loads("#" * 1_000_001)


def test_endless_device_is_refused() -> None:
    assert _only_problem("/dev/zero").startswith("/dev/zero: is a device; a regular file is needed")


def test_binary_garbage_names_the_line(tmp_path: Path) -> None:
    path = tmp_path / "garbage.toml"
    path.write_bytes(b"schema = 1\n\x80\x81\xff\x00")
    message = _only_problem(path)
    assert message.startswith(f"{path}:2: ")
    assert "0x80" in message
    assert "UTF-8" in message


def test_binary_that_is_text_is_no_toml(tmp_path: Path) -> None:
    path = tmp_path / "garbage.toml"
    path.write_bytes(bytes(range(1, 128)) * 20)
    assert "not valid TOML" in _only_problem(path)


def test_unreadable_file(tmp_path: Path) -> None:
    path = tmp_path / "secret.toml"
    path.write_text(SOUND, encoding="utf-8")
    path.chmod(0)
    if os.access(path, os.R_OK):
        pytest.skip("this user may read every file")
    assert "permission denied" in _only_problem(path)


def test_odd_names() -> None:
    assert "cannot be read" in _only_problem("car\0.toml")
    assert "cannot be read" in _only_problem("x" * 5000)


def test_a_loop_of_links_cannot_be_read(tmp_path: Path) -> None:
    path = tmp_path / "loop.toml"
    path.symlink_to(path)
    assert "is a symbolic link that leads back to itself" in _only_problem(path)


DEEP = ["a = " + "[" * 100_000, "a = " + "{a=" * 50_000, "a" + ".a" * 100_000 + " = 1", "[" + "a." * 9_000 + "a]"]


@pytest.mark.parametrize("text", DEEP, ids=["arrays", "tables", "keys", "headers"])
def test_deep_nesting_is_refused(text: str) -> None:
    with pytest.raises(ModelError, match=r"^<text>:2: .*nested too deeply$"):
        loads("schema = 1\n" + text)


def test_empty_file_names_what_is_required() -> None:
    with pytest.raises(ModelError) as caught:
        loads("", "car.toml")
    (problem,) = caught.value.problems
    assert (problem.place, problem.value) == ("car.toml", "an empty file")
    for key in ("schema", "inertia", "excitation"):
        assert key in problem.remedy


def _calls(count: int) -> int:
    """Count the Python calls that a file with so many wrong meshes and inertias takes; all problems are reported."""
    rows = "".join(f'[[mesh]]\nname = "m{i}"\nbetween = ["a{i}", "b"]\n' for i in range(count))
    rows += "".join(f'[[inertia]]\nname = "c{i}"\nJ = -1\n' for i in range(count))
    calls = 0

    def note(_frame: object, event: str, _argument: object) -> None:
        nonlocal calls
        calls += event == "call"

    sys.setprofile(note)
    try:
        with pytest.raises(ModelError) as caught:
            loads("schema = 1\n" + rows)
    finally:
        sys.setprofile(None)
    assert len(caught.value.problems) == count * 5 + 1  # per mesh: two ends, radii, stiffness
    return calls


def test_the_work_grows_with_the_number_of_problems() -> None:
    """Sixteen times as many problems take less than twenty times as many calls; quadratic work would take 256."""
    _calls(100)  # what is made once
    assert _calls(960) < 20 * _calls(60)


def test_no_code_runs(tmp_path: Path) -> None:
    target = tmp_path / "touched"
    attack = f"__import__('pathlib').Path('{target}').touch()"
    for text in (attack, "1 " + attack, "1 m*" + attack, "1 (" + attack + ")"):
        for old in ('"0.16 rad"', '"0.3 kg*m^2"', '"exact"', '"flywheel"', '"sound"'):
            try:
                loads(SOUND.replace(old, f'"{text}"', 1))
            except ModelError:
                continue
    assert not target.exists()
