"""An event of a branch followed over a second value of the model: the border of where motions exist, as a curve.

The second value is changed step by step. Each event is predicted by a parabola through the last three, then located
exactly. Other events of the same kind may lie near. So an event must be as near to its prediction as on a curve; in a
step that is not short its motion keeps its crossings; and one of motions of n periods is not one of motions of fewer.
The first step is short, for it has no prediction.

Where two events of one kind meet, the slope of their test function along the branch vanishes like a root. So no step
leads farther than half the way to where the square of that slope would be zero: beyond there another event may lie.

Two folds meet in a cusp, and neither exists beyond it: the curve ends there. It may end as well where a fold meets a
grazing, or go on beyond (``engine.periodic.special``). Where a curve of folds turns back over the second value, an
isolated branch shrinks to a point, or two branches join.

Takes a Branch and an event; gives a Dataset.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import islice, pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from gearrattle.engine.periodic.boundary import missed_sooner, relocated, word_but_for_touch
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.drift import ALONG, slope_along
from gearrattle.engine.periodic.events import FOLD, GRAZING, NEIMARK_SACKER, Event
from gearrattle.engine.periodic.special import (
    CUSP,
    MEETING,
    TURNING,
    grazing_near,
    meeting_of_grazing,
    meeting_of_two,
    resonance,
)
from gearrattle.errors import ConvergenceError, ModelError
from gearrattle.model.path_labels import path_label
from gearrattle.model.quantity import CALLBACK, checked
from gearrattle.orbits.family import family_of, watched_names
from gearrattle.orbits.followed import Followed
from gearrattle.orbits.gradients import check_kind, second_of
from gearrattle.orbits.progress import Progress, part_of

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]

Follower = Callable[[float], Continuation]
"""The branch over the value, by the second value."""
Across = Callable[[float, float], Continuation]
"""The branch over the second value, by the value and a second value near."""

_STEPS = 40.0  # over the range, at least
_MOST = 2000  # points on either side of the model's own value
_SHORTEST = 1e-4  # of an even step
_FARTHEST = 0.2  # largest distance that an event may move in a step, in units of w
_FARTHEST_FIRST = 1e-3  # the same in the first step
_EASY = 0.05  # a smaller distance than this: the step may grow
_FIRST = 1e-3  # of an even step: the first one, without a prediction
_REPEATS = 1e-7  # of the size of the state: what fails to repeat sooner by so little does repeat
_FALL = 0.2  # of how much a motion fails to repeat sooner: what is left after a step, at least
_PREDICTED_FROM = 3  # last points, by a parabola through them
_OFF, _STRAIGHT = 0.2, 0.05  # of the distance: how far an event may be from its prediction; if so near, steps grow fast
_ROUNDING = 1e-8  # of w: what lies so near to the prediction is near
_SHORT, _BEND = 1e-2, 4.0  # of an even step; a curve may have a corner: over short steps it leads so many times as far
_AT_TURNING, _MOST_VALUES = 1e-8, 60  # of the value: to so much is known where a curve of folds turns back; tries
_INSIDE = 0.02  # of where that is sought: so far from both ends it must lie
_TOWARDS = 0.5  # of the way to where two events would meet: the longest step
_REACH = 0.1  # of the range: a special point farther from the last known event is another one's
_BEHIND = 1e-3  # of the last step: the event was met there, so a point at which it vanishes lies no farther back
_BACK = 7  # last points of a fold from which a grazing near is sought
_TRIED = 0.1  # of the distance between two points: the first step from there to where a fold meets a grazing


@dataclass(frozen=True)
class _Row:
    """An event at a second value; what is special about it."""

    second: float
    event: Event
    special: str = ""
    slope: float = np.nan  # of its test function along the branch


def boundary_of(
    branch: Followed,
    event: tuple[Event, Continuation],
    second: str,
    range: Sequence[float | str],
    progress: Progress | None,
) -> xr.Dataset:
    """Follow an event from the model's own second value to both ends of its range; see ``Branch.boundary``.

    Parameters
    ----------
    branch
        that the event lies on.
    event
        the event, and the Continuation of its curve.
    second
        path of the other value.
    range
        its ends.
    progress
        called with the finished share; an exception from it ends the work.
    """
    import xarray as xr

    checked(CALLBACK, progress, "progress")
    model, path = branch.model, branch.path
    own, ends = second_of(model, path, second, range)
    chosen, curve = event
    check_kind(chosen)

    def follower(value: float) -> Continuation:
        changed = model.with_({second: value})
        family = family_of(changed, path, chosen.point.parameter, curve.family.cycles, curve.family.unit)
        if family.clearances != curve.family.clearances:
            raise ConvergenceError("a clearance closes or opens there")
        return curve.of(family)

    def across(value: float, near: float) -> Continuation:
        family = family_of(model.with_({path: value}), second, near, curve.family.cycles, abs(own) or 1.0)
        return curve.of(family)

    parts = part_of(progress, 0, 2), part_of(progress, 1, 2)
    low, high = (_one_way(follower, chosen, (own, end), part) for end, part in zip(ends, parts, strict=True))
    sides = [_ended((follower, across), side, end) for side, end in ((low, ends[0]), (high, ends[1]))]
    rows = [*reversed(sides[0][1:]), *sides[1]]
    if progress is not None:
        progress(1.0)
    notes = [_note(second, side) for side, end in zip(sides, ends, strict=True) if side[-1].second != end]
    attributes = {
        "result": "event boundary",
        "path": path,
        "second": second,
        "own": own,
        "kind": chosen.kind,
        "clearance": watched_names(model)[chosen.watch] if chosen.watch >= 0 else "",
        "notes": notes,
        "title": model.name,
    }
    labels = {name: path_label(name, model) for name in (path, second)}
    about = {name: {"long_name": label.words, "units": label.unit or "1"} for name, label in labels.items()}
    variables = {
        "second": ("point", np.array([row.second for row in rows]), about[second]),
        "value": ("point", np.array([row.event.point.parameter for row in rows]), about[path]),
        "special": ("point", np.array([row.special for row in rows], dtype=np.str_)),
        "error": ("point", np.array([row.event.point.error for row in rows])),
    }
    return xr.Dataset(variables, attrs=attributes)


def _note(second: str, rows: list[_Row]) -> str:
    """What is said of a curve that ends inside the range."""
    last = rows[-1]
    if len(rows) >= _MOST:
        return f"The event is not followed beyond {second} = {last.second:.6g}: more than {_MOST} points."
    reason = f": {last.special}" if last.special else ""
    return f"The event is not found beyond {second} = {last.second:.6g}{reason}."


def _ended(followers: tuple[Follower, Across], rows: list[_Row], end: float) -> list[_Row]:
    """The rows from the model's own value to an end with their special points, the last one where the curve ends."""
    follower = followers[0]
    if rows[-1].second != end and len(rows) > 1:
        rows = _last(followers, rows, end)
    out = rows[:1]
    for before, after in pairwise(rows):
        if not after.special and (between := _between(follower, before, after)):
            out.append(between)
        out.append(after)
    return out


