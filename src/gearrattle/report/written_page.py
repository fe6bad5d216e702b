"""A page and its figures as files.

Every result has one template (``page.html.j2``); the report of a run extends it (``run_report.html.j2``). A page needs
nothing else: no network, no folder beside it. Every figure is in it as SVG, which is shown without JavaScript and
printed. On a page that is interactive it is there a second time as data, which ``browser/plot.js``, inlined once, draws
when the figure scrolls into view. A page forbids itself to load anything from elsewhere.
"""

from __future__ import annotations

from pathlib import Path

from markupsafe import Markup

from gearrattle.report.live_figures import page_script, page_style
from gearrattle.report.page import Page
from gearrattle.report.provenance import now, versions
from gearrattle.report.static_figures import fill_figures
from gearrattle.report.templates import templates

_HERE = Path(__file__).parent


def fill_page(page: Page, folder: Path) -> None:
    """Write a page and figures/ into an existing folder that holds neither."""
    drawn = fill_figures(page.charts, folder)
    for section in page.sections:
        for picture in section.pictures:
            (folder / "figures" / f"{picture.key}.svg").write_bytes(picture.svg)
    template = templates().get_template(page.template)
    html = template.render(
        page=page,
        svg={chart.key: svg for chart, svg in drawn},
        created=now(),
        version=versions().get("gearrattle", ""),
        style=Markup((_HERE / "page.css").read_text(encoding="utf-8")) + (page_style() if page.is_interactive else ""),
        script=page_script() if page.is_interactive else page.script,
        **page.values,
    )
    (folder / "report.html").write_text(html, encoding="utf-8")
