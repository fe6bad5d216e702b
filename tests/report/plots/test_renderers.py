"""Every renderer draws the same chart, faithfully."""

from __future__ import annotations

import json
import re
from base64 import b64decode
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.colors import to_hex

from gearrattle.report.plots.chart import Band, Bars, Cells, Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.plots.palette import NO_VALUE, PAPER
from gearrattle.report.plots.shapes import background
from gearrattle.report.plots.study_maps import NOTHING, cells_of
from gearrattle.report.plots.svg_charts import _hatching, draw
from gearrattle.report.plots.typeset import matplotlib_figure

TIME = np.linspace(0.0, 4.0, 401)
WAVE = np.sin(TIME)
UNEVEN = np.array([0.0, 0.5, 3.0, 4.0])
BROKEN = np.array([1.0, np.nan, 2.0, 3.0])
CHART = Chart(
    "key",
    "Title <&>",
    'Caption with "quotes" & <tags>',
    (
        Panel(
            "first",
            "mm",
            "cycles",
            (Line(TIME, WAVE, "wave"), Line(UNEVEN, BROKEN, "broken", mark="points")),
            bands=(Band(0.5, None, "#0072b2"), Band(1.0, 2.0, "#d55e00", along="x")),
            rules=(Rule(0.5, label="corner"), Rule(1.5, along="x", dashed=False)),
            y_range=(-1.5, 3.5),
        ),
        Panel(
            "second", x_title="speed", bars=(Bars(np.array([0.0, 1.0, 3.0]), np.array([4.0, 0.0]), "count"),), note="n"
        ),
        Panel("third", lines=(Line(TIME, np.exp(-TIME), "decay"),), y_log=True, y_range=(1e-3, 1.0)),
    ),
    columns=2,
    share_x=False,
)


def decoded(packed: dict[str, Any]) -> np.ndarray:
    if "count" in packed:
        return packed["first"] + packed["step"] * np.arange(packed["count"])
    (kind,) = packed.keys() & {"f4", "f8"}
    return np.frombuffer(b64decode(packed[kind]), dtype=f"<{kind}").reshape(packed["shape"])


def test_data_for_a_browser_hold_the_chart() -> None:
    first, second, third = json.loads(json.dumps(chart_json(CHART), allow_nan=False))["panels"]
    wave, broken = first["lines"]
    assert np.array_equal(decoded(wave["y"]), WAVE.astype(np.float32))
    assert np.allclose(decoded(wave["x"]), TIME, rtol=0.0, atol=1e-12)
    assert wave["x"]["count"] == TIME.size
    assert np.array_equal(decoded(broken["x"]), UNEVEN)
    assert np.array_equal(decoded(broken["y"]), BROKEN.astype(np.float32), equal_nan=True)
    assert broken["mark"] == "points"
    assert np.array_equal(decoded(second["bars"][0]["heights"]), [4.0, 0.0])
    (raised, upright) = first["bands"]
    assert (raised["low"], raised["high"], raised["along"]) == (0.5, None, "y")
    assert (upright["low"], upright["high"], upright["along"]) == (1.0, 2.0, "x")
    assert [rule["dashed"] for rule in first["rules"]] == [True, False]
    assert (third["y_log"], third["y_range"]) == (True, [1e-3, 1.0])


@pytest.mark.parametrize("values", [[], [1.0], [1.0, np.nan, 3.0], [1e9, 1e9 + 1e-3, 1e9 + 5e-3]])
def test_what_is_not_equally_spaced_travels_as_it_is(values: list[float]) -> None:
    line = Line(np.array(values), np.zeros(len(values)), "line")
    (panel,) = chart_json(Chart("k", "t", "c", (Panel("p", lines=(line,)),)))["panels"]
    assert np.array_equal(decoded(panel["lines"][0]["x"]), values, equal_nan=True)


def test_ink_is_well_formed_and_the_same_every_time() -> None:
    svg = draw(CHART)
    assert svg == draw(CHART)
    root = ElementTree.fromstring(svg)
    words = ["".join(text.itertext()) for text in root.iter("{http://www.w3.org/2000/svg}text")]
    assert "first mm" in words
    assert {"second", "third", "cycles", "speed", "corner", "n", "0.001"} <= set(words)
    assert root.findtext("{http://www.w3.org/2000/svg}title") == "Title <&>"
    assert root.findtext("{http://www.w3.org/2000/svg}desc") == 'Caption with "quotes" & <tags>'
    assert b"nan" not in svg


