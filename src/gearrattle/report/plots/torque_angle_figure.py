"""Torque over deflection: the static loop of every coupling with dry friction, and the run's own motion over it.

The static loop is drawn between the extremes of the motion, so that both cover the same range. The motion differs from
it by viscous damping and by smaller loops inside.
"""

from __future__ import annotations

import numpy as np

from gearrattle.analysis.torque_angle import torque_angle
from gearrattle.assembly import deflection
from gearrattle.pipeline import Findings
from gearrattle.report.plots.chart import Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.motion_window import scale
from gearrattle.report.plots.palette import ACCENT, CENTRE, MUTED
from gearrattle.signals import last_cycles

CYCLES = 4
_POINTS = 8000


def torque_angles(findings: Findings) -> Chart | None:
    """Draw every coupling with friction; None where there is none."""
    # couplings whose friction sliders let go
    trajectory = findings.motion.trajectory
    layout = trajectory.layout
    if trajectory.auxiliaries is None:
        return None
    names = [element.name for element in findings.model.elements if not element.along_line]
    rubbing = [n for n in names if any(c.startswith(f"{n}.") and "let go" in w for c, w in _sliders(findings))]
    # the last cycles, thinned
    window = last_cycles(trajectory, CYCLES)
    part = slice(window.first, window.last + 1, max(1, (window.last - window.first) // _POINTS))
    panels = []
    for name in rubbing:
        k = layout.element_names.index(name)
        delta = deflection(findings.model, trajectory, k)[part]
        torque = trajectory.element_torque[part, k]
        if not np.ptp(delta) > 0.0:
            continue
        # the static loop between the motion's extremes
        loop = torque_angle(findings.model, name, float(delta.min()), float(delta.max()))
        si = findings.model.units == "SI"
        degrees, across = (180.0 / np.pi, "°") if si else (1.0, "")
        torque_scale = scale(loop.torque, "N m" if si else "")
        # loop and motion
        lines = (
            Line(loop.deflection * degrees, loop.elastic * torque_scale.factor, "without friction", CENTRE, width=1.0),
            Line(
                loop.deflection * degrees,
                loop.torque * torque_scale.factor,
                "static loop",
                MUTED,
                width=3.0,
                opacity=0.55,
            ),
            Line(delta * degrees, torque * torque_scale.factor, "this run", ACCENT, width=1.0, opacity=0.8),
        )
        # corners and limits
        corners = layout.corners[layout.clearance.tolist().index(k)] * degrees if k in layout.clearance else np.zeros(0)
        rules = tuple(Rule(float(c), "x") for c in corners)
        margin = 0.06 * float(np.ptp(delta)) * degrees
        reach = (float(delta.min()) * degrees - margin, float(delta.max()) * degrees + margin)
        title = f"deflection  [{across}]" if across else "deflection"
        panels.append(Panel(name, torque_scale.unit, title, lines, rules=rules, x_range=reach))
    if not panels:
        return None
    return Chart(
        key="torque_angle",
        title="Friction",
        caption=(
            "Torque over deflection of every coupling with dry friction, over the last cycles of the run: a slow cycle "
            "between the same ends, and the run, which has viscous damping as well. Dotted: corners."
        ),
        panels=tuple(panels),
        columns=min(2, len(panels)),
        panel_height=300,
        share_x=False,
        legend=(Key("static loop", MUTED), Key("this run", ACCENT), Key("without friction", CENTRE)),
    )


def _sliders(findings: Findings) -> list[tuple[str, tuple[str, ...]]]:
    layout = findings.motion.trajectory.layout
    return list(zip(layout.auxiliary_names, layout.auxiliary_words, strict=True))
