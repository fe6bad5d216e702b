"""Figures of sideways motion: the orbit inside its clearance, displacements and forces over time."""

from __future__ import annotations

import json
from xml.etree import ElementTree

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.pipeline import Findings
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.plots.run_figures import charts
from gearrattle.report.plots.sideways_figures import bearing_forces, displacements, orbits
from gearrattle.report.plots.svg_charts import draw
from gearrattle.signals import last_cycles
from tests.laws.test_sideways import with_a_loose_gear

GAP = 1e-5
FACES = 12


@pytest.fixture(scope="module")
def findings() -> Findings:
    model = with_a_loose_gear(clearance=GAP, faces=FACES)
    return gr.run(model, cycles=6, discard=2, samples_per_cycle=128)


def test_an_orbit_is_drawn_inside_its_clearance(findings: Findings) -> None:
    chart = orbits(findings)
    assert chart is not None
    panel = next(panel for panel in chart.panels if panel.title.startswith("at_wheel"))
    assert panel.title == "at_wheel, around shaft"
    assert panel.unit == "y  [µm]"
    assert panel.equal_scales
    faces, circle, orbit = panel.lines
    assert np.hypot(circle.x, circle.y) == pytest.approx(np.full(circle.x.size, 1e6 * GAP))
    assert np.hypot(faces.x, faces.y) == pytest.approx(np.full(FACES + 1, 1e6 * GAP / np.cos(np.pi / FACES)))
    middle = 0.5 * np.hypot(faces.x[1:] + faces.x[:-1], faces.y[1:] + faces.y[:-1])
    assert middle == pytest.approx(np.full(FACES, 1e6 * GAP))
    # the samples that a screen needs, of the gear relative to its shaft
    trajectory = findings.motion.trajectory
    assert trajectory.sideways is not None
    names = list(trajectory.layout.direction_names)
    moved = {name: trajectory.sideways.displacement[:, names.index(name)] for name in names}
    window = last_cycles(trajectory, 4)
    relative = np.stack([moved["wheel.x"] - moved["shaft.x"], moved["wheel.y"] - moved["shaft.y"]], axis=1)
    relative = 1e6 * relative[window.first : window.last + 1]
    shown = np.stack([orbit.x, orbit.y], axis=1)
    assert all(np.min(np.linalg.norm(relative - point, axis=1)) < 1e-9 for point in shown)
    assert np.ptp(shown, axis=0) == pytest.approx(np.ptp(relative, axis=0), rel=0.01)


def test_histories_have_x_and_y_of_every_body_and_bearing(findings: Findings) -> None:
    moved = displacements(findings)
    force = bearing_forces(findings)
    assert moved is not None
    assert force is not None
    assert [panel.title for panel in moved.panels] == ["pinion", "wheel", "shaft"]
    assert [panel.title for panel in force.panels] == ["all on the casing", "at_pinion", "at_wheel", "at_shaft"]
    for panel in (*moved.panels, *force.panels):
        assert [line.name.rpartition(".")[2] for line in panel.lines] == ["x", "y"]
    sideways = findings.motion.trajectory.sideways
    assert sideways is not None
    last = last_cycles(findings.motion.trajectory, 4)
    drawn = force.panels[0].lines[1].y
    factor = {"N": 1.0, "kN": 1e-3}[force.panels[0].unit]
    assert drawn.max() == pytest.approx(factor * last.closed(sideways.casing_force)[:, 1].max())


def test_both_ways_of_drawing_take_them_and_the_page_has_them(findings: Findings) -> None:
    made = [chart for chart in charts(findings) if chart.group == "sideways"]
    assert [chart.tab for chart in made] == ["Orbits", "Displacement", "Bearing force"]
    for chart in made:
        assert chart.caption.endswith(".")
        json.dumps(chart_json(chart), allow_nan=False)
        ElementTree.fromstring(draw(chart))
    drawn = {chart.key: [panel.title for panel in chart.panels] for chart in charts(findings)}
    assert drawn["deflection"] == ["gear-drive", "gear-coast", "at_wheel"]
    assert drawn["phase_plane"] == ["gear-drive", "gear-coast"]