def test_ink_draws_the_curve_and_lifts_the_pen() -> None:
    svg = draw(CHART).decode()
    paths = [p.get("d", "") for p in ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}path")]
    wave = next(p for p in paths if p.count("L") == TIME.size - 1)
    heights = np.array([float(point.split()[1]) for point in wave[1:].split("L")])
    assert np.allclose(heights, (3.5 - WAVE) / 5.0 * CHART.panel_height, rtol=0.0, atol=0.051)
    lifted = Chart("k", "t", "c", (Panel("p", lines=(Line(UNEVEN, BROKEN, "broken"),)),))
    path = next(
        p.get("d", "")
        for p in ElementTree.fromstring(draw(lifted)).iter("{http://www.w3.org/2000/svg}path")
        if p.get("stroke-linejoin")
    )
    assert (path.count("M"), path.count("L")) == (2, 1)


@pytest.mark.parametrize("mark", ["lines", "points"])
def test_a_line_without_points_is_drawn_by_every_renderer(mark: Literal["lines", "points"]) -> None:
    """The envelope of a run within one period has none."""
    nothing = np.zeros(0)
    broken_and_empty = Line(UNEVEN, BROKEN, "broken"), Line(nothing, nothing, "none", mark=mark)
    for lines in (broken_and_empty, broken_and_empty[1:]):
        chart = Chart("key", "Title", "Caption", (Panel("first", "mm", "cycles", lines),))
        ElementTree.fromstring(draw(chart))
        assert len(chart_json(chart)["panels"][0]["lines"]) == len(lines)
        assert len(matplotlib_figure(chart).axes) == 1


def test_cells_are_drawn_where_they_lie() -> None:
    cells = Cells(
        np.array([-0.5, 1.5]), np.array([1.5, 2.5]), np.array([0.0, 1.0]), np.array([1.0, 3.0]), "wet", "#123456"
    )
    panel = Panel("p", cells=(cells,), x_range=(-0.5, 2.5), y_range=(0.0, 3.0), x_ticks=((0.0, "left"), (2.0, "right")))
    chart = Chart("k", "t", "c", (panel,), panel_height=300, legend=(Key("wet", "#123456"),))
    root = ElementTree.fromstring(draw(chart, legend=True))
    space = "{http://www.w3.org/2000/svg}"
    path = next(p.get("d", "") for p in root.iter(f"{space}path") if p.get("fill") == "#123456")
    width = float(next(root.iter(f"{space}g")).find(f"{space}svg").get("width"))  # type: ignore[union-attr,arg-type]
    a, c, b, d = (float(v) for v in path[1:].split("Z")[0].replace("H", " ").replace("V", " ").split()[:4])
    assert (a, b, c, d) == pytest.approx((0.0, width * 2.0 / 3.0, 300.0, 200.0), abs=0.051)
    words = [text.text for text in root.iter(f"{space}text")]
    assert {"left", "right", "wet"} <= set(words)
    assert "wet" not in [text.text for text in ElementTree.fromstring(draw(chart)).iter(f"{space}text")]
    (written,) = json.loads(json.dumps(chart_json(chart), allow_nan=False))["panels"]
    for edge in ("left", "right", "low", "high"):
        assert np.array_equal(decoded(written["cells"][0][edge]), getattr(cells, edge))
    assert written["x_ticks"] == [[0.0, "left"], [2.0, "right"]]


def test_cells_without_a_value_are_hatched_everywhere() -> None:
    """Told from every colour, and without colours: never an area of one, in the figure and in its legend."""
    legend = (Key("low", "#d3e3ef"), Key("high", "#083d60"), NOTHING)
    cells = cells_of(np.array([[0, 1, -1], [-1, 0, 1]]), legend)
    panel = Panel("map", "", "x", x_range=(-0.5, 2.5), y_range=(-0.5, 1.5), cells=cells)
    chart = Chart("map", "Map", "", (panel,), legend=legend)
    drawn = draw(chart, legend=True).decode()
    assert f'fill="{NO_VALUE}"' not in drawn
    strokes = [path for path in ElementTree.fromstring(drawn).iter() if path.get("stroke") == NO_VALUE]
    assert [path.get("d", "").count("M") > 2 for path in strokes] == [True, True]
    assert background(NOTHING).startswith("repeating-linear-gradient")
    figure = matplotlib_figure(chart)
    (area,) = [area for area in figure.axes[0].collections if area.get_label() == NOTHING.name]
    assert area.get_hatch()
    assert to_hex(area.get_facecolor()[0]) == PAPER
    assert to_hex(area.get_edgecolor()[0]) == NO_VALUE


def test_hatching_stays_within_its_rectangle_and_goes_on_in_its_neighbour() -> None:
    ends = re.findall(r"M([\d.]+) ([\d.]+)L([\d.]+) ([\d.]+)", _hatching(3.0, 50.0, 7.0, 20.0))
    assert len(ends) == (50 + 20) // 6 - (3 + 7) // 6
    for x0, y0, x1, y1 in (map(float, row) for row in ends):
        assert 3.0 <= x0 <= x1 <= 50.0
        assert 7.0 <= y1 <= y0 <= 20.0
        assert (x0 + y0) % 6.0 == (x1 + y1) % 6.0 == 0.0
