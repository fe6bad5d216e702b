"""Regions of every clearance over time: the centre, or a stage of a side.

A region is a stretch of the deflection between two corners: 0 the centre, 1, 2, ... outward on the drive side, -1, -2,
... on the coast side. The times are those of the crossings, not of the samples.
"""

from __future__ import annotations

import numpy as np

from gearrattle.report.plots.chart import Cells, Chart, Line, Panel
from gearrattle.report.plots.chosen_parts import Judged, chosen_clearances
from gearrattle.report.plots.corner_marks import SIDES
from gearrattle.report.plots.motion_window import TimeAxis, detail
from gearrattle.report.plots.palette import COAST, DRIVE, INK
from gearrattle.signals import Window, centre, find_impacts, region_at
from gearrattle.trajectory import Array, IntArray, Trajectory

_MOST = 3000
"""Crossings of a clearance that are drawn: the last ones."""


def regions(findings: Judged) -> Chart:
    """Draw in which region every clearance is over the last cycles, with its impacts."""
    axis = TimeAxis.of(findings)
    window = detail(findings)
    chosen, left_out = chosen_clearances(findings)
    caption = (
        "Region of every element with a corner: 0 the centre, then the stages outward, drive side up, coast side down. "
        f"Filled: in contact. Dots: impacts. All at the exact times of the crossings.{left_out}"
    )
    panels = tuple(_panel(axis, k, window) for k in chosen)
    return Chart(
        "regions", "Clearances", caption, panels, panel_height=72, legend=SIDES, group="clearances", tab="Regions"
    )


def _panel(axis: TimeAxis, k: int, window: Window) -> Panel:
    """Draw one clearance: its regions as steps, contact filled, impacts as dots."""
    # stays in the regions, from crossing to crossing
    trajectory = axis.trajectory
    layout = trajectory.layout
    time, region = _stretches(trajectory, k, window)
    begin = axis.at(time[:-1])
    end = axis.at(time[1:])
    inner = centre(layout, k)
    cells = []
    # contact on either side, filled from the edge of the centre
    for name, colour, side in (
        ("drive side", DRIVE, region > max(inner)),
        ("coast side", COAST, region < min(inner)),
    ):
        if side.any():
            floor = np.full(side.sum(), float(max(inner) if colour == DRIVE else min(inner)))
            level = region[side].astype(np.float64)
            low = np.minimum(floor, level)
            high = np.maximum(floor, level)
            cells.append(Cells(begin[side], end[side], low, high, name, colour))
    # the region as a step curve
    steps = np.repeat(region, 2).astype(np.float64)
    lines = [Line(np.column_stack([begin, end]).ravel(), steps, "region", INK, width=1.0)]
    # impacts at their times
    impacts = find_impacts(trajectory).of(k).within(window)
    is_drawn = impacts.time >= time[0]
    if is_drawn.any():
        level = impacts.region[is_drawn].astype(np.float64)
        lines.append(Line(axis.at(impacts.time[is_drawn]), level, "impact", INK, "points", 5.0))
    # labels of the regions
    first = int(layout.region_of_first_piece[k])
    labels = range(first, first + layout.stiffness_of_piece[k].size)
    return Panel(
        layout.clearance_names[k],
        "region",
        axis.title,
        tuple(lines),
        cells=tuple(cells),
        x_range=(float(begin[0]), float(end[-1])),
        y_range=(labels[0] - 0.4, labels[-1] + 0.4),
        y_ticks=tuple((float(label), f"{label}".replace("-", "−")) for label in labels),
    )


def _stretches(trajectory: Trajectory, k: int, window: Window) -> tuple[Array, IntArray]:
    """Return the bounds of the stretches of time in one region, (S + 1,) [s], and the region of each, (S,)."""
    log = trajectory.events
    own = np.flatnonzero((log.clearance == k) & (log.time >= window.start) & (log.time < window.end))
    is_cut = own.size > _MOST
    start = float(log.time[own[-_MOST - 1]]) if is_cut else window.start
    first = int(log.to_region[own[-_MOST - 1]]) if is_cut else region_at(trajectory, k, window.start)
    own = own[-_MOST:]
    time = np.concatenate([[start], log.time[own], [window.end]])
    return time, np.concatenate([[first], log.to_region[own]]).astype(np.int64)
