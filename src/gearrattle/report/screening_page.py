"""A screening as a result: the gears that lift off, by speed and load, with maps and tables."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from gearrattle.json_types import json_value
from gearrattle.report.page import Section, figure_sections, notes_section
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.screening_figure import screening_map
from gearrattle.report.presentation import Presentation
from gearrattle.report.screening_tables import (
    checks_table,
    gears_of,
    gears_table,
    inside,
    setting_of,
    summary_of,
    thresholds_table,
)
from gearrattle.report.tables import Table
from gearrattle.studies.screening_check import FORECASTS

if TYPE_CHECKING:
    import xarray as xr


class ScreeningPage(Presentation["xr.Dataset"]):
    """Presentation of a screening of loose gears over speed and load; the maps are interactive."""

    kind = "screening"
    is_interactive = True
    is_data = True

    def __init__(self, result: xr.Dataset, title: str = "") -> None:
        """Present a screening; the title is the Dataset's own by default."""
        super().__init__(result)
        self._title = title

    @property
    def title(self) -> str:
        return self._title or str(self.result.attrs["title"])

    @property
    def sentence(self) -> str:
        return summary_of(self.result)

    def sections(self) -> tuple[Section, ...]:
        data = self.result
        words = (setting_of(data),)
        gears = Section("summary", "Which gears lift off", self.sentence, words, tables=(gears_table(data),))
        figures = figure_sections(self.charts())
        thresholds = Section("thresholds", "Thresholds", tables=(thresholds_table(data),))
        checks = checks_table(data)
        check = (Section("check", "Forecast and simulation", tables=(checks,)),) if checks.rows else ()
        return gears, *check, *figures, thresholds, *notes_section(self.notes)

    def charts(self) -> list[Chart]:
        return [screening_map(self.result), screening_map(self.result, "separation_ratio")]

    def answer(self) -> tuple[Table, ...]:
        return tuple(table for table in (gears_table(self.result), checks_table(self.result)) if table.rows)

    def content(self) -> dict[str, Any]:
        """Return everything for machines: speeds in rad/s; infinite ratios become None."""
        # gears with speed and load of their largest margin
        data = self.result
        gears = []
        for gear in gears_of(data):
            position = {"speed": float(data["speed"].values[gear.speed]), "load": float(data["load"].values[gear.load])}
            gears.append({**asdict(gear), **position})
        # arrays over speed, load and gear, as far as the screening has them
        wanted = (
            "separation_ratio",
            "margin",
            "lift_ratio",
            "lift_low",
            "lift_high",
            "forecast",
            "inside",
            "severity",
            "regime",
        )
        names = [name for name in wanted if name in data]
        return {
            "units": str(data.attrs["units"]),
            "cases": int(inside(data).size),
            "exact": int(inside(data).sum()),
            "gears": json_value(gears),
            "axes": {str(name): json_value(coordinate.values) for name, coordinate in data.coords.items()},
            "dimensions": ["speed", "load", "gear"],
            "forecasts": list(FORECASTS),
            "notes": list(self.notes),
            **{name: json_value(data[name].values) for name in names},
        }

    def numbers(self) -> xr.Dataset:
        return self.result
