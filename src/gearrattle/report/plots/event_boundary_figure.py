"""An event of a branch as a curve in the plane of two values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from gearrattle.orbits.two_parameters.special_points import SpecialPoint
from gearrattle.report.plots.axis_names import Measure
from gearrattle.report.plots.chart import Chart, Line, Panel, Rule
from gearrattle.report.plots.motion_map_figure import special_keys, special_lines
from gearrattle.report.plots.palette import ACCENT

if TYPE_CHECKING:
    import xarray as xr


def event_boundary_chart(
    curve: xr.Dataset, event: str, points: Sequence[SpecialPoint], across: Measure, up: Measure
) -> Chart:
    """Draw the curve of ``Branch.boundary``, its special points, and the model's own second value."""
    line = Line(curve["value"].values * across.factor, curve["second"].values * up.factor, event, ACCENT, width=2.0)
    own = Rule(float(curve.attrs["own"]) * up.factor, label="the model's own")
    panel = Panel(up.words, up.unit, across.title, (line, *special_lines(points, across, up)), rules=(own,))
    caption = (
        f"{across.words.capitalize()} across, {up.words} up. Line: where the motions of the branch have the {event}; "
        f"dashed: the model's own {up.words}, from which it was followed."
    )
    legend = tuple(special_keys(points))
    return Chart("event-boundary", "Event over two values", caption, (panel,), panel_height=380, legend=legend)
