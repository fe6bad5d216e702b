"""Figures of an event: over time in seconds, its torque above, its impacts at their instants."""

from __future__ import annotations

import numpy as np
import pytest

import gearrattle as gr
from gearrattle.report.plots.clearance_figures import deflections, overview
from gearrattle.report.plots.history_figures import accelerations
from gearrattle.report.plots.impact_figures import impacts


@pytest.fixture(scope="module")
def event() -> gr.Findings:
    return gr.run(gr.example("tip_in"))


def test_histories_of_an_event_are_over_seconds(event: gr.Findings) -> None:
    for chart in (deflections(event), overview(event), accelerations(event)):
        assert {panel.x_title for panel in chart.panels} == {"time  [s]"}
        assert "cycles of the common period" not in chart.caption
    whole = overview(event).panels[0]
    assert whole.x_range == pytest.approx((0.0, event.motion.trajectory.time[-1]))


def test_the_torque_stands_above_and_ends_at_its_ramp(event: gr.Findings) -> None:
    """From -20 to 80 N m, mean included."""
    panel = overview(event).panels[0]
    assert panel.title == "torque on rotor"
    (line,) = panel.lines
    assert line.y[0] == pytest.approx(-20.0)
    assert line.y[-1] == pytest.approx(80.0)


def test_impacts_of_an_event_stand_at_their_instants(event: gr.Findings) -> None:
    chart = impacts(event)
    assert chart is not None
    first = event.verdict.first_impact
    at = np.concatenate([line.x for panel in chart.panels[::3] for line in panel.lines])
    assert at.min() == pytest.approx(first)


def test_histories_of_a_steady_motion_are_over_cycles() -> None:
    steady = gr.run(gr.example("case1"))
    assert {panel.x_title for panel in deflections(steady).panels} == {"time / T  [cycles]"}
    assert "torque on" not in str([panel.title for panel in deflections(steady).panels])
