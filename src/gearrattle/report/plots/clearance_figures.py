"""Deflections with their corners, and the forces of the elements.

A clearance is free between its corners and in contact beyond them. Contact is shaded, blue on the drive side and
vermilion on the coast side. Dots mark impacts at the exact time of the crossing, which may be between two samples.
"""

from __future__ import annotations

import numpy as np

from gearrattle.assembly.input_histories import torque_histories
from gearrattle.assembly.means import own_mean
from gearrattle.assembly.records import Recorded
from gearrattle.report.plots.chart import Band, Chart, Line, Panel, Rule
from gearrattle.report.plots.chosen_parts import Judged, chosen_clearances, ring_words
from gearrattle.report.plots.corner_marks import SIDES, reach, shading, units
from gearrattle.report.plots.motion_window import Scale, TimeAxis, coarse, detail, scale
from gearrattle.report.plots.palette import COAST, DRIVE, INK, MUTED
from gearrattle.signals import Impacts, Window, find_impacts

_MOST_IMPACTS = 3000


def deflections(findings: Judged) -> Chart:
    """Draw the deflection of every clearance over the last cycles, with its impacts."""
    window = detail(findings)
    caption = (
        "Deflection of every element with a corner, in detail. Shaded: in contact, beyond the dotted corners. "
        f"Dots: impacts, at the exact time of the crossing.{ring_words(findings, 'the size of the displacement')}"
        f"{chosen_clearances(findings)[1]}"
    )
    panels = _deflection_panels(findings, window)
    return Chart(
        "deflection",
        "Clearances",
        caption,
        panels,
        panel_height=128,
        legend=SIDES,
        group="clearances",
        tab="Deflection",
    )


def overview(findings: Judged) -> Chart:
    """Draw the deflection of every clearance over the whole run, thinned with its extremes kept."""
    caption = (
        "The whole run, start-up included; thinned for the screen with every extreme kept. "
        f"Shaded: cycles left out of the criteria.{chosen_clearances(findings)[1]}"
    )
    panels = _deflection_panels(findings, None)
    return Chart(
        "overview",
        "Clearances",
        caption,
        panels,
        panel_height=128,
        legend=SIDES,
        group="clearances",
        tab="Whole run",
    )


def forces(findings: Judged) -> Chart:
    """Draw the force or torque of every element with a corner over the last cycles."""
    trajectory = findings.motion.trajectory
    window = detail(findings)
    axis = TimeAxis.of(findings)
    chosen, left_out = chosen_clearances(findings)
    panels = []
    for k in chosen:
        name = trajectory.layout.clearance_names[k]
        x, y = axis.history(trajectory.force[:, k], window)
        in_unit = scale(y, units(findings, k)["force"])
        line = Line(x, y * in_unit.factor, name, INK, mark="points" if coarse(trajectory) else "line")
        span = (float(x[0]), float(x[-1]))
        zero = Rule(0.0, dashed=False)
        panels.append(Panel(name, in_unit.unit, axis.title, lines=(line,), rules=(zero,), x_range=span))
    caption = (
        "Force in every element with a corner, elastic and damping: torque in couplings, force along the line of "
        f"action in meshes; positive on the drive side.{ring_words(findings, 'the size of the force')}{left_out}"
    )
    return Chart("force", "Clearances", caption, tuple(panels), panel_height=128, group="clearances", tab="Force")


def _deflection_panels(findings: Judged, window: Window | None) -> tuple[Panel, ...]:
    trajectory = findings.motion.trajectory
    layout = trajectory.layout
    impacts = find_impacts(trajectory)
    axis = TimeAxis.of(findings)
    panels = _torque_panels(findings, axis, window)
    for k in chosen_clearances(findings)[0]:
        name = layout.clearance_names[k]
        x, y = axis.history(trajectory.deflection[:, k], window)
        in_unit = scale(np.concatenate([y, layout.corners[k]]), units(findings, k)["deflection"])
        bands, rules = shading(layout, k, in_unit.factor)
        line = Line(x, y * in_unit.factor, name, INK, mark="points" if coarse(trajectory) else "line", width=1.2)
        lines: tuple[Line, ...] = (line,)
        if window is None:
            bands += (Band(0.0, trajectory.discard * axis.length, MUTED, along="x", opacity=0.12),)
        else:
            lines += _marks(axis, impacts.of(k).within(window), k, in_unit)
        limits = reach(y * in_unit.factor, layout.corners[k] * in_unit.factor)
        span = (float(x[0]), float(x[-1]))
        panels.append(Panel(name, in_unit.unit, axis.title, lines, (), bands, rules, x_range=span, y_range=limits))
    return tuple(panels)


def _torque_panels(findings: Judged, axis: TimeAxis, window: Window | None) -> list[Panel]:
    """Draw the torques over time that cause an event, in panels above the forces."""
    if findings.verdict.event is None:
        return []
    time = findings.motion.trajectory.time
    panels = []
    for index, signal in torque_histories(findings.model).items():
        mean = float(own_mean(findings.model, index))
        x, y = axis.history(mean + Recorded(signal).at(time), window)
        in_unit = scale(y, "N m" if findings.model.units == "SI" else "")
        name = f"torque on {findings.model.torques[index].on}"
        span = (float(x[0]), float(x[-1]))
        line = Line(x, y * in_unit.factor, name, INK, width=1.2)
        panels.append(Panel(name, in_unit.unit, axis.title, lines=(line,), x_range=span))
    return panels


def _marks(axis: TimeAxis, impacts: Impacts, clearance: int, in_unit: Scale) -> tuple[Line, ...]:
    """Draw each impact as a dot on the corner it crosses."""
    layout = axis.trajectory.layout
    first = int(layout.region_of_first_piece[clearance])
    corners = layout.corners[clearance]
    marks = []
    for name, colour, chosen in (("drive", DRIVE, impacts.drive), ("coast", COAST, ~impacts.drive)):
        if not 0 < chosen.sum() <= _MOST_IMPACTS:
            continue
        lower = impacts.region[chosen] - first - (1 if name == "drive" else 0)
        at = corners[np.clip(lower, 0, corners.size - 1)] * in_unit.factor
        x = axis.at(impacts.time[chosen])
        marks.append(Line(x, at, f"impact, {name} side", colour, mark="points", width=7.0))
    return tuple(marks)
