"""Phase planes: deflection rate against deflection, one panel per clearance.

A quiet clearance draws one small loop on one side; rattle draws straight passages through the gap. The rate follows
from the bodies' speeds: delta' = R_a theta_a' - R_b theta_b' - e'(t), with R = 1 for couplings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain

import numpy as np

from gearrattle.assembly import deflection_acceleration as acceleration_of
from gearrattle.assembly import deflection_rate as rate_of
from gearrattle.report.plots.chart import Band, Chart, Line, Mark, Panel, Rule
from gearrattle.report.plots.chords import SCREEN, WITHIN, thinned
from gearrattle.report.plots.chosen_parts import Judged, chosen_clearances
from gearrattle.report.plots.corner_marks import SIDES, reach, shading, units
from gearrattle.report.plots.curve_between_samples import Knots, between, with_crossings
from gearrattle.report.plots.motion_window import coarse, scale
from gearrattle.report.plots.palette import INK
from gearrattle.signals import Window, last_cycles
from gearrattle.trajectory import Array
from gearrattle.wording import counted

CYCLES = 8
_POINTS = 6000


def phase_plane(findings: Judged, cycles: int = CYCLES) -> Chart:
    """Draw the phase plane of every clearance over the last cycles."""
    # curves of the chosen clearances over the last cycles
    trajectory = findings.motion.trajectory
    layout = trajectory.layout
    window = last_cycles(trajectory, min(cycles, max(1, _POINTS // trajectory.samples_per_cycle)))
    chosen, left_out = chosen_clearances(findings)
    curves, mark = phase_curves(findings, chosen, window)
    panels = []
    # scales, shading and corners of one clearance
    for k, curve in zip(chosen, curves, strict=True):
        name = layout.clearance_names[k]
        unit = units(findings, k)
        delta, rate = curve.T
        across = scale(np.concatenate([delta, layout.corners[k]]), unit["deflection"])
        rate_scale = scale(rate, unit["rate"])
        bands, rules = shading(layout, k, across.factor)
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
        f"Deflection rate against deflection over the last {counted(window.cycles, 'cycle')}. "
        "Dotted: corners; shaded: in contact. Passages right across the middle are rattle."
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


def phase_curves(findings: Judged, clearances: Sequence[int], window: Window) -> tuple[list[Array], Mark]:
    """Return deflection and rate (N, 2) of each clearance over the last cycles, and how they are drawn.

    A motion with exact values between samples is drawn exactly. Another motion is drawn by polynomials through its
    samples (``plots/curve_between_samples``), or as points if the samples are too far apart. ``clearances`` are indices
    into ``layout.clearance``.
    """
    trajectory = findings.motion.trajectory
    if trajectory.exact is not None and clearances:
        names = [trajectory.layout.clearance_names[k] for k in clearances]
        exact = trajectory.exact.phase_curves(trajectory, names, window.cycles)
        if exact is not None:
            return _drawn(exact), "line"
    part = slice(window.first, window.last + 1)
    if not coarse(trajectory):
        curves = [_through_samples(findings, k, part) for k in clearances]
        return [_on_screen(curve, np.ptp(curve, axis=0), WITHIN) for curve in curves], "line"
    rates = [deflection_rate(findings, k) for k in clearances]
    deflections = [trajectory.deflection[:, k] for k in clearances]
    return [np.stack(both, 1)[part] for both in zip(deflections, rates, strict=True)], "points"


def _through_samples(findings: Judged, clearance: int, part: slice) -> Array:
    """(N, 2) deflection and rate of one clearance through samples and its crossings."""
    trajectory = findings.motion.trajectory
    model = findings.model
    layout = trajectory.layout
    events = trajectory.events
    element = int(layout.clearance[clearance])
    deflection = trajectory.deflection[:, clearance]
    second = acceleration_of(model, trajectory, element)
    samples = Knots(trajectory.time, deflection, deflection_rate(findings, clearance), second)
    own = events.clearance == clearance
    reached = np.interp(events.time[own], trajectory.time, deflection)
    corners = layout.corners[clearance]
    corner = corners[np.argmin(np.abs(reached[:, None] - corners), axis=1)] if corners.size else reached
    knots = Knots(*(values[part] for values in samples))
    return between(with_crossings(knots, events.time[own], corner, events.velocity[own]))


def _drawn(pieces: Iterator[Array]) -> list[Array]:
    """The points that a screen can show, for curves in consecutive pieces (N, q, 2).

    A curve in several pieces is thinned twice, with half of the allowed distance: every piece, and then the whole
    curve. The frame for a piece is the frame of all pieces so far. It can only grow, so no piece loses too many points.
    """
    first = next(pieces)
    second = next(pieces, None)
    if second is None:
        return [_on_screen(curve, np.ptp(curve, axis=0), WITHIN) for curve in first.swapaxes(0, 1)]
    low = first.min(axis=0)
    high = first.max(axis=0)
    kept: list[list[Array]] = [[] for _ in low]
    for piece in chain((first, second), pieces):
        low = np.minimum(low, piece.min(axis=0))
        high = np.maximum(high, piece.max(axis=0))
        for k, points in enumerate(kept):
            points.append(_on_screen(piece[:, k], high[k] - low[k], 0.5 * WITHIN))
    frames = high - low
    return [_on_screen(np.concatenate(points), frames[k], 0.5 * WITHIN) for k, points in enumerate(kept)]


def _on_screen(points: Array, frame: Array, within: float) -> Array:
    """Those of the points of a curve that a screen shows in a frame of some width and height."""
    return points[thinned(points * (np.array(SCREEN) / np.where(frame > 0.0, frame, 1.0)), within)]


def deflection_rate(findings: Judged, clearance: int) -> Array:
    """Return the deflection rate of ``layout.clearance[clearance]`` at every sample, (Nt,) [rad/s or m/s]."""
    trajectory = findings.motion.trajectory
    return rate_of(findings.model, trajectory, int(trajectory.layout.clearance[clearance]))
