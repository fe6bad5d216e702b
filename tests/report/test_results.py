"""What every result can do, whatever its kind: words, tables, figures, files, a view for notebooks."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.report.kinds import PRESENTATIONS, kind_of, presentation_class, presentation_of
from gearrattle.report.numbers import Arrays, write_netcdf
from gearrattle.report.plots.chart import Chart
from gearrattle.report.records import texts
from gearrattle.report.tables import Table
from gearrattle.report.text import plain_text
from gearrattle.reproduction.record import Reproduction, Section, row
from tests.browser import BROWSER, browse
from tests.measured.identification.test_loop import ANGLE
from tests.measured.test_gas_torque import engine
from tests.measured.validation import made
from tests.measured.validation.test_run_ups import MODEL as RUN_UP
from tests.measured.validation.test_run_ups import record


@cache
def model() -> gr.Model:
    return gr.example("case3")


@cache
def motion() -> gr.Run:
    return gr.simulate(model(), cycles=20, samples_per_cycle=64)


EXAMPLES: dict[str, Callable[[], Any]] = {
    "run": lambda: gr.run(model(), cycles=20, samples_per_cycle=64),
    "motion": motion,
    "verdict": lambda: gr.criteria(motion()),
    "modes": lambda: gr.modes(model()),
    "Campbell diagram": lambda: gr.campbell(model()),
    "comparison": lambda: gr.compare(model(), ["rk4"], cycles=4, samples_per_cycle=32),
    "validation": lambda: gr.validate(made.run(), made.record(gain=1.1)),
    "validation of a run-up": lambda: gr.validate_run_up(gr.simulate(gr.loads(RUN_UP), audit=False), record(1.1)),
    "reproduction": lambda: Reproduction(
        (Section("table-5", "Table 5", "What was done.", (row("sigma", "4 %", "3.9 %", "reproduced", share=3.9),)),),
        quick=True,
        seconds=1.0,
    ),
    "reduction": lambda: gr.reduce(gr.example("eight_dof"), "75 Hz", keep=["clutch", "spline", "mesh_34"]),
    "condensation": lambda: gr.condense(gr.example("eight_dof"), "75 Hz"),
    "scaling": lambda: gr.nondimensionalize(model()),
    "fit": lambda: gr.fit(
        model(),
        {"mode": [{"number": 2, "frequency": "350 rad/s"}, {"number": 3, "frequency": "8000 rad/s"}]},
        ["coupling.clutch.stiffness"],
        starts=1,
    ),
    "stiffness": lambda: gr.stiffness(model()),
    "equilibrium": lambda: gr.equilibrium(model()),
    "advice": lambda: gr.advise(model(), cycles=20),
    "torque over angle": lambda: gr.torque_angle(model(), "clutch"),
    "gas torque": lambda: gr.gas_torque(**engine(1), speed="1500 rpm"),
    "contents": lambda: gr.look(Path(__file__).parents[2] / "examples" / "measured" / "flywheel_speed.csv"),
    "sound": lambda: gr.listen(motion()),
    "loop fit": lambda: gr.fit_loop((ANGLE, 100.0 * ANGLE), stages=1),
    "study": lambda: gr.study(short(), {"torque.0.mean": [10.0, 400.0]}, workers=1),
    "sensitivities": lambda: gr.sensitivities(samples("saltelli"), "crossings per cycle"),
    "rattle probability": lambda: gr.rattle_probability(samples("sobol")),
    "regime boundary": lambda: gr.regime_boundary(result("study")),
    "screening": lambda: gr.screen(model(), [100.0, 150.0, 200.0]),
    "spectra": lambda: gr.spectra(motion(), CHANNEL, "velocity.flywheel"),
    "density": lambda: gr.psd(motion(), CHANNEL),
    "cross density": lambda: gr.cross_psd(motion(), CHANNEL, "velocity.flywheel"),
    "coherence": lambda: gr.coherence(motion(), CHANNEL, "velocity.flywheel"),
    "order map": lambda: gr.order_map(motion(), CHANNEL, turns=2),
    "order cuts": lambda: gr.order_cuts(motion(), CHANNEL, [1.0, 2.0], turns=2),
    "waterfall": lambda: gr.waterfall(motion(), CHANNEL),
    "metrics": lambda: gr.metrics(motion()),
    "contact ratio": lambda: gr.contact_ratio(motion()),
}
"""The cheapest example of every kind."""

CHANNEL = "acceleration.hub"
WITHOUT_FIGURES = {"reproduction"}
"""Kinds whose example has no figure; a whole reproduction has."""


def short() -> gr.Model:
    return model().with_({"simulation.cycles": 20, "simulation.discard": 10})


def samples(method: str) -> xr.Dataset:
    scatter = {"torque.0.mean": {"distribution": "uniform", "from": 5.0, "to": 12.0}}
    return gr.study(
        short(), None, ["crossings per cycle", "verdict"], vary=scatter, samples=4, method=method, workers=1
    )


@cache
def result(kind: str) -> Any:
    return EXAMPLES[kind]()


class Tags(HTMLParser):
    """Collects what a page or a view is made of, and its words."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.names: set[str] = set()
        self.attributes: list[tuple[str, str]] = []
        self.words = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.names.add(tag)
        self.attributes += [(name, value or "") for name, value in attrs]

    def handle_data(self, data: str) -> None:
        self.words += data


