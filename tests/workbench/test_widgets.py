"""Widgets load, in a notebook as one text that imports nothing, on the page as modules; the page is light."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from gearrattle import workbench
from gearrattle.report.browser import widgets

STATIC = Path(workbench.__file__).parent / "static"
NODE = shutil.which("node")
HEAVIEST = 300_000


@pytest.mark.parametrize("name", widgets.names())
def test_a_widget_is_one_text_that_imports_nothing(name: str) -> None:
    text = widgets.text(name)
    assert re.findall(r"^export default ", text, flags=re.MULTILINE) == ["export default "]
    assert re.findall(r"^\s*import\b|\bimport\(", text, flags=re.MULTILINE) == []
    assert "innerHTML" not in text
    assert not re.search(r"https?://(?!www\.w3\.org/)", text)


@pytest.mark.skipif(NODE is None, reason="no node on this machine")
@pytest.mark.parametrize("name", widgets.names())
def test_a_widget_loads(name: str, tmp_path: Path) -> None:
    (tmp_path / "widget.mjs").write_text(widgets.text(name), encoding="utf-8")
    is_part = name in {"host", "plot", "numerals"}
    code = "import('./widget.mjs').then((m) => console.log(typeof m.default.render, Object.keys(m.default).length))"
    done = subprocess.run([str(NODE), "-e", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    kind, count = done.stdout.split()
    assert kind == ("undefined" if is_part else "function")
    assert int(count) >= 1


def test_parts_stand_before_what_needs_them_and_once() -> None:
    text = widgets.text("result")
    positions = [text.index(f"const {part} = (() =>") for part in ("host", "numerals", "plot", "verdict", "histories")]
    assert positions == sorted(positions)
    assert text.count("const plot = (() =>") == 1


@pytest.mark.skipif(NODE is None, reason="no node on this machine")
def test_the_page_imports_the_parts_that_a_notebook_has_in_one_text(tmp_path: Path) -> None:
    """Every module loads, with the names of its text; together they hold no part in another."""
    for name in widgets.names():
        (tmp_path / f"{name}.js").write_text(widgets.module(name), encoding="utf-8")
        (tmp_path / f"{name}_text.js").write_text(widgets.text(name), encoding="utf-8")
    (tmp_path / "package.json").write_text('{"type": "module"}', encoding="utf-8")
    show = "async (name) => console.log(...Object.keys((await import(name)).default))"
    code = f"Promise.all(process.argv.slice(1).map({show}))"
    keys = [
        subprocess.run(
            [str(NODE), "-e", code, *(f"./{name}{suffix}.js" for name in widgets.names())],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for suffix in ("", "_text")
    ]
    assert sorted(keys[0].splitlines()) == sorted(keys[1].splitlines())
    assert all("const plot = (() =>" not in widgets.module(name) for name in widgets.names())


def test_an_unknown_widget_is_refused() -> None:
    with pytest.raises(KeyError):
        widgets.text("../app")


def test_the_page_is_light() -> None:
    """Everything that is served, as if all were opened."""
    files = [path for path in STATIC.rglob("*") if path.is_file()]
    weight = sum(path.stat().st_size for path in files if "LICENSE" not in path.name)
    weight += sum(len(widgets.module(name).encode()) for name in widgets.names()) + len(widgets.style().encode())
    assert 100_000 < weight < HEAVIEST, weight


def test_nothing_is_inline() -> None:
    """The policy of the page refuses scripts, styles and style attributes in HTML."""
    page = (STATIC / "page.html").read_text(encoding="utf-8")
    assert re.findall(r"<script(?![^>]*\bsrc=)|<style|\sstyle=|\son\w+=", page) == []
    for path in [*STATIC.glob("*.js"), *widgets.FOLDER.glob("*.js")]:
        text = path.read_text(encoding="utf-8")
        assert re.findall(r"""setAttribute\(["']style|\bstyle=["$]|\beval\(|new Function""", text) == [], path.name


def test_the_page_names_all_modules_that_it_needs_at_once() -> None:
    """Otherwise a module is asked for only when the one that imports it has come, four times in a row."""
    page = (STATIC / "page.html").read_text(encoding="utf-8")
    known: set[str] = set()
    waiting = ["/static/app.js"]
    while waiting:
        url = waiting.pop()
        known.add(url)
        imported = re.findall(r'^(?:import|export)\b[^;]*?from "([^"]+)"', _module(url), re.MULTILINE)
        waiting += [other for other in imported if other not in known]
    named = re.findall(r'<link rel="modulepreload" href="([^"]+)">|<script type="module" src="([^"]+)">', page)
    assert sorted("".join(pair) for pair in named) == sorted(known)


def _module(url: str) -> str:
    if url.startswith("/widgets/"):
        return widgets.module(url.removeprefix("/widgets/").removesuffix(".js"))
    return (STATIC / url.removeprefix("/static/")).read_text(encoding="utf-8")


def test_every_vendored_file_has_its_licence() -> None:
    licences = {path.name for path in (STATIC / "vendor").glob("*LICENSE*")}
    assert licences == {"htm-LICENSE.txt", "preact-LICENSE.txt"}
    assert {path.name for path in (STATIC / "vendor").glob("*.js")} == {"htm-preact.js"}
