"""The channels of a measured file as a figure: each over time, outlined by its extremes."""

from __future__ import annotations

import numpy as np

from gearrattle.measured.look import Contents
from gearrattle.report.plots.chart import Chart, Line, Panel
from gearrattle.report.plots.palette import INK
from gearrattle.wording import counted

_MOST_PANELS = 24


def channels_chart(contents: Contents) -> Chart | None:
    """Draw every channel that has two finite samples or more; None where none has."""
    panels = []
    for name, unit, (time, values) in zip(
        contents.table["channel"], contents.table["unit"], contents.outline, strict=True
    ):
        if np.isfinite(values).sum() > 1:
            x_range = float(time[0]), float(time[-1])
            panels.append(Panel(name, unit, "time  [s]", (Line(time, values, name, INK, width=1.0),), x_range=x_range))
    if not panels:
        return None
    left_out = len(panels) - _MOST_PANELS
    caption = (
        "Every channel over time, in its own unit; of long ones the smallest and largest sample of every part."
        + (f" {counted(left_out, 'channel')} more are in the table." if left_out > 0 else "")
    )
    return Chart("channels", "Channels", caption, tuple(panels[:_MOST_PANELS]), panel_height=120, share_x=False)
