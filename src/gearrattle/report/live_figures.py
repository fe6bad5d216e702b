"""Interactive figures of a page: their data, and the script that draws them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from markupsafe import Markup

from gearrattle.report.browser import widgets
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.interactive import chart_json

_HERE = Path(__file__).parent


def chart_data(chart: Chart) -> Markup:
    """Return a chart as data to be embedded in a page."""
    return embedded(chart_json(chart))


def embedded(content: Any) -> Markup:
    """Return JSON for the script element of a page, escaped so that nothing in it ends the element."""
    return Markup(json.dumps(content, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"))


def page_script() -> Markup:
    """Return the script that makes the figures of a page interactive, with the parts that draw them."""
    return Markup(widgets.with_parts((_HERE / "page.js").read_text(encoding="utf-8")))


def page_style() -> Markup:
    """Return the style sheet of the parts that draw the figures."""
    return Markup(widgets.style())
