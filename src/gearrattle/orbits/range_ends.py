"""Arguments of calls about branches: the two ends of a range of a value, and the row of a point or an event.

Takes what a user gives; gives numbers in SI, or refuses it.
"""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral

import numpy as np

from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.balance import BALANCE
from gearrattle.model.factors import Written, factor_in, is_factor
from gearrattle.model.path_values import in_si
from gearrattle.model.paths import path_names, value_at
from gearrattle.model.table import shown

_WIDTHS = 1e3  # of a range: the unit of its value is no larger
_LEAST = 1e-9  # of the larger end: the ends must differ by more


def ends_of(model: Model, path: str, ends: Sequence[Written], argument: str = "path") -> tuple[float, float]:
    """Read the two ends of a range [SI]; ``argument`` is what names the path, for messages.

    Raises
    ------
    ModelError
        the path leads nowhere or to an order, an end the model refuses, or ends that are the same.
    """
    if isinstance(ends, str) or not isinstance(ends, Sequence | np.ndarray) or len(ends) != 2:
        raise ModelError(Problem("range", shown(ends), "must be two values", "such as (100.0, 200.0)"))
    if not isinstance(path, str):
        raise ModelError(Problem(argument, shown(path), "must be text", "such as excitation.speed"))
    if path.partition(".")[0] == "simulation":
        rule = "is a setting of simulations, on which motions do not depend"
        raise ModelError(Problem(path, "", rule, "follow a value of the driveline"))
    if "." not in path:
        names = [name for name in ("excitation.speed", *path_names(model.to_tables())) if name.endswith(f".{path}")]
        remedy = f'did you mean "{names[0]}"?' if names else "such as excitation.speed"
        raise ModelError(Problem(argument, path, "leads to no number", remedy))
    own = value_at(model.to_tables(), path)
    if isinstance(own, str | bool) and own != BALANCE:
        raise ModelError(Problem(argument, path, "leads to no number", "follow a number of the driveline"))
    values = [in_si(path, end, model) for end in ends]
    if len({is_factor(end) for end in ends}) > 1:
        rule = "one end is a factor, the other none"
        remedy = "give both, such as (gr.factor(0.5), gr.factor(2))"
        raise ModelError(Problem("range", f"{_shown(ends[0])} to {_shown(ends[1])}", rule, remedy))
    has_unit = [isinstance(end, str) for end in ends if end != 0]
    if model.units == "SI" and len(set(has_unit)) > 1:
        rule, remedy = "one end has a unit, the other none", 'give both, such as ("1 deg", "2 deg")'
        raise ModelError(Problem("range", shown(list(ends)), rule, remedy))
    if path.rpartition(".")[2] == "order":
        rule = "cannot be followed: between two orders there are others without a common period"
        raise ModelError(Problem(path, "", rule, "follow another value of the model"))
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ModelError(Problem("range", shown(value), "what is followed must be a number"))
    first, last = map(float, values)
    if abs(last - first) <= _LEAST * max(abs(first), abs(last)):
        rule = f"must be two different values, by more than {_LEAST:g} of the larger one"
        raise ModelError(Problem("range", shown(ends), rule))
    return first, last


def _shown(end: Written) -> str:
    """Return an end as a command line has it."""
    return f"x{factor_in(end).times:g}" if is_factor(end) else shown(end)


def unit_of(ends: Sequence[float]) -> float:
    """Return the scale of a value between two ends [SI]: as much as the larger end, and the width.

    The unit of a narrow range is not its width: along a branch the value would count far more than the state, and its
    folds would be sharper than motions are known.
    """
    first, last = ends
    width = abs(last - first)
    return max(width, min(abs(first), _WIDTHS * width), min(abs(last), _WIDTHS * width))


def check_index(name: str, index: object, ends: tuple[int, int]) -> None:
    """Refuse an index that is no whole number from the first end up to, but not including, the last.

    Raises
    ------
    ModelError
        it is none.
    """
    first, count = ends
    if isinstance(index, Integral) and not isinstance(index, bool) and first <= int(index) < count:
        return
    rule = f"must be a whole number from {first} to {count - 1}" if count > first else f"there is no {name}"
    raise ModelError(Problem(name, shown(index), rule))
