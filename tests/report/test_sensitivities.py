"""Figures and tables of designed samples show what was computed, and are drawn for the designs they are of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.report.plots.convergence import probability_convergence
from gearrattle.report.plots.scatter import histograms, probability_bars, tornado
from gearrattle.report.plots.sensitivities import sobol_bars, swing_bars
from gearrattle.report.sensitivity_tables import sensitivity_tables
from gearrattle.report.study import StudyReport
from gearrattle.report.study_pages.grid import charts, summary_of
from gearrattle.studies.designs import DESIGNS

CODES = {"flag_values": [0, 1, 2], "flag_meanings": "quiet single-sided double-sided"}


def made(method: str, count: int = 64, axis: bool = False) -> xr.Dataset:
    """A study of two values; the level is 3 a + b of them, the gear rattles where a is above a half."""
    shares = DESIGNS[method].shares(2, count, 3)
    points = np.where(np.isnan(shares), 0.25, shares)
    level = points @ [3.0, 1.0]
    data = xr.Dataset(
        {
            "regime": (("sample", "part"), (points[:, :1] > 0.5).astype(np.int8), CODES),
            "level": ("sample", level, {"units": "N s"}),
            "outcome": ("sample", np.ones(len(points), dtype=np.int8)),
        },
        {"b.J": ("sample", points[:, 0]), "a.J": ("sample", points[:, 1]), "part": ["gear"]},
        {"sampling": method, "sampled": ["b.J", "a.J"]},
    )
    return data.expand_dims(gap=[1.0, 2.0]) if axis else data


def bars(panel: object, name: str) -> np.ndarray:
    return next(c.right - c.left for c in panel.cells if c.name == name)  # type: ignore[attr-defined]


@pytest.mark.parametrize("method", ["saltelli", "saltelli-pairs"])
def test_bars_of_indices_are_as_long_as_the_indices(method: str) -> None:
    data = made(method)
    chart, found = sobol_bars(data), gr.sensitivities(data, "level")
    assert chart is not None
    panel = next(panel for panel in chart.panels if panel.title == "level")
    assert [label.words for label in panel.labels] == ["b.J", "a.J"]
    np.testing.assert_allclose(bars(panel, "total_order"), found["total_order"].values)
    assert found["total_order"].values == pytest.approx([0.9, 0.1], abs=0.05)
    titles = [table.title for table in sensitivity_tables(data)]
    assert ("level, pairs" in titles) == (method == "saltelli-pairs")
    assert (tornado(data), swing_bars(data)) == (None, None)


def test_bars_of_single_values_reach_from_one_end_to_the_other() -> None:
    data = made("one-at-a-time")
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
    data = made("sobol", 200)
    chart = probability_convergence(data)
    assert chart is not None
    (panel,) = chart.panels
    assert float(panel.lines[2].y[-1]) == float(gr.rattle_probability(data)["probability"][0])
    assert panel.x_range == (1.0, 200.0)
    assert probability_convergence(made("sobol", 4)) is None
    quiet = data.assign(regime=data["regime"] * 0).assign_attrs(data.attrs)
    quiet["regime"].attrs = CODES
    assert probability_convergence(quiet) is None


@pytest.mark.parametrize("method", ["saltelli", "saltelli-pairs", "one-at-a-time"])
@pytest.mark.parametrize("axis", [False, True])
def test_a_page_of_every_design(method: str, axis: bool, tmp_path: Path) -> None:
    data = made(method, 8, axis)
    StudyReport(data, {}, title="designs").fill(tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert method in page
    assert charts(data)
    assert "median" not in page or method != "one-at-a-time"
    for path in (tmp_path / "figures").glob("*.svg"):
        assert b"nan" not in path.read_bytes()
