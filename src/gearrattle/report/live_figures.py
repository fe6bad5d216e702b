"""Interactive figures of a page: their data for plotly.js, plotly.js itself, and the page's own script."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path

from markupsafe import Markup

from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.interactive import plotly_figure

_HERE = Path(__file__).parent


def plotly_data(chart: Chart) -> Markup:
    """Return a chart as data for plotly.js, to stand in a page."""
    data = json.dumps(plotly_figure(chart), allow_nan=False, separators=(",", ":"))
    return Markup(data.replace("<", "\\u003c"))


def page_script() -> Markup:
    """Return what makes a page's figures interactive."""
    return Markup((_HERE / "page.js").read_text(encoding="utf-8"))


def plotly_script() -> Markup:
    """Return plotly.js as the plotly package carries it, found without importing plotly."""
    spec = find_spec("plotly")
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError("plotly is not installed: pip install plotly")
    return Markup((Path(spec.origin).parent / "package_data" / "plotly.min.js").read_text(encoding="utf-8"))
