"""A cause as a result: the response of a body to every order of every source by modes, and the linear driveline."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.causes import Cause, Contribution
from gearrattle.json_types import json_value
from gearrattle.report.page import Section, figure_sections
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.row_charts import Series, row_chart
from gearrattle.report.presentation import ModelPresentation
from gearrattle.report.record_dataset import texts
from gearrattle.report.tables import Table
from gearrattle.wording import numeral

if TYPE_CHECKING:
    import xarray as xr


class CausePage(ModelPresentation[Cause]):
    """Presentation of a cause: the orders that accelerate a body, and the modes through which they act."""

    kind = "cause"

    @property
    def sentence(self) -> str:
        return self.result.sentence

    def sections(self) -> tuple[Section, ...]:
        summary = Section("summary", "Summary", self.sentence, tables=self.answer())
        linear = Section("linear", "The linear driveline of the estimate", tables=(self._slopes(),))
        return summary, *figure_sections(self.figures()), linear

    def figures(self) -> list[Chart]:
        items = self.result.contributions
        chart = row_chart(
            "shares",
            "Shares of the forced acceleration",
            "Share of every order of every source in the mean square of the forced acceleration of "
            f"{self.result.body}; below 0 of what acts against the others at its order.",
            [f"order {item.order:g}, {item.source}" for item in items],
            [Series("", np.array([item.share for item in items]))],
            level="share",
            marks=[0.0, 1.0],
        )
        return [] if chart is None else [chart]

    def answer(self) -> tuple[Table, ...]:
        si = self.result.model.units == "SI"
        scale = 1.0 / (2.0 * np.pi) if si else 1.0
        head = ["order", "source", "frequency", "acceleration", "share", "mode", "its frequency", "its damping"]
        if si:
            head[2:4] = "frequency [Hz]", "acceleration [rad/s²]"
            head[6] = "its frequency [Hz]"
        rows = tuple(
            (
                f"{item.order:g}",
                item.source,
                numeral(scale * item.frequency, 4),
                numeral(abs(item.acceleration), 4),
                f"{numeral(100.0 * item.share, 3)} %",
                _mode(item),
                numeral(scale * item.through.frequency, 4) if item.through and item.through.elements else "–",
                numeral(item.through.damping_ratio, 3) if item.through else "–",
            )
            for item in self.result.contributions
        )
        return (Table(tuple(head), rows, frozenset({1, 5})),)

    def content(self) -> dict[str, Any]:
        return cause_content(self.result)

    def numbers(self) -> xr.Dataset:
        import xarray as xr

        # cosine and sine parts of the acceleration, and the mode behind every contribution
        cause = self.result
        si = cause.model.units == "SI"
        items = cause.contributions
        modes = [item.through for item in items]
        nothing = math.nan
        columns: dict[str, tuple[list[float], str]] = {
            "frequency": ([item.frequency for item in items], "rad/s"),
            "acceleration_cosine": ([item.acceleration.real for item in items], "rad/s^2"),
            "acceleration_sine": ([-item.acceleration.imag for item in items], "rad/s^2"),
            "share": ([item.share for item in items], "1"),
            "mode_frequency": ([mode.frequency if mode else nothing for mode in modes], "rad/s"),
            "mode_damping_ratio": ([mode.damping_ratio if mode else nothing for mode in modes], "1"),
            "mode_share": ([mode.share if mode else nothing for mode in modes], "1"),
        }
        # variables over contributions, with units of SI models
        variables: dict[str, Any] = {
            name: ("contribution", np.array(values), {"units": unit if si else "1"})
            for name, (values, unit) in columns.items()
        }
        variables["order"] = ("contribution", np.array([item.order for item in items]), {"units": "1"})
        variables["source"] = ("contribution", texts(item.source for item in items))
        variables["mode"] = ("contribution", texts(map(_mode, items)))
        # linear stiffness and damping of the elements
        for name, values_of in (("stiffness", cause.slopes), ("damping", cause.dampings)):
            variables[name] = ("element", np.array(list(values_of.values())))
        return xr.Dataset(variables, {"element": texts(cause.slopes)}, {"body": cause.body, "error": cause.error})

    def _slopes(self) -> Table:
        rows = tuple(
            (name, numeral(slope, 4), numeral(self.result.dampings[name], 4))
            for name, slope in self.result.slopes.items()
        )
        note = "Slope and damping of every element in its piece, or fitted to its force along the motion; SI units."
        return Table(("element", "stiffness", "damping"), rows, note=note)


def _mode(item: Contribution) -> str:
    """Return the name of the mode through which a contribution acts."""
    if item.through is None:
        return "as prescribed"
    return " and ".join(item.through.elements) or "rigid motion"


def cause_content(cause: Cause) -> dict[str, Any]:
    """Return a cause in JSON types: its sentence, and every contribution with the size of its acceleration [SI]."""
    contributions = [
        {
            "source": item.source,
            "order": item.order,
            "frequency": item.frequency,
            "acceleration": abs(item.acceleration),
            "phase": float(np.angle(item.acceleration)),
            "share": item.share,
            "mode": json_value(item.through),
        }
        for item in cause.contributions
    ]
    return {
        "sentence": cause.sentence,
        "body": cause.body,
        "parts": list(cause.parts),
        "error": json_value(cause.error),
        "contributions": contributions,
        "stiffness": dict(cause.slopes),
        "damping": dict(cause.dampings),
    }
