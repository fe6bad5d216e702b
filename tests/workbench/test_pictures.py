"""Pictures of the workbench in the manual: taken where there is a browser, and left out where there is none."""

from __future__ import annotations

import re
import shutil
import struct
import subprocess
import sys
from pathlib import Path
from runpy import run_path
from typing import Any

import pytest

from tests.browser import MARKS

pytest.importorskip("docutils")

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "docs" / "images" / "workbench_pictures.py"
PAGE = """# Page

```{workbench-picture} editor
:alt: the editor

A caption.
```
"""


@pytest.fixture(scope="module")
def script() -> dict[str, Any]:
    return run_path(str(SCRIPT))


def test_the_page_shows_every_picture_and_none_is_committed(script: dict[str, Any]) -> None:
    page = (ROOT / "docs" / "howto" / "workbench.md").read_text(encoding="utf-8")
    assert sorted(re.findall(r"\{workbench-picture\} (\w+)\n:alt: \w", page)) == sorted(script["PICTURES"])
    ignored = (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()
    assert "docs/images/workbench-*.png" in ignored


def built(folder: Path) -> str:
    """Build a manual of one page, a warning is an error."""
    pytest.importorskip("myst_parser")
    (folder / "index.md").write_text(PAGE, encoding="utf-8")
    path = f"import sys; sys.path.insert(0, {str(SCRIPT.parent)!r})"
    (folder / "conf.py").write_text(f"{path}\nextensions = ['myst_parser', 'workbench_pictures']\n", encoding="utf-8")
    target = folder / "out"
    words = [sys.executable, "-m", "sphinx", "-W", "-q", "-E", "-b", "html", str(folder), str(target)]
    subprocess.run(words, check=True, capture_output=True, timeout=120)
    return (target / "index.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_without_pictures_the_page_builds_without_a_warning(script: dict[str, Any], tmp_path: Path) -> None:
    assert "<img" not in built(tmp_path)
    (tmp_path / "images").mkdir()
    shutil.copy(ROOT / "docs" / "images" / "case3.svg", script["path_of"]("editor", tmp_path / "images"))
    page = built(tmp_path)
    assert 'alt="the editor"' in page
    assert "A caption." in page


@pytest.mark.long
@pytest.mark.parametrize("_marks", [pytest.param((), marks=MARKS)])
def test_pictures_are_of_pages_with_something_on_them(
    _marks: tuple[()], script: dict[str, Any], tmp_path: Path
) -> None:
    assert script["main"](tmp_path)
    for name in script["PICTURES"]:
        content = script["path_of"](name, tmp_path).read_bytes()
        assert struct.unpack(">II", content[16:24]) == (1280, 800)
        assert len(content) > 40_000
