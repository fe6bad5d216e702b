"""One template for every page: what a section holds is there in order, what it does not hold leaves no trace."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gearrattle.report.page import Page, Picture, Section, notes_section
from gearrattle.report.plots.chart import Chart, Line, Panel
from gearrattle.report.tables import Table
from gearrattle.report.written_page import fill_page
from tests.architecture.places import SOURCE


def chart(key: str, group: str = "") -> Chart:
    line = Line(np.arange(3.0), np.arange(3.0), "line")
    return Chart(key, f"Title of {key}", "A caption.", (Panel("panel", lines=(line,)),), group=group, tab=key)


def html_of(page: Page, folder: Path) -> str:
    fill_page(page, folder)
    return (folder / "report.html").read_text(encoding="utf-8")


def test_one_file_holds_a_whole_page() -> None:
    templates = [path.name for path in SOURCE.rglob("*.j2") if "<html" in path.read_text(encoding="utf-8")]
    environments = [path.name for path in SOURCE.rglob("*.py") if "Environment(" in path.read_text(encoding="utf-8")]
    assert templates == ["page.html.j2"]
    assert environments == ["templates.py"]


def test_a_section_shows_all_it_holds_in_order(tmp_path: Path) -> None:
    section = Section(
        "all",
        "Heading",
        "A lead.",
        ("A paragraph.",),
        ("An item.",),
        (chart("curve"),),
        pictures=(Picture("shape", "A drawing.", b"<svg/>"),),
        tables=(Table(("column",), (("cell",),)),),
        text=("A text", "Long."),
    )
    html = html_of(Page("test", "A title", (section,)), tmp_path)
    parts = ["A lead.", "A paragraph.", "An item.", 'data-key="curve"', "A drawing.", "cell", "A text", "Long."]
    places = [html.index(part) for part in ["<h1>A title</h1>", '<section id="all"', *parts]]
    assert places == sorted(places)
    assert sorted(path.name for path in (tmp_path / "figures").iterdir()) == ["charts.npz", "curve.svg", "shape.svg"]


def test_a_section_without_content_is_left_out(tmp_path: Path) -> None:
    empty = Section("none", "Heading", tables=(Table(("column",), ()),), charts=(replace(chart("a"), panels=()),))
    assert empty.is_empty
    html = html_of(Page("test", "A title", (empty, replace(empty, key="some", lead="An answer."))), tmp_path)
    assert 'id="none"' not in html
    assert html.count("<h2>Heading</h2>") == 1


@pytest.mark.parametrize("interactive", [False, True])
def test_scripts_stand_on_interactive_pages_alone(interactive: bool, tmp_path: Path) -> None:
    page = Page("test", "A title", (Section("figures", "Heading", charts=(chart("curve"),)),), interactive)
    html = html_of(page, tmp_path)
    assert ("<script" in html) == interactive
    assert ("script-src" in html) == interactive


def test_charts_of_one_group_are_chosen_by_tabs(tmp_path: Path) -> None:
    charts = (chart("first", "group"), chart("second", "group"))
    html = html_of(Page("test", "A title", (Section("group", "Heading", charts=charts),), True), tmp_path)
    assert re.findall(r'aria-controls="(.*?)"', html) == ["first-figure", "second-figure"]
    assert html.count('class="later"') == 1


def test_long_tables_fold_where_the_section_says_so(tmp_path: Path) -> None:
    long, short = (Table(("column",), (("cell",),) * rows, title=f"{rows} rows") for rows in (13, 12))
    html = html_of(Page("test", "A title", (Section("s", "Heading", tables=(long, short), folds=True),)), tmp_path)
    assert html.count("<details>") == 1


def test_text_is_escaped_everywhere(tmp_path: Path) -> None:
    evil = "<script>alert(1)</script>"
    table = Table((evil,), ((evil,),), title=evil, note=evil)
    section = Section("s", evil, evil, (evil,), (evil,), tables=(table,), text=(evil, evil))
    assert "<script" not in html_of(Page(evil, evil, (section,)), tmp_path)


def test_notes_have_a_section_only_where_there_are_some(tmp_path: Path) -> None:
    assert notes_section(()) == ()
    assert "One note." in html_of(Page("test", "A title", notes_section(("One note.",))), tmp_path)
