"""Evaluations of a study as results: sensitivities, probabilities of rattle, the boundary of regimes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.report.plots.boundaries import boundary_chart
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.sample_figures import bars_of_probability, tornado_chart, tornado_panels
from gearrattle.report.plots.sensitivities import sobol_chart, sobol_panels, swing_chart, swing_panels
from gearrattle.report.presentation import Presentation
from gearrattle.report.sensitivity_tables import output_tables
from gearrattle.report.study_tables import changes_table, probabilities_table
from gearrattle.report.tables import Table
from gearrattle.studies.designs import ONE_AT_A_TIME, PAIRS, SALTELLI
from gearrattle.studies.regime_boundary import CROSSING
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr


class _OfStudy(Presentation["xr.Dataset"]):
    """Common to what is made of a study: tables, a figure if there is one, and all numbers by name."""

    is_data = True

    @property
    def title(self) -> str:
        return f"{self.kind[:1].upper()}{self.kind[1:]}: {self.result.attrs['output']}"

    def content(self) -> dict[str, Any]:
        data = self.result
        values = {str(name): json_value(variable.values) for name, variable in data.variables.items()}
        dimensions = {str(name): [str(dim) for dim in variable.dims] for name, variable in data.variables.items()}
        attributes = {str(name): json_value(value) for name, value in data.attrs.items() if name != "result"}
        return {**attributes, "values": values, "dimensions": dimensions}

    def numbers(self) -> xr.Dataset:
        return self.result


class SensitivitiesPage(_OfStudy):
    """Presentation of the sensitivities of an output to every value that scatters."""

    kind = "sensitivities"

    @property
    def sentence(self) -> str:
        data = self.result
        output = str(self.result.attrs["output"])
        strengths = np.abs(data[self._measure()].values)
        strengths = strengths if data.attrs["subject"] else strengths[None, :]
        if not np.isfinite(strengths).any():
            return f"{output} follows none of {counted(data.sizes['value'], 'value')}: it is the same in all cases."
        largest = np.nan_to_num(strengths, nan=-1.0)
        words = dict.fromkeys(str(data["label"].values[int(np.argmax(row))]) for row in largest if row.max() > 0.0)
        most = " and ".join(words)
        values = data.sizes["value"]
        others = f"of {counted(values, 'value')} that scatter" if values > 1 else "the only value that scatters"
        return f"{output} follows {most}{' most' if values > 1 else ''}, {others}."

    def answer(self) -> tuple[Table, ...]:
        return tuple(output_tables(self.result, self._measured()))

    def figures(self) -> list[Chart]:
        data = self.result
        measured = self._measured()
        count = self.result.sizes["value"]
        if self._measure() == "total_order":
            chart = sobol_chart(sobol_panels(data, measured), count)
        elif self._measure() == "swing":
            chart = swing_chart(swing_panels(data, measured), count)
        else:
            chart = tornado_chart(tornado_panels(data, measured), count)
        return [] if chart is None else [chart]

    def _measure(self) -> str:
        """By what values are said to decide."""
        method = str(self.result.attrs["sampling"])
        return {SALTELLI: "total_order", PAIRS: "total_order", ONE_AT_A_TIME: "swing"}.get(method, "rank_regression")

    def _measured(self) -> xr.Dataset:
        """The values that scatter, with words and units, as a study has them."""
        import xarray as xr

        data = self.result
        ends = [data[name] for name in ("low_value", "high_value") if name in data]
        columns = np.array([end.isel({dim: 0 for dim in end.dims if dim != "value"}).values for end in ends])
        return xr.Dataset(
            {
                str(path): (
                    "end",
                    columns[:, i] if ends else np.zeros(0),
                    {"long_name": str(data["label"].values[i]), "units": str(data["unit"].values[i])},
                )
                for i, path in enumerate(data["value"].values)
            }
        )


class ProbabilityPage(_OfStudy):
    """Presentation of the probability of rattle of every part, with its interval."""

    kind = "rattle probability"

    @property
    def sentence(self) -> str:
        shares = self.result["probability"].values
        if not np.isfinite(shares).any():
            return "No part has a gap and a sample: nothing can be said of rattle."
        level = 100.0 * float(self.result.attrs["level"])
        low, high = (f"{100.0 * value:.0f}" for value in (np.nanmin(shares), np.nanmax(shares)))
        if shares.size == 1:
            return f"The probability of rattle is {low} %, with its {level:g} % interval."
        return f"{shares.size} probabilities of rattle, from {low} to {high} %, each with its {level:g} % interval."

    def answer(self) -> tuple[Table, ...]:
        return (probabilities_table(self.result),)

    def figures(self) -> list[Chart]:
        alone = set(self.result["probability"].dims) <= {self.result.attrs["subject"]}
        chart = bars_of_probability(self.result) if alone else None
        return [] if chart is None else [chart]


class BoundaryPage(_OfStudy):
    """Presentation of the boundary of regimes over the grid."""

    kind = "regime boundary"

    @property
    def sentence(self) -> str:
        count = self.result.sizes.get(CROSSING, 0)
        output = self.result.attrs["output"]
        return f"The {output} changes between neighbouring values of the grid at {counted(count, 'place')}."

    def answer(self) -> tuple[Table, ...]:
        if "along" not in self.result:
            return ()
        return (changes_table(self.result, self.result, self._varied(), str(self.result.attrs["subject"])),)

    def figures(self) -> list[Chart]:
        chart = boundary_chart(self.result, self._varied(), str(self.result.attrs["subject"]))
        return [] if chart is None else [chart]

    def _varied(self) -> list[str]:
        """Names of what varies."""
        known = {"along", "below", "above", "from", "to", str(self.result.attrs["subject"])}
        return [str(name) for name in self.result.data_vars if str(name) not in known]