def _between(follower: Follower, before: _Row, after: _Row) -> _Row | None:
    """The point between two rows at which a fold meets a grazing; None if none does."""
    meeting = None
    if before.event.kind == GRAZING and before.event.point.tangent[-1] * after.event.point.tangent[-1] < 0.0:
        meeting = _meeting(follower, [before, after], 0.5 * (after.second - before.second))
    elif before.event.kind == FOLD and before.event.point.pattern != after.event.point.pattern:
        meeting = _meeting_of_fold(follower, before, after) or _meeting_of_fold(follower, after, before)
    share = 0.0 if meeting is None else (meeting.second - before.second) / (after.second - before.second)
    return meeting if 0.0 < share < 1.0 else None


def _last(followers: tuple[Follower, Across], rows: list[_Row], end: float) -> list[_Row]:
    """The rows up to where the curve ends, with the special point there if one is near."""
    follower, across = followers
    last, step = rows[-1], rows[-1].second - rows[-2].second
    kind = last.event.kind
    points = list[_Row]()
    if kind == NEIMARK_SACKER:
        with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
            second, event, name = resonance((rows[-2].second, rows[-2].event), (last.second, last.event), follower)
            points.append(_Row(second, event, name))
    if not points:
        with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
            second, event = meeting_of_two(last.event, follower, last.second, step)
            points.append(_Row(second, event, CUSP if kind == FOLD else TURNING))
    if kind == FOLD:
        meetings = (_meeting_of_fold(follower, after, before) for before, after in reversed([*pairwise(rows[-_BACK:])]))
        points.extend(islice((meeting for meeting in meetings if meeting), 1))
        with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
            points.append(_turning(rows, across))
    farthest = _REACH * abs(end - rows[0].second)
    near = list[tuple[float, _Row]]()
    for point in points:
        ahead = (point.second - last.second) * np.sign(step)
        behind = _BEHIND if point.special != MEETING else 1.0  # a fold may stay so near to a grazing as rounding
        if -behind * abs(step) <= ahead < farthest:
            near.append((ahead, point))
    if not near:
        return rows
    ahead, point = min(near, key=lambda pair: pair[0])
    return [*(rows if ahead > 0.0 else rows[:-1]), point]


def _meeting_of_fold(follower: Follower, row: _Row, other: _Row) -> _Row | None:
    """The point near a row of a fold, and another one, at which it meets a grazing; None if none is near."""
    with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
        grazings = [(one.second, grazing_near(one.event, follower(one.second))) for one in (row, other)]
        known = [_Row(second, grazing) for second, grazing in grazings if grazing]
        if known and (meeting := _meeting(follower, known, _TRIED * abs(other.second - row.second))):
            return replace(meeting, event=replace(meeting.event, kind=FOLD))
    return None


