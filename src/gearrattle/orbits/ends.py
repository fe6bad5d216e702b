"""The two ends of a range of a value of a model, as a user gives them.

Takes a Model, a path and two values; gives numbers in SI.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.path_values import in_si
from gearrattle.model.table import shown


def ends_of(model: Model, path: str, ends: Sequence[float | str]) -> tuple[float, float]:
    """Read the two ends of a range [SI].

    Raises
    ------
    ModelError
        the path leads nowhere, an end the model refuses, or ends that are the same.
    """
    if isinstance(ends, str) or not isinstance(ends, Sequence | np.ndarray) or len(ends) != 2:
        raise ModelError(Problem("range", shown(ends), "must be two values", "such as (100.0, 200.0)"))
    values = [in_si(path, end, model) for end in ends]
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ModelError(Problem("range", shown(value), "what is followed must be a number"))
    first, last = map(float, values)
    if first == last:
        raise ModelError(Problem("range", shown(ends), "must be two different values"))
    return first, last
