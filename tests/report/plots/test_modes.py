"""Figures of modes: every crossing is marked where it is, the sketch shows angles and shares."""

from __future__ import annotations

import re
from math import pi
from xml.etree import ElementTree

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.assembly import assemble
from gearrattle.report.plots.campbell_figure import campbell_chart
from gearrattle.report.plots.mode_shapes import mode_sketch
from gearrattle.report.plots.svg_charts import draw
from tests.architecture.places import EXAMPLES

MODEL = gr.load(EXAMPLES / "paper" / "eight_dof.toml")


def test_torques_and_transmission_errors_have_a_panel_each() -> None:
    chart = campbell_chart(gr.campbell(MODEL), si=True)
    assert [panel.title for panel in chart.panels] == ["Torque orders", "Transmission error orders"]
    for panel, orders in zip(chart.panels, ([1, 2, 3, 4, 5], [20, 25, 31]), strict=True):
        rising = [line for line in panel.lines if line.name.startswith("order")]
        assert [line.name for line in rising] == [f"order {order}" for order in orders]
        for line, order in zip(rising, orders, strict=True):
            assert line.y * 60.0 == pytest.approx(order * line.x, rel=1e-12)
        assert panel.y_range is not None
        assert max(line.y.max() for line in panel.lines) <= panel.y_range[1]


@pytest.mark.parametrize("si", [True, False])
def test_every_crossing_is_marked_on_its_lines(si: bool) -> None:
    actual = gr.campbell(MODEL, contact_ratio={"spline": [0.1, 1.0]})
    chart = campbell_chart(actual, si=si)
    marks = np.array(
        sorted(
            (x, y)
            for panel in chart.panels
            for line in panel.lines
            if line.mark == "points"
            for x, y in zip(line.x.tolist(), line.y.tolist(), strict=True)
        )
    )
    scale = (30 / pi, 0.5 / pi) if si else (1.0, 1.0)
    wanted = np.array(sorted((c.speed * scale[0], c.frequency * scale[1]) for c in actual.crossings))
    assert marks == pytest.approx(wanted, rel=1e-12)
    assert [key.name for key in chart.legend] == ["spline 0.1", "spline 1"]


def test_labels_stand_apart_and_are_drawn() -> None:
    chart = campbell_chart(gr.campbell(MODEL), si=True)
    svg = draw(chart).decode()
    texts = [element.text for element in ElementTree.fromstring(svg).iter() if element.tag.endswith("text")]
    for panel in chart.panels:
        for side in ("above", "right"):
            heights = sorted(label.y for label in panel.labels if label.side == side and "speed" not in label.words)
            assert panel.y_range is not None
            assert np.all(np.diff(heights) >= 12.0 / chart.panel_height * panel.y_range[1] * (1 - 1e-9))
        for label in panel.labels:
            assert label.words in texts


def test_a_sketch_shows_an_inertia_of_prescribed_motion_as_held() -> None:
    model = gr.load(EXAMPLES / "measured_flywheel.toml")
    modes, layout = gr.modes(model), assemble(model).layout
    root = ElementTree.fromstring(mode_sketch(layout, modes, 0, "mode 1").decode())
    words = [element.text for element in root.iter() if element.text]
    assert words[words.index("flywheel") + 1] == "held"
    assert words[words.index("fifth_gear") + 1] == "1"
    assert "flywheel 0, hub 0.73" in next(word for word in words if word.startswith("flywheel 0"))


def test_a_sketch_shows_angles_up_and_down_and_the_elements_that_work() -> None:
    modes, layout = gr.modes(MODEL), assemble(MODEL).layout
    svg = mode_sketch(layout, modes, 1, "mode 2").decode()
    root = ElementTree.fromstring(svg)
    words = [element.text for element in root.iter() if element.text]
    assert set(layout.inertia_names) <= set(words)
    assert [name for name in layout.element_names if name in words] == ["clutch"]
    assert "99 %" in words
    stems = re.findall(r"M[\d.]+ ([\d.]+)V([\d.]+)", svg.split('stroke-width="3"')[0].rsplit("<path", 1)[1])
    tips = [(float(base) - float(tip)) / 34.0 for base, tip in stems]
    assert sorted(tips) == pytest.approx(sorted(modes.shapes[:, 1].tolist()), abs=0.002)
    widths = [float(group.get("stroke-width", "0")) for group in root.iter("{http://www.w3.org/2000/svg}g")]
    assert max(widths) == pytest.approx(1.6 + 3.0 * modes.strain_energy[0, 1], abs=0.01)
