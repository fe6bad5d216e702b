"""What every result can do, whatever its kind: words, tables, figures, files, a view for notebooks."""

from __future__ import annotations

import html
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.report.numbers import Arrays, write_netcdf
from gearrattle.report.plots.chart import Chart
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import texts
from gearrattle.report.result_kinds import PRESENTATIONS, kind_of, presentation_class, presentation_of
from gearrattle.report.tables import Table
from gearrattle.report.text import plain_text
from gearrattle.reproduction.reproduction_record import Reproduction, Section, row
from gearrattle.typing import Result
from tests.browser import BROWSER, browse
from tests.report.examples import CASE_PARAMETERS, EXAMPLES, model, result

WITHOUT_FIGURES = {"reproduction"}
"""Kinds whose example has no figure; a whole reproduction has."""
WITHOUT_ROWS = {"contact ratio of linear motion", "spectra of zeros", "density of zeros", "coherence of zeros"}
"""Cases of which nothing can be tabulated: no clearance, no peak."""


VOID = {"meta", "img", "br", "link", "hr", "input"}
"""Tags without an end."""


class Tags(HTMLParser):
    """Collects what a page or a view is made of, and its words."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.names: set[str] = set()
        self.attributes: list[tuple[str, str]] = []
        self.words = ""
        self.open: list[str] = []
        self.scripts = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.names.add(tag)
        if tag not in VOID:
            self.open.append(tag)
        self.attributes += [(name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open[-1:] == ["script"]:
            self.scripts += data
        else:
            self.words += data


@pytest.fixture(scope="module", params=CASE_PARAMETERS)
def case(request: pytest.FixtureRequest) -> str:
    """Of a module's scope, so that all tests of a case follow one another, in one process: it is computed once."""
    return str(request.param)


@pytest.fixture(scope="module")
def presentation(case: str) -> Presentation[Any]:
    return presentation_of(result(case))


