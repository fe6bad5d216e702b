"""figures/ of a result: every chart as ink, and the charts themselves, so that they can be drawn anew.

Takes Charts and a folder; gives their ink to the page.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gearrattle.plots.chart import Chart
from gearrattle.plots.static import draw
from gearrattle.plots.stored import packed_charts

CHARTS = "charts.npz"
"""File in figures/ that keeps the charts themselves."""


def fill_figures(found: Sequence[Chart], folder: Path, *, legend: bool = True) -> list[tuple[Chart, bytes]]:
    """Write figures/ of a result: every chart as ink, and the charts themselves.

    Args:
        found: its charts.
        folder: of the result; figures/ is made there.
        legend: whether files carry their legends; a page has its own.

    Returns:
        Every chart with its ink for the page, without legend.
    """
    place = folder / "figures"
    place.mkdir()
    drawn = [(chart, draw(chart)) for chart in found]
    for chart, svg in drawn:
        (place / f"{chart.key}.svg").write_bytes(draw(chart, legend=True) if legend else svg)
    (place / CHARTS).write_bytes(packed_charts(found))
    return drawn
