"""Figures of periodic motions: phase planes, several motions in one, multipliers."""

from __future__ import annotations

from collections.abc import Sequence

from gearrattle.orbits import Orbit
from gearrattle.report.plots.chart import Chart, Key, Line
from gearrattle.report.plots.corner_marks import SIDES
from gearrattle.report.plots.palette import ACCENT, COAST, COLOURS, INK
from gearrattle.report.plots.phase_loops import START, Loop, phase_panel
from gearrattle.report.plots.unit_circle import outside_words, unit_circle
from gearrattle.wording import counted

_MOST_PANELS = 9
_MOST_LOOPS = 12
_MOST_TABS = 4
STABLE = Key("stable", INK, dash="solid")
UNSTABLE = Key("unstable", INK, dash="dashed")
INSIDE = Key("in or on the unit circle", ACCENT, "circle")
OUTSIDE = Key("outside", COAST, "cross")
_ROOM = 1e-9


def phase_chart(orbit: Orbit) -> Chart:
    """Draw the phase plane of every clearance."""
    names = orbit.run.trajectory.layout.clearance_names
    shown = range(min(len(names), _MOST_PANELS))
    panels = tuple(phase_panel([Loop("the motion", orbit.run)], k, names[k]) for k in shown)
    caption = (
        f"Deflection rate against deflection over {orbit.cycles} T: a closed curve. Dotted: corners; shaded: in "
        f"contact.{_left_out(len(names))}"
    )
    return Chart(
        "phase_plane",
        "Phase plane",
        caption,
        panels,
        columns=min(3, max(1, len(panels))),
        panel_height=260,
        share_x=False,
        legend=(*SIDES, START),
    )


def overlaid_chart(orbits: Sequence[tuple[str, Orbit]]) -> Chart:
    """Draw several motions of one driveline in the phase plane of every clearance."""
    shown = orbits[-_MOST_LOOPS:]
    loops = [
        Loop(name, orbit.run, COLOURS[i % len(COLOURS)], "solid" if orbit.stable else "dashed")
        for i, (name, orbit) in enumerate(shown)
    ]
    names = shown[0][1].run.trajectory.layout.clearance_names
    panels = tuple(phase_panel(loops, k, names[k]) for k in range(min(len(names), _MOST_PANELS)))
    more = len(orbits) - len(shown)
    left = f" {counted(more, 'motion')} with smaller swings are left out." if more else ""
    return Chart(
        "phase_planes",
        "Phase planes",
        "All motions, deflection rate against deflection. Solid: stable; dashed: unstable."
        f"{left}{_left_out(len(names))}",
        panels,
        columns=min(2, max(1, len(panels))),
        panel_height=340,
        share_x=False,
        legend=(*(Key(loop.name, loop.colour, dash=loop.dash) for loop in loops), START),
    )


def multipliers_chart(orbits: Sequence[tuple[str, Orbit]]) -> Chart:
    """Draw the multipliers of one or several motions with the unit circle."""
    marks: list[Line] = []
    for name, orbit in orbits:
        values = orbit.multipliers
        for key, chosen in ((INSIDE, abs(values) <= 1.0 + _ROOM), (OUTSIDE, abs(values) > 1.0 + _ROOM)):
            if chosen.any():
                marks.append(
                    Line(
                        values[chosen].real.copy(),
                        values[chosen].imag.copy(),
                        name,
                        key.colour,
                        "points",
                        9.0,
                        shape=key.shape,
                    )
                )
    caption = (
        "Floquet multipliers in the complex plane: what a small disturbance is multiplied by until the motion repeats. "
        f"All inside the circle: the motion is stable.{outside_words(marks)}"
    )
    panel = unit_circle(marks, "multipliers")
    return Chart("multipliers", "Multipliers", caption, (panel,), panel_height=360, legend=(INSIDE, OUTSIDE))


def _left_out(clearances: int) -> str:
    more = clearances - _MOST_PANELS
    return f" {counted(more, 'clearance')} more are left out." if more > 0 else ""


def selected_charts(orbits: Sequence[tuple[str, Orbit]]) -> list[Chart]:
    """Return the phase planes of some motions along a branch, a panel each, a chart for every clearance."""
    layout = orbits[0][1].run.trajectory.layout
    loops = [Loop(name, orbit.run, INK, "solid" if orbit.stable else "dashed") for name, orbit in orbits]
    names = layout.clearance_names[:_MOST_TABS]
    more = len(layout.clearance_names) - len(names)
    left = f" {counted(more, 'clearance')} more are left out." if more else ""
    return [
        Chart(
            f"motions-{k + 1}",
            "Phase planes",
            f"Motions of {name}: at the ends of the first branch, and where the stability changes. Deflection rate "
            f"against deflection; dotted: corners; shaded: in contact.{left}",
            tuple(phase_panel([loop], k, loop.name, loops) for loop in loops),
            columns=min(3, len(loops)),
            panel_height=200,
            share_x=False,
            legend=(*SIDES, STABLE, UNSTABLE, START),
            group="motions",
            tab=name,
        )
        for k, name in enumerate(names)
    ]
