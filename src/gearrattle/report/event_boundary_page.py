"""An event of a branch over a second value as a result: a curve that bounds the region where a motion exists."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

from gearrattle.json_types import json_value
from gearrattle.orbits.two_parameters.special_points import SpecialPoint
from gearrattle.report.plots.axis_names import Measure, measure_at
from gearrattle.report.plots.chart import Chart
from gearrattle.report.plots.event_boundary_figure import event_boundary_chart
from gearrattle.report.plots.motion_map_figure import SPECIAL
from gearrattle.report.plots.numerals import numeral
from gearrattle.report.presentation import Presentation
from gearrattle.report.tables import Table

if TYPE_CHECKING:
    import xarray as xr

_MOST_ROWS = 12
_NAMES = {"value": "path", "second": "second"}


class EventBoundaryPage(Presentation["xr.Dataset"]):
    """An event over two values."""

    kind = "event boundary"
    is_interactive = True

    @property
    def title(self) -> str:
        return str(self.result.attrs["title"]) or "Driveline"

    @property
    def sentence(self) -> str:
        (across, up) = self._measures
        (first, last) = self._ends()
        words = (
            f"The {self._event} is followed over {up.words} from {up.with_unit(first[1], 5)} to "
            f"{up.with_unit(last[1], 5)}: {across.words} from {across.with_unit(first[0], 5)} to "
            f"{across.with_unit(last[0], 5)}."
        )
        special = [
            f" {SPECIAL[one.kind].name.capitalize()} at {across.words} {across.with_unit(one.value, 6)} and "
            f"{up.words} {up.with_unit(one.second, 6)}."
            for one in self._special
        ]
        return words + "".join(special)

    @property
    def _event(self) -> str:
        """Return the name of the event."""
        clearance = str(self.result.attrs["clearance"])
        return f"{self.result.attrs['kind']}{f' of {clearance}' if clearance else ''}"

    @cached_property
    def _measures(self) -> tuple[Measure, Measure]:
        """Return the names of the first and the second value, and their units."""
        across, up = (self._measure(name) for name in _NAMES)
        return across, up

    def _measure(self, name: str) -> Measure:
        data = self.result[name]
        unit = str(data.attrs["units"])
        path = str(self.result.attrs[_NAMES[name]])
        return measure_at(path, str(data.attrs["long_name"]), "" if unit == "1" else unit, float(abs(data).max()))

    @cached_property
    def _special(self) -> list[SpecialPoint]:
        columns = (self.result[name].values.tolist() for name in ("special", "value", "second"))
        return [SpecialPoint(kind, value, second) for kind, value, second in zip(*columns, strict=True) if kind]

    def _ends(self) -> list[tuple[float, float]]:
        """Both values at the first and the last point."""
        data = self.result
        return [(float(data["value"][i]), float(data["second"][i])) for i in (0, -1)]

    def figures(self) -> tuple[Chart, ...]:
        return (event_boundary_chart(self.result, self._event, self._special, *self._measures),)

    def answer(self) -> tuple[Table, ...]:
        (across, up) = self._measures
        data = self.result
        points = data.sizes["point"]
        special = data["special"].values.tolist()
        step = max(1, -(-(points - 1) // (_MOST_ROWS - 1)))
        shown = [i for i in range(points) if i % step == 0 or i == points - 1 or special[i]]
        rows = tuple(
            (
                numeral(float(data["second"][i]) * up.factor, 6),
                numeral(float(data["value"][i]) * across.factor, 8),
                SPECIAL[special[i]].name if special[i] else "",
            )
            for i in shown
        )
        note = f"{len(shown)} of {points} points; files hold all of them." * (step > 1)
        return (Table((up.title, across.title, "special point"), rows, frozenset({2}), "Curve", note),)

    def content(self) -> dict[str, Any]:
        data = self.result
        keys = ("path", "second", "own", "kind", "clearance")
        curve = {name: json_value(data[name].values) for name in ("value", "second", "special", "error")}
        return {"model": data.attrs["title"], **{key: data.attrs[key] for key in keys}, "curve": curve}

    def numbers(self) -> xr.Dataset:
        return self.result.assign_attrs(notes="\n".join(self.notes))
