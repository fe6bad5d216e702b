"""The page of a study: it says what the Dataset holds, for grids and samples of every kind."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.report.plots.sample_figures import probability_bars, tornado
from gearrattle.report.plots.study_maps import code_map, code_maps, number_maps, probability_map
from gearrattle.report.plots.study_sweep_figures import output_sweep, probability_sweep
from gearrattle.report.study_pages.grid_page import charts, summary_of
from gearrattle.report.study_tables import count_table
from tests.report.examples import study_over


def area(panel: Any, name: str) -> float:
    return sum(float(np.sum((c.right - c.left) * (c.high - c.low))) for c in panel.cells if c.name == name)


def test_a_map_has_a_cell_for_every_case_of_its_colour() -> None:
    data = study_over("gap", "load", failed=1)
    chart = code_map(data, "regime")
    assert chart is not None
    assert [panel.title for panel in chart.panels] == ["joint", "gear <1>"]
    for panel in chart.panels:
        codes = data["regime"].sel(part=panel.title).values
        for code, word in enumerate(("quiet", "single-sided", "double-sided")):
            assert area(panel, word) == pytest.approx(np.count_nonzero(codes == code))
        assert area(panel, "no value") == pytest.approx(1.0)
    assert [len(panel.lines) for panel in chart.panels] == [1, 0]  # no boundary where all is quiet
    (edge,) = chart.panels[0].lines
    quiet = data["regime"].sel(part="joint").values
    changes = sum(
        int(np.count_nonzero((a > 0) != (b > 0)) - np.count_nonzero(((a > 0) != (b > 0)) & ((a < 0) | (b < 0))))
        for a, b in ((quiet[1:], quiet[:-1]), (quiet[:, 1:], quiet[:, :-1]))
    )
    assert np.count_nonzero(np.isnan(edge.x)) == changes > 0


def with_severity(data: xr.Dataset) -> xr.Dataset:
    """The same study with the severity kept as well, by the same codes: single-sided cases touch."""
    flags = {**data["regime"].attrs, "flag_meanings": "quiet touches rattles"}
    return data.assign(severity=data["regime"].assign_attrs(flags))


def test_a_map_of_severity_separates_what_rattles_from_touches_and_the_regime_has_one_of_its_own() -> None:
    data = with_severity(study_over("gap", "load"))
    by_severity, by_regime = code_maps(data)
    assert (by_severity.key, by_regime.key) == ("map", "map-regime")
    codes = data["severity"].sel(part="joint").values
    for code, word in enumerate(("quiet", "touches", "rattles")):
        assert area(by_severity.panels[0], word) == np.count_nonzero(codes == code)
    edges = {chart.key: chart.panels[0].lines[0] for chart in (by_severity, by_regime)}
    for key, lowest in (("map", 2), ("map-regime", 1)):
        rattles = codes >= lowest
        changes = np.count_nonzero(rattles[1:] != rattles[:-1]) + np.count_nonzero(rattles[:, 1:] != rattles[:, :-1])
        assert np.count_nonzero(np.isnan(edges[key].x)) == changes


def test_touches_are_no_rattle_in_probabilities_and_sentences() -> None:
    samples = with_severity(study_over("sample"))
    codes = samples["severity"].sel(part="joint").values
    assert gr.studies.rattle_probability(samples)["rattling"].sel(part="joint") == np.count_nonzero(codes == 2)
    assert gr.studies.rattle_probability(samples, "regime")["rattling"].sel(part="joint") == np.count_nonzero(codes > 0)
    grid = with_severity(study_over("gap", "load"))
    counts = [int(np.count_nonzero(grid["severity"].sel(part="joint") == code)) for code in range(3)]
    said = f"joint is quiet in {counts[0]}, touches in {counts[1]} and rattles in {counts[2]} of 12 cases."
    assert said in summary_of(grid)
    assert count_table(grid).head == ("part", "quiet", "touches", "rattles", "single-sided", "double-sided")
    assert count_table(grid).rows[0] == ("joint", *map(str, counts), *map(str, counts[1:]))


def test_more_than_two_axes_show_the_largest_over_the_others() -> None:
    data = study_over("gap", "load", "drag")
    chart = code_map(data, "regime")
    assert chart is not None
    assert "largest over drag" in chart.caption
    largest = data["regime"].sel(part="joint").max("drag").values
    assert area(chart.panels[0], "double-sided") == np.count_nonzero(largest == 2)


def test_units_that_differ_are_not_drawn_on_one_scale() -> None:
    grid = number_maps(study_over("gap", "load"), "largest impulse")
    assert [[panel.title for panel in chart.panels] for chart in grid] == [["joint"], ["gear <1>"]]
    assert ["N m s" in chart.caption for chart in grid] == [True, False]
    assert len({chart.key for chart in grid}) == 2
    sweep = output_sweep(study_over("gap"))
    assert sweep is not None
    assert [(panel.title, panel.unit) for panel in sweep.panels] == [
        ("Largest impulse", "N m s"),
        ("Largest impulse", "N s"),
    ]


def test_a_part_that_one_shade_of_another_would_hide_has_a_scale_of_its_own() -> None:
    data = study_over("gap", "load")
    data["largest impulse"].attrs["units"] = "N s"
    data["largest impulse"].values[..., 1] *= 2.0  # 8 to 10, beside 0 to 10
    both = number_maps(data, "largest impulse")
    assert [[panel.title for panel in chart.panels] for chart in both] == [["joint", "gear <1>"]]
    data["largest impulse"].values[..., 1] *= 0.1  # 0.8 to 1
    apart = number_maps(data, "largest impulse")
    assert [[panel.title for panel in chart.panels] for chart in apart] == [["joint"], ["gear <1>"]]
    assert [chart.title.partition(": ")[2] for chart in apart] == ["joint", "gear <1>"]
    assert [len({cells.name for cells in chart.panels[0].cells}) > 1 for chart in apart] == [True, True]
    assert len({chart.key for chart in apart}) == 2


def test_an_output_that_hardly_varies_is_no_map() -> None:
    data = study_over("gap", "load")
    data["largest impulse"].values[..., 1] = 5.0 + 0.004 * data["largest impulse"].values[..., 1]
    assert [chart.panels[0].title for chart in number_maps(data, "largest impulse")] == ["joint"]


def test_figures_of_samples_show_what_was_computed() -> None:
    data = study_over("sample")
    bars, winds = probability_bars(data), tornado(data)
    assert bars is not None
    assert winds is not None
    shares = bars.panels[0].cells[0]
    assert shares.right.tolist() == pytest.approx([float(np.mean(data["regime"].sel(part="joint").values > 0)), 0.0])
    assert [panel.title for panel in winds.panels] == [
        "joint: regime",
        "joint: largest impulse",
        "gear <1>: largest impulse",
    ]
    rising, falling = winds.panels[1], winds.panels[2]
    assert [label.words for label in rising.labels][:2] == ["a.J", "b.J"]
    assert float(rising.cells[0].right.max()) == pytest.approx(1.0, abs=1e-6)
    assert float(falling.cells[1].left.min()) == pytest.approx(-1.0, abs=1e-6)


def test_figures_are_drawn_for_the_studies_they_are_of() -> None:
    assert probability_map(study_over("gap", "load")) is None
    assert probability_map(study_over("gap", "load", "sample")) is not None
    assert code_map(study_over("gap", "sample"), "regime") is None
    assert probability_sweep(study_over("gap", "sample")) is not None
    assert probability_sweep(study_over("gap")) is None
    assert tornado(study_over("gap", "sample")) is None
    assert charts(study_over("gap").drop_vars(["regime", "largest impulse"])) == []


def test_the_summary_counts_and_names_what_decides() -> None:
    data = study_over("gap", "load")
    counts = [int(np.count_nonzero(data["regime"].sel(part="joint") == code)) for code in range(3)]
    assert f"joint is quiet in {counts[0]}, single-sided in {counts[1]} and double-sided in {counts[2]} of 12" in (
        summary_of(data)
    )
    assert "gear <1> is quiet in all 12 cases" in summary_of(data)
    said = summary_of(study_over("sample"))
    assert "it follows a.J most (rank correlation 0.9" in said
    assert "gear <1> rattles in 0 % of samples (95 % interval 0 to 5 %)." in said
    missing = study_over("gap")
    missing["outcome"][:2] = 0
    assert "2 are not computed yet" in summary_of(missing)