def _turning(rows: list[_Row], across: Across) -> _Row:
    """The point ahead at which a curve of folds turns back: an extremum of the second value over the value.

    A fold of the branch over the value is one of the branch over the second value as well, and has the same tangent.
    """
    last, side = rows[-1], np.sign(rows[-1].second - rows[-2].second)
    begin, width = last.event.point.parameter, _twice_to_turning(rows)
    curve = across(begin, last.second)
    w = np.append(last.event.point.w[:-1], last.second / curve.family.unit)
    known = {begin: replace(last.event, point=replace(last.event.point, parameter=last.second, w=w))}

    def way_back(value: float) -> float:
        event = known[min(known, key=lambda other: abs(other - value))]
        known[value] = relocated(event, across(value, event.point.parameter), np.zeros_like(w), _FARTHEST)
        return float(-side * known[value].point.parameter)

    options = {"xatol": _AT_TURNING * abs(begin), "maxiter": _MOST_VALUES}
    bounds = sorted((begin, begin + width))
    value = float(minimize_scalar(way_back, bounds=bounds, method="bounded", options=options).x)
    if not _INSIDE < (value - begin) / width < 1.0 - _INSIDE:
        raise ConvergenceError("the curve does not turn back near")
    point = known[value].point
    return _Row(point.parameter, replace(last.event, point=replace(point, parameter=value)), TURNING)


def _twice_to_turning(rows: list[_Row]) -> float:
    """Twice the change of the value from the last point to where a parabola through the last three turns back."""
    if len(rows) < _PREDICTED_FROM:
        raise ConvergenceError("too few points are known")
    one, two, three = rows[-_PREDICTED_FROM:]
    values = [row.event.point.parameter for row in (one, two, three)]
    if len(set(values)) < len(values):
        raise ConvergenceError("the value does not move")
    earlier = (two.second - one.second) / (values[1] - values[0])
    later = (three.second - two.second) / (values[2] - values[1])
    bend = (later - earlier) / (values[2] - values[0])
    slope = later + bend * (values[2] - values[1])
    if bend * slope * (values[2] - values[1]) >= 0.0:
        raise ConvergenceError("the curve does not turn back ahead")
    return -slope / bend


def _meeting(follower: Follower, rows: list[_Row], step: float) -> _Row | None:
    """The point near rows of a grazing at which it meets a fold; None if it meets none."""
    with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
        known = {row.second: row.event for row in rows}
        return _Row(*meeting_of_grazing(known, follower, step), MEETING)
    return None


def _one_way(follower: Follower, event: Event, ends: tuple[float, float], progress: Progress | None) -> list[_Row]:
    """The event from a start value to an end value, as far as it exists."""
    start, end = ends
    located = [_Row(start, event)]
    even = (end - start) / _STEPS
    missed = missed_sooner(follower(start).family, event.point)
    keeps_cycles = missed > _REPEATS
    step = _FIRST * even
    while located[-1].second != end and abs(step) >= _SHORTEST * abs(even) and len(located) < _MOST:
        if progress is not None:
            progress((located[-1].second - start) / (end - start))
        following = located[-1].second + step
        if (end - following) * (end - start) <= 0.0:
            following = end
        row, growth, still_missed = None, 0.0, np.inf
        with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
            curve = follower(following)
            row, growth = _moved(located, curve, following, abs(step) <= _SHORT * abs(even))
            still_missed = missed_sooner(curve.family, row.event.point) if row else np.inf
        if keeps_cycles and still_missed < max(_FALL * missed, _REPEATS):
            row = None
        if row is None:
            step *= 0.5
            continue
        located.append(row)
        longest = min(2.0 * abs(even), max(_to_meeting(located), _SHORTEST * abs(even)))
        step, missed = float(np.clip(growth * step, -longest, longest)), still_missed
    return located


def _to_meeting(located: list[_Row]) -> float:
    """How far the next step may lead towards where the event would meet another one of its kind."""
    if len(located) < 2:
        return np.inf
    one, two = located[-2:]
    way, fall = abs(two.second - one.second), one.slope**2 - two.slope**2
    return _TOWARDS * way * two.slope**2 / fall if fall > 0.0 else np.inf


def _moved(located: list[_Row], curve: Continuation, second: float, is_short: bool) -> tuple[_Row | None, float]:
    """The next row of an event, None if that is another event's; how many times as long the step after it may be."""
    last = located[-1]
    change = np.zeros_like(last.event.point.w)
    if len(located) > 1:
        change = _predicted(located[-_PREDICTED_FROM:], second) - last.event.point.w
    event = relocated(last.event, curve, change, _FARTHEST)
    growth = _growth(event.point.w - last.event.point.w, change, is_short)
    if not is_short and word_but_for_touch(event) != word_but_for_touch(last.event):
        growth = 0.0
    slope = np.nan
    if event.kind != GRAZING:  # whose depth is no smooth function beyond it
        with suppress(ConvergenceError):  # a fold so sharp that no motion is near
            slope = slope_along(event, event.point, curve, ALONG)[0]
    growth = 0.0 if slope * last.slope < 0.0 else growth
    return (_Row(second, event, slope=slope) if growth else None), growth


def _predicted(known: list[_Row], second: float) -> Array:
    """The point w at a second value, by Lagrange's polynomial through known ones."""
    w = np.zeros_like(known[0].event.point.w)
    for row in known:
        others = [other.second for other in known if other is not row]
        w += np.prod([(second - other) / (row.second - other) for other in others]) * row.event.point.w
    return w


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
