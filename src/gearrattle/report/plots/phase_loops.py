"""Closed loops in phase planes: motions that repeat, one or several in a panel.

Dots on a loop mark the starts of its periods T.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gearrattle.assembly import deflection_rate
from gearrattle.report.plots.chart import Band, Dash, Key, Line, Panel, Rule
from gearrattle.report.plots.corner_marks import reach, shading, units_of
from gearrattle.report.plots.motion_window import scale
from gearrattle.report.plots.palette import INK
from gearrattle.results import Run
from gearrattle.trajectory import Array

START = Key("start of a period T", INK, "circle")
_MOST_POINTS = 4000


@dataclass(frozen=True)
class Loop:
    """A motion over whole periods, and how it is drawn."""

    name: str
    run: Run
    colour: str = INK
    dash: Dash = "solid"


def phase_panel(loops: Sequence[Loop], clearance: int, title: str, limits: Sequence[Loop] = ()) -> Panel:
    """Draw loops of drivelines with the same corners in the phase plane of one clearance; there is at least one.

    ``clearance`` is an index into ``layout.clearance``. The loops in ``limits`` decide the limits and the units; by
    default those that are drawn.
    """
    # scales common to all loops
    run = loops[0].run
    layout = run.trajectory.layout
    unit = units_of(run.model, run.trajectory.layout, clearance)
    curves = [_curve(loop.run, clearance) for loop in limits or loops]
    all_x, all_y = (np.concatenate([curve[i] for curve in curves]) for i in (0, 1))
    across = scale(np.concatenate([all_x, layout.corners[clearance]]), unit["deflection"])
    up = scale(all_y, unit["rate"])
    # every loop, with a dot at the start of each period
    lines: list[Line] = []
    for loop in loops:
        x, y = _curve(loop.run, clearance)
        begins = slice(0, -1, loop.run.trajectory.samples_per_cycle)
        step = slice(None, None, max(1, len(x) // _MOST_POINTS))
        lines.append(Line(x[step] * across.factor, y[step] * up.factor, loop.name, loop.colour, dash=loop.dash))
        lines.append(
            Line(
                x[begins] * across.factor,
                y[begins] * up.factor,
                f"{loop.name}: start of a period",
                loop.colour,
                "points",
                6.0,
                shape="circle",
            )
        )
    # shading, corners and limits
    bands, rules = shading(layout, clearance, across.factor)
    x_range = reach(all_x * across.factor, layout.corners[clearance] * across.factor)
    room = 0.08 * (float(np.ptp(all_y)) or 1.0) * up.factor
    y_range = (float(all_y.min()) * up.factor - room, float(all_y.max()) * up.factor + room)
    return Panel(
        title,
        f"rate  [{up.unit}]" if up.unit else "rate",
        f"deflection  [{across.unit}]" if across.unit else "deflection",
        tuple(lines),
        bands=tuple(Band(b.low, b.high, b.colour, "x", b.opacity) for b in bands),
        rules=tuple(Rule(r.at, "x") for r in rules),
        x_range=x_range,
        y_range=y_range,
    )


def _curve(run: Run, clearance: int) -> tuple[Array, Array]:
    """Deflection and its rate."""
    trajectory = run.trajectory
    element = int(trajectory.layout.clearance[clearance])
    return trajectory.deflection[:, clearance], deflection_rate(run.model, trajectory, element)
