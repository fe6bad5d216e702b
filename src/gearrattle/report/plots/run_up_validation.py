"""Figures of a validated run-up: the amplitude of every order over speed, measured and simulated.

Takes a RunUp; gives a Chart a channel.
"""

from __future__ import annotations

import numpy as np

from gearrattle.measured.validation import RunUp, Track
from gearrattle.report.plots.chart import Chart, Key, Line, Panel
from gearrattle.report.plots.order_maps import raised
from gearrattle.report.plots.palette import DRIVE, INK, MUTED
from gearrattle.wording import noun_of

MOST = 12
_HEIGHT = 150


def run_up_charts(run_up: RunUp) -> list[Chart]:
    """Return a chart a channel, a panel an order, the largest first if there are more than a dozen."""
    repeats = len(run_up.sources) > 1
    legend = (Key("measured", INK), Key("simulated", DRIVE), *((Key("95 % limits", MUTED),) if repeats else ()))
    charts = []
    for number, channel in enumerate(run_up.channels, start=1):
        tracks = sorted(run_up.of(channel), key=lambda track: -max(track.levels))
        drawn = sorted(tracks[:MOST], key=lambda track: track.order)
        left = f" {len(tracks) - MOST} smaller orders are not drawn." if len(tracks) > MOST else ""
        how = f"the mean of {len(run_up.sources)} run-ups" if repeats else "one run-up"
        caption = (
            f"{channel}: amplitudes of orders over speed, fitted over blocks of {run_up.turns:g} "
            f"{noun_of(run_up.turns, 'turn')}; measured: {how}."
        )
        panels = tuple(_panel(track, si=run_up.units == "SI") for track in drawn)
        charts.append(
            Chart(
                f"orders_{number}",
                f"Orders of {channel}",
                caption + left,
                panels,
                columns=min(2, len(panels)),
                panel_height=_HEIGHT,
                legend=legend,
            )
        )
    return charts


def _panel(track: Track, *, si: bool) -> Panel:
    """Draw one order."""
    x = track.speed * 30.0 / np.pi if si else track.speed
    lines: list[Line] = []
    if np.isfinite(track.reach).all():
        ends = (np.maximum(track.measured + side * track.reach, 0.0) for side in (-1.0, 1.0))
        lines += [Line(x, end, "95 % limit", MUTED, width=0.8) for end in ends]
    lines += [
        Line(x, track.simulated, "simulated", DRIVE, width=1.6),
        Line(x, track.measured, "measured", INK, width=1.6),
    ]
    top = max(float(np.nanmax(line.y)) for line in lines)
    return Panel(
        f"order {track.order:g}",
        "" if track.unit == "1" else raised(track.unit),
        "speed, rpm" if si else "speed",
        tuple(lines),
        x_range=(float(x[0]), float(x[-1])),
        y_range=(0.0, 1.08 * max(top, 1e-300)),
    )
