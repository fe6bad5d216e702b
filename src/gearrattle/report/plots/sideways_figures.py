"""Sideways motion: orbits inside the clearance of bearings, displacements, and forces of bearings.

An *orbit* is the displacement of a body along y over that along x, of a bearing around another body relative to that.
The circle has the radius C of the clearance; the polygon inside which the body floats touches it from outside.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearrattle.assembly import directions_of
from gearrattle.report.plots.chart import Chart, Key, Line, Mark, Panel
from gearrattle.report.plots.chords import SCREEN, WITHIN, thinned
from gearrattle.report.plots.chosen_parts import MOST, Judged
from gearrattle.report.plots.motion_window import TimeAxis, coarse, detail, detail_words, scale
from gearrattle.report.plots.palette import ACCENT, CENTRE, INK, MUTED
from gearrattle.trajectory import Array

if TYPE_CHECKING:
    from gearrattle.model.components import Bearing

_GROUP = "sideways"
_TITLE = "Sideways motion"
_Y = "#b3541e"
_AXES = (Key("x", ACCENT), Key("y", _Y))
_CIRCLE = np.linspace(0.0, 2.0 * np.pi, 181)


def orbits(findings: Judged) -> Chart | None:
    """Draw the orbit of the body in every bearing over the last cycles; None where no body moves sideways."""
    if findings.motion.trajectory.sideways is None:
        return None
    # displacements of all bodies in both directions
    trajectory = findings.motion.trajectory
    position = _displacements(findings)
    window = detail(findings)
    part = slice(window.first, window.last + 1)
    names = [body.name for body in findings.model.inertias]
    bearings = findings.model.bearings
    held = {bearing.on for bearing in bearings}
    floating = [body.name for body in findings.model.inertias if body.mass is not None and body.name not in held]
    panels = []
    for bearing, name in [*((bearing, bearing.on) for bearing in bearings), *((None, name) for name in floating)][
        :MOST
    ]:
        # relative to the body around which a bearing lies
        moved = position[part, names.index(name)]
        words = name
        gap = 0.0
        if bearing is not None:
            gap = bearing.clearance
            words = bearing.name
            if bearing.around in names:
                moved = moved - position[part, names.index(bearing.around)]
                words += f", around {bearing.around}"
        # the orbit and the clearance in one unit
        frame = np.maximum(np.ptp(moved, axis=0), 2.0 * gap)
        shown = moved[thinned(moved * (np.array(SCREEN) / np.where(frame > 0.0, frame, 1.0)), WITHIN)]
        in_unit = scale(np.append(moved, gap), "m" if findings.model.units == "SI" else "")
        x, y = shown.T * in_unit.factor
        mark: Mark = "points" if coarse(trajectory) else "line"
        circle = () if bearing is None else _clearance(bearing, in_unit.factor)
        across, up = (f"{axis}  [{in_unit.unit}]" if in_unit.unit else axis for axis in "xy")
        panels.append(Panel(words, up, across, (*circle, Line(x, y, "orbit", INK, mark, 1.2)), equal_scales=True))
    caption = (
        f"Displacement of the body that a bearing holds, y over x, over the {detail_words(findings, window)}; of a "
        "bearing around another body relative to that. Dashed: the circle of the clearance, with the faces that stand "
        f"for it.{_left_out(len(bearings) + len(floating))}"
    )
    return Chart(
        "orbits",
        _TITLE,
        caption,
        tuple(panels),
        columns=min(3, len(panels)),
        panel_height=260,
        share_x=False,
        legend=(Key("clearance", CENTRE, dash="dashed"),) * any(bearing.clearance for bearing in bearings),
        group=_GROUP,
        tab="Orbits",
    )


def displacements(findings: Judged) -> Chart | None:
    """Draw the displacements of every body with a mass over the last cycles; None where no body moves sideways."""
    sideways = findings.motion.trajectory.sideways
    if sideways is None:
        return None
    names = findings.motion.trajectory.layout.direction_names
    return _histories(findings, "displacement", "Displacement", (names, sideways.displacement, "m"))


def bearing_forces(findings: Judged) -> Chart | None:
    """Draw the forces of bearings, and of all in the housing on the casing; None where no body moves sideways."""
    sideways = findings.motion.trajectory.sideways
    if sideways is None or not findings.model.bearings:
        return None
    names = ("all on the casing.x", "all on the casing.y", *findings.motion.trajectory.layout.bearing_names)
    values = np.concatenate([sideways.casing_force, sideways.bearing_force], axis=1)
    return _histories(findings, "bearing_force", "Bearing force", (names, values, "N"))


def _displacements(findings: Judged) -> Array:
    """(Nt, n, 2) displacement of every body along x and y [m]; zero without a mass."""
    sideways = findings.motion.trajectory.sideways
    assert sideways is not None
    position = np.zeros((len(sideways.displacement), len(findings.model.inertias), 2))
    for moved, direction in zip(sideways.displacement.T, directions_of(findings.model), strict=True):
        position[:, direction.body] += moved[:, None] * (direction.x, direction.y)
    return position


def _clearance(bearing: Bearing, factor: float) -> tuple[Line, ...]:
    """Draw the circle of a clearance all around, and its polygon."""
    if bearing.clearance == 0.0 or bearing.direction is not None:
        return ()
    radius = bearing.clearance * factor
    step = 2.0 * np.pi / bearing.face_count
    corner = step * (np.arange(bearing.face_count + 1) + 0.5)
    outer = radius / np.cos(0.5 * step)
    return (
        Line(outer * np.cos(corner), outer * np.sin(corner), "faces", CENTRE, width=0.8),
        Line(radius * np.cos(_CIRCLE), radius * np.sin(_CIRCLE), "clearance", MUTED, width=1.0, dash="dashed"),
    )


def _histories(findings: Judged, key: str, what: str, columns: tuple[tuple[str, ...], Array, str]) -> Chart:
    """Draw columns named NAME.x, NAME.y or NAME.u over the last cycles, one panel a name."""
    names, values, unit = columns
    trajectory = findings.motion.trajectory
    window = detail(findings)
    axis = TimeAxis.of(findings)
    # columns of every panel
    owned: dict[str, list[int]] = {}
    for k, name in enumerate(names):
        owned.setdefault(name.rpartition(".")[0], []).append(k)
    panels = []
    for name, own in list(owned.items())[:MOST]:
        in_unit = scale(values[window.first : window.last + 1, own], unit if findings.model.units == "SI" else "")
        lines = []
        for k in own:
            x, y = axis.history(values[:, k], window)
            colour = _Y if names[k].endswith(".y") else ACCENT
            mark: Mark = "points" if coarse(trajectory) else "line"
            lines.append(Line(x, y * in_unit.factor, names[k], colour, mark))
        panels.append(Panel(name, in_unit.unit, axis.title, tuple(lines), x_range=axis.ends(window)))
    caption = f"{what} along x and y over the {detail_words(findings, window)}{axis.words}.{_left_out(len(owned))}"
    return Chart(key, _TITLE, caption, tuple(panels), panel_height=128, legend=_AXES, group=_GROUP, tab=what)


def _left_out(count: int) -> str:
    """Say how many panels are shown, and where the others are; empty if all are."""
    if count <= MOST:
        return ""
    return f" Shown are the first {MOST} of {count}; results.nc holds all of them (gr.open_run)."
