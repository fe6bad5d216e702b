"""Contact ratios as a result: the mean slope of every clearance, with limits or with all fixed points of a forecast."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.report.page import Section, figure_sections, notes_section
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.palette import ACCENT, CENTRE
from gearrattle.report.plots.row_charts import Series, row_chart
from gearrattle.report.presentation import Presentation
from gearrattle.report.record_dataset import texts
from gearrattle.report.tables import Table
from gearrattle.trajectory import Array
from gearrattle.wording import counted

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_POINT = ("gain", "mean_slope", "mean", "deviation")


class ContactRatioPage(Presentation["pd.Series[float]"]):
    """The stiffness contact ratio of every clearance."""

    kind = "contact ratio"
    result: pd.Series[float]

    @property
    def title(self) -> str:
        return f"Contact ratio: {self.result.attrs['quantity']}"

    @property
    def sentence(self) -> str:
        ratios = ", ".join(f"{name} {ratio:.4g}" for name, ratio in self.result.items())
        words = f"By {self.result.attrs['quantity']} ({self.result.name}): {ratios or 'there is no clearance'}."
        points = self._points()
        return f"{words} The forecast has {counted(len(points), 'fixed point')}." if points else words

    def sections(self) -> tuple[Section, ...]:
        summary = Section("summary", "Summary", self.sentence, tables=(self._ratios(),))
        points = Section("fixed-points", "Fixed points", tables=tuple(self._fixed_points()))
        figures = figure_sections(self.figures())
        return summary, *figures, *([points] if points.tables else []), *notes_section(self.notes)

    def figures(self) -> list[Chart]:
        low, high = self._limits()
        points = [np.array([point["mean_slope"][name] for name in self.result.index]) for point in self._points()]
        others = [Series("" if i else "another fixed point", values, CENTRE) for i, values in enumerate(points[1:])]
        ratio = Series("ratio" if others else "", np.array(self.result.tolist()), ACCENT, low, high)
        chart = row_chart(
            "ratios",
            "Contact ratios",
            "Ratio of every clearance, with its limits: 0 is always free, 1 always in contact.",
            [str(name) for name in self.result.index],
            [*others, ratio],
            level="contact ratio",
            marks=[0.0, 1.0],
        )
        return [] if chart is None else [chart]

    def answer(self) -> tuple[Table, ...]:
        return self._ratios(), *self._fixed_points()

    def content(self) -> dict[str, Any]:
        values = {str(name): json_value(ratio) for name, ratio in self.result.items()}
        others = {str(name): json_value(value) for name, value in self.result.attrs.items()}
        return {"method": str(self.result.name), **others, "ratios": values}

    def numbers(self) -> xr.Dataset:
        import xarray as xr

        names = [str(name) for name in self.result.index]
        unit = {"units": "1"}
        variables: dict[str, Any] = {"ratio": ("clearance", self.result.to_numpy(), unit)}
        for name in ("low", "high"):
            if name in self.result.attrs:
                column = [float(self.result.attrs[name][clearance]) for clearance in names]
                variables[name] = ("clearance", column, unit)
        points = self._points()
        for name in _POINT if points else ():
            values = [[float(point[name][clearance]) for clearance in names] for point in points]
            variables[f"fixed_point_{name}"] = (("fixed_point", "clearance"), values)
        if points:
            variables["fixed_point_motion"] = ("fixed_point", texts(point["motion"] for point in points))
            variables["fixed_point_starts"] = ("fixed_point", [int(point["starts"]) for point in points])
        attributes = {"method": str(self.result.name), "quantity": self.result.attrs["quantity"]}
        return xr.Dataset(variables, {"clearance": texts(names)}, attributes)

    def _points(self) -> list[dict[str, Any]]:
        return list(self.result.attrs.get("fixed_points", ()))

    def _limits(self) -> tuple[Array, Array]:
        """Lower and upper limits of the ratios; NaN for ratios without limits."""
        low, high = (
            np.array([self.result.attrs.get(name, {}).get(clearance, np.nan) for clearance in self.result.index])
            for name in ("low", "high")
        )
        return low, high

    def _ratios(self) -> Table:
        """The ratios, with their limits if they have any."""
        limits = self._limits()
        has_limits = bool(np.isfinite(limits).any())
        rows = []
        for (name, ratio), low, high in zip(self.result.items(), *limits, strict=True):
            rows.append((str(name), f"{ratio:.4g}", *([f"{low:.4g} to {high:.4g}"] if has_limits else [])))
        return Table(("clearance", "ratio", *(["limits"] if has_limits else [])), tuple(rows))

    def _fixed_points(self) -> list[Table]:
        """Every fixed point of a forecast, one row per clearance."""
        rows = []
        for number, point in enumerate(self._points(), start=1):
            for i, clearance in enumerate(self.result.index):
                values = (f"{point[name][clearance]:.4g}" for name in _POINT)
                first = (f"{number}", point["motion"], f"{point['starts']}") if i == 0 else ("", "", "")
                rows.append((*first, str(clearance), *values))
        head = ("fixed point", "motion", "searches", "clearance", "gain", "mean slope", "mean", "deviation")
        return [Table(head, tuple(rows), frozenset({1, 3}), title="Fixed points")] if rows else []
