"""A validation as one page: the verdict first, then levels, budget, mean cycles, orders, spectra and impacts.

``fill_validation`` writes report.html, summary.json and figures/ into a folder. The page has no script and loads
nothing.

Takes a Validation.
"""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path
from typing import Any

from markupsafe import Markup

from gearrattle.report.drawn import charts_of
from gearrattle.report.ink import fill_figures
from gearrattle.report.provenance import now, versions
from gearrattle.report.saved import write_json
from gearrattle.report.templates import templates
from gearrattle.report.validation_tables import (
    budget_table,
    impacts_table,
    levels_table,
    orders_table,
    parameter_tables,
    setting_table,
    ways_table,
)
from gearrattle.validation import Validation

_HERE = Path(__file__).parent


def validation_content(found: Validation) -> dict[str, Any]:
    """Return everything for machines, in JSON types."""
    return {**found.to_dict(), "versions": versions(), "created": now()}


def fill_validation(found: Validation, folder: Path) -> None:
    """Write all files into an existing folder."""
    drawn = fill_figures(charts_of(found), folder, legend=False)
    figures = {
        chart.key: (chart, f"data:image/svg+xml;base64,{b64encode(svg).decode('ascii')}") for chart, svg in drawn
    }
    tables = {
        "sigma": [levels_table(found)],
        "budget": [budget_table(found), ways_table(found), *parameter_tables(found)],
        "orders": [orders_table(pair) for pair in found.pairs if pair.orders],
    }
    environment = templates()
    page = environment.get_template("validation.html.j2").render(
        title=f"{found.model} against {Path(found.source).name}",
        found=found,
        figures=figures,
        tables=tables,
        impacts=impacts_table(found),
        setting=setting_table(found),
        created=now(),
        version=versions().get("gearrattle", ""),
        style=Markup((_HERE / "page.css").read_text(encoding="utf-8")),
    )
    (folder / "report.html").write_text(page, encoding="utf-8")
    write_json(validation_content(found), folder / "summary.json", "validation summary")
