"""Figures of studies: words and units on every axis, no path of the model file, room for all words at 85 mm."""

from __future__ import annotations

import re
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.report.plots.axis_names import labels_of, measure_of, positions, title_of
from gearrattle.report.plots.basins_figure import basin_map
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.screening_figure import STEPS, bounds_of
from gearrattle.report.plots.typeset import Style, matplotlib_figure
from gearrattle.report.plots.typeset.overlap_removal import shown_words
from gearrattle.report.result_charts import charts_of
from gearrattle.report.study_pages import page_of
from tests.report.plots.test_typeset import words_of

EXAMPLES = Path(__file__).parents[3] / "examples"
SHORT = {"simulation.cycles": 12, "simulation.discard": 6, "simulation.samples_per_cycle": 32}
PATH = re.compile(r"\b(inertia|coupling|mesh|torque|excitation|simulation|deflection|rate)\.[A-Za-z0-9_]+")
GAP = "mesh.gear.backlash"
SPEED = "excitation.speed"
INERTIA = "inertia.output_gear.J"


def _studies() -> dict[str, xr.Dataset]:
    model = gr.load(EXAMPLES / "paper" / "case1.toml")
    gap = {"from": "0.02 mm", "to": "0.2 mm", "count": 6, "spacing": "log"}
    loads = {"torque.0.harmonics.0.amplitude": [50.0, 100.0, 200.0], "inertia.output_gear.drag_torque": [1.0, 2.0, 4.0]}
    vary = {
        GAP: {"distribution": "uniform", "from": 0.5e-4, "to": 1.5e-4},
        INERTIA: {"distribution": "normal", "mean": 1.5e-3, "deviation": 3e-5},
    }
    outputs = ["regime", "impacts per cycle", "contact share"]
    oscillator = gr.load(EXAMPLES / "rattle_oscillator.toml")
    over = {
        "deflection.flanks": {"from": -0.3, "to": 0.3, "count": 5},
        "rate.flanks": {"from": -1.0, "to": 1.0, "count": 5},
    }
    return {
        "map": gr.study(model, {GAP: gap, "load": loads}, outputs, fixed=SHORT),
        "speeds": gr.study(model, {SPEED: {"from": "600 rpm", "to": "2400 rpm", "count": 5}}, outputs, fixed=SHORT),
        "scatter": gr.study(model, None, outputs, vary=vary, samples=8, method="sobol", fixed=SHORT),
        "saltelli": gr.study(model, None, outputs, vary=vary, samples=4, method="saltelli", fixed=SHORT),
        "ends": gr.study(model, None, outputs, vary=vary, method="one-at-a-time", fixed=SHORT),
        "basins": gr.basins(oscillator, over, cycles=60, discard=40, workers=1),
        "bifurcation": gr.bifurcation(
            oscillator, "torque.0.harmonics.0.amplitude", [1.0, 3.0, 5.0], cycles=40, discard=20, workers=1
        ),
    }


@pytest.fixture(scope="module")
def studies() -> dict[str, xr.Dataset]:
    return _studies()


def _words(chart: Chart) -> list[str]:
    actual = [chart.title, chart.caption, *(key.name for key in chart.legend)]
    for panel in chart.panels:
        actual += [panel.title, panel.unit, panel.x_title, *(word for _, word in (*panel.x_ticks, *panel.y_ticks))]
        actual += [label.words for label in panel.labels]
    return actual


@pytest.mark.slow
def test_no_figure_sentence_or_table_shows_a_path_of_the_model_file(studies: dict[str, xr.Dataset]) -> None:
    for name, data in studies.items():
        page = page_of(data)
        said = [word for chart in charts_of(data) for word in _words(chart)]
        said += [page.summary(data), page.setting(data)]
        tables = [page.counts(data), *page.answer(data)]
        tables += [table for section in page.sections(data, {}) for table in section.tables]
        said += [
            cell for table in tables for row in (table.head, *table.rows) for cell in (*row, table.title, table.note)
        ]
        assert len(said) > 20
        assert [word for word in said if PATH.search(str(word))] == [], name


