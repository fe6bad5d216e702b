"""Values that depend on the reference speed: a table in the file, a plain number in the model.

``{ speed = ["800 rpm", "3000 rpm"], value = ["200 N*m", "80 N*m"] }`` stands for the straight line between its points
at the speed of the model; nothing is extrapolated. In the model it is a float, that of its own speed, which remembers
its table: a copy of the model at another speed takes another value, and a sweep of the speed follows it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from pydantic import GetCoreSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema, core_schema

from gearrattle.model import units
from gearrattle.model.table import breach, did_you_mean
from gearrattle.model.value_kinds import Quantity

OMEGA = "omega"
"""Key of the validation context under which the model's speed stands [rad/s]; that at the start of a sweep."""
LAST = "last omega"
"""Key of the validation context under which the speed at the end of a sweep stands [rad/s]; None without one."""
_KEYS = ("speed", "value")


class AtSpeed(float):
    """A number at the model's speed, from a table over ascending speeds [rad/s]."""

    speeds: tuple[float, ...]
    values: tuple[float, ...]

    def __new__(cls, value: float, speeds: tuple[float, ...], values: tuple[float, ...]) -> AtSpeed:
        """Make the number; ``value`` is that of the model's speed."""
        made = super().__new__(cls, value)
        made.speeds = speeds
        made.values = values
        return made

    def __getnewargs__(self) -> tuple[float, tuple[float, ...], tuple[float, ...]]:  # type: ignore[override]
        """Return what makes an equal one, for copies and pickles."""
        return float(self), self.speeds, self.values

    def at(self, speed: float) -> float:
        """Return the value at another speed within the table [rad/s]."""
        for k, (sooner, later) in enumerate(pairwise(self.speeds)):
            if speed <= later:
                share = (speed - sooner) / (later - sooner)
                return self.values[k] + share * (self.values[k + 1] - self.values[k]) if share else self.values[k]
        raise AssertionError("between the first and the last speed")

    def to_plain(self) -> dict[str, list[float]]:
        """Return its table."""
        return {"speed": list(self.speeds), "value": list(self.values)}


@dataclass(frozen=True)
class OverSpeed(Quantity):
    """A quantity, or a table of it over the reference speed; ``swept`` if it can follow a sweep."""

    swept: bool = True

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        def check(value: Any, info: ValidationInfo) -> float:
            context = info.context or {}
            dimensionless = bool(context.get("dimensionless", False))
            if not isinstance(value, Mapping):
                return self.read(value, dimensionless)
            speeds = (context.get(OMEGA), context.get(LAST))
            if speeds[1] is not None and not self.swept:
                raise breach("cannot follow a sweep of the speed", "give one value, or one speed")
            return self._tabled(value, dimensionless, *speeds)

        return core_schema.with_info_plain_validator_function(check)

    def _tabled(self, table: Mapping[str, Any], dimensionless: bool, omega: float | None, last: float | None) -> float:
        """Read a table off at the model's speed."""
        # keys of the table, and lengths of its lists
        unknown = [key for key in table if key not in _KEYS]
        if unknown or len(table) != 2:
            rule = "a table over speed has the keys speed and value, lists of equal length"
            raise breach(rule, did_you_mean(unknown[0], _KEYS) if unknown else "")
        lists = [table[key] for key in _KEYS]
        if (
            not all(isinstance(entry, list | tuple) for entry in lists)
            or len(lists[0]) != len(lists[1])
            or len(lists[0]) < 2
        ):
            raise breach("speed and value must be lists of equal length, of two points or more")
        # points, ascending in speed
        speed = Quantity(units.ANGULAR_VELOCITY, "non-negative")
        speeds = tuple(speed.read(entry, dimensionless) for entry in lists[0])
        values = tuple(Quantity.read(self, entry, dimensionless) for entry in lists[1])
        if any(later <= sooner for sooner, later in pairwise(speeds)):
            raise breach("speeds must ascend")
        # speeds of the model and of its sweep within the table
        if omega is None:  # the speed itself is wrong, and said to be
            return AtSpeed(values[0], speeds, values)
        if not speeds[0] <= omega <= speeds[-1]:
            rule = f"the table covers {speeds[0]:.6g} to {speeds[-1]:.6g} rad/s; the model's speed is {omega:.6g}"
            raise breach(rule, "extend the table: nothing is extrapolated")
        if last is not None and not speeds[0] <= last <= speeds[-1]:
            rule = f"the table covers {speeds[0]:.6g} to {speeds[-1]:.6g} rad/s; the sweep ends at {last:.6g}"
            raise breach(rule, "extend the table: nothing is extrapolated")
        # value at the model's speed
        return AtSpeed(AtSpeed(values[0], speeds, values).at(omega), speeds, values)

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema: a quantity, or a table of two lists."""
        plain = super().describe()
        speed = Quantity(units.ANGULAR_VELOCITY, "non-negative").describe()
        points = {"type": "array", "minItems": 2}
        table = {
            "type": "object",
            "required": list(_KEYS),
            "additionalProperties": False,
            "properties": {
                "speed": {**points, "items": speed, "description": f"Reference speeds, each {speed['description']}"},
                "value": {**points, "items": plain, "description": f"The value there, {plain['description']}"},
            },
            "description": "a table over the reference speed, straight lines between its points",
        }
        return {"anyOf": [*plain["anyOf"], table], "description": plain["description"] + "; or a table over speed"}
