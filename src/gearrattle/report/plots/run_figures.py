"""The figures of a run, in the order of the report.

To add one: write a module with a function that takes Findings and gives a Chart (or None where it has nothing to show),
and name it in the table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from gearrattle.pipeline import Findings
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.clearance_figures import deflections, forces, overview
from gearrattle.report.plots.history_figures import accelerations, angles, speeds
from gearrattle.report.plots.impact_figures import impacts
from gearrattle.report.plots.metric_figures import rattle_metrics
from gearrattle.report.plots.phase_plane import phase_plane
from gearrattle.report.plots.region_figures import regions
from gearrattle.report.plots.run_up_figures import run_up_orders, run_up_spectra
from gearrattle.report.plots.sideways_figures import bearing_forces, displacements, orbits
from gearrattle.report.plots.spectrum_figures import spectra
from gearrattle.report.plots.torque_angle_figure import torque_angles
from gearrattle.results import Run
from gearrattle.signals import by_parts

FIGURES: tuple[Callable[[Findings], Chart | None], ...] = (
    deflections,
    overview,
    forces,
    regions,
    accelerations,
    speeds,
    angles,
    orbits,
    displacements,
    bearing_forces,
    impacts,
    phase_plane,
    torque_angles,
    spectra,
    rattle_metrics,
    run_up_spectra,
    run_up_orders,
)
"""Every figure of the report, in reading order."""
_OF_PARTS = (deflections, overview, forces, regions, impacts)
"""Figures of clearances, which show the faces of a bearing as one."""
_OF_AVERAGES = (spectra, rattle_metrics)
"""Figures of averages over cycles, which say nothing of an event."""


def charts(findings: Findings) -> list[Chart]:
    """Return every figure that has something to show."""
    left_out = () if findings.verdict.event is None else _OF_AVERAGES
    motion = Run(by_parts(findings.motion.trajectory), findings.model)
    merged = findings if motion.trajectory is findings.motion.trajectory else replace(findings, motion=motion)
    made = (figure(merged if figure in _OF_PARTS else findings) for figure in FIGURES if figure not in left_out)
    return [chart for chart in made if chart is not None and chart.panels]
