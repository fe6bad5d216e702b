"""The smallest pulses of torque that tip a motion over, as a result."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.json_types import json_value
from gearrattle.report.plots.axis_names import Measure, measure_at
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.plots.tipping import tipping_chart
from gearrattle.report.presentation import Presentation
from gearrattle.report.tables import Table
from gearrattle.wording import listed

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_WAYS = ("forward", "backward")
_NOTE = (
    "Pulses are tried in steps of 10 %, and where the time until the motion is back has a maximum; the border is then "
    "found by bisection. Ranges of smaller pulses that tip the motion over as well may not be seen where they are "
    "narrower: the error says how well this border is known, not that no smaller pulse does it."
)
_UNSURE = 1e-5  # of a pulse: a larger error is named


class TippingPage(Presentation["pd.DataFrame"]):
    """The smallest pulses at some instants of a motion."""

    kind = "tipping pulses"
    is_interactive = True

    @property
    def title(self) -> str:
        return str(self.result.attrs["title"]) or "Driveline"

    @property
    def sentence(self) -> str:
        table: pd.DataFrame = self.result
        pulse = self._pulse
        parts = []
        for way in _WAYS:
            if table[way].notna().any():
                sizes = np.abs(table[way].to_numpy())
                shares = table["share"].to_numpy()
                least = int(np.nanargmin(sizes))
                at = f"at {numeral(float(shares[least]))} of {table.attrs['cycles']} T"
                parts.append(f"{pulse.with_unit(float(sizes[least]))} {way} ({at})")
        if not parts:
            return f"No pulse on {table.attrs['on']} that was tried tips the motion over."
        return f"The smallest pulses on {table.attrs['on']} that tip the motion over are {listed(parts)}."

    @cached_property
    def _pulse(self) -> Measure:
        """Return the name of a pulse, and its unit."""
        sizes = np.abs(self.result[list(_WAYS)].to_numpy())
        largest = float(np.nanmax(sizes, initial=0.0))
        return measure_at("", "smallest pulse", self._unit("N m s"), largest)

    def _unit(self, unit: str) -> str:
        return unit if self.result.attrs["units"] == "SI" else ""

    def figures(self) -> tuple[Chart, ...]:
        return (tipping_chart(self.result, self._pulse),)

    def answer(self) -> tuple[Table, ...]:
        table = self.result
        pulse = self._pulse
        ways = (table[way].to_numpy() * pulse.factor for way in _WAYS)
        columns = np.stack([table["share"].to_numpy(), table["time"].to_numpy(), *ways], axis=1).tolist()
        rows = tuple(tuple(numeral(value, 6) for value in row) for row in columns)
        time, impulse = (f" [{unit}]" if unit else "" for unit in (self._unit("s"), pulse.unit))
        head = (f"share of {table.attrs['cycles']} T", f"time{time}", *(f"{way}{impulse}" for way in _WAYS))
        return (Table(head, rows, title="Smallest pulses that tip the motion over", note=self._note),)

    @property
    def _note(self) -> str:
        """How pulses are sought, how far they are not certain, and where they lead to what does not settle."""
        table = self.result
        share = max(float(np.nan_to_num(table[f"{way}_error"] / table[way].abs()).max(initial=0.0)) for way in _WAYS)
        unsure = (
            f"Up to {share:.2g} of a pulse below it, it is not decided where pulses lead." if share > _UNSURE else ""
        )
        return " ".join(filter(None, (_NOTE, unsure, *table.attrs["notes"])))

    def content(self) -> dict[str, Any]:
        table = self.result
        return {
            "model": table.attrs["title"],
            "on": table.attrs["on"],
            "cycles": table.attrs["cycles"],
            "pulses": json_value(table.to_dict("records")),
            "notes": list(table.attrs["notes"]),
        }

    def numbers(self) -> xr.Dataset:
        import xarray as xr

        impulses = (*_WAYS, *(f"{way}_error" for way in _WAYS))
        units = {"share": "1", "time": self._unit("s") or "1"} | dict.fromkeys(impulses, self._unit("N m s") or "1")
        variables = {name: ("instant", self.result[name].to_numpy(), {"units": unit}) for name, unit in units.items()}
        return xr.Dataset(variables, attrs=self.result.attrs)
