"""The reproduction as one page and one file: "paper, ours, why they differ".

``fill`` writes reproduction.html, reproduction.json and figures/ into a folder. The page has no script and loads
nothing.

Takes a Reproduction.
"""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path

from markupsafe import Markup

from gearrattle import report
from gearrattle.report.ink import fill_figures
from gearrattle.report.provenance import now, versions
from gearrattle.report.saved import write_json
from gearrattle.report.tables import Table
from gearrattle.report.templates import templates
from gearrattle.reproduction.record import Reproduction, Section

_HERE, _REPORT = Path(__file__).parent, Path(report.__file__).parent


def fill(found: Reproduction, folder: Path) -> None:
    """Write all files of a reproduction into an existing folder."""
    charts = [chart for section in found.sections for chart in section.charts]
    drawn = {chart.key: svg for chart, svg in fill_figures(charts, folder, legend=False)}
    environment = templates(_HERE)
    page = environment.get_template("reproduction.html.j2").render(
        found=found,
        counts=found.counts(),
        rows={section.key: rows_table(section) for section in found.sections},
        ink={key: f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}" for key, svg in drawn.items()},
        created=now(),
        version=versions().get("gearrattle", ""),
        style=Markup((_REPORT / "page.css").read_text(encoding="utf-8")),
    )
    (folder / "reproduction.html").write_text(page, encoding="utf-8")
    content = {**found.to_dict(), "created": now(), "versions": versions()}
    write_json(content, folder / "reproduction.json", "reproduction summary")


def rows_table(section: Section) -> Table:
    """A section's rows as a table of words."""
    lines = tuple((each.item, each.paper, each.ours, each.verdict, each.why) for each in section.rows)
    return Table(("", "paper", "ours", "status", "why"), lines, frozenset(range(5)))
