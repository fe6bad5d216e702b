"""Results appear whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from gearrattle.report.staging import Staging


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
        "figures", "figures/fresh.svg", "mine.txt", "x.txt",
    ]  # fmt: skip
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
