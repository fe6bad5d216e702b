"""``gr.figures``: what has figures, what they show, and files of them."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.figure import Figure

import gearrattle as gr
from gearrattle.report import result_charts
from gearrattle.report.plots.run_figures import charts
from gearrattle.report.result_charts import charts_of
from tests import synthetic
from tests.report.plots.test_typeset import (
    test_figure_has_the_chart_s_panels_labels_and_limits as panels_and_limits,
)
from tests.report.plots.test_typeset import (
    test_lines_bars_and_maps_are_the_chart_s_data as data_of,
)
from tests.report.plots.test_typeset import (
    test_words_stand_apart_and_on_the_paper as words_apart,
)

EXAMPLES = Path(__file__).parents[2] / "examples"
SHORT = {"cycles": 12, "discard": 4, "samples_per_cycle": 128}


@pytest.fixture(scope="module")
def run() -> gr.Run:
    return gr.simulate(gr.load(EXAMPLES / "paper" / "case3.toml"), **SHORT)


@pytest.fixture(scope="module")
def run_up() -> gr.Run:
    return gr.simulate(gr.load(EXAMPLES / "run_up.toml"))


MAPS = ("run_up_orders",)
"""Charts of a run-up that no made-up motion has; the smallest of them."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("example", "width", "keys"),
    [
        ("run_up.toml", "single", MAPS),
        *(
            pytest.param(example, width, None, marks=pytest.mark.long)
            for example in ("paper/case3.toml", "manual_transmission.toml", "run_up.toml")
            for width in ("single", "double")
        ),
    ],
)
def test_figures_of_examples_keep_the_laws(
    example: str, width: str, keys: tuple[str, ...] | None, request: pytest.FixtureRequest
) -> None:
    ready = {"paper/case3.toml": "run", "run_up.toml": "run_up"}
    motion = (
        request.getfixturevalue(ready[example])
        if example in ready
        else gr.simulate(gr.load(EXAMPLES / example), **SHORT)
    )
    actual = gr.figures(motion, width=width)
    assert len(actual) >= 10
    wanted = [chart for chart in charts_of(motion) if keys is None or chart.key in keys]
    assert len(wanted) == len(actual if keys is None else keys)
    for chart in wanted:
        entry = chart, actual[chart.key]
        panels_and_limits(entry)
        data_of(entry)
        words_apart(entry)


@pytest.mark.slow
def test_every_noun_with_a_page_has_figures(run: gr.Run, run_up: gr.Run) -> None:
    model, hub = run.model, "acceleration.hub"
    loop = gr.identification.fit_loop(
        EXAMPLES / "measured" / "damper_loop.csv", name="damper", between=("flywheel", "hub")
    )
    study = gr.study(model, {"excitation.speed": [80.0, 90.0]}, ["regime", "impacts per cycle"], workers=1)
    nouns: dict[str, tuple[Any, list[str]]] = {
        "spectra": (
            gr.spectra(run, hub, "acceleration.flywheel"),
            ["psd", "reference_psd", "cross", "response", "coherence"],
        ),
        "screen": (gr.screen(model, ["800 rpm", "900 rpm"]), ["screening", "screening_separation"]),
        "campbell": (gr.campbell(model), ["campbell"]),
        "order_map": (gr.spectral.order_map(run_up, hub), ["order_map"]),
        "order_cuts": (gr.spectral.order_cuts(run_up, hub, [2, 4]), ["order_cuts"]),
        "waterfall": (gr.spectral.waterfall(run_up, hub), ["waterfall"]),
        "fit_loop": (loop, ["loop"]),
        "study": (study, [chart.key for chart in charts_of(study)]),
    }
    for name, (noun, keys) in nouns.items():
        assert list(gr.figures(noun)) == keys, name
        assert keys, name


def test_a_dimensionless_campbell_diagram_names_no_units() -> None:
    actual = gr.campbell(gr.load(EXAMPLES / "rattle_oscillator.toml"))
    assert actual.units == "dimensionless"
    assert charts_of(actual)[0].panels[0].unit == ""