@pytest.mark.slow
def test_axes_say_words_and_a_unit_that_suits_the_values(studies: dict[str, xr.Dataset]) -> None:
    data = studies["map"]
    assert title_of(data, GAP) == "backlash of mesh gear [µm]"
    assert title_of(data, "load") == "load: drag torque of output_gear [N m]"
    assert labels_of(data, GAP)[0] == "20"
    assert labels_of(data, GAP)[-1] == "200"
    speeds = studies["speeds"]
    assert title_of(speeds, SPEED) == "speed [rpm]"
    assert positions(speeds, SPEED)[0] == pytest.approx(np.linspace(600.0, 2400.0, 5))
    assert measure_of(studies["scatter"], INERTIA).title == "moment of inertia of output_gear [kg m²]"
    assert measure_of(studies["basins"], "initial.rate.flanks").title == "initial rate of flanks"


def test_maps_that_can_disagree_say_which_to_believe(studies: dict[str, xr.Dataset]) -> None:
    captions = {chart.key: chart.caption for chart in charts_of(studies["map"])}
    assert "believe this one on whether a part rattles" in captions["map"]
    alone = studies["map"][["regime", "outcome"]]
    assert "believe" not in next(chart.caption for chart in charts_of(alone) if chart.key == "map")


def test_labels_of_neighbouring_values_differ() -> None:
    values = [1000.0, 1000.4, 1000.8]
    data = xr.Dataset(coords={GAP: (GAP, values, {"long_name": "backlash", "units": ""})})
    assert labels_of(data, GAP) == ["1000", "1000.4", "1000.8"]


@pytest.mark.parametrize(
    ("width", "names"),
    [(85.0, {"map", "ends"}), *(pytest.param(width, None, marks=pytest.mark.long) for width in (85.0, 175.0))],
)
def test_words_of_study_figures_stand_apart_in_print(
    studies: dict[str, xr.Dataset], width: float, names: set[str] | None
) -> None:
    for name in names or set(studies):
        for chart in charts_of(studies[name]):
            figure = matplotlib_figure(chart, Style(width))
            figure.draw_without_rendering()
            pixel = figure.dpi / 72.0
            boxes = [(text.get_text(), text.get_window_extent()) for text in words_of(figure)]
            for words, box in boxes:
                assert box.x0 >= -0.5, (name, chart.key, words)
                assert box.x1 <= figure.bbox.x1 + 0.5, (name, chart.key, words)
            for (first, a), (second, b) in combinations(boxes, 2):
                together = a.padded(-0.4 * pixel).overlaps(b.padded(-0.4 * pixel))
                assert not together, f"{name}, {chart.key}: {first!r} on {second!r}"
            for axes in figure.axes:
                ticks = sorted((text.get_window_extent() for text in shown_words(axes.xaxis)), key=lambda box: box.x0)
                gaps = [second.x0 - first.x1 for first, second in pairwise(ticks)]
                assert min(gaps, default=9.0 * pixel) > 3.5 * pixel, f"{name}, {chart.key}: ticks touch"


def test_attractors_lie_within_the_map_of_their_basins(studies: dict[str, xr.Dataset]) -> None:
    (panel,) = basin_map(studies["basins"]).panels
    rings = [line for line in panel.lines if line.name == "attractors"]
    assert rings
    outside = 0
    for line in rings:
        assert panel.x_range is not None
        assert panel.y_range is not None
        assert np.all((line.x > panel.x_range[0]) & (line.x < panel.x_range[1]))
        assert np.all((line.y > panel.y_range[0]) & (line.y < panel.y_range[1]))
        outside += int(np.count_nonzero(np.abs(line.x) > 0.375))
    assert outside, "all attractors lie within the grid: this test shows nothing"


@pytest.mark.parametrize("largest", [0.4, 2.0, 7.0, 17.9, 45.0, 119.0])
@pytest.mark.parametrize("least", [0.0, -1.0, -41.0])
def test_shades_of_a_screening_reach_the_margins_on_either_side(largest: float, least: float) -> None:
    bounds = bounds_of(np.array([[least, largest, np.inf, np.nan]]))
    for reach, (step, twice) in ((largest, bounds[3:]), (-least, (-bounds[1], -bounds[0]))):
        assert twice == 2.0 * step
        assert reach <= 3.0 * step
        assert step == STEPS[0] or reach > 3.0 * STEPS[STEPS.index(step) - 1]
    assert bounds[2] == 0.0
