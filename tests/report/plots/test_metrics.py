"""The figure of metrics shows every value where it belongs."""

from __future__ import annotations

import json

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.quantities.evaluation import rows_of
from gearrattle.quantities.metric_sources import inputs_of_recording, recording_of
from gearrattle.quantities.metrics import inputs_of
from gearrattle.report.plots.interactive import chart_json
from gearrattle.report.plots.metric_figures import metrics_chart, rattle_metrics
from gearrattle.report.plots.palette import COAST, DRIVE
from gearrattle.report.plots.screening_figure import screening_map
from gearrattle.report.plots.svg_charts import draw
from tests import synthetic

FOUND = synthetic.findings("double-sided")
ROWS = rows_of(inputs_of(FOUND.motion))


def test_points_are_the_values_of_the_table() -> None:
    """Every point of the figure is a value of a subject, and most values are points."""
    chart = rattle_metrics(FOUND)
    assert chart is not None
    known = {(row.subject, row.value) for row in ROWS}
    points = [(line.name, float(y)) for panel in chart.panels for line in panel.lines for y in line.y]
    assert len(points) > 20
    assert set(points) <= known


def test_shares_fill_the_width() -> None:
    """Coast, free and drive add up to 100 % of every gap."""
    chart = metrics_chart(ROWS)
    assert chart is not None
    sides = next(panel for panel in chart.panels if panel.title == "Sides of contact")
    assert sides.cells[0].left == pytest.approx(0.0)
    assert sides.cells[-1].right == pytest.approx(100.0)


def test_no_subject_has_the_colour_of_a_side() -> None:
    """Blue and vermilion mean drive and coast."""
    chart = metrics_chart(ROWS)
    assert chart is not None
    assert {line.colour for panel in chart.panels for line in panel.lines}.isdisjoint({DRIVE, COAST})


def test_a_recording_is_drawn_as_well() -> None:
    """What it cannot give has no panel; nothing at all makes no figure."""
    motion = FOUND.motion.trajectory
    inputs = inputs_of_recording(recording_of(motion), motion.layout, synthetic.OMEGA, np.array([1.0, 2.0]))
    chart = metrics_chart(rows_of(inputs))
    assert chart is not None
    assert "Rattle level" not in {panel.title for panel in chart.panels}
    assert metrics_chart([]) is None


def _screened(loads: list[float] | None, **options: bool) -> object:
    model = gr.load("examples/manual_transmission.toml").with_({"simulation.cycles": 4, "simulation.discard": 2})
    return gr.screen(model, ["800 rpm", "1500 rpm", "3000 rpm"], loads, **options)


def test_cells_of_a_screening_are_its_margins() -> None:
    """Each cell's legend holds its value; a dot where the simulation rattles."""
    data = _screened([0.1, 1.0], simulate=True, workers=1)
    chart = screening_map(data, "separation_ratio")
    assert [panel.title for panel in chart.panels] == data.gear.values.tolist()
    margins = data.margin.values[:, :, 0].T
    for cells in chart.panels[0].cells:
        for left, right, low in zip(cells.left, cells.right, cells.low, strict=True):
            for i in range(round(left + 0.5), round(right + 0.5)):
                value = margins[round(low + 0.5), i]
                words = cells.name.replace("−", "-").split()
                if words[0] in ("below", "above"):
                    assert (value < float(words[1])) == (words[0] == "below")
                else:
                    assert float(words[0]) <= value < float(words[2])
    dots = chart.panels[0].lines[-1]
    assert dots.x.size == int((data.regime.values[:, :, 0] > 0).sum())
    assert all("[rpm]" in panel.x_title for panel in chart.panels)
    draw(chart)
    json.dumps(chart_json(chart), allow_nan=False)


def test_one_load_gives_curves_over_speed() -> None:
    """A line a gear, the threshold as a rule at 0 dB."""
    data = _screened(None)
    (panel,) = screening_map(data).panels
    assert panel.unit == "dB"
    assert panel.rules[0].at == 0.0
    line = next(line for line in panel.lines if line.name == "fifth_mesh" and line.mark == "line")
    assert line.y == pytest.approx(20.0 * np.log10(data.lift_ratio.values[:, 0, 1]))
    assert line.x == pytest.approx([800.0, 1500.0, 3000.0])


def test_loads_by_path_are_named_on_their_axis() -> None:
    """A single path by its name and values in SI; factors by that word; the two measures have files of their own."""
    model = gr.load("examples/manual_transmission.toml")
    data = gr.screen(model, ["800 rpm", "1500 rpm"], {"torque.0.harmonics.0.amplitude": [25.0, "50 N*m"]})
    chart = screening_map(data)
    assert {panel.unit for panel in chart.panels} == {"↑ torque amplitude on flywheel, order 2 [N m]"}
    assert [word for _, word in chart.panels[0].y_ticks] == ["25", "50"]
    by_factor = screening_map(_screened([0.1, 1.0]), "separation_ratio")
    assert by_factor.panels[0].unit == "↑ load factor"
    assert {chart.key, by_factor.key} == {"screening", "screening_separation"}
