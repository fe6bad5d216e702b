"""A validation as one page: the verdict first, then levels, budget, mean cycles, orders, spectra and impacts.

``fill_validation`` writes report.html, summary.json and figures/ into a folder. The page has no script and loads
nothing.

Takes a Validation.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gearrattle.report.drawn import charts_of
from gearrattle.report.page import Page, Section, fill_page, notes_section
from gearrattle.report.provenance import now, versions
from gearrattle.report.saved import write_json
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


def validation_content(found: Validation) -> dict[str, Any]:
    """Return everything for machines, in JSON types."""
    return {**found.to_dict(), "versions": versions(), "created": now()}


def fill_validation(found: Validation, folder: Path) -> None:
    """Write all files into an existing folder."""
    fill_page(Page("validation", _title(found), _sections(found), has_legends=False), folder)
    write_json(validation_content(found), folder / "summary.json", "validation summary")


def _title(found: Validation) -> str:
    return f"{found.model} against {Path(found.source).name}"


def _sections(found: Validation) -> tuple[Section, ...]:
    tables = {
        "sigma": (levels_table(found),),
        "budget": (budget_table(found), ways_table(found), *parameter_tables(found)),
        "orders": tuple(orders_table(pair) for pair in found.pairs if pair.orders),
    }
    figures = [
        Section(chart.key, chart.title, charts=(chart,), tables=tables.get(chart.key, ())) for chart in charts_of(found)
    ]
    impacts = [Section("impacts", "Impacts", tables=(impacts_table(found),))] if found.impacts else []
    return (
        Section("verdict", "Verdict", found.verdict, notes=tuple(found.findings)),
        *figures,
        *impacts,
        Section("setting", "What was compared", tables=(setting_table(found),)),
        *notes_section(tuple(found.notes)),
    )
