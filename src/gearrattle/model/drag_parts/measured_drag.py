"""A measured drag torque over speed, or over speed and temperature: linear interpolation without extrapolation."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Any, ClassVar

from gearrattle.errors import ModelError, Problem
from gearrattle.model import units
from gearrattle.model.drag_parts.drag_part import Drag, DragPart
from gearrattle.model.oil import Oil
from gearrattle.model.table import Breach
from gearrattle.model.value_kinds import Choice, Quantity

_SPEED = Quantity(units.ANGULAR_VELOCITY, "non-negative")
_TORQUE = Quantity(units.TORQUE, "non-negative")
_TEMPERATURE = Quantity(units.TEMPERATURE)


class MeasuredDrag(DragPart):
    """A table that somebody measured."""

    needs_oil: ClassVar[bool] = False
    source: ClassVar[str] = "measured"
    law_error: ClassVar[str] = "that of the measurement"
    kind: Annotated[str, Choice(("measured",))]
    """"measured"."""
    speed: tuple[Annotated[float, _SPEED], ...]
    """Relative speeds, ascending [rad/s]."""
    temperature: tuple[Annotated[float, _TEMPERATURE], ...] | None = None
    """Temperatures of the oil, ascending [degC]; absent: one row of torques, for any temperature."""
    torque: tuple[tuple[Annotated[float, _TORQUE], ...], ...]
    """Drag torques [N m], a row per temperature."""

    @classmethod
    def rules(cls, table: Mapping[str, Any], dimensionless: bool, /) -> Iterator[Breach]:
        """Yield breaches: lists that do not ascend or do not fit each other."""
        yield from super().rules(table, dimensionless)
        speeds = _numbers(table.get("speed"), _SPEED, dimensionless)
        temperatures = _numbers(table.get("temperature"), _TEMPERATURE, dimensionless)
        rows = table.get("torque")
        rows = rows if isinstance(rows, list | tuple) else ()
        for key, values in (("speed", speeds), ("temperature", temperatures)):
            if values is not None and (len(values) < 2 or any(b <= a for a, b in pairwise(values))):
                yield Breach((key,), table[key], "must ascend, and have two values or more")
        count = 1 if table.get("temperature") is None else len(temperatures or rows)
        if len(rows) != count:
            yield Breach(("torque",), rows, f"must have a row per temperature: {count}, not {len(rows)}")
        for index, row in enumerate(rows):
            if speeds is not None and isinstance(row, list | tuple) and len(row) != len(speeds):
                yield Breach(("torque", index), row, f"must have a torque per speed: {len(speeds)}, not {len(row)}")

    def law(self, speed: float, oil: Oil | None, /) -> Drag:
        """Return torque and slope at a relative speed [rad/s]; ModelError outside the table."""
        k = _interval(self.speed, speed, "speed", "rad/s")
        width = self.speed[k + 1] - self.speed[k]
        row = self._row(oil)
        slope = (row[k + 1] - row[k]) / width
        return Drag(row[k] + slope * (speed - self.speed[k]), slope)

    def _row(self, oil: Oil | None) -> Sequence[float]:
        """Return the torques at the temperature of the oil."""
        if self.temperature is None:
            return self.torque[0]
        if oil is None:
            rule = "a table over temperature needs the table [oil]"
            raise ModelError(Problem("temperature", "", rule, "add oil, or leave the temperatures out"))
        k = _interval(self.temperature, oil.temperature, "temperature", "degC")
        share = (oil.temperature - self.temperature[k]) / (self.temperature[k + 1] - self.temperature[k])
        return [
            (1.0 - share) * cold + share * hot for cold, hot in zip(self.torque[k], self.torque[k + 1], strict=True)
        ]


def _interval(points: Sequence[float], value: float, word: str, unit: str) -> int:
    """Return the index of the interval that holds a value."""
    if not points[0] <= value <= points[-1]:
        rule = f"the measured drag covers {points[0]:.6g} to {points[-1]:.6g} {unit}"
        raise ModelError(Problem(word, f"{value:.6g} {unit}", rule, "measure further: nothing is extrapolated"))
    return min(max(bisect_left(points, value) - 1, 0), len(points) - 2)


def _numbers(values: object, reader: Quantity, dimensionless: bool) -> list[float] | None:
    """Return a list in SI; None if the field refuses it (the field then reports the breach)."""
    if not isinstance(values, list | tuple):
        return None
    try:
        return [reader.read(value, dimensionless) for value in values]
    except ValueError:
        return None
