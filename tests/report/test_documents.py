"""Results as documents: PDF, slides, Excel tables; and everything of one in a zip."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.cli import main
from gearrattle.errors import ModelError, NotInstalled
from gearrattle.report.documents import document_of, page_as_pdf
from gearrattle.report.documents.workbook import _number
from gearrattle.report.presentation import FIGURE_ENDINGS, ONE_FIGURE_ENDINGS, RESULT_ENDINGS
from gearrattle.report.result_kinds import PRESENTATIONS, presentation_class, presentation_of
from tests.architecture.places import EXAMPLES

openpyxl = pytest.importorskip("openpyxl")
pptx = pytest.importorskip("pptx")
CASE = EXAMPLES / "paper" / "case3.toml"


@pytest.fixture(scope="module")
def run() -> gr.Run:
    return gr.simulate(gr.load(CASE), cycles=4, discard=2, samples_per_cycle=64)


def sheets(path: Path) -> dict[str, list[tuple[object, ...]]]:
    """Return the rows of every sheet by its name."""
    book = openpyxl.load_workbook(path)
    return {sheet.title: [tuple(row) for row in sheet.iter_rows(values_only=True)] for sheet in book}


def slide_texts(path: Path) -> list[str]:
    """Return all words of every slide, those of tables too."""
    texts = []
    for slide in pptx.Presentation(str(path)).slides:
        words = [shape.text_frame.text for shape in slide.shapes if shape.has_text_frame]
        tables = [shape.table for shape in slide.shapes if shape.has_table]
        words += [cell.text for table in tables for row in table.rows for cell in row.cells]
        texts.append("\n".join(words))
    return texts


def test_every_kind_is_saved_as_documents() -> None:
    """Where a result is one figure, its PDF is the figure, as before."""
    for kind in PRESENTATIONS:
        endings = presentation_class(kind).endings
        assert set(RESULT_ENDINGS) <= set(endings)
        assert document_of(".xlsx", endings) is not None
        is_one_figure = set(FIGURE_ENDINGS) <= set(endings)
        assert (document_of(".pdf", endings) is None) == is_one_figure
    assert document_of(".pdf", ONE_FIGURE_ENDINGS) is None
    assert document_of(".nc", RESULT_ENDINGS) is None


def test_a_workbook_has_the_tables_of_the_page_and_the_numbers(tmp_path: Path) -> None:
    modes = gr.modes(gr.load(CASE))
    path = gr.save(modes, tmp_path / "modes.xlsx")
    book = sheets(path)
    summary = "\n".join(str(row[0]) for row in book["Summary"] if row)
    assert modes.sentence in summary
    titles = list(book)
    assert titles[0] == "Summary"
    assert titles[-1] == "Numbers"
    shown = [table for table in presentation_of(modes).answer() if table.rows]
    rows = book[titles[1]]
    assert [str(cell or "") for cell in rows[0]] == list(shown[0].head)
    flat = [cell for row in book["Numbers"] for cell in row if isinstance(cell, int | float)]
    for frequency in modes.data["frequency"].values:
        assert np.isclose(flat, frequency, rtol=1e-15, atol=0.0).any()


def test_the_numbers_of_a_long_run_are_left_to_other_files(run: gr.Run, tmp_path: Path) -> None:
    longer = gr.simulate(run.model, cycles=60, discard=2, samples_per_cycle=128)
    book = sheets(gr.save(longer, tmp_path / "run.xlsx"))
    assert "Numbers" not in book
    assert any("save it as .nc or .csv" in str(row[0]) for row in book["Summary"] if row)


@pytest.mark.parametrize(
    ("cell", "value"),
    [("23.2", 23.2), ("−0.5", -0.5), ("1.09 × 10⁵", 1.09e5), ("1.5 × 10⁻⁴", 1.5e-4), ("12 345", 12345.0)],
)
def test_numerals_become_numbers(cell: str, value: float) -> None:
    assert _number(cell) == value


@pytest.mark.parametrize("cell", ["4613 ± 320", "–", "189 mm/s", "=1+1", "1.5.2", ""])
def test_other_texts_stay_texts(cell: str) -> None:
    assert _number(cell) == cell


def test_a_text_is_no_formula(tmp_path: Path) -> None:
    """A name of a model may begin with =."""
    text = CASE.read_text(encoding="utf-8").replace('name = "Padmanabhan', 'name = "=1+1 Padmanabhan', 1)
    path = gr.save(gr.modes(gr.loads(text)), tmp_path / "modes.xlsx")
    cell = openpyxl.load_workbook(path)["Summary"]["A1"]
    assert str(cell.value).startswith("=1+1")
    assert cell.data_type == "s"


def test_slides_have_answer_and_figures(run: gr.Run, tmp_path: Path) -> None:
    verdict = gr.criteria(run)
    path = gr.save(verdict, tmp_path / "verdict.pptx")
    texts = slide_texts(path)
    assert verdict.sentence.splitlines()[0] in texts[0]
    assert "gear" in "\n".join(texts)
    charts = presentation_of(verdict).charts()
    pictures = [
        shape for slide in pptx.Presentation(str(path)).slides for shape in slide.shapes if shape.shape_type == 13
    ]
    assert len(pictures) == len(charts)


def test_a_long_table_is_parted_over_slides(tmp_path: Path) -> None:
    rows = "".join(f'[[inertia]]\nname = "b{k}"\nJ = 1.0\n' for k in range(40))
    shafts = "".join(
        f'[[coupling]]\nname = "s{k}"\nbetween = ["b{k}", "b{k + 1}"]\nstiffness = "1 kN*m/rad"\n' for k in range(39)
    )
    model = gr.loads(f'schema = 1\n{rows}{shafts}[excitation]\nspeed = "100 rad/s"\n')
    texts = slide_texts(gr.save(gr.modes(model), tmp_path / "modes.pptx"))
    assert any("(2 of 3)" in text for text in texts)


@pytest.mark.browser
@pytest.mark.slow
def test_a_browser_prints_the_page(tmp_path: Path) -> None:
    if page_as_pdf.browser() is None:
        pytest.skip("no browser")
    path = gr.save(gr.modes(gr.load(CASE)), tmp_path / "modes.pdf")
    content = path.read_bytes()
    assert content[:5] == b"%PDF-"
    assert b"Chromium" in content or b"Skia" in content or b"Chrome" in content


def test_without_a_browser_matplotlib_sets_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(page_as_pdf.BROWSER, str(tmp_path / "none"))
    modes = gr.modes(gr.load(CASE))
    content = gr.save(modes, tmp_path / "modes.pdf").read_bytes()
    assert content[:5] == b"%PDF-"
    assert content.count(b"/Type /Page ") + content.count(b"/Type /Page\n") == 1 + len(modes.charts())


def test_a_browser_that_fails_is_no_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "browser"
    program.write_text("#!/bin/sh\nexit 3\n")
    program.chmod(0o755)
    monkeypatch.setenv(page_as_pdf.BROWSER, str(program))
    assert gr.save(gr.modes(gr.load(CASE)), tmp_path / "modes.pdf").read_bytes()[:5] == b"%PDF-"


@pytest.mark.parametrize(("suffix", "library"), [(".xlsx", "openpyxl"), (".pptx", "pptx"), (".pptx", "matplotlib")])
def test_what_is_missing_is_named_before_anything_is_computed(
    suffix: str, library: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(NotInstalled, match=r'pip install "gearrattle\[(office|figures)\]"'):
        gr.save(gr.modes(gr.load(CASE)), tmp_path / f"modes{suffix}")
    assert main(["modes", str(CASE), "-o", str(tmp_path / f"modes{suffix}")]) == 2
    assert "pip install" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_run_is_shared_and_repeated_from_what_is_shared(run: gr.Run, tmp_path: Path) -> None:
    path = gr.share(run, tmp_path / "case.zip")
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        archive.extractall(tmp_path)
    assert {f"case/{name}" for name in ("report.html", "results.nc", "model.toml", "repeat.py", "README.txt")} <= names
    folder = tmp_path / "case"
    assert gr.load(folder / "model.toml") == gr.open_run(folder / "results.nc").model
    words = [sys.executable, "repeat.py"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=True, env={**os.environ})
    assert "angle: equal to the last bit" in done.stdout
    assert "velocity: equal to the last bit" in done.stdout


def test_a_folder_is_shared_as_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By the command; a link in it is left out, and only regular files go with it."""
    gr.modes(gr.load(CASE)).save(tmp_path / "modes")
    (tmp_path / "secret").write_text("secret")
    (tmp_path / "modes" / "link").symlink_to(tmp_path / "secret")
    assert main(["share", str(tmp_path / "modes"), "-o", str(tmp_path / "m.zip"), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == {"output": str(tmp_path / "m.zip"), "bytes": (tmp_path / "m.zip").stat().st_size}
    with zipfile.ZipFile(tmp_path / "m.zip") as archive:
        assert archive.read("m/report.html") == (tmp_path / "modes" / "report.html").read_bytes()
        assert "m/link" not in archive.namelist()


def test_what_cannot_be_shared_is_refused(tmp_path: Path) -> None:
    modes = gr.modes(gr.load(CASE))
    folder = modes.save(tmp_path / "modes").parent
    with pytest.raises(ModelError, match=r"must end in \.zip, \.pdf, \.pptx or \.xlsx"):
        gr.share(modes, tmp_path / "x.doc")
    with pytest.raises(ModelError, match="holds too little to make this file of it"):
        gr.share(folder, tmp_path / "x.pptx")
    with pytest.raises(ModelError, match=r"holds no report\.html"):
        gr.share(tmp_path, tmp_path / "x.zip")
    with pytest.raises(ModelError, match="no such file"):
        gr.share(tmp_path / "none.nc", tmp_path / "x.zip")
    with pytest.raises(ModelError, match="is no result"):
        gr.share(3.0, tmp_path / "x.zip")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["modes"]
