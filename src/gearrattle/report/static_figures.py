"""The folder figures/ of a result: every chart as SVG, and a file with the data to draw the charts again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.chart_files import packed_charts
from gearrattle.report.plots.svg_charts import draw

CHARTS = "charts.npz"
"""File in figures/ with the data of the charts."""


def fill_figures(charts: Sequence[Chart], folder: Path) -> list[tuple[Chart, bytes]]:
    """Write figures/ into the folder of a result: every chart as SVG, and the file with the data of the charts.

    Every chart is returned with its SVG for the page, without legend, because the page has its own.
    """
    target = folder / "figures"
    target.mkdir()
    drawn = [(chart, draw(chart)) for chart in charts]
    for chart, svg in drawn:
        (target / f"{chart.key}.svg").write_bytes(draw(chart, legend=True) if chart.legend else svg)
    (target / CHARTS).write_bytes(packed_charts(charts))
    return drawn
