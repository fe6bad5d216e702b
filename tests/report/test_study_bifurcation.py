"""The page of a bifurcation diagram: it says and tabulates what the Dataset holds, and draws every point once."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from gearrattle.report.plots.bifurcation_figure import diagram
from gearrattle.report.study_pages import page_of
from gearrattle.report.study_pages.bifurcation_page import charts, coexistence_table, stretch_table, summary_of
from tests.report.examples import bifurcation
from tests.studies.oscillator import AMPLITUDE


@pytest.fixture(scope="module")
def data() -> xr.Dataset:
    return bifurcation()


def test_the_summary_says_what_the_sweeps_found(data: xr.Dataset) -> None:
    reported = summary_of(data)
    assert "Going up: quiet, period 1 T from 1 to 5.5; double-sided, period 1 T at 7." in reported
    assert "Two motions coexist from 2.5 to 5.5." in reported


def test_the_tables_say_the_same(data: xr.Dataset) -> None:
    rows = stretch_table(data).rows
    assert rows[0] == ("up", "1", "5.5", "4", "periodic", "1", "quiet")
    assert sum(int(row[3]) for row in rows if row[0] == "down") == 5
    assert coexistence_table(data).rows == (("all", "2.5", "5.5"),)


def test_every_point_of_an_orbit_is_drawn_once(data: xr.Dataset) -> None:
    chart = diagram(data)
    up = chart.panels[0].lines[0]
    assert up.x.tolist() == data[AMPLITUDE].values.tolist()
    np.testing.assert_array_equal(up.y, data["deflection.flanks"].isel(direction=0, cycle=-1))
    (band,) = chart.panels[0].bands
    assert (band.low, band.high) == (1.75, 6.25)
    assert [key.name for key in chart.legend] == [
        "going up",
        "going down",
        "two motions",
        "quiet",
        "single-sided",
        "double-sided",
    ]


def test_further_axes_have_a_figure_each(data: xr.Dataset) -> None:
    more = xr.concat([data, data], "inertia.gear.drag").assign_coords({"inertia.gear.drag": [0.5, 0.6]})
    more = more.transpose("direction", "inertia.gear.drag", AMPLITUDE, ...)
    more["motions"] = more["motions"].transpose("inertia.gear.drag", AMPLITUDE)
    assert [chart.key for chart in charts(more)] == ["bifurcation-1", "bifurcation-2"]
    assert len(coexistence_table(more).rows) == 2


def test_the_counts_are_of_each_sweep(data: xr.Dataset) -> None:
    assert page_of(data).counts(data).rows == (("up", "5", "0", "0"), ("down", "5", "0", "0"))
