"""A screening as one page: which gears lift off and where, the maps, and the tables behind them.

``fill_screening`` writes report.html, results.nc, summary.json and figures/ into a folder. The maps are interactive,
and ink without JavaScript; the page loads nothing.

Takes the Dataset of ``gearrattle.screen``.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearrattle.json_types import json_value
from gearrattle.report.drawn import charts_of
from gearrattle.report.page import Page, Section, fill_page
from gearrattle.report.provenance import now, versions
from gearrattle.report.saved import write_json, write_netcdf
from gearrattle.report.screening_tables import (
    gears_of,
    gears_table,
    inside,
    setting_of,
    summary_of,
    thresholds_table,
)

if TYPE_CHECKING:
    import xarray as xr


def screening_content(data: xr.Dataset) -> dict[str, Any]:
    """Return everything for machines, in JSON types: speeds in rad/s; infinite ratios become None."""
    gears = []
    for each in gears_of(data):
        at = {"speed": float(data["speed"].values[each.speed]), "load": float(data["load"].values[each.load])}
        gears.append({**asdict(each), **at})
    names = ("separation_ratio", "margin", "lift_ratio", "inside", *(("regime",) if "regime" in data else ()))
    return {
        "title": str(data.attrs["title"]),
        "units": str(data.attrs["units"]),
        "summary": summary_of(data),
        "cases": int(inside(data).size),
        "exact": int(inside(data).sum()),
        "gears": json_value(gears),
        "axes": {str(name): json_value(each.values) for name, each in data.coords.items()},
        "dimensions": ["speed", "load", "gear"],
        **{name: json_value(data[name].values) for name in names},
        "versions": versions(),
        "created": now(),
    }


def fill_screening(data: xr.Dataset, folder: Path, *, title: str) -> None:
    """Write all files into an existing empty folder.

    Args:
        data: what ``screen`` returned.
        folder: where to.
        title: heading of the page.
    """
    gears = Section(
        "summary", "Which gears lift off", summary_of(data), (setting_of(data),), tables=(gears_table(data),)
    )
    figures = [Section(chart.key, chart.title, charts=(chart,)) for chart in charts_of(data)]
    table = thresholds_table(data)
    thresholds = [Section("thresholds", "Thresholds", tables=(table,))] if table.rows else []
    fill_page(Page("screening", title, (gears, *figures, *thresholds), is_interactive=True), folder)
    write_json(screening_content(data), folder / "summary.json", "screening summary")
    write_netcdf(data, folder / "results.nc", "screening")
