"""Phase planes: deflection rate against deflection, one panel a clearance.

A quiet clearance draws one small loop on one side; rattle draws straight passages through the gap. The rate follows
from the bodies' speeds: delta' = R_a theta_a' - R_b theta_b' - e'(t), with R = 1 for couplings.
"""

from __future__ import annotations

import numpy as np

from gearrattle.assembly import deflection_acceleration as acceleration_of
from gearrattle.assembly import deflection_rate as rate_of
from gearrattle.report.plots.chart import Band, Chart, Line, Mark, Panel, Rule
from gearrattle.report.plots.chords import SCREEN, WITHIN, thinned
from gearrattle.report.plots.chosen import Judged, chosen_clearances
from gearrattle.report.plots.corners import SIDES, reach, shading, units
from gearrattle.report.plots.palette import INK
from gearrattle.report.plots.smooth import Knots, between, with_crossings
from gearrattle.report.plots.view import coarse, scale
from gearrattle.signals import last_cycles
from gearrattle.trajectory import Array, Trajectory

CYCLES = 8
_POINTS = 6000


def phase_plane(findings: Judged) -> Chart:
    """Draw the phase plane of every clearance over the last cycles."""
    trajectory = findings.motion.trajectory
    layout = trajectory.layout
    window = last_cycles(trajectory, CYCLES)
    whole = max(1, _POINTS // trajectory.samples_per_cycle)
    first = max(window.first, window.last - whole * trajectory.samples_per_cycle)
    part = slice(first, window.last + 1, max(1, (window.last - first) // _POINTS))
    chosen, left_out = chosen_clearances(findings)
    panels = []
    for k in chosen:
        name = layout.clearance_names[k]
        unit = units(findings, k)
        if coarse(trajectory):
            delta, rate = trajectory.deflection[part, k], deflection_rate(findings, k)[part]
        else:
            delta, rate = smooth_curve(findings, k, slice(first, window.last + 1)).T
        across = scale(np.concatenate([delta, layout.corners[k]]), unit["deflection"])
        rate_scale = scale(rate, unit["rate"])
        bands, rules = shading(layout, k, across.factor)
        mark: Mark = "points" if coarse(trajectory) else "line"
        line = Line(
            delta * across.factor,
            rate * rate_scale.factor,
            name,
            INK,
            mark,
            0.9 if mark == "line" else 4.0,
            opacity=0.75,
        )
        title = f"deflection  [{across.unit}]" if across.unit else "deflection"
        sideways = tuple(Band(b.low, b.high, b.colour, "x", b.opacity) for b in bands)
        walls = tuple(Rule(r.at, "x") for r in rules)
        panels.append(
            Panel(
                name,
                f"rate  [{rate_scale.unit}]" if rate_scale.unit else "rate",
                title,
                (line,),
                bands=sideways,
                rules=walls,
                x_range=reach(delta * across.factor, layout.corners[k] * across.factor),
            )
        )
    caption = (
        f"Deflection rate against deflection over the last {_count(window.last - first, trajectory)}. "
        "Dotted: corners; shaded: in contact. Passages right across the white middle are rattle."
        f"{left_out}"
    )
    return Chart(
        key="phase_plane",
        title="Phase plane",
        caption=caption,
        panels=tuple(panels),
        columns=min(3, max(1, len(panels))),
        panel_height=232,
        share_x=False,
        legend=SIDES,
    )


def smooth_curve(findings: Judged, clearance: int, part: slice) -> Array:
    """Return (N, 2) deflection and rate of one clearance over some samples, smooth on a screen.

    Parameters
    ----------
    findings
        what the pipeline found.
    clearance
        index into ``layout.clearance``.
    part
        of the samples.
    """
    trajectory, model = findings.motion.trajectory, findings.model
    layout, events = trajectory.layout, trajectory.events
    element, deflection = int(layout.clearance[clearance]), trajectory.deflection[:, clearance]
    second = acceleration_of(model, trajectory, element)
    samples = Knots(trajectory.time, deflection, deflection_rate(findings, clearance), second)
    own = events.clearance == clearance
    reached = np.interp(events.time[own], trajectory.time, deflection)
    corners = layout.corners[clearance]
    corner = corners[np.argmin(np.abs(reached[:, None] - corners), axis=1)] if corners.size else reached
    knots = with_crossings(Knots(*(values[part] for values in samples)), events.time[own], corner, events.velocity[own])
    points = between(knots)
    frame = np.ptp(points, axis=0)
    return points[thinned(points * (np.array(SCREEN) / np.where(frame > 0.0, frame, 1.0)), WITHIN)]


def _count(samples: int, trajectory: Trajectory) -> str:
    cycles = samples // trajectory.samples_per_cycle
    return "cycle" if cycles == 1 else f"{cycles} cycles"


def deflection_rate(findings: Judged, clearance: int) -> Array:
    """Return the deflection rate of one clearance at every sample, (Nt,) [rad/s or m/s].

    Parameters
    ----------
    findings
        what the pipeline found.
    clearance
        index into ``layout.clearance``.
    """
    trajectory = findings.motion.trajectory
    return rate_of(findings.model, trajectory, int(trajectory.layout.clearance[clearance]))
