"""The figure of metrics shows every value where it belongs."""

from __future__ import annotations

import numpy as np
import pytest

from gearrattle.calls.measure import heard_of, rows_of
from gearrattle.metrics import hear_recording, measure, recording_of
from gearrattle.plots.metrics import metrics_chart, rattle_metrics
from gearrattle.plots.palette import COAST, DRIVE
from tests import synthetic

FOUND = synthetic.findings("double-sided")
ROWS = rows_of(heard_of(FOUND.run))


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
    motion = FOUND.run.trajectory
    heard = hear_recording(recording_of(motion), motion.layout, synthetic.OMEGA, np.array([1.0, 2.0]))
    chart = metrics_chart(measure(heard))
    assert chart is not None
    assert "Rattle level" not in {panel.title for panel in chart.panels}
    assert metrics_chart([]) is None
