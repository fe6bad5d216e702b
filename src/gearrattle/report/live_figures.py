"""Figures that a page shows as ink and, with JavaScript, as interactive plots.

A figure is in the page twice: as SVG, which is shown without JavaScript and printed, and as data that plotly.js,
inlined once, turns into a plot when it scrolls into view (``page.js``).

Takes Charts and their SVG; gives what the templates need.
"""

from __future__ import annotations

import json
from base64 import b64encode
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from markupsafe import Markup

from gearrattle.plots.chart import Chart
from gearrattle.plots.interactive import plotly_figure

_HERE = Path(__file__).parent


@dataclass(frozen=True)
class Figure:
    """A chart as the page needs it: ink as a data address, and data for plotly."""

    chart: Chart
    ink: str
    data: str


def figure_of(chart: Chart, svg: bytes) -> Figure:
    """Return a chart and its SVG, ready for a template."""
    data = json.dumps(plotly_figure(chart), allow_nan=False, separators=(",", ":"))
    return Figure(
        chart,
        ink=f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}",
        data=Markup(data.replace("<", "\\u003c")),
    )


def page_script() -> Markup:
    """Return what makes a page's figures interactive."""
    return Markup((_HERE / "page.js").read_text(encoding="utf-8"))


def plotly_script() -> Markup:
    """Return plotly.js as the plotly package carries it, found without importing plotly."""
    spec = find_spec("plotly")
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError("plotly is not installed: pip install plotly")
    return Markup((Path(spec.origin).parent / "package_data" / "plotly.min.js").read_text(encoding="utf-8"))
