"""How the events of a branch move with every number of the model, and how they scatter under tolerances.

Takes a Branch and an event; gives tables.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.drift import KINDS, FamiliesOf, gradient_of
from gearrattle.engine.periodic.events import GRAZING, Event
from gearrattle.engine.periodic.family import Family
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.paths import path_names, value_at
from gearrattle.orbits.family import family_of

if TYPE_CHECKING:
    import pandas as pd

_SAME = {"excitation.speed", "excitation.frequency"}
_LEFT_OUT = ("simulation", "schema", "name", "units")


def numbers_of(model: Model, path: str) -> Iterator[str]:
    """Yield the paths of all numbers of a model that are not zero, without ``path`` and simulation settings."""
    tables = model.to_tables()
    for other in path_names(tables):
        value = value_at(tables, other)
        is_number = isinstance(value, int | float) and not isinstance(value, bool) and value != 0.0
        is_order = other.endswith(".order")
        same = {other, path} <= _SAME
        if is_number and not is_order and not same and other != path and other.split(".")[0] not in _LEFT_OUT:
            yield other


def number_at(model: Model, path: str, other: str) -> float:
    """Return the number at a path by which an event may be moved.

    Raises
    ------
    ModelError
        the path leads to no number, to zero, or to what the branch is followed over.
    """
    value = value_at(model.to_tables(), other)
    if other == path or {other, path} <= _SAME:
        raise ModelError(Problem("paths", other, "is what the branch is followed over", "name another number"))
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ModelError(Problem("paths", other, "must lead to a number of the model"))
    if value == 0.0:
        raise ModelError(Problem("paths", other, "is zero, and is changed in proportion", "give it a small value"))
    return float(value)


def check_kind(event: Event, clearances: int) -> None:
    """Refuse an event without a test function that is smooth along the branch.

    Parameters
    ----------
    event
        of a branch.
    clearances
        number of them: a bound of a slider or of a limiter has no depth.

    Raises
    ------
    ModelError
        it has none.
    """
    has_depth = event.kind != GRAZING or event.watch < clearances
    if event.kind in KINDS and not event.is_collision and has_depth:
        return
    kind = event.kind if event.kind not in KINDS else f"{event.kind} at which the gradient of the motion jumps"
    rule = f"must be a {', '.join(KINDS[:-1])} or {KINDS[-1]} of a clearance, at which that gradient is continuous"
    raise ModelError(Problem("event", kind, rule))


def gradients_of(
    model: Model, path: str, curve: Continuation, event: Event, paths: Sequence[str] | None
) -> pd.DataFrame:
    """Return how an event moves with the numbers of a model, as a table; see ``Branch.gradients``.

    Parameters
    ----------
    model
        the driveline.
    path
        of the value that the branch is followed over.
    curve
        the Continuation of the branch that the event lies on.
    event
        the event.
    paths
        of the numbers; None: all of them.

    Raises
    ------
    ModelError
        the kind of event has no gradient.
    """
    import pandas as pd

    rows = []
    for other in numbers_of(model, path) if paths is None else paths:
        value = number_at(model, path, other)
        try:
            slope = gradient_of(event, curve, _families(model, path, curve, event, (other, value)), value)
        except (ConvergenceError, ModelError):
            slope = np.nan
        rows.append((other, value, slope, 0.1 * value * slope))
    table = pd.DataFrame(rows, columns=["path", "value", "gradient", "per_10_percent"])
    order = np.argsort(-np.abs(table["per_10_percent"].to_numpy()), kind="stable")
    return table.iloc[order].reset_index(drop=True)


def _families(model: Model, path: str, curve: Continuation, event: Event, number: tuple[str, float]) -> FamiliesOf:
    """What gives the families of the driveline with a number a little smaller, and a little larger."""
    (other, value), family = number, curve.family

    def families_of(change: float) -> tuple[Family, Family]:
        first, cycles, unit = event.point.parameter, family.cycles, family.unit
        low, high = (
            family_of(model.with_({other: value + side}), path, first, cycles, unit) for side in (-change, change)
        )
        return low, high

    return families_of


def scatter_of(gradients: Mapping[Any, Any], tolerances: Mapping[str, float]) -> float:
    """Return the standard deviation of an event [SI]: independent numbers, to first order.

    Parameters
    ----------
    gradients
        by path.
    tolerances
        standard deviations by path [SI].
    """
    parts: list[Any] = [gradients[path] * deviation for path, deviation in tolerances.items()]
    return float(np.sqrt(np.sum(np.square(parts))))
