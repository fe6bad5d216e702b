"""Orders and spectra along a change of speed as results: the strongest orders, and the map or the curves.

The orders and frequencies in the attributes ``excited_orders`` and ``natural_frequencies`` [rad/s], which the command
sets from the model, are drawn over a map.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.report.labelled_data import channel_title, is_si, numbers_in, plain_attributes
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.order_maps import cuts_chart, map_chart, raised
from gearrattle.report.presentation import ONE_FIGURE_ENDINGS, Presentation
from gearrattle.report.tables import Table
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

_MOST = 8
_LEAST = 0.01


class _Along(Presentation["xr.Dataset"]):
    """Base of presentations of data along a change of speed; they have one figure, which can be saved as a file."""

    endings = ONE_FIGURE_ENDINGS
    is_interactive = True
    is_data = True

    def __init__(self, result: xr.Dataset) -> None:
        super().__init__(result)
        self.si = is_si(result)
        self.unit = raised(str(result.attrs["units"])).removesuffix("1")

    @property
    def title(self) -> str:
        return channel_title(self.result.attrs)

    @property
    def sentence(self) -> str:
        attributes = self.result.attrs
        rows = counted(self._values().shape[0], "row")
        return f"{self._largest()} {rows}, resolution {attributes['resolution']:.4g}, shaft: {_shaft(attributes)}."

    def numbers(self) -> xr.Dataset:
        return self.result

    def _values(self) -> xr.DataArray:
        """Return amplitudes, or densities, over rows and orders or frequencies."""
        return self.result["amplitude"]

    def _largest(self) -> str:
        """Return a sentence with the largest value and its position."""
        raise NotImplementedError

    def _place(self, row: dict[str, float]) -> str:
        """Return the time or speed of a row in words."""
        if "speed" in row:
            return f"{row['speed'] * 30.0 / math.pi:.5g} rpm" if self.si else f"speed {row['speed']:.5g}"
        return f"{row['time']:.5g}{' s' if self.si else ''}"

    def _map(self) -> list[Chart]:
        values = self._values()
        data = values.assign_attrs({**self.result.attrs, **values.attrs})
        lines = {"orders": "excited_orders", "natural": "natural_frequencies"}
        return [map_chart(data, si=self.si, **{key: numbers_in(data, name) for key, name in lines.items()})]


class OrderCutsPage(_Along):
    """Amplitudes of chosen orders along a change of speed."""

    kind = "order cuts"

    def answer(self) -> tuple[Table, ...]:
        head = ("order", f"largest{f' [{self.unit}]' if self.unit else ''}", "at [rpm]" if self.si else "at speed")
        turning = 30.0 / math.pi if self.si else 1.0
        rows = [
            (f"{row['order']:g}", f"{row['amplitude']:.5g}", f"{row['speed'] * turning:.5g}") for row in self._orders()
        ]
        return (Table(head, tuple(rows), frozenset()),)

    def content(self) -> dict[str, Any]:
        rows = int(self._values().shape[0])
        return {**plain_attributes(self.result.attrs), "rows": rows, "orders": self._orders()}

    def figures(self) -> list[Chart]:
        return [cuts_chart(self.result, si=self.si)]

    def _largest(self) -> str:
        orders = self._orders()
        if not orders:
            return "No order stands above its neighbours."
        row = max(orders, key=lambda row: row["amplitude"])
        value = f"{row['amplitude']:.5g} {self.unit}".rstrip()
        return f"Order {row['order']:g} is the largest: {value} at {self._place(row)}."

    def _orders(self) -> list[dict[str, float]]:
        """Return for some orders their largest amplitude and its position."""
        data = self.result
        amplitude = self._values()
        rows = []
        for k in self._chosen():
            at = int(amplitude.values[:, k].argmax())
            row = {"order": float(data["order"][k]), "amplitude": float(amplitude[at, k])}
            rows.append(row | {name: float(data[name][at]) for name in ("speed", "time") if name in data.coords})
        return rows

    def _chosen(self) -> list[int]:
        """Return the indices of the orders in the table."""
        return list(range(self.result.sizes["order"]))


class OrderMapPage(OrderCutsPage):
    """Amplitudes of all orders along a change of speed; the table has the strongest."""

    kind = "order map"

    def figures(self) -> list[Chart]:
        return self._map()

    def _chosen(self) -> list[int]:
        """Return the strongest orders that are larger than their neighbours."""
        peak = self._values().values.max(axis=0)
        inner = (peak[1:-1] >= peak[:-2]) & (peak[1:-1] > peak[2:]) & (peak[1:-1] >= _LEAST * peak[1:].max())
        return sorted(sorted((inner.nonzero()[0] + 1).tolist(), key=lambda k: -peak[k])[:_MOST])


class WaterfallPage(_Along):
    """Spectra side by side along time or a change of speed."""

    kind = "waterfall"

    def __init__(self, result: xr.DataArray | xr.Dataset) -> None:
        """Present a map, or the Dataset of one variable that it was saved as."""
        import xarray as xr

        (values,) = [result] if isinstance(result, xr.DataArray) else result.data_vars.values()
        self._map_values = values
        super().__init__(values.to_dataset(promote_attrs=True))

    def answer(self) -> tuple[Table, ...]:
        peak = self._peak()
        along = str(self._map_values.dims[1])
        unit = " [Hz]" if along == "frequency" and self.si else ""
        head = (f"largest{f' [{self.unit}]' if self.unit else ''}", f"{along}{unit}", "at")
        return (Table(head, ((f"{peak['amplitude']:.5g}", f"{peak[along]:.5g}", self._place(peak)),), frozenset()),)

    def content(self) -> dict[str, Any]:
        rows, bins = self._map_values.shape
        return {**plain_attributes(self.result.attrs), "rows": rows, "bins": bins, "largest": self._peak()}

    def figures(self) -> list[Chart]:
        return self._map()

    def numbers(self) -> xr.Dataset:
        return self._map_values.to_dataset()

    def _values(self) -> xr.DataArray:
        return self._map_values

    def _largest(self) -> str:
        peak = self._peak()
        along = str(self._map_values.dims[1])
        value = f"{peak['amplitude']:.5g} {self.unit}".rstrip()
        where = f"order {peak[along]:.5g}" if along == "order" else f"{peak[along]:.5g}{' Hz' if self.si else ''}"
        return f"Largest: {value} at {where}, {self._place(peak)}."

    def _peak(self) -> dict[str, float]:
        """Return the position of the largest value; the map is NaN for orders above the highest frequency."""
        data = self._map_values
        along = str(self._map_values.dims[1])
        row, column = divmod(int(np.nanargmax(data.values)), data.shape[1])
        peak = {along: float(data[along][column]), "amplitude": float(data.values[row, column])}
        return peak | {name: float(data[name][row]) for name in ("time", "speed") if name in data.coords}


def _shaft(attributes: dict[Any, Any]) -> str:
    return str(attributes["shaft"]) or "unknown"
