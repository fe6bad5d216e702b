"""Floquet multipliers in the complex plane with the unit circle: the disturbance of a multiplier inside it decays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearrattle.report.plots.chart import Line, Panel, Rule
from gearrattle.report.plots.palette import CENTRE, MUTED

_MOST_SHOWN = 2.0
"""Largest modulus that the limits of the axes take into account."""


def unit_circle(marks: Sequence[Line], title: str) -> Panel:
    """Draw multipliers: x the real, y the imaginary parts."""
    turn = np.linspace(0.0, 2.0 * np.pi, 241)
    circle = Line(np.cos(turn), np.sin(turn), "unit circle", MUTED, width=1.0, dash="solid")
    sizes = np.concatenate([np.zeros(1), *(np.hypot(mark.x, mark.y) for mark in marks)])
    radius = 1.12 * max(1.0, min(float(sizes.max()), _MOST_SHOWN))
    return Panel(
        title,
        "imaginary part",
        "real part",
        (circle, *marks),
        rules=(Rule(0.0, "x", CENTRE), Rule(0.0, "y", CENTRE)),
        x_range=(-radius, radius),
        y_range=(-radius, radius),
        equal_scales=True,
    )


def outside_words(marks: Sequence[Line]) -> str:
    """Say how many multipliers may lie beyond the figure, which is wider than high; empty for none."""
    beyond = sum(int(np.count_nonzero(np.hypot(mark.x, mark.y) > _MOST_SHOWN)) for mark in marks)
    return f" {beyond} with a modulus above {_MOST_SHOWN:g} may lie outside the figure." if beyond else ""