@pytest.mark.parametrize("kind", PRESENTATIONS)
def test_every_kind_has_an_example_that_names_it(kind: str) -> None:
    assert kind_of(result(kind)) == kind


@pytest.mark.parametrize("kind", EXAMPLES)
def test_words_tables_and_figures(kind: str) -> None:
    presentation = presentation_of(result(kind))
    assert presentation.title
    assert presentation.sentence.rstrip()[-1] in ".!?", presentation.sentence
    assert presentation.sentence[0].strip()
    assert all(isinstance(note, str) and note for note in presentation.notes)
    tables, charts = presentation.tables(), presentation.charts()
    assert tables, "nothing is tabulated"
    for table in (*tables, *presentation.answer()):
        assert isinstance(table, Table)
        assert all(len(row) == len(table.head) for row in table.rows), table.title
    assert all(isinstance(chart, Chart) and chart.title and chart.caption for chart in charts)
    keys = [chart.key for chart in charts]
    assert len(set(keys)) == len(keys)


@pytest.mark.parametrize("kind", EXAMPLES)
def test_no_section_of_the_page_is_empty(kind: str) -> None:
    assert not [section.title for section in presentation_of(result(kind)).page().sections if section.is_empty]


@pytest.mark.parametrize("kind", EXAMPLES)
def test_a_result_says_what_its_presentation_says(kind: str) -> None:
    of, presentation = result(kind), presentation_of(result(kind))
    if not isinstance(of, gr.Result):
        assert isinstance(of, pd.DataFrame | pd.Series | xr.Dataset | xr.DataArray)
        return
    assert of.title == presentation.title
    assert presentation.sentence.endswith(of.sentence), "the one of a verdict begins with its word there"
    assert set(of.notes) <= set(presentation.notes)
    assert [table.head for table in of.tables()] == [table.head for table in presentation.tables()]
    assert [chart.key for chart in of.charts()] == [chart.key for chart in presentation.charts()]
    assert isinstance(of.data, xr.Dataset)


@pytest.mark.parametrize("kind", EXAMPLES)
def test_a_folder_holds_page_summary_numbers_and_figures(kind: str, tmp_path: Path) -> None:
    presentation, folder = presentation_of(result(kind)), tmp_path / "out"
    assert gr.save(result(kind), folder) == folder / "report.html"
    names = {path.name for path in folder.iterdir()}
    assert {"report.html", "summary.json", "results.nc", "figures"} <= names
    text = (folder / "report.html").read_text(encoding="utf-8")
    page = Tags(text)
    for said in (presentation.title, presentation.sentence):
        assert " ".join(said.split())[-60:] in " ".join(page.words.replace("\u2060", "").split())
    addresses = [value for name, value in page.attributes if name in ("src", "href")]
    assert all(address.startswith(("#", "data:")) for address in addresses)
    assert "default-src 'none'" in text
    assert not re.search(r">\s*nan\b", text)
    keys = {chart.key for chart in presentation.charts()}
    assert keys <= {path.stem for path in (folder / "figures").glob("*.svg")}
    if keys:
        assert set(gr.figures(folder)) == keys


