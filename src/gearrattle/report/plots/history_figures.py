"""Time histories of the bodies: acceleration, speed and angle over the last cycles, or while an event hits.

One panel per body, all on the same cycles, so that an impact can be followed along the driveline. Angles and speeds are
fluctuations about uniform rotation.
"""

from __future__ import annotations

from gearrattle.report.plots.chart import Chart, Line, Panel
from gearrattle.report.plots.chosen_parts import Judged, chosen_bodies
from gearrattle.report.plots.motion_window import TimeAxis, coarse, detail, detail_words, scale
from gearrattle.trajectory import Array

_CAPTION = "{what} of every body over the {cycles}{axis}. All panels share the axis: zoom one and the others follow."


def accelerations(findings: Judged) -> Chart:
    """Draw the angular acceleration of every body."""
    values = findings.motion.trajectory.acceleration
    return _chart(findings, "acceleration", "Angular acceleration", "rad/s²", values)


def speeds(findings: Judged) -> Chart:
    """Draw the speed fluctuation of every body."""
    return _chart(findings, "speed", "Speed fluctuation", "rad/s", findings.motion.trajectory.velocity)


def angles(findings: Judged) -> Chart:
    """Draw the angle of every body."""
    return _chart(findings, "angle", "Angle", "rad", findings.motion.trajectory.angle)


def _chart(findings: Judged, key: str, what: str, unit: str, values: Array) -> Chart:
    trajectory = findings.motion.trajectory
    window = detail(findings)
    axis = TimeAxis.of(findings)
    chosen, left_out = chosen_bodies(findings)
    panels = []
    for i in chosen:
        name = trajectory.layout.inertia_names[i]
        x, y = axis.history(values[:, i], window)
        in_unit = scale(y, unit if findings.model.units == "SI" else "")
        line = Line(x, y * in_unit.factor, name, mark="points" if coarse(trajectory) else "line")
        panels.append(Panel(name, in_unit.unit, axis.title, lines=(line,), x_range=axis.ends(window)))
    return Chart(
        key=key,
        title="Time histories",
        caption=_CAPTION.format(what=what, cycles=detail_words(findings, window), axis=axis.words) + left_out,
        panels=tuple(panels),
        panel_height=104,
        group="histories",
        tab=what,
    )
