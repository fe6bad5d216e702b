"""Maps of spectra over speed: no line is lost, shades mean what the legend says, both renderers draw the same."""

from __future__ import annotations

import json
import struct
import zlib
from base64 import b64decode
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.pipeline import Findings
from gearrattle.pipeline import run as pipeline
from gearrattle.recording import Channel, Recording
from gearrattle.report.browser import widgets
from gearrattle.report.plots.chart import Chart, Heat, Panel
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.plots.order_maps import (
    SPAN,
    coherence_chart,
    cuts_chart,
    levels,
    map_chart,
    scale_keys,
)
from gearrattle.report.plots.palette import SHADES, shade
from gearrattle.report.plots.raster import largest_along
from gearrattle.report.plots.run_figures import charts
from gearrattle.report.plots.svg_charts import draw

EXAMPLES = Path(__file__).parents[3] / "examples"
RATE = 4000.0
TIME = np.arange(80_000) / RATE
SPEED = 2.0 * np.pi * (10.0 + 1.5 * TIME)
ANGLE = 2.0 * np.pi * (10.0 * TIME + 0.75 * TIME**2)
SVG = "{http://www.w3.org/2000/svg}"


@cache
def record() -> Recording:
    wave = 3.0 * np.sin(2.0 * ANGLE) + 0.01 * np.random.default_rng(1).standard_normal(TIME.size)
    channels = (
        Channel("a", "acceleration", "hub", "rad/s^2", wave),
        Channel("n", "speed", "", "rad/s", SPEED),
    )
    return Recording(TIME, channels, "rig")


@cache
def found() -> Findings:
    return pipeline(gr.load(EXAMPLES / "run_up.toml"), cycles=16)


def picture(svg: bytes) -> tuple[np.ndarray, list[str], list[str]]:
    """Read the only picture of a drawing: codes with the first row on top, colours, chunk names."""
    (image,) = ElementTree.fromstring(svg).iter(f"{SVG}image")
    data = b64decode(image.get("href", "").split(",", 1)[1])
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, chunks = 8, {}
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind, content = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        assert zlib.crc32(kind + content) == struct.unpack(">I", data[at + 8 + length : at + 12 + length])[0]
        chunks[kind.decode()] = content
        at += 12 + length
    width, height = struct.unpack(">II", chunks["IHDR"][:8])
    rows = np.frombuffer(zlib.decompress(chunks["IDAT"]), np.uint8).reshape(height, width + 1)
    assert not rows[:, 0].any()
    colours = ["#" + chunks["PLTE"][k : k + 3].hex() for k in range(0, len(chunks["PLTE"]), 3)]
    return rows[:, 1:], colours, list(chunks)


def test_a_map_is_drawn_alike_by_both_renderers() -> None:
    values = np.array([[0.0, 10.0, 20.0], [np.nan, 40.0, -5.0]])
    chart = Chart("k", "t", "c", (Panel("p", heat=Heat((0.0, 3.0), (0.0, 2.0), values, 0.0, 40.0, "dB")),))
    codes, colours, chunks = picture(draw(chart))
    assert chunks == ["IHDR", "PLTE", "tRNS", "IDAT", "IEND"]
    assert codes.tolist() == [[0, 255, 1], [1, 65, 128]]  # upside down; empty, highest, lowest
    assert colours[codes[0, 1]] == SHADES[-1]
    heat = chart_json(chart)["panels"][0]["heat"]
    packed = np.frombuffer(b64decode(heat["values"]["f4"]), "<f4").reshape(heat["values"]["shape"])
    assert np.array_equal(packed, values.astype(np.float32), equal_nan=True)
    assert (heat["x_range"], heat["y_range"], heat["low"], heat["high"]) == ([0.0, 3.0], [0.0, 2.0], 0.0, 40.0)
    assert json.dumps(SHADES) in (widgets.FOLDER / "plot.js").read_text(encoding="utf-8")
    json.dumps(chart_json(chart), allow_nan=False)


def test_shades_get_ever_lighter() -> None:
    parts = [[int(shade(s)[k : k + 2], 16) / 255.0 for k in (1, 3, 5)] for s in np.linspace(0.0, 1.0, 50).tolist()]
    linear = np.where(np.array(parts) <= 0.04045, np.array(parts) / 12.92, ((np.array(parts) + 0.055) / 1.055) ** 2.4)
    assert np.all(np.diff(linear @ [0.2126, 0.7152, 0.0722]) > 0.0)


def test_gathering_keeps_the_largest_and_invents_nothing() -> None:
    values = np.array([[1.0], [5.0], [2.0], [7.0]])
    gathered = largest_along(values, np.array([0.1, 0.2, 0.9, 1.4]), np.linspace(0.0, 1.5, 4))
    assert gathered[:, 0].tolist() == [5.0, 2.0, 7.0]
    wide = largest_along(values[:2], np.array([0.0, 2.0]), np.linspace(-1.0, 6.0, 8))
    assert wide[:4, 0].tolist() == [1.0, 1.0, 5.0, 5.0]
    assert np.isnan(wide[4:, 0]).all()


def test_a_line_one_bin_wide_stays_in_a_coarse_map() -> None:
    data = gr.spectral.waterfall(record(), "a", resolution="0.5 Hz", overlap=0.9)
    assert data.shape[1] > 3000
    chart = map_chart(data, orders=[2.0], natural=[2.0 * np.pi * 100.0])
    (panel,) = chart.panels
    assert panel.heat is not None
    ridge = levels(data.values, squared=False).max(axis=1)
    assert np.nanmax(panel.heat.values, axis=0).min() >= ridge.min() - 1e-9
    assert panel.heat.values.shape[0] <= 160
    assert (panel.unit, panel.x_title) == ("Hz", "speed, rpm")
    dark, light = (line for line in panel.lines if line.name == "order 2")
    assert light.x[[0, -1]] == pytest.approx(panel.heat.x_range)
    for line in (dark, light):
        assert line.y == pytest.approx(2.0 * line.x / 60.0)
    assert {label.words for label in panel.labels} == {"order 2", "f1"}
    assert chart.legend[-1].name.endswith("dB re 1 rad/s²")
    ElementTree.fromstring(draw(chart, legend=True))


