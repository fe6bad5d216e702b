"""Where means pass corners, also where the value that a branch goes over moves the corners."""

from __future__ import annotations

import pytest

import gearrattle as gr
from gearrattle.orbits.branch import MEAN
from gearrattle.report.plots.branches_figure import branch_charts

CLEARANCE = "coupling.gap.clearance"


def oscillator(clearance: float, amplitude: float = 0.2) -> gr.Model:
    return gr.Model.from_tables(
        {
            "schema": 1,
            "name": "moved corner",
            "units": "dimensionless",
            "inertia": [{"name": "body", "J": 1.0, "drag": 0.1}],
            "coupling": [
                {
                    "name": "gap",
                    "between": ["body", "ground"],
                    "stiffness": 5.0,
                    "damping": 0.1,
                    "clearance": clearance,
                }
            ],
            "excitation": {"speed": 1.5},
            "torque": [{"on": "body", "mean": 0.5, "harmonics": [{"order": 1, "amplitude": amplitude}]}],
        }
    )


@pytest.mark.parametrize("ends", [(1.0, 0.5), (0.5, 1.0)])
def test_a_mean_that_keeps_its_distance_from_a_moved_corner_is_no_event(ends: tuple[float, float]) -> None:
    """In contact all along: the mean is 0.5 / 5 beyond the corner, wherever that is."""
    branch = gr.continuation(oscillator(ends[0]), CLEARANCE, ends)
    beyond = branch.data["mean"].values[:, 0] - branch.data["value"].values
    assert beyond == pytest.approx(0.1, rel=1e-9)
    assert branch.events.empty


@pytest.mark.parametrize("ends", [pytest.param((0.05, 0.3), marks=pytest.mark.long), (0.3, 0.05)])
def test_a_moved_corner_that_passes_the_mean_is_one_either_way(ends: tuple[float, float]) -> None:
    branch = gr.continuation(oscillator(ends[0], 0.5), CLEARANCE, ends)
    assert list(branch.events["kind"]) == [MEAN]
    value = float(branch.events["value"][0])
    last = gr.simulate(oscillator(value, 0.5), cycles=400, samples_per_cycle=512).data["deflection"].values[-513:-1]
    assert float(last.mean()) == pytest.approx(value, abs=1e-8)
    back = gr.continuation(oscillator(ends[1], 0.5), CLEARANCE, ends[::-1]).events
    assert float(back["value"][0]) == pytest.approx(value, rel=1e-9)


def test_figures_draw_a_moved_corner_where_it_is() -> None:
    branch = gr.continuation(oscillator(0.5), CLEARANCE, (0.5, 1.0))
    panel = branch_charts(branch)[0].panels[0]
    assert not panel.rules
    dotted = [line for line in panel.lines if line.dash == "dotted"]
    assert len(dotted) == 1  # the other corner is far below
    assert dotted[0].y == pytest.approx(dotted[0].x)
    assert dotted[0].x[[0, -1]].tolist() == [0.5, 1.0]