def test_a_folder_gives_the_figures_of_its_page(tmp_path: Path) -> None:
    findings = synthetic.findings("double-sided")
    findings.save(tmp_path / "out")
    figures = gr.figures(tmp_path / "out")
    of_folder, of_file = charts_of(tmp_path / "out"), charts_of(tmp_path / "out" / "figures" / result_charts.CHARTS)
    assert list(figures) == [chart.key for chart in charts(findings)]
    for chart, again in zip(of_folder, of_file, strict=True):
        assert chart.key == again.key
        for panel, other in zip(chart.panels, again.panels, strict=True):
            for line, same in zip(panel.lines, other.lines, strict=True):
                assert np.array_equal(line.y, same.y, equal_nan=True)
    data_of((of_folder[0], figures[of_folder[0].key]))


def test_a_saved_motion_gives_the_figures_of_the_run(run: gr.Run, tmp_path: Path) -> None:
    run.save(tmp_path / "run.nc")
    opened, direct = charts_of(tmp_path / "run.nc"), charts_of(run)
    assert [chart.key for chart in opened] == [chart.key for chart in direct]
    assert np.array_equal(opened[0].panels[0].lines[0].y, direct[0].panels[0].lines[0].y)


def test_figures_are_matplotlib_s_and_may_be_changed(run: gr.Run, tmp_path: Path) -> None:
    before = plt.get_fignums()
    actual = gr.figures(run, width="85 mm")
    figure = actual["deflection"]
    assert isinstance(figure, Figure)
    assert plt.get_fignums() == before
    assert figure.get_figwidth() * 25.4 == pytest.approx(85.0)
    figure.axes[0].set_title("mine", loc="left")
    figure.axes[0].set_xlim(9.0, 9.5)
    actual.save(tmp_path, "svg", only=["deflection"])
    kept = gr.figures(run, width="85 mm")
    kept.save(tmp_path / "theirs", "svg", only=["deflection"])
    assert actual["deflection"] is figure
    assert (tmp_path / "deflection.svg").read_bytes() != (tmp_path / "theirs" / "deflection.svg").read_bytes()


@pytest.mark.slow
def test_files_are_written_whole_and_again_the_same(run: gr.Run, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    actual = gr.figures(run, width="single")
    files = actual.save(tmp_path, ["pdf", "png"], only=["force", "spectrum"])
    assert [file.name for file in files] == ["force.pdf", "force.png", "spectrum.pdf", "spectrum.png"]
    assert {path.name for path in tmp_path.iterdir()} == {"mine.txt", *(file.name for file in files)}
    again = gr.figures(run, width="single").save(tmp_path / "again", ["pdf", "png"], only=["spectrum", "force"])
    for file, other in zip(files, again, strict=True):
        assert file.read_bytes() == other.read_bytes()
    assert actual.captions["force"].encode() in files[0].read_bytes().replace(b"\\", b"")


def test_what_is_wrong_is_refused_and_nothing_written(run: gr.Run, tmp_path: Path) -> None:
    actual = gr.figures(run)
    for wrong in ({"formats": "docx"}, {"dpi": 7.0}, {"only": ["nope"]}):
        with pytest.raises(gr.ModelError):
            actual.save(tmp_path / "out", **wrong)  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()
    for refused, reported in (
        (3, "int"),
        (SimpleNamespace(dims=("a",)), "is no result"),
        (tmp_path, "charts.npz"),
        (tmp_path / "none", "does not exist"),
        (tmp_path / "none.npz", "does not exist"),
    ):
        with pytest.raises(gr.ModelError, match=reported):
            gr.figures(refused)
    (tmp_path / "text.nc").write_text("no netCDF")
    with pytest.raises(gr.ModelError, match=r"text\.nc"):
        gr.figures(tmp_path / "text.nc")
    with pytest.raises(gr.ModelError, match="width"):
        gr.figures(run, width="85 kg")
