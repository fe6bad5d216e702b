"""Factors of values of a model: ``gr.factor(3)``, in a file ``{ factor = 3 }``, in a command ``x3``.

``paths.resolved`` multiplies the value at the path by it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model.table import shown

FACTOR = "factor"
"""The only key of a table that stands for a factor."""


@dataclass(frozen=True)
class Factor:
    """A factor of the model's own value.

    Attributes
    ----------
    times
        by which the value is multiplied.

    Examples
    --------
    >>> gr.factor(3).times
    3.0
    """

    times: float

    def of(self, own: float) -> float:
        """Return the value that it makes of the model's own: of a whole number a whole one, where it is one."""
        value = self.times * own
        return int(value) if isinstance(own, int) and float(value).is_integer() else value


Written = float | str | Factor
"""A number of a model as it is written: in SI, with its unit, or as a factor."""


def factor(times: float) -> Factor:
    """Return a value that is a multiple of what the model says, for ``Model.with_`` and studies.

    Parameters
    ----------
    times
        a finite number, by which the model's own value is multiplied.

    Raises
    ------
    ModelError
        no finite number.

    Examples
    --------
    >>> model = gr.example("case3")
    >>> model.with_({"mesh.gear.backlash": gr.factor(3)})["mesh.gear.backlash"] / model["mesh.gear.backlash"]
    3.0
    """
    is_number = isinstance(times, int | float) and not isinstance(times, bool)
    if not is_number or not math.isfinite(times):
        raise ModelError(Problem(FACTOR, shown(times), "must be a finite number", "such as 3, or 0.5"))
    return Factor(float(times))


def is_factor(value: object) -> bool:
    """Return whether a value is a factor, or a table that stands for one: ``{ factor = ... }``."""
    return isinstance(value, Factor) or (isinstance(value, Mapping) and set(value) == {FACTOR})


def factor_in(value: Any) -> Factor:
    """Return the factor that a value is or a table stands for, see ``is_factor``; ModelError: no valid number."""
    return value if isinstance(value, Factor) else factor(value[FACTOR])
