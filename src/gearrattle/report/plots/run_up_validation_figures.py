"""Figures of a validated run-up: the amplitude of every order over speed, measured and simulated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearrattle.measured.validation import RunUp, Track
from gearrattle.report.plots.chart import Chart, Key, Line, Panel
from gearrattle.report.plots.order_maps import raised
from gearrattle.report.plots.palette import DRIVE, INK, MUTED
from gearrattle.wording import noun_of

MOST = 12
_HEIGHT = 150


def run_up_charts(run_up: RunUp) -> list[Chart]:
    """Return one chart per channel of a validation."""
    repeats = len(run_up.sources) > 1
    how = f"the mean of {len(run_up.sources)} run-ups" if repeats else "one run-up"
    blocks = f"fitted over blocks of {run_up.turns:g} {noun_of(run_up.turns, 'turn')}; measured: {how}"
    return track_charts(run_up.tracks, "simulated", blocks, si=run_up.units == "SI")


def track_charts(tracks: Sequence[Track], partner: str, blocks: str, *, si: bool) -> list[Chart]:
    """Return one chart per channel, one panel per order, the largest first if there are more than a dozen.

    SI speeds [rad/s] are drawn in rpm.
    """
    # 95 % limits where run-ups were repeated
    limits = any(np.isfinite(track.reach).all() for track in tracks)
    legend = (Key("measured", INK), Key(partner, DRIVE), *((Key("95 % limits", MUTED),) if limits else ()))
    charts = []
    for number, channel in enumerate(dict.fromkeys(track.channel for track in tracks), start=1):
        # the largest orders of one channel, ascending
        of_channel = [track for track in tracks if track.channel == channel]
        largest = sorted(of_channel, key=lambda track: -max(track.levels))
        drawn = sorted(largest[:MOST], key=lambda track: track.order)
        left = f" {len(largest) - MOST} smaller orders are not drawn." if len(largest) > MOST else ""
        panels = tuple(_panel(track, partner, si=si) for track in drawn)
        charts.append(
            Chart(
                f"orders_{number}",
                f"Orders of {channel}",
                f"{channel}: amplitudes of orders over speed, {blocks}.{left}",
                panels,
                columns=min(2, len(panels)),
                panel_height=_HEIGHT,
                legend=legend,
            )
        )
    return charts


def _panel(track: Track, partner: str, *, si: bool) -> Panel:
    """Draw one order."""
    x = track.speed * 30.0 / np.pi if si else track.speed
    lines: list[Line] = []
    if np.isfinite(track.reach).all():
        ends = (np.maximum(track.measured + side * track.reach, 0.0) for side in (-1.0, 1.0))
        lines += [Line(x, end, "95 % limit", MUTED, width=0.8) for end in ends]
    lines += [
        Line(x, track.simulated, partner, DRIVE, width=1.6),
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
