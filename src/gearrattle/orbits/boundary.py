"""An event of a branch followed over a second value of the model: the border of where motions exist, as a curve.

The second value is changed step by step. Each event is predicted by a straight line through the last two, then located
exactly. Other events of the same kind may lie near. So an event must be as near to its prediction as on a curve, and
one of motions of n periods is not one of motions of fewer. The first step is short, for it has no prediction.

Two folds meet in a cusp, and neither exists beyond it: the curve ends there. It ends as well where a fold meets a
grazing. Both points are located (``engine.periodic.special``).

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

from gearrattle.engine.periodic.boundary import relocated, repeats_sooner
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
_FARTHEST_FIRST = 1e-3  # the same in the first step
_EASY = 0.05  # a smaller distance than this: the step may grow
_FIRST = 1e-3  # of an even step: the first one, without a prediction
_OFF, _STRAIGHT = 0.5, 0.1  # of the distance: how far an event may be from its prediction; if so near, steps grow fast
_ROUNDING = 1e-5  # of w: what lies so near to the prediction is near
_SHORT, _BEND = 1e-2, 4.0  # of an even step; a curve may have a corner: over short steps it leads so many times as far
_REACH = 0.1  # of the range: a special point farther from the last known event is another one's
_BEHIND = 1e-3  # of the last step: the event was met there, so a point at which it vanishes lies no farther back
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
        if family.clearances != curve.family.clearances:
            raise ConvergenceError("a clearance closes or opens there")
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
        ahead = (second - last.second) * np.sign(step)
        if -_BEHIND * abs(step) <= ahead < _REACH * abs(end - rows[0].second):
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
    even = (end - start) / _STEPS
    sooner = repeats_sooner(follower(start).family, event.point)
    step = _FIRST * even
    while located[-1].second != end and abs(step) >= _SHORTEST * abs(even):
        value, now = located[-1].second, located[-1].event
        following = value + step
        if (end - following) * (end - start) <= 0.0:
            following = end
        change = np.zeros_like(now.point.w)
        if len(located) > 1:
            earlier = located[-2]
            change = (now.point.w - earlier.event.point.w) * (following - value) / (value - earlier.second)
        growth = 0.0
        with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
            curve = follower(following)
            moved = relocated(now, curve, change, _FARTHEST)
            growth = _growth(moved.point.w - now.point.w, change, abs(step) <= _SHORT * abs(even))
            if growth and not sooner and repeats_sooner(curve.family, moved.point):
                growth = 0.0
        if not growth:
            step *= 0.5
            continue
        located.append(_Row(following, moved))
        step = float(np.clip(growth * step, -2.0 * abs(even), 2.0 * abs(even)))
    return located


def _growth(move: Array, change: Array, is_short: bool) -> float:
    """How many times as long the step after a move that was predicted may be; 0: it led to another event."""
    distance, predicted, off = (float(np.linalg.norm(way)) for way in (move, change, move - change))
    if distance > (_FARTHEST if predicted else _FARTHEST_FIRST):
        return 0.0
    if predicted and off > _OFF * distance + _ROUNDING and not (is_short and distance < _BEND * predicted):
        return 0.0
    if distance > _EASY:
        return 1.0
    return 3.0 if off < _STRAIGHT * distance else 1.5
