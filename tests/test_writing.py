"""Results appear whole or not at all, whatever fails and whoever is killed between two file operations."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from gearrattle import writing
from gearrattle.writing import PREFIX, Lock, Staging, put, sweep, temporary_folder, whole


def test_a_new_folder_appears_with_everything(tmp_path: Path) -> None:
    target = tmp_path / "a" / "b"
    with Staging(target) as staging:
        (staging.path / "x.txt").write_text("new")
        assert not target.exists()
        staging.commit()
    assert [p.name for p in target.iterdir()] == ["x.txt"]
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_an_existing_folder_keeps_what_is_not_ours(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    (tmp_path / "x.txt").write_text("old")
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "stale.svg").write_text("old")
    with Staging(tmp_path) as staging:
        (staging.path / "x.txt").write_text("new")
        (staging.path / "figures").mkdir()
        (staging.path / "figures" / "fresh.svg").write_text("new")
        staging.commit()
    assert sorted(str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*")) == [
        "figures",
        "figures/fresh.svg",
        "mine.txt",
        "x.txt",
    ]
    assert (tmp_path / "x.txt").read_text() == "new"


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt(), ValueError("bug")])
def test_a_failure_leaves_everything_as_it_was(tmp_path: Path, failure: BaseException) -> None:
    (tmp_path / "x.txt").write_text("old")

    def work() -> None:
        with Staging(tmp_path) as staging:
            (staging.path / "x.txt").write_text("half")
            raise failure

    with pytest.raises(type(failure)):
        work()
    assert [p.name for p in tmp_path.iterdir()] == ["x.txt"]
    assert (tmp_path / "x.txt").read_text() == "old"


def test_without_commit_nothing_happens(tmp_path: Path) -> None:
    with Staging(tmp_path / "new") as staging:
        (staging.path / "x.txt").write_text("unwanted")
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way_is_found_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(NotADirectoryError), Staging(tmp_path / "file" / "below"):
        raise AssertionError("the staging area opened")


def test_closed_staging_has_no_path(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="not open"):
        _ = Staging(tmp_path).path


OLD = {
    "report.html": "old",
    "figures/a.svg": "old",
    "figures/stale.svg": "old",
    "results.nc": "old",
    "mine.txt": "mine",
}
FRESH = {
    "report.html": "new",
    "figures/a.svg": "new",
    "figures/b.svg": "new",
    "results.nc": "new",
    "summary.json": "new",
}
NEW = {**FRESH, "mine.txt": "mine"}


def fill(folder: Path, content: dict[str, str]) -> None:
    for name, text in content.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def tree(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


class Killed(BaseException):
    """The program is no more."""


class Operations:
    """Counts the operations that change files, and lets one of them fail, or it and all that follow."""

    NAMES = ("rename", "replace", "fsync", "mkdir", "rmdir", "unlink", "link")

    def __init__(self, patch: pytest.MonkeyPatch, failing: int, failure: BaseException) -> None:
        self.count = 0
        self._failing = failing
        self._failure = failure
        for name in self.NAMES:
            patch.setattr(os, name, self._counted(getattr(os, name)))

    def _counted(self, operation: Any) -> Any:
        def counted(*arguments: Any, **options: Any) -> Any:
            self.count += 1
            dead = isinstance(self._failure, Killed) and self.count > self._failing
            if self.count == self._failing or dead:
                raise self._failure
            return operation(*arguments, **options)

        return counted


def replace(target: Path) -> None:
    with Staging(target) as staging:
        fill(staging.path, FRESH)
        staging.commit()


def attacked(target: Path, failing: int, failure: BaseException) -> int:
    """Replace results while an operation fails; return how many there were, 0 if none was left to fail."""
    with pytest.MonkeyPatch.context() as patch:
        opened: list[int] = []
        open_file = os.open
        patch.setattr(os, "open", lambda *a, **o: opened.append(open_file(*a, **o)) or opened[-1])
        operations = Operations(patch, failing, failure)
        patch.setattr(writing, "_flush_file", lambda _: None)  # from several threads: in no fixed order
        with suppress(OSError, Killed):
            replace(target)
    for handle in opened if isinstance(failure, Killed) else ():
        with suppress(OSError):  # what the operating system does for a process that ends
            os.close(handle)
    return operations.count if operations.count >= failing else 0


@pytest.mark.parametrize("exists", [True, False], ids=["over old results", "into a new folder"])
@pytest.mark.parametrize("failure", [OSError(5, "Input/output error"), Killed()], ids=["error", "kill"])
def test_between_any_two_operations_all_is_old_or_all_is_new(
    tmp_path: Path, failure: BaseException, exists: bool
) -> None:
    before, after = (OLD, NEW) if exists else ({}, FRESH)
    failing, seen = 0, []
    while True:
        failing += 1
        home = tmp_path / str(failing)
        home.mkdir()
        target = home / "out"
        if exists:
            fill(target, before)
        ended = not attacked(target, failing, failure)
        if isinstance(failure, OSError):
            actual = {name: text for name, text in tree(target).items() if not name.startswith(PREFIX)}
            assert actual in (before, after), f"operation {failing}"
        with Staging(target):  # the next start
            pass
        assert tree(target) in (before, after), f"operation {failing}"
        assert not list(home.rglob(f"{PREFIX}*")), f"operation {failing}"
        seen.append(tree(target) == after)
        if ended:
            break
    assert seen[-1]
    assert len(seen) > 10
    assert not all(seen[:-1])


def test_a_failed_renaming_leaves_the_old_figures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fill(tmp_path, OLD)
    rename = os.rename

    def refuse(source: Any, target: Any) -> None:
        if Path(target) == tmp_path / "results.nc" and PREFIX in str(source) and "new" in Path(source).parts:
            raise OSError(13, "Permission denied", str(target))
        rename(source, target)

    monkeypatch.setattr(os, "rename", refuse)
    with pytest.raises(OSError, match="Permission denied"):
        replace(tmp_path)
    assert tree(tmp_path) == OLD


def test_what_a_living_program_writes_is_left_alone(tmp_path: Path) -> None:
    with Staging(tmp_path) as first:
        fill(first.path, FRESH)
        with Staging(tmp_path) as second:
            fill(second.path, {"other.txt": "other"})
            second.commit()
        first.commit()
    assert tree(tmp_path) == {**FRESH, "other.txt": "other"}


def test_two_that_make_the_same_folder_both_commit_whole(tmp_path: Path) -> None:
    target = tmp_path / "a" / "b"
    with Staging(target) as first, Staging(target) as second:
        fill(first.path, FRESH)
        fill(second.path, {"report.html": "second", "figures/c.svg": "second"})
        first.commit()
        second.commit()
    assert tree(tmp_path) == {
        "a/b/report.html": "second",
        "a/b/figures/c.svg": "second",
        "a/b/results.nc": "new",
        "a/b/summary.json": "new",
    }


@pytest.mark.parametrize("bait", ["new", "lock"])
def test_links_in_a_folder_left_behind_are_not_followed(tmp_path: Path, bait: str) -> None:
    fill(tmp_path / "private", {"letter.txt": "mine"})
    hidden = tmp_path / "out" / f"{PREFIX}left"
    hidden.mkdir(parents=True)
    (hidden / bait).symlink_to(tmp_path / "private" / ("" if bait == "new" else "letter.txt"))
    with suppress(OSError), Staging(tmp_path / "out"):
        pass
    assert tree(tmp_path / "private") == {"letter.txt": "mine"}
    (tmp_path / "out" / Lock.NAME).symlink_to(tmp_path / "private" / "letter.txt")
    with pytest.raises(OSError, match=r"symbolic|no regular file"):
        Lock(tmp_path / "out")
    assert tree(tmp_path / "private") == {"letter.txt": "mine"}


def test_a_small_file_is_put_whole_and_what_was_left_of_one_is_removed(tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "replace", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device")))
        with pytest.raises(OSError, match="No space left"):
            put(tmp_path / "state", b"new")
    assert list(tmp_path.iterdir()) == []
    (tmp_path / f"{PREFIX}dead.part").write_bytes(b"half")
    put(tmp_path / "state", b"old")
    sweep(tmp_path)
    assert tree(tmp_path) == {"state": "old"}
    with pytest.raises(FileExistsError):
        put(tmp_path / "state", b"second", new=True)
    assert tree(tmp_path) == {"state": "old"}


def test_a_single_file_goes_into_a_folder_that_is_there(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), whole(tmp_path / "absent" / "x.nc"):
        raise AssertionError("the file was opened")
    with pytest.raises(IsADirectoryError), whole(tmp_path):
        raise AssertionError("the file was opened")
    with whole(tmp_path / "x.nc") as path:
        path.write_text("new")
        assert tree(tmp_path).keys() >= {str(path.relative_to(tmp_path))}
    assert tree(tmp_path) == {"x.nc": "new"}
    assert (tmp_path / "x.nc").stat().st_mode & 0o777 == 0o666 & ~umask()


def umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_a_temporary_folder_of_a_killed_program_is_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / f"{PREFIX}dead" / "content").mkdir(parents=True)
    with temporary_folder() as path:
        (path / "x").write_text("x")
        assert [p.name for p in tmp_path.iterdir()] == [path.parent.name]
    assert list(tmp_path.iterdir()) == []
