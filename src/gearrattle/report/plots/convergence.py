"""Convergence of a probability: the share of the first 1, 2, 3, ... samples that rattle, with its interval."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearrattle.report.plots.chart import Chart, Line, Panel
from gearrattle.report.plots.palette import ACCENT, MUTED
from gearrattle.report.plots.study_sweep_figures import subjects_of
from gearrattle.studies.dataset_layout import (
    axes_in,
    chosen_codes,
    gaps_of,
    has_probabilities,
    independent,
    rattling_from,
    subject_of,
    values_of,
)
from gearrattle.studies.probability import running

if TYPE_CHECKING:
    import xarray as xr

_FEWEST = 8
_MOST_PANELS = 6
_MOST_POINTS = 600


def probability_convergence(data: xr.Dataset) -> Chart | None:
    """Draw the running share of samples that rattle, one panel per part that rattles in some; None without any."""
    # codes of independent samples alone
    output = chosen_codes(data)
    if not output or not has_probabilities(data) or axes_in(data):
        return None
    codes = gaps_of(values_of(independent(data), output))
    panels = []
    # running share and Wilson interval of every subject
    for name, subject_codes in subjects_of(codes, subject_of(data, output)):
        n, share, low, high = running(np.asarray(subject_codes.values), rattling_from(codes))
        if n.size < _FEWEST or not 0.0 < share[-1] < 1.0:
            continue
        # samples equally apart on the logarithmic axis
        shown = np.unique(np.geomspace(1, n.size, _MOST_POINTS).round().astype(int)) - 1
        lines = (
            Line(n[shown], low[shown], "95 % interval", MUTED, width=0.9),
            Line(n[shown], high[shown], "95 % interval", MUTED, width=0.9),
            Line(n[shown], share[shown], "share", ACCENT, width=1.8),
        )
        panels.append(
            Panel(
                name or output,
                "",
                "samples",
                lines,
                x_range=(1.0, float(n[-1])),
                x_log=True,
                y_range=(0.0, 1.0),
                y_ticks=tuple((v / 4, f"{25 * v} %") for v in range(5)),
            )
        )
    if not panels:
        return None
    # caption and grid of panels
    caption = (
        "Share of the first samples that rattle, over their number; thin: Wilson's 95 % interval. Where the curve "
        "still drifts out of the interval of fewer samples, more are needed."
    )
    shown_panels = tuple(panels[:_MOST_PANELS])
    return Chart(
        "convergence",
        "How the probability settles",
        caption,
        shown_panels,
        columns=min(2, len(shown_panels)),
        panel_height=170,
        share_x=True,
    )
