"""Values at paths of a model, as the model has them.

Takes a Model, a path and a value as it is written; gives plain values in SI.
"""

from __future__ import annotations

from typing import Any

from gearrattle.model.model import Model
from gearrattle.model.paths import value_at


def in_si(path: str, value: Any, model: Model) -> Any:
    """Read a value as the model does, and return it as the model has it: numbers in SI.

    Raises
    ------
    ModelError
        the model refuses it, or the path leads nowhere.
    """
    taken = model.with_({path: value})
    return value_at(taken.to_tables(), path)