@pytest.mark.parametrize("kind", EXAMPLES)
def test_the_summary_is_json_and_names_format_and_kind(kind: str, tmp_path: Path) -> None:
    presentation = presentation_of(result(kind))
    gr.save(presentation, tmp_path / "out")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text(encoding="utf-8"))
    assert (summary["format"], summary["result"]) == ("gearrattle summary 1", presentation.kind)
    assert summary["title"] == presentation.title
    assert "summary" not in summary, "the sentence has one name"
    assert summary["notes"] == list(presentation.notes)
    assert set(summary) > {"format", "result", "title", "sentence", "notes", "versions", "created"}, "it says nothing"


@pytest.mark.parametrize("kind", EXAMPLES)
def test_numbers_are_saved_and_read_again(kind: str, tmp_path: Path) -> None:
    data = presentation_of(result(kind)).data()
    assert data.sizes or data.data_vars
    assert not [name for name, variable in data.variables.items() if np.iscomplexobj(variable.values)]
    gr.save(result(kind), tmp_path / "numbers.nc")
    with xr.open_dataset(tmp_path / "numbers.nc", engine="h5netcdf") as opened:
        assert str(opened.attrs["format"]).startswith("gearrattle ")
        assert set(opened.variables) >= set(data.variables), "the file of a run holds its events too"
        assert dict(opened.sizes) == dict(data.sizes)
        assert set(data.attrs) <= set(opened.attrs)
        for name, variable in data.variables.items():
            assert opened[name].dims == variable.dims
            assert opened[name].attrs.get("units") == variable.attrs.get("units")
            np.testing.assert_array_equal(opened[name].values, variable.values, err_msg=str(name))
    gr.save(result(kind), tmp_path / "numbers.csv")
    table = pd.read_csv(tmp_path / "numbers.csv", low_memory=False, comment="#")
    assert len(table) > 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["numbers.csv", "numbers.nc"]


@pytest.mark.parametrize("kind", EXAMPLES)
def test_figures_are_drawn_for_print(kind: str) -> None:
    charts = presentation_of(result(kind)).charts()
    if kind in WITHOUT_FIGURES:
        with pytest.raises(gr.ModelError, match="has no figures"):
            gr.figures(result(kind))
        return
    figures = gr.figures(result(kind), width="single")
    assert list(figures) == [chart.key for chart in charts]
    for key in list(figures)[:1]:
        assert figures[key].get_size_inches()[0] == pytest.approx(85.0 / 25.4)


@pytest.mark.parametrize("kind", EXAMPLES)
def test_a_notebook_shows_it_without_script_or_style_sheet(kind: str) -> None:
    view = view_of(kind)
    tags = Tags(view)
    assert tags.names <= {"div", "p", "b", "table", "thead", "tbody", "tr", "th", "td", "img", "ul", "li"}
    assert not [name for name, _ in tags.attributes if name.startswith("on")]
    assert not [value for name, value in tags.attributes if name == "style" and re.search(r"(?<!-)color:", value)]
    assert len(view) < 250_000
    assert " ".join(presentation_of(result(kind)).sentence.split())[:60] in " ".join(tags.words.split())


def view_of(kind: str) -> str:
    from gearrattle.report.notebook import notebook_view

    view = notebook_view(result(kind))
    if isinstance(result(kind), gr.Result):
        assert result(kind)._repr_html_() == view
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
@pytest.mark.parametrize("kind", EXAMPLES)
def test_the_page_opens_in_a_browser_without_a_complaint(kind: str, tmp_path: Path) -> None:
    """A forbidden address, a style that the page's policy refuses or a failing script would be told on the console."""
    done = browse(gr.save(result(kind), tmp_path / "out"), tmp_path / "profile", "--dump-dom")
    assert [line for line in done.stderr.splitlines() if "CONSOLE" in line] == []
    assert presentation_of(result(kind)).title.split()[0] in done.stdout


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


@pytest.mark.parametrize("name", ["out.pdf", "out.html", "out.json", "out.xlsx"])
def test_an_ending_of_another_kind_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(gr.ModelError, match=r"must be a folder, or a file that ends in \.nc or \.csv"):
        gr.save(gr.modes(model()), tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_folder_of_somebody_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(gr.ModelError, match="holds no page of gearrattle"):
        gr.modes(model()).save(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
