"""Values at paths of a model, as the model has them.

Takes a Model, a path and a value as it is written; gives plain values in SI.
"""

from __future__ import annotations

from typing import Any

from gearrattle.model.model import Model
from gearrattle.model.path_labels import dimension_at
from gearrattle.model.paths import value_at
from gearrattle.model.quantity import Bound, Plain, Quantity, checked


def in_si(path: str, value: Any, model: Model) -> Any:
    """Read a value as the model does, and return it as the model has it: numbers in SI.

    Raises
    ------
    ModelError
        the model refuses it, or the path leads nowhere.
    """
    taken = model.with_({path: value})
    return value_at(taken.to_tables(), path)


def change_in_si(path: str, change: Any, model: Model, bound: Bound, name: str) -> float:
    """Read by how much a number at a path changes, such as a step or a standard deviation: no rule of the number holds.

    Parameters
    ----------
    path
        of the number.
    change
        a plain number in SI, or a string with a unit.
    model
        whose path it is.
    bound
        of the change.
    name
        of the change, for messages.

    Raises
    ------
    ModelError
        it is no such change.
    """
    dimension = dimension_at(path)
    reader = Plain(bound) if dimension is None else Quantity(dimension, bound)
    return float(checked(reader, change, name, dimensionless=model.units == "dimensionless"))
