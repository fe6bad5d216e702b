"""Densities and transfer functions: what is drawn is what the Dataset holds, and nothing where nothing is known."""

from __future__ import annotations

import json
from functools import cache
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr

import gearrattle as gr
from gearrattle.recording import Channel, Recording
from gearrattle.report.plots.density_figures import cross_chart, density_chart, response_chart, spectra_charts
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.plots.svg_charts import draw

RATE = 1000.0


@cache
def found() -> xr.Dataset:
    rng = np.random.default_rng(2)
    x = rng.standard_normal(20_000)
    below = np.convolve(x, np.ones(8) / 8.0, mode="same")  # nothing is left at 125 Hz and its multiples
    channels = (
        Channel("x", "", "", "1", x),
        Channel("y", "acceleration", "hub", "rad/s^2", below + 0.05 * rng.standard_normal(x.size)),
    )
    return gr.spectra(Recording(np.arange(x.size) / RATE, channels, "rig"), "y", "x", resolution="5 Hz")


def test_a_density_stands_between_its_limits() -> None:
    data = found()
    low, high, middle = density_chart(data).panels[0].lines
    assert middle.x == pytest.approx(data.frequency.values[1:])
    assert middle.y == pytest.approx(data.psd.values[1:])
    assert low.y == pytest.approx(data.psd_low.values[1:])
    assert high.y == pytest.approx(data.psd_high.values[1:])
    (panel,) = density_chart(data, "reference").panels
    assert panel.unit == "1/Hz"
    assert panel.y_log


def test_no_phase_is_drawn_where_nothing_is_known_of_it() -> None:
    """At 125 Hz and its multiples the answer is noise."""
    data = found()
    phase = response_chart(data).panels[1].lines[-1]
    known = data.response_phase_limit.values[1:] < np.pi
    assert 0 < np.count_nonzero(~known) < known.size
    assert np.isnan(phase.y[~known]).all()
    assert phase.y[known] == pytest.approx(np.degrees(data.response_phase.values[1:][known]))
    assert not known[np.searchsorted(data.frequency.values[1:], 125.0)]


def test_a_cross_density_is_the_product_of_response_and_cause() -> None:
    data = found()
    size, phase = cross_chart(data).panels
    (line,) = size.lines
    expected = data.response_magnitude.values[1:] * data.reference_psd.values[1:]
    assert line.y == pytest.approx(expected, rel=1e-9)
    assert size.unit == "(rad/s²)·(N m)/Hz" or "·" in size.unit
    theirs = response_chart(data).panels[1]
    for mine, other in zip(phase.lines, theirs.lines, strict=True):
        assert np.array_equal(mine.y, other.y, equal_nan=True)


def test_natural_frequencies_are_marked_where_the_density_reaches() -> None:
    charts = spectra_charts(found(), natural=[2.0 * np.pi * 80.0, 2.0 * np.pi * 900.0])
    assert [chart.key for chart in charts] == ["psd", "reference_psd", "cross", "response", "coherence"]
    assert [(rule.at, rule.label) for rule in charts[0].panels[0].rules] == [(pytest.approx(80.0), "f1")]
    assert "natural frequencies" in charts[0].caption
    assert charts[0].panels[0].x_title == "frequency, Hz"
    for chart in charts:
        ElementTree.fromstring(draw(chart, legend=True))
        json.dumps(chart_json(chart), allow_nan=False)
    single = found()[["psd", "psd_low", "psd_high"]]
    single.attrs = {key: value for key, value in found().attrs.items() if not key.startswith("reference")}
    assert [chart.key for chart in spectra_charts(single)] == ["psd"]