@pytest.fixture(scope="module")
def folder(case: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that a result was saved into."""
    folder = tmp_path_factory.mktemp("saved") / "out"
    assert gr.save(result(case), folder) == folder / "report.html"
    return folder


@pytest.mark.parametrize("kind", PRESENTATIONS)
def test_every_kind_has_an_example_that_names_it(kind: str) -> None:
    assert kind_of(result(kind)) == kind


def test_words_tables_and_figures(case: str, presentation: Presentation[Any]) -> None:
    assert presentation.title
    assert presentation.sentence.rstrip()[-1] in ".!?", presentation.sentence
    assert presentation.sentence[0].strip()
    assert all(isinstance(note, str) and note for note in presentation.notes)
    tables, charts = presentation.tables(), presentation.charts()
    assert bool(tables) == (case not in WITHOUT_ROWS)
    for table in (*tables, *presentation.answer()):
        assert isinstance(table, Table)
        assert all(len(row) == len(table.head) for row in table.rows), table.title
        assert not [cell for row in table.rows for cell in row if re.search(r"\bnan\b", cell)], table.head
    assert all(isinstance(chart, Chart) and chart.title and chart.caption for chart in charts)
    keys = [chart.key for chart in charts]
    assert len(set(keys)) == len(keys)


def test_no_section_of_the_page_is_empty(presentation: Presentation[Any]) -> None:
    assert not [section.title for section in presentation.page().sections if section.is_empty]


def test_a_result_says_what_its_presentation_says(case: str, presentation: Presentation[Any]) -> None:
    of = result(case)
    if not isinstance(of, Result):
        assert isinstance(of, pd.DataFrame | pd.Series | xr.Dataset | xr.DataArray)
        return
    assert of.title == presentation.title
    assert presentation.sentence.endswith(of.sentence), "the one of a verdict begins with its word there"
    assert set(of.notes) <= set(presentation.notes)
    assert [table.head for table in of.tables()] == [table.head for table in presentation.tables()]
    assert [chart.key for chart in of.charts()] == [chart.key for chart in presentation.charts()]
    assert isinstance(of.data, xr.Dataset)
    assert len(repr(of)) < 200 + len(of.sentence), "a few words, not every number of it"


def test_a_folder_holds_page_summary_numbers_and_figures(presentation: Presentation[Any], folder: Path) -> None:
    names = {path.name for path in folder.iterdir()}
    assert {"report.html", "summary.json", "results.nc", "figures"} <= names
    text = (folder / "report.html").read_text(encoding="utf-8")
    page = Tags(text)
    for said in (presentation.title, presentation.sentence):
        assert " ".join(said.split())[-40:] in " ".join(page.words.replace("\u2060", "").split())
    assert page.open == []
    assert "alert(1)" not in page.scripts, "a name is run"
    addresses = [value for name, value in page.attributes if name in ("src", "href")]
    assert all(address.startswith(("#", "data:")) for address in addresses)
    assert "default-src 'none'" in text
    assert not re.search(r">\s*nan\b", text)
    keys = {chart.key for chart in presentation.charts()}
    assert keys <= {path.stem for path in (folder / "figures").glob("*.svg")}
    for figure in (folder / "figures").glob("*.svg"):
        ElementTree.parse(figure)
        assert not re.search(r"\bnan\b", figure.read_text(encoding="utf-8"))
    if keys:
        assert set(gr.figures(folder)) == keys


def test_the_summary_is_json_and_names_format_and_kind(presentation: Presentation[Any], folder: Path) -> None:
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert (summary["format"], summary["result"]) == ("gearrattle summary 1", presentation.kind)
    assert summary["title"] == presentation.title
    assert [name for name, value in summary.items() if value == summary["sentence"]] == ["sentence"]
    assert summary["notes"] == list(presentation.notes)
    assert set(summary) > {"format", "result", "title", "sentence", "notes", "versions", "created"}, "it says nothing"


def test_numbers_are_saved_and_read_again(case: str, presentation: Presentation[Any], tmp_path: Path) -> None:
    data = presentation.data()
    assert data.sizes or data.data_vars
    assert not [name for name, variable in data.variables.items() if np.iscomplexobj(variable.values)]
    gr.save(result(case), tmp_path / "numbers.nc")
    with xr.open_dataset(tmp_path / "numbers.nc", engine="h5netcdf") as opened:
        assert str(opened.attrs["format"]).startswith("gearrattle ")
        assert set(opened.variables) >= set(data.variables), "the file of a run holds its events too"
        assert dict(opened.sizes) == dict(data.sizes)
        assert set(data.attrs) <= set(opened.attrs)
        for name, variable in data.variables.items():
            assert opened[name].dims == variable.dims
            assert opened[name].attrs.get("units") == variable.attrs.get("units")
            np.testing.assert_array_equal(opened[name].values, variable.values, err_msg=str(name))
    gr.save(result(case), tmp_path / "numbers.csv")
    table = pd.read_csv(tmp_path / "numbers.csv", low_memory=False, comment="#")
    assert len(table) > 0 or case in WITHOUT_ROWS
    assert sorted(path.name for path in tmp_path.iterdir()) == ["numbers.csv", "numbers.nc"]


@pytest.mark.parametrize("kind", EXAMPLES)
def test_every_kind_has_figures_for_print(kind: str) -> None:
    if kind in WITHOUT_FIGURES:
        with pytest.raises(gr.ModelError, match="has no figures"):
            gr.figures(result(kind))
        return
    assert list(gr.figures(result(kind))) == [chart.key for chart in presentation_of(result(kind)).charts()]


@pytest.mark.long
@pytest.mark.parametrize("kind", [kind for kind in EXAMPLES if kind not in WITHOUT_FIGURES])
def test_figures_of_every_kind_are_drawn_for_print(kind: str) -> None:
    figures = gr.figures(result(kind), width="single")
    assert [figures[key].get_size_inches()[0] for key in figures] == pytest.approx([85.0 / 25.4] * len(figures))


def test_a_notebook_shows_it_without_script_or_style_sheet(case: str) -> None:
    view = view_of(case)
    tags = Tags(view)
    assert tags.names <= {"div", "p", "b", "table", "thead", "tbody", "tr", "th", "td", "img", "ul", "li"}
    assert not [name for name, _ in tags.attributes if name.startswith("on")]
    assert not [value for name, value in tags.attributes if name == "style" and re.search(r"(?<!-)color:", value)]
    assert len(view) < 250_000
    assert " ".join(presentation_of(result(case)).sentence.split())[:60] in " ".join(tags.words.split())


def view_of(case: str) -> str:
    from gearrattle.report.notebook_view import notebook_view

    view = notebook_view(result(case))
    if isinstance(result(case), Result):
        assert result(case)._repr_html_() == view
    return view


@pytest.mark.parametrize("kind", [kind for kind in EXAMPLES if presentation_class(kind).is_data])
def test_saved_data_is_the_result_again(kind: str, tmp_path: Path) -> None:
    """The file alone gives sentence, tables, notes and figures of the page."""
    gr.save(result(kind), tmp_path / "saved.nc")
    with xr.open_dataset(tmp_path / "saved.nc", engine="h5netcdf") as opened:
        again, presentation = presentation_of(opened.load()), presentation_of(result(kind))
    assert again.sentence == presentation.sentence
    assert again.answer() == presentation.answer()
    assert again.notes == presentation.notes
    assert [chart.key for chart in again.charts()] == [chart.key for chart in presentation.charts()]
    if again.charts():
        assert list(gr.figures(tmp_path / "saved.nc")) == [chart.key for chart in again.charts()]


@pytest.mark.long
@pytest.mark.browser
@pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine")
def test_the_page_opens_in_a_browser_without_a_complaint(
    presentation: Presentation[Any], folder: Path, tmp_path: Path
) -> None:
    """A forbidden address, a style that the page's policy refuses or a failing script would be told on the console."""
    done = browse(folder / "report.html", tmp_path / "profile", "--dump-dom")
    assert [line for line in done.stderr.splitlines() if "CONSOLE" in line] == []
    assert html.escape(presentation.title.split()[0], quote=False) in done.stdout


def test_arrays_without_elements_and_truth_values_are_saved(tmp_path: Path) -> None:
    truth = ("case", [True, False])
    arrays = Arrays({"value": ("row", []), "text": ("row", texts(())), "truth": truth}, {}, {"of": "clutch"})
    write_netcdf(arrays, tmp_path / "numbers.nc", "modes")
    with xr.open_dataset(tmp_path / "numbers.nc", engine="h5netcdf") as opened:
        assert dict(opened.sizes) == {"row": 0, "case": 2}
        assert opened["truth"].dtype == bool
        assert opened["truth"].values.tolist() == [True, False]
        assert opened.attrs["of"] == "clutch"


@pytest.mark.parametrize("width", [80, 120])
def test_words_of_a_table_are_wrapped_to_the_width_of_a_terminal(width: int) -> None:
    why = "The paper prints neither its loads nor its tolerances, " * 4
    rows = (row("natural frequencies", "4 %", "9 %", "differs", why),)
    presentation = presentation_of(Reproduction((Section("a", "A", "Done.", rows),), quick=True, seconds=1.0))
    wide, wrapped = plain_text(presentation), plain_text(presentation, width)
    assert max(map(len, wide.splitlines())) > 200
    assert max(map(len, wrapped.splitlines())) <= width
    assert wrapped.split() == wide.split(), "the item stands on the first line of its reason"


def test_what_is_no_result_is_refused(tmp_path: Path) -> None:
    for wrong in (3, "case3", {"a": 1}, pd.DataFrame({"a": [1]}), model()):
        with pytest.raises(gr.ModelError, match="is no result of gearrattle"):
            gr.save(wrong, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["out.svg", "out.html", "out.json", "out.mat"])
def test_an_ending_of_another_kind_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(gr.ModelError, match=r"or a file that ends in \.nc, \.csv, \.pdf, \.pptx or \.xlsx"):
        gr.save(gr.modes(model()), tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_folder_of_somebody_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(gr.ModelError, match="holds no page of gearrattle"):
        gr.modes(model()).save(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
