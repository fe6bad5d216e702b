"""Figures and tables of designed samples show what was computed, and are drawn for the designs they are of."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.report.plots.convergence import probability_convergence
from gearrattle.report.plots.sample_figures import histograms, probability_bars, tornado
from gearrattle.report.plots.sensitivities import sobol_bars, swing_bars
from gearrattle.report.sensitivity_tables import sensitivity_tables
from gearrattle.report.study_pages.grid_page import summary_of
from tests.report.examples import CODES, designed


def bars(panel: object, name: str) -> np.ndarray:
    return next(c.right - c.left for c in panel.cells if c.name == name)  # type: ignore[attr-defined]


@pytest.mark.parametrize("method", ["saltelli", "saltelli-pairs"])
def test_bars_of_indices_are_as_long_as_the_indices(method: str) -> None:
    data = designed(method)
    chart, actual = sobol_bars(data), gr.studies.sensitivities(data, "level")
    assert chart is not None
    panel = next(panel for panel in chart.panels if panel.title == "level")
    assert [label.words for label in panel.labels] == ["b.J", "a.J"]
    np.testing.assert_allclose(bars(panel, "total_order"), actual["total_order"].values)
    assert actual["total_order"].values == pytest.approx([0.9, 0.1], abs=0.05)
    titles = [table.title for table in sensitivity_tables(data)]
    assert ("level, pairs" in titles) == (method == "saltelli-pairs")
    assert (tornado(data), swing_bars(data)) == (None, None)


def test_bars_of_single_values_reach_from_one_end_to_the_other() -> None:
    data = designed("one-at-a-time")
    chart = swing_bars(data)
    assert chart is not None
    panel = next(panel for panel in chart.panels if panel.title == "level")
    assert panel.rules[0].at == pytest.approx(1.0)
    assert bars(panel, "low") == pytest.approx([0.75, 0.25])
    assert bars(panel, "high") == pytest.approx([2.25, 0.75])
    (_, table) = sensitivity_tables(data)
    assert table.rows[0][:4] == ("b.J", "0", "0.25", "1")
    for figure in (sobol_bars, tornado, histograms, probability_bars, probability_convergence):
        assert figure(data) is None
    assert "gear is quiet in 4 and single-sided in 1 of 5 cases" in summary_of(data)


def test_the_running_share_ends_at_the_probability() -> None:
    data = designed("sobol", 200)
    chart = probability_convergence(data)
    assert chart is not None
    (panel,) = chart.panels
    assert float(panel.lines[2].y[-1]) == float(gr.studies.rattle_probability(data)["probability"][0])
    assert panel.x_range == (1.0, 200.0)
    assert probability_convergence(designed("sobol", 4)) is None
    quiet = data.assign(regime=data["regime"] * 0).assign_attrs(data.attrs)
    quiet["regime"].attrs = CODES
    assert probability_convergence(quiet) is None
