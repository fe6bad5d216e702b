"""Factors of values of a model: ``gr.factor(3)`` in Python, ``{ factor = 3 }`` in a file, ``x3`` in a command.

``paths.resolved`` multiplies the value at the path by the factor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model.table import shown

FACTOR = "factor"
"""The only key of a table that represents a factor."""


@dataclass(frozen=True)
class Factor:
    """A factor of the model's own value.

    Attributes
    ----------
    times
        number by which the value of the model is multiplied.

    Examples
    --------
    >>> gr.factor(3).times
    3.0
    """

    times: float

    def of(self, own: float) -> float:
        """Return the product with the value of the model; an int if the value is one and the product is whole."""
        value = self.times * own
        return int(value) if isinstance(own, int) and float(value).is_integer() else value


Written = float | str | Factor
"""A number as users write it: in SI, as a text with its unit, or as a factor."""


def factor(times: float) -> Factor:
    """Return a factor of the model's own value, for ``Model.with_`` and studies.

    Parameters
    ----------
    times
        a finite number, by which the model's own value is multiplied.

    Raises
    ------
    ModelError
        ``times`` is not a finite number.

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
    """Return whether a value is a factor, or a table that represents one: ``{ factor = ... }``."""
    return isinstance(value, Factor) or (isinstance(value, Mapping) and set(value) == {FACTOR})


def factor_in(value: Any) -> Factor:
    """Return the factor of a value for which ``is_factor`` is true; ModelError if it is not a valid number."""
    return value if isinstance(value, Factor) else factor(value[FACTOR])
