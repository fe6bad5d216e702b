"""The static equilibrium as a figure: elements with corners at rest on their characteristic."""

from __future__ import annotations

import numpy as np

from gearrattle.analysis.statics import Equilibrium
from gearrattle.assembly import assemble
from gearrattle.report.plots.chart import Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.corner_marks import SIDES, reach, shading
from gearrattle.report.plots.motion_window import scale
from gearrattle.report.plots.palette import INK, MUTED

_MOST_PANELS = 12
_POINTS = 201


def rest_chart(rest: Equilibrium) -> Chart | None:
    """Draw torque or force over deflection with the point of rest; None where no element has a corner."""
    # the first elements with corners
    driveline = assemble(rest.model)
    layout = driveline.layout
    si = rest.model.units == "SI"
    panels = []
    for j, k in enumerate(layout.clearance[:_MOST_PANELS].tolist()):
        # limits that show all corners and the rest
        name = layout.element_names[k]
        law = driveline.system.laws[k]
        is_mesh = bool(layout.is_mesh[k])
        at = rest.deflection[name]
        low, high = reach(np.array([at]), law.corners)
        low = min(low, *law.corners)
        high = max(high, *law.corners)
        margin = 0.25 * (high - low)
        # the elastic characteristic, with a sample at each corner
        deflection = np.union1d(np.linspace(low - margin, high + margin, _POINTS), [*law.corners, at])
        force = np.array([law.elastic(float(value)) for value in deflection])
        # scales and shading
        across = scale(deflection, ("m" if is_mesh else "rad") if si else "")
        up = scale(force, ("N" if is_mesh else "N m") if si else "")
        bands = tuple(
            type(band)(band.low, band.high, band.colour, along="x") for band in shading(layout, j, across.factor)[0]
        )
        x = deflection * across.factor
        # the characteristic and the rest on it
        lines = (
            Line(x, force * up.factor, name, MUTED, width=1.6),
            Line(np.array([at]) * across.factor, np.array([law.elastic(at)]) * up.factor, "rest", INK, "points", 9.0),
        )
        title = f"deflection  [{across.unit}]" if across.unit else "deflection"
        ends = float(x[0]), float(x[-1])
        panels.append(Panel(name, up.unit, title, lines, bands=bands, rules=(Rule(0.0, dashed=False),), x_range=ends))
    if not panels:
        return None
    left_out = len(layout.clearance) - len(panels)
    caption = (
        "Static torque over deflection, of meshes the force along the line of action. The dot: where the element rests "
        "under the mean loads. Shaded: in contact." + (f" {left_out} more are in the table." if left_out > 0 else "")
    )
    return Chart(
        "rest",
        "Where the elements rest",
        caption,
        tuple(panels),
        columns=min(2, len(panels)),
        panel_height=190,
        share_x=False,
        legend=(Key("rest", INK), *SIDES),
    )