def test_natural_frequencies_fall_over_a_map_of_orders() -> None:
    """o = omega_r / Omega at every speed of the axis; an order of the excitation is a tick that hides no ridge."""
    data = gr.spectral.order_map(record(), "a", highest=10.0)
    amplitude = data.amplitude.assign_attrs(data.attrs)
    omega = 2.0 * np.pi * 60.0
    chart = map_chart(amplitude, orders=[2.0, 40.0], natural=[omega])
    (panel,) = chart.panels
    falling = next(line for line in panel.lines if line.name == "natural frequency 1")
    shown = np.isfinite(falling.y)
    assert falling.y[shown] == pytest.approx(omega * 30.0 / np.pi / falling.x[shown])
    assert falling.y[shown].max() < 10.0
    left, right = panel.heat.x_range
    tick = next(line for line in panel.lines if line.name == "order 2")
    assert tick.x[1] - tick.x[0] <= 0.02 * (right - left) * (1.0 + 1e-9)
    assert tick.y.tolist() == [2.0, 2.0]
    assert {label.words for label in panel.labels} == {"order 2", "f1"}
    assert "falling lines: natural frequencies" in chart.caption
    json.dumps(chart_json(chart), allow_nan=False)
    ElementTree.fromstring(draw(chart))


def test_over_time_lines_follow_the_speed_of_each_row() -> None:
    """A speed that rises and falls again has no axis of its own; orders and natural frequencies go with it."""
    speed = 2.0 * np.pi * (20.0 + 10.0 * np.sin(2.0 * np.pi * TIME / 20.0))
    wave = np.sin(2.0 * np.cumsum(speed) / RATE)
    rig = Recording(TIME, (Channel("a", "", "", "1", wave), Channel("n", "speed", "", "rad/s", speed)), "rig")
    spectra = gr.spectral.waterfall(rig, "a", resolution="1 Hz")
    (panel,) = map_chart(spectra, orders=[2.0], natural=[2.0 * np.pi * 100.0]).panels
    assert panel.x_title == "time, s"
    order = next(line for line in panel.lines if line.name == "order 2")
    assert order.x == pytest.approx(spectra.time.values)
    assert order.y == pytest.approx(2.0 * spectra.speed.values / (2.0 * np.pi))
    at = np.abs(spectra.frequency.values[spectra.values.argmax(axis=1)] - order.y)
    assert at.max() < 2.0  # the ridge of the map itself
    mapped = gr.spectral.order_map(rig, "a", highest=10.0)
    (panel,) = map_chart(mapped.amplitude.assign_attrs(mapped.attrs), natural=[2.0 * np.pi * 90.0]).panels
    falling = next(line for line in panel.lines if line.name == "natural frequency 1")
    shown = np.isfinite(falling.y)
    assert falling.y[shown] == pytest.approx(2.0 * np.pi * 90.0 / mapped.speed.values[shown])


def test_the_ends_of_the_shades_are_what_the_legend_says() -> None:
    data = gr.spectral.order_map(record(), "a", highest=10.0).amplitude
    data.attrs |= {"channel": "a", "source": "rig"}
    (panel,) = map_chart(data).panels
    heat = panel.heat
    assert heat is not None
    assert heat.high == 10.0  # 3 rad/s^2 are 9.5 dB
    assert heat.high - heat.low == SPAN
    keys = scale_keys(heat.high, heat.name)
    assert [key.colour for key in keys] == [shade(share) for share in np.linspace(0.0, 1.0, 7).tolist()]
    assert keys[0].name == "≤ −50"


def test_cuts_and_coherence_are_drawn() -> None:
    cuts = cuts_chart(gr.spectral.order_cuts(record(), "a", [2.0, 3.0]))
    two, three = cuts.panels[0].lines
    assert two.y == pytest.approx(3.0, abs=0.01)
    assert three.y.max() < 0.02
    coherent = coherence_chart(gr.spectral.coherence(record(), "a", "n", resolution="20 Hz"))
    low, high, value, chance = coherent.panels[0].lines
    assert chance.y[0] == chance.y[1] > 0.0
    assert np.nanmax(low.y) <= 1.0
    assert np.nanmax(high.y) <= 1.0
    assert value.name == "coherence"
    for chart in (cuts, coherent):
        ElementTree.fromstring(draw(chart))
        json.dumps(chart_json(chart), allow_nan=False)


def test_the_report_of_a_run_up_has_its_maps_with_orders_and_natural_frequencies() -> None:
    drawn = {chart.key: chart for chart in charts(found())}
    spectra, orders = drawn["run_up_spectra"], drawn["run_up_orders"]
    assert spectra.group == orders.group == "run_up"
    assert [panel.title for panel in spectra.panels] == list(found().motion.trajectory.layout.inertia_names)
    names = {line.name for line in spectra.panels[1].lines}
    assert {"order 2", "order 4", "natural frequency 1"} <= names
    assert "order 40 reaches 2000 Hz" in spectra.caption
    assert "order 21, 40" in orders.caption
    for chart in (spectra, orders):
        json.dumps(chart_json(chart), allow_nan=False)
        ElementTree.fromstring(draw(chart))
