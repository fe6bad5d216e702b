"""The smallest pulses that tip a motion over, over the instants of its period."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearrattle.report.plots.axis_names import Measure
from gearrattle.report.plots.chart import Chart, Key, Line, Panel, Rule
from gearrattle.report.plots.palette import COAST, DRIVE

if TYPE_CHECKING:
    import pandas as pd

_KEYS = {"forward": Key("forward", DRIVE, "circle"), "backward": Key("backward", COAST, "diamond")}


def tipping_chart(pulses: pd.DataFrame, pulse: Measure) -> Chart:
    """Draw the smallest pulses of ``Orbit.tipping`` over the share of the motion's periods."""
    share = pulses["share"].to_numpy()
    lines = tuple(
        Line(share, pulses[way].to_numpy() * pulse.factor, way, key.colour, "points", 9.0, shape=key.shape)
        for way, key in _KEYS.items()
        if pulses[way].notna().any()
    )
    x_title = f"share of {pulses.attrs['cycles']} T"
    panel = Panel(pulse.words, pulse.unit, x_title, lines, rules=(Rule(0.0, dashed=False),), x_range=(-0.02, 1.0))
    caption = (
        f"Smallest pulse of torque on {pulses.attrs['on']} that tips the motion over, over the instant at which it "
        "acts. After smaller ones of those that were tried it comes back."
    )
    legend = tuple(_KEYS[line.name] for line in lines)
    return Chart("tipping", "Pulses that tip the motion over", caption, (panel,) * bool(lines), 1, 300, legend=legend)
