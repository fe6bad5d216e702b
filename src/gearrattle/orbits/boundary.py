"""An event of a branch followed over a second value of the model: the border of where motions exist, as a curve.

The second value is changed step by step. Each event is predicted by a straight line through the last two, then located
exactly. Two folds meet in a cusp, and neither exists beyond it: the curve ends there. It ends as well where a fold
meets a grazing. Both points are located (``engine.periodic.special``).

Takes a Branch and an event; gives a Dataset.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.boundary import relocated
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events import FOLD, GRAZING, Event
from gearrattle.engine.periodic.special import (
    CUSP,
    MEETING,
    TURNING,
    grazing_near,
    meeting_of_grazing,
    meeting_of_two,
)
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.path_labels import path_label
from gearrattle.model.table import shown
from gearrattle.orbits.family import family_of
from gearrattle.orbits.gradients import number_at

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

Follower = Callable[[float], Continuation]

_STEPS = 40.0  # over the range, at least
_SHORTEST = 1e-4  # of the first step
_FARTHEST = 0.2  # largest distance that an event may move in a step, in units of w
_EASY = 0.05  # a smaller distance than this: the step may grow
_REACH = 0.1  # of the range: a special point farther from the last known event is another one's
_BACK = 6  # points of the curve from which a grazing near the fold is sought


@dataclass(frozen=True)
class _Row:
    """An event at a second value; what is special about it."""

    second: float
    event: Event
    special: str = ""


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
    sides = [_ended(follower, side, end) for side, end in ((low, ends[0]), (high, ends[1]))]
    rows = [*reversed(sides[0][1:]), *sides[1]]
    notes = [_note(second, side[-1]) for side, end in zip(sides, ends, strict=True) if side[-1].second != end]
    attributes = {"path": path, "second": second, "kind": event.kind, "notes": notes, "title": model.name}
    units = {name: {"units": path_label(name, model).unit or "1"} for name in (path, second)}
    variables = {
        "second": ("point", np.array([row.second for row in rows]), units[second]),
        "value": ("point", np.array([row.event.point.parameter for row in rows]), units[path]),
        "special": ("point", np.array([row.special for row in rows], dtype=np.str_)),
        "error": ("point", np.array([row.event.point.error for row in rows])),
    }
    return xr.Dataset(variables, attrs=attributes)


def _note(second: str, last: _Row) -> str:
    """What is said of a curve that ends inside the range."""
    reason = f": {last.special}" if last.special else ""
    return f"The event is not found beyond {second} = {last.second:.6g}{reason}."


def _ended(follower: Follower, rows: list[_Row], end: float) -> list[_Row]:
    """The rows from the model's own value to an end with their special points, cut where the curve ends."""
    kind = rows[0].event.kind
    if kind == GRAZING:
        rows = _with_folds(follower, rows)
    if kind == FOLD and (met := _at_grazing(follower, rows, end)):
        return met
    if rows[-1].second == end or len(rows) < 2:
        return rows
    last = rows[-1]
    step = last.second - rows[-2].second
    with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
        second, event = meeting_of_two(last.event, follower, last.second, step)
        if abs(second - last.second) < _REACH * abs(end - rows[0].second):
            return [*rows, _Row(second, event, CUSP if kind == FOLD else TURNING)]
    return rows


def _with_folds(follower: Follower, rows: list[_Row]) -> list[_Row]:
    """The rows of a grazing, with those at which a fold meets it between."""
    out = rows[:1]
    for before, after in pairwise(rows):
        if before.event.point.tangent[-1] * after.event.point.tangent[-1] < 0.0:
            with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
                step, known = after.second - before.second, {row.second: row.event for row in (before, after)}
                second, event = meeting_of_grazing(known, follower, 0.5 * step)
                if 0.0 < (second - before.second) / step < 1.0:
                    out.append(_Row(second, event, MEETING))
        out.append(after)
    return out


def _at_grazing(follower: Follower, rows: list[_Row], end: float) -> list[_Row] | None:
    """The rows of a fold with that at which it meets a grazing, the last one if it ends there; None if none does."""
    changes = [i for i, (a, b) in enumerate(pairwise(rows)) if a.event.point.pattern != b.event.point.pattern]
    if rows[-1].second != end:
        changes.append(len(rows) - 1)
    for change in changes:
        for row in reversed(rows[max(0, change - _BACK) : change + 1]):
            with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
                grazing = grazing_near(row.event, follower(row.second))
                if grazing is None:
                    continue
                step = 1e-3 * (end - rows[0].second)
                second, event = meeting_of_grazing({row.second: grazing}, follower, step)
                if abs(second - row.second) < _REACH * abs(end - rows[0].second):
                    sooner = [one for one in rows if (second - one.second) * (end - rows[0].second) > 0.0]
                    later = rows[len(sooner) :] if rows[-1].second == end else []
                    return [*sooner, _Row(second, replace(event, kind=FOLD), MEETING), *later]
    return None


def _one_way(follower: Follower, event: Event, start: float, end: float) -> list[_Row]:
    """The event from a start value to an end value, as far as it exists."""
    located = [_Row(start, event)]
    first_step = (end - start) / _STEPS
    step = first_step
    while located[-1].second != end and abs(step) >= _SHORTEST * abs(first_step):
        value, now = located[-1].second, located[-1].event
        following = value + step
        if (end - following) * (end - start) <= 0.0:
            following = end
        change = np.zeros_like(now.point.w)
        if len(located) > 1:
            earlier = located[-2]
            change = (now.point.w - earlier.event.point.w) * (following - value) / (value - earlier.second)
        try:
            moved = relocated(now, follower(following), change, _FARTHEST)
        except (ConvergenceError, ModelError, np.linalg.LinAlgError):
            step *= 0.5
            continue
        distance = float(np.linalg.norm(moved.point.w - now.point.w))
        if distance > _FARTHEST:
            step *= 0.5
            continue
        located.append(_Row(following, moved))
        step = float(np.clip(1.5 * step, -2.0 * abs(first_step), 2.0 * abs(first_step))) if distance < _EASY else step
    return located
