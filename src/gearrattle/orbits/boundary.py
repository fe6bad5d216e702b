"""An event of a branch followed over a second value of the model: the border of where motions exist, as a curve.

The second value is changed step by step. Each event is predicted by a straight line through the last two, then located
exactly. Two folds meet in a cusp, and neither exists beyond it: the curve ends there.

Takes a Branch and an event; gives a Dataset.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.boundary import relocated
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events import Event
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.path_labels import path_label
from gearrattle.model.table import shown
from gearrattle.orbits.family import family_of
from gearrattle.orbits.gradients import number_at

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

_STEPS = 40.0  # over the range, at least
_SHORTEST = 1e-4  # of the first step
_FARTHEST = 0.2  # largest distance that an event may move in a step, in units of w
_EASY = 0.05  # a smaller distance than this: the step may grow


def boundary_of(
    model: Model, path: str, curve: Continuation, event: Event, *, second: str, ends: tuple[float, float]
) -> xr.Dataset:
    """Follow an event from the model's own second value to both ends of its range; see ``Branch.boundary``.

    Raises
    ------
    ModelError
        the model's own value lies outside the ends.
    """
    import xarray as xr

    own = number_at(model, path, second)
    if not ends[0] <= own <= ends[1]:
        rule = f"must contain the model's own value, {own:.6g}"
        raise ModelError(Problem("range", shown(list(ends)), rule))

    def follower(value: float) -> Continuation:
        changed = model.with_({second: value})
        family = family_of(changed, path, event.point.parameter, curve.family.cycles, curve.family.unit)
        return curve.of(family)

    low, high = (_one_way(follower, event, own, end) for end in ends)
    rows = [*reversed(low[1:]), *high]
    located = [(value, one.point.parameter, one.point.error) for value, one in rows]
    values, parameters, errors = (np.array(column) for column in zip(*located, strict=True))
    reached = [
        abs(float(rows[i][0]) - end) < 1e-12 * abs(ends[1] - ends[0]) for i, end in ((0, ends[0]), (-1, ends[1]))
    ]
    sides = zip(reached, ends, (values[0], values[-1]), strict=True)
    notes = [f"The event is not found beyond {second} = {last:.6g}." for is_there, _, last in sides if not is_there]
    attributes = {"path": path, "second": second, "kind": event.kind, "notes": notes, "title": model.name}
    units = {name: {"units": path_label(name, model).unit or "1"} for name in (path, second)}
    variables = {
        "second": ("point", values, units[second]),
        "value": ("point", parameters, units[path]),
        "error": ("point", errors),
    }
    return xr.Dataset(variables, attrs=attributes)


def _one_way(
    follower: Callable[[float], Continuation], event: Event, start: float, end: float
) -> list[tuple[float, Event]]:
    """The event from a start value to an end value, as far as it exists: pairs of second value and event."""
    located = [(start, event)]
    first_step = (end - start) / _STEPS
    step = first_step
    while located[-1][0] != end and abs(step) >= _SHORTEST * abs(first_step):
        value, now = located[-1]
        following = value + step
        if (end - following) * (end - start) <= 0.0:
            following = end
        change = np.zeros_like(now.point.w)
        if len(located) > 1:
            earlier, before = located[-2]
            change = (now.point.w - before.point.w) * (following - value) / (value - earlier)
        try:
            moved = relocated(now, follower(following), change, _FARTHEST)
        except (ConvergenceError, ModelError, np.linalg.LinAlgError):
            step *= 0.5
            continue
        distance = float(np.linalg.norm(moved.point.w - now.point.w))
        if distance > _FARTHEST:
            step *= 0.5
            continue
        located.append((following, moved))
        step = float(np.clip(1.5 * step, -2.0 * abs(first_step), 2.0 * abs(first_step))) if distance < _EASY else step
    return located
