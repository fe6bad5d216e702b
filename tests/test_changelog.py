"""The changelog of a version: every file of changes/ comes into it once, and a release needs all of it."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.architecture.places import ROOT

SCRIPT = ROOT / ".ci" / "changelog"
OLD = "# Changelog\n\nNotable changes.\n\n## 0.1.0 - 2026-11-23\n\n- First.\n"


def changelog(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    call = [sys.executable, str(SCRIPT), *arguments]
    return subprocess.run(call, cwd=folder, capture_output=True, text=True, timeout=60, check=False)


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "pyproject.toml").write_text('[project]\nversion = "0.2.0"\n', encoding="utf-8")
    (tmp_path / "CITATION.cff").write_text("version: 0.2.0\n", encoding="utf-8")
    (tmp_path / "CHANGELOG.md").write_text(OLD, encoding="utf-8")
    (tmp_path / "changes").mkdir()
    (tmp_path / "changes" / "README.md").write_text("How to.\n", encoding="utf-8")
    for name, text in {"a.fixed": "A fault\nis gone.", "b.added": "A call.", "c.fixed": "Another."}.items():
        (tmp_path / "changes" / f"{name}.md").write_text(f"{text}\n", encoding="utf-8")
    return tmp_path


def text_of(project: Path) -> str:
    return (project / "CHANGELOG.md").read_text(encoding="utf-8")


def test_files_become_a_section_above_the_older_ones(project: Path) -> None:
    assert changelog(project).stdout == "changelog: 0.2.0, 3 changes added\n"
    new = "## 0.2.0 - unreleased\n\n### Added\n\n- A call.\n\n### Fixed\n\n- A fault is gone.\n- Another.\n\n"
    assert text_of(project) == OLD.replace("## 0.1.0", f"{new}## 0.1.0")
    assert [path.name for path in (project / "changes").iterdir()] == ["README.md"]


def test_a_section_without_a_date_is_added_to_and_dated(project: Path) -> None:
    changelog(project)
    (project / "changes" / "d.changed.md").write_text("Called otherwise.\n", encoding="utf-8")
    assert changelog(project, "2026-12-31").returncode == 0
    assert re.findall(r"^(?:## .*|### .*|- .*)$", text_of(project), re.MULTILINE) == [
        "## 0.2.0 - 2026-12-31",
        "### Added",
        "- A call.",
        "### Changed",
        "- Called otherwise.",
        "### Fixed",
        "- A fault is gone.",
        "- Another.",
        "## 0.1.0 - 2026-11-23",
        "- First.",
    ]
    assert changelog(project, "--check").returncode == 0
    newest = changelog(project, "--newest").stdout
    assert newest.startswith("### Added\n\n- A call.\n\n### Changed")
    assert newest.endswith("- Another.\n")


def test_what_a_release_lacks_is_named(project: Path) -> None:
    (project / "CITATION.cff").write_text("version: 0.1.0\n", encoding="utf-8")
    done = changelog(project, "--check")
    assert done.returncode == 1
    assert done.stdout.splitlines() == [
        "CHANGELOG.md begins with 0.1.0, pyproject.toml says 0.2.0",
        "CITATION.cff does not say version: 0.2.0",
        "3 files are left in changes/: .ci/changelog DATE",
    ]
    changelog(project)
    assert "CHANGELOG.md: 0.2.0 has no date" in changelog(project, "--check").stdout


@pytest.mark.parametrize("name", ["a.removed.md", "no_kind.md", "empty.added.md"])
def test_a_file_of_another_form_stops_it_before_anything_is_written(project: Path, name: str) -> None:
    (project / "changes" / name).write_text("" if "empty" in name else "Text.\n", encoding="utf-8")
    done = changelog(project)
    assert (done.returncode, done.stdout) == (2, "")
    assert name in done.stderr
    assert text_of(project) == OLD
    assert (project / "changes" / "a.fixed.md").exists()


def test_a_dated_section_is_not_changed(project: Path) -> None:
    changelog(project, "2026-12-31")
    (project / "changes" / "late.fixed.md").write_text("Late.\n", encoding="utf-8")
    done = changelog(project)
    assert done.returncode == 2
    assert "raise the version in pyproject.toml first" in done.stderr
    assert changelog(project, "31.12.2026").returncode == 2


def test_the_changes_of_this_tree_are_of_the_form(tmp_path: Path) -> None:
    for name in ("CHANGELOG.md", "CITATION.cff", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path / name)
    shutil.copytree(ROOT / "changes", tmp_path / "changes")
    assert changelog(tmp_path).returncode == 0
    assert not [line for line in changelog(tmp_path, "--check").stdout.splitlines() if "no date" not in line]
