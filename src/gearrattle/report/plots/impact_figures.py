"""Impact statistics: phase within the cycle, approach speed and energy.

One row per clearance with impacts in the steady part, all from the exact log of crossings. The left panel shows each
impact at its phase in the cycle, cycle over cycle: vertical stripes are a periodic rattle, scatter a chaotic one.
"""

from __future__ import annotations

import numpy as np

from gearrattle.pipeline import Findings
from gearrattle.report.plots.chart import Bars, Chart, Line, Panel
from gearrattle.report.plots.chosen_parts import chosen_clearances
from gearrattle.report.plots.corner_marks import SIDES, units
from gearrattle.report.plots.motion_window import Scale, TimeAxis, scale
from gearrattle.report.plots.palette import COAST, DRIVE
from gearrattle.signals import Impacts, find_impacts, steady
from gearrattle.trajectory import Array, Trajectory

_MOST_POINTS = 4000
_BINS = 24


def impacts(findings: Findings) -> Chart | None:
    """Draw the impact statistics of every clearance that has any; None if nothing impacts."""
    # impacts of the steady part, for the chosen clearances
    trajectory = findings.motion.trajectory
    layout = trajectory.layout
    steady_impacts = find_impacts(trajectory).within(steady(trajectory))
    panels: list[Panel] = []
    chosen, left_out = chosen_clearances(findings)
    axis = TimeAxis.of(findings)
    is_event = findings.verdict.event is not None
    for k in chosen:
        name = layout.clearance_names[k]
        mine = steady_impacts.of(k)
        if not len(mine):
            continue
        # phase or instant, approach speed and impact energy of one clearance
        unit = units(findings, k)
        speed = scale(mine.velocity, unit["rate"])
        energy = scale(mine.energy, unit["energy"])
        panels += [
            _instants(axis, mine, name, energy) if is_event else _phases(trajectory, mine, name),
            _histogram(mine, np.abs(mine.velocity) * speed.factor, name, "approach speed", speed.unit),
            _histogram(mine, mine.energy * energy.factor, name, "impact energy", energy.unit),
        ]
    if not panels:
        return None
    left = (
        "Every impact of the event. Left: when it comes, and its impact energy. "
        if is_event
        else "Every impact of the steady part. Left: its phase within the cycle, cycle over cycle; stripes mean a "
        "rattle that repeats, scatter one that does not. "
    )
    caption = left + (f"Middle and right: how many, by approach speed v and by impact energy m_eff v²/2.{left_out}")
    return Chart(
        key="impacts",
        title="Impacts",
        caption=caption,
        panels=tuple(panels),
        columns=3,
        panel_height=150,
        share_x=False,
        legend=SIDES,
    )


def _phases(trajectory: Trajectory, mine: Impacts, name: str) -> Panel:
    """Draw each impact at its phase and cycle; the latest ones where there are too many."""
    lines = []
    for side, colour, chosen in (("drive", DRIVE, mine.drive), ("coast", COAST, ~mine.drive)):
        at = mine.time[chosen][-_MOST_POINTS:] / trajectory.layout.period
        if at.size:
            lines.append(Line(at % 1.0, np.floor(at), f"{side} side", colour, "points", 4.0, 0.8))
    return Panel(name, "cycle", "phase in the cycle", tuple(lines), x_range=(0.0, 1.0))


def _instants(axis: TimeAxis, mine: Impacts, name: str, energy: Scale) -> Panel:
    """Draw each impact at its instant and energy; the latest ones where there are too many."""
    lines = []
    for side, colour, chosen in (("drive", DRIVE, mine.drive), ("coast", COAST, ~mine.drive)):
        at = axis.at(mine.time[chosen][-_MOST_POINTS:])
        if at.size:
            values = mine.energy[chosen][-_MOST_POINTS:] * energy.factor
            lines.append(Line(at, values, f"{side} side", colour, "points", 4.0, 0.8))
    top = 1.08 * float(np.nanmax(mine.energy, initial=0.0)) * energy.factor
    return Panel(name, energy.unit, axis.title, tuple(lines), y_range=(0.0, top) if top > 0.0 else None)


def _histogram(mine: Impacts, values: Array, name: str, what: str, unit: str) -> Panel:
    """Count values by side, coast stacked on drive."""
    x_title = f"{what}  [{unit}]" if unit else what
    if not np.all(np.isfinite(values)):
        return Panel(name, "", x_title, note="no body at it is free to move")
    edges = np.linspace(0.0, float(values.max()) or 1.0, _BINS + 1)
    drive = np.histogram(values[mine.drive], edges)[0].astype(np.float64)
    coast = np.histogram(values[~mine.drive], edges)[0].astype(np.float64)
    bars = (Bars(edges, drive, "drive side", DRIVE), Bars(edges, coast, "coast side", COAST, base=drive))
    return Panel(name, "impacts", x_title, bars=bars, x_range=(0.0, float(edges[-1])))
