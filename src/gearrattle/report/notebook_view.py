"""A result in a notebook: its sentence, its first tables and its first figure, static and small.

There is no script and no style sheet, because a notebook that is not trusted removes both. Text has the colours of the
notebook, light or dark; a figure has a white background.
"""

from __future__ import annotations

from base64 import b64encode
from typing import Any

from markupsafe import Markup

from gearrattle.report.plots.svg_charts import draw
from gearrattle.report.result_kinds import presentation_of
from gearrattle.report.tables import shortened
from gearrattle.report.templates import templates

_LARGEST_FIGURE = 120_000  # bytes of SVG
_TABLES = 3


def notebook_view(result: Any) -> str:
    """Return a result of any kind as HTML for a notebook, at most about 200 kB; ModelError if it is not a result."""
    presentation = presentation_of(result)
    tables = [shortened(table) for table in presentation.answer() if table.rows][:_TABLES]
    charts = presentation.charts()
    image = None
    if charts and len(svg := draw(charts[0], legend=True)) <= _LARGEST_FIGURE:
        image = Markup(f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}")
    return (
        templates()
        .get_template("notebook.html.j2")
        .render(
            presentation=presentation,
            tables=tables,
            chart=charts[0] if charts else None,
            image=image,
            count=len(charts),
        )
    )
