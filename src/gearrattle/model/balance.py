"""A mean torque that balances its train: the word "balance" instead of a number.

The value of such a torque depends on all other torques of the train; ``assembly.mean_balance`` computes it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal

from gearrattle.model.over_speed import OverSpeed
from gearrattle.model.table import breach, did_you_mean

BALANCE: Final = "balance"
Balancing = Literal["balance"]


@dataclass(frozen=True)
class OrBalance(OverSpeed):
    """A quantity, a table of it over the reference speed, or "balance"."""

    def read(self, value: Any, dimensionless: bool, /) -> Any:
        """Return the value in SI, or the word."""
        if isinstance(value, str) and value == BALANCE:
            return BALANCE
        if remedy := did_you_mean(value, (BALANCE,)):
            rule = f'must be a number, a string with a unit, a table over speed, or "{BALANCE}"'
            raise breach(rule, remedy)
        return super().read(value, dimensionless)

    def describe(self) -> dict[str, Any]:
        """Return the JSON Schema: a quantity, a table of two lists, or the word."""
        number = super().describe()
        words = "the mean torque that balances all other mean torques and the drag of its free train"
        word = {"const": BALANCE, "description": words}
        return {"anyOf": [*number["anyOf"], word], "description": f'{number["description"]}; or "{BALANCE}"'}
