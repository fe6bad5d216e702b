"""An event of a branch followed over a second value of the model: the border of where motions exist, as a curve.

The second value is changed step by step. Each event is predicted by a parabola through the last three, then located
exactly. Other events of the same kind may lie near. So an event must be as near to its prediction as on a curve, and
its motion keeps its crossings, except in a short step: the first one has no prediction, and the curve may have a
corner. An event of motions of n periods is not one of motions of fewer; but a grazing may pass the point where it is
one of n / 2 periods, also in a long step, for there the halves of its motion change their roles.

Where two events of one kind meet, the slope of their test function along the branch vanishes like a root. So no step
leads farther than half the way to where the square of that slope would be zero: beyond there another event may lie.

Two folds meet in a cusp, and neither exists beyond it: the curve ends there. It may end as well where a fold meets a
grazing, or go on beyond (``engine.periodic.special``). Where a curve of folds turns back over the second value, an
isolated branch shrinks to a point, or two branches join. Two ends of families meet where their length is least: their
test function is that length.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from gearrattle.engine.periodic.boundary import missed_after, polynomial_at, relocated, word_but_for_touch
from gearrattle.engine.periodic.breaking import HalfPeriodFamily
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.drift import slope_along
from gearrattle.engine.periodic.events import FOLD, GRAZING, NEIMARK_SACKER, Event
from gearrattle.engine.periodic.grazing import JUMP, RELEASE
from gearrattle.engine.periodic.special import (
    CUSP,
    FOLD_AT_DOUBLING,
    GRAZING_AT_DOUBLING,
    MEETING,
    TANGENCY,
    TURNING,
    fold_at_doubling,
    grazing_at_doubling,
    grazing_near,
    meeting_of_grazing,
    meeting_of_two,
    resonance,
    resonance_of,
    tangency,
)
from gearrattle.engine.periodic.unit_circle import nearest_pair
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model.factors import Written
from gearrattle.model.path_labels import path_label, shown_value
from gearrattle.model.quantity import CALLBACK, checked
from gearrattle.orbits.family_ends import EDGE, end_again, slope_of_length
from gearrattle.orbits.gradients import moved_as, second_of
from gearrattle.orbits.over_value import alike, family_of, watched_names
from gearrattle.orbits.progress import Progress, never_falling, part_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from gearrattle.orbits.branch import Branch

Array = NDArray[np.float64]

Follower = Callable[[float], Continuation]
"""The branch over the value, by the second value."""
Across = Callable[[float, float], Continuation]
"""The branch over the second value, by the value and a second value near."""

_STEPS = 40.0  # over the range, at least
_MOST = 2000  # points on either side of the model's own value
_SHORTEST = 1e-4  # of an even step
_FARTHEST = 0.2  # largest distance that an event may move in a step, in units of w
_FARTHEST_SHORT = 1e-3  # the same in a short step that is not predicted: the first one, or over a corner of the curve
_EASY = 0.05  # a smaller distance than this: the step may grow
_FIRST = 1e-3  # of an even step: the first one, without a prediction
_REPEATS = 1e-7  # of the size of the state: a motion that misses its begin by so little after fewer periods repeats
_FALL = 0.2  # of how much a motion fails to repeat sooner: what is left after a step, at least
_PREDICTED_FROM = 3  # last points, by a parabola through them
_OFF, _STRAIGHT = 0.2, 0.05  # of the distance: how far an event may be from its prediction; if so near, steps grow fast
_PAIR = 0.1  # how much the real part of a pair on the unit circle counts beside w
_ROUNDING = 1e-8  # of w: what lies so near to the prediction is near
_SHORT = 1e-2  # of an even step: the longest one in which the crossings may change, or the prediction fail
_AT_TURNING, _MOST_VALUES = 1e-8, 60  # of the value: to so much is known where a curve of folds turns back; tries
_INSIDE = 0.02  # of where that is sought: so far from both ends it must lie
_TOWARDS = 0.5  # of the way to where two events would meet: the longest step
_REACH = 0.1  # of the range: a special point farther from the last known event is another one's
_MET = 1e-3  # of the last step: the event was met there, so a point at which it vanishes lies no farther back
_BEHIND = {MEETING: 1.0, FOLD_AT_DOUBLING: np.inf}
"""The same where rounding hides the event: a fold may stay at a grazing, or be lost in a doubling."""
_BACK = 7  # last points of a fold from which a grazing near is sought, and of a grazing for its acceleration
_NEAR_HALF, _NOT_ROUNDING = 1e-3, 5e-4  # of the size of the state: such a motion nearly repeats after half its periods
_STAYS = 0.01  # of how much its motion misses: a grazing so near to a fold stays there
_SPACED, _LEVEL = 1.4, 0.2  # of the slope of a length: of the next one for the extrapolation, and what is left of it
_BESIDE = 1e-6  # of the second value: a driveline so near has the same symmetry
_TRIED = 0.1  # of the distance between two points: the first step from there to where a fold meets a grazing


@dataclass(frozen=True)
class _Row:
    """An event at a second value; what is special about it."""

    second: float
    event: Event
    special: str = ""
    slope: float = np.nan  # of its test function along the branch
    word: str = ""  # of its pattern, but for its touch
    missed: tuple[Array, ...] = ()  # by how much its motion fails to repeat after fewer periods, half of them first


def boundary_of(
    branch: Branch,
    event: tuple[Event, Continuation],
    second: str,
    range: Sequence[Written],
    progress: Progress | None,
) -> xr.Dataset:
    """Follow an event from the model's own second value to both ends of its range; see ``Branch.boundary``."""
    import xarray as xr

    checked(CALLBACK, progress, "progress")
    model, path = branch.model, branch.path
    own, ends = second_of(model, path, second, range)
    chosen, curve = moved_as(*event)

    def follower(value: float) -> Continuation:
        changed, near = model.with_({second: value}), chosen.point.parameter
        family = family_of(changed, path, near, curve.family.cycles, curve.family.unit)
        return curve.of(alike(family, curve.family, near))

    if isinstance(curve.family, HalfPeriodFamily):
        _check_symmetry(follower, second, own)

    def across(value: float, near: float) -> Continuation:
        family = family_of(model.with_({path: value}), second, near, curve.family.cycles, abs(own) or 1.0)
        return curve.of(family)

    work = never_falling(progress)
    parts = part_of(work, 0, 2), part_of(work, 1, 2)
    low, high = (_one_way(follower, chosen, (own, end), part) for end, part in zip(ends, parts, strict=True))
    sides = [_ended((follower, across), side, end) for side, end in ((low, ends[0]), (high, ends[1]))]
    rows = [*reversed(sides[0][1:]), *sides[1]]
    work(1.0)
    shown = partial(shown_value, second, model, digits=6, largest=max(abs(row.second) for row in rows))
    notes = [_note(second, shown, side) for side, end in zip(sides, ends, strict=True) if side[-1].second != end]
    attributes = {
        "result": "event boundary",
        "path": path,
        "second": second,
        "own": own,
        "kind": event[0].kind,
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


def _check_symmetry(follower: Follower, second: str, own: float) -> None:
    """Refuse a second value without which there is no symmetry that could break.

    Raises ModelError: the driveline is not symmetric beside its own second value.
    """
    try:
        follower(own * (1.0 + _BESIDE))
    except ConvergenceError as error:
        rule = f"cannot be changed alone for a breaking of symmetry: {error.message}"
        raise ModelError(Problem("second", second, rule, "name another number")) from None


def _note(second: str, shown: Callable[[float], str], rows: list[_Row]) -> str:
    """What is said of a curve that ends inside the range."""
    last = rows[-1]
    limit = f"{second} = {shown(last.second)}"
    if len(rows) >= _MOST:
        return f"The event is not followed beyond {limit}: more than {_MOST} points."
    reason = f": {last.special}" if last.special else ""
    return f"The event is not found beyond {limit}{reason}."


def _ended(followers: tuple[Follower, Across], rows: list[_Row], end: float) -> list[_Row]:
    """The rows from the model's own value to an end with their special points, the last one where the curve ends."""
    follower = followers[0]
    if rows[-1].second != end and len(rows) > 1:
        rows = _last(followers, rows, end)
    out = rows[:1]
    for before, after in pairwise(rows):
        out += [after] if after.special else [*_between(follower, before, after), after]
    return out


def _between(follower: Follower, before: _Row, after: _Row) -> list[_Row]:
    """The special point between two rows; none if there is none."""
    kind, step = before.event.kind, 0.5 * (after.second - before.second)
    known = {row.second: row.event for row in (before, after)}
    points = list[_Row]()
    if _turns_around(before, after):
        points = _sought(lambda: grazing_at_doubling(known, follower, step), GRAZING_AT_DOUBLING)
    elif kind == GRAZING and before.event.point.tangent[-1] * after.event.point.tangent[-1] < 0.0:
        is_apart = min(_missed(before), _missed(after)) > _NEAR_HALF  # else the tangent is upright by itself
        points = _sought(lambda: meeting_of_grazing(known, follower, step), MEETING) if is_apart else []
    elif kind == FOLD and before.event.point.pattern != after.event.point.pattern:
        points = _meeting_of_fold(follower, before, after) or _meeting_of_fold(follower, after, before)
    ends = sorted((before.second, after.second))
    return [point for point in points if ends[0] < point.second < ends[1]]


def _missed(row: _Row) -> float:
    """By how much the motion of a row fails to repeat after fewer periods; infinite for one of one period."""
    return min((float(np.linalg.norm(missed)) for missed in row.missed), default=np.inf)


def _turns_around(before: _Row, after: _Row) -> bool:
    """Whether a grazing repeats after half of its periods between two rows: then the halves change their roles."""
    has_half = bool(before.missed) and before.event.point.motion.cycles % 2 == 0
    is_grazing = before.event.kind == GRAZING
    return is_grazing and has_half and float(before.missed[0] @ after.missed[0]) < 0.0


def _last(followers: tuple[Follower, Across], rows: list[_Row], end: float) -> list[_Row]:
    """The rows up to where the curve ends, with the special point there if one is near."""
    last, step = rows[-1], rows[-1].second - rows[-2].second
    farthest = _REACH * abs(end - rows[0].second)
    for points in _ends(followers, rows):
        near = list[tuple[float, _Row]]()
        for point in points:
            ahead = (point.second - last.second) * np.sign(step)
            if -_BEHIND.get(point.special, _MET) * abs(step) <= ahead < farthest:
                near.append((ahead, point))
        if near:
            _, point = min(near, key=lambda pair: pair[0])
            return [*(row for row in rows if (point.second - row.second) * step > 0.0), point]
    return rows


def _ends(followers: tuple[Follower, Across], rows: list[_Row]) -> Iterator[list[_Row]]:
    """Yield the special points near the last row at which its curve may end, those that are sure first.

    Beside a resonance or a doubling the test function is so flat that it seems to have a meeting of two.
    """
    follower, across = followers
    if rows[-1].event.kind == EDGE:
        yield _sought(lambda: _turning_of_end(rows), TURNING)
        return
    known = [(row.second, row.event) for row in rows[-_PREDICTED_FROM:]]
    (before, _), (second, event) = known[-2:]
    if event.kind == NEIMARK_SACKER:
        yield _sought(lambda: resonance(known[-2], known[-1], follower), resonance_of(event))
    if event.kind in (FOLD, GRAZING) and event.point.motion.cycles % 2 == 0:
        yield _at_doubling(follower, rows)
    if event.kind == GRAZING:
        yield _sought(lambda: tangency([(row.second, row.event) for row in rows[-_BACK:]], follower), TANGENCY)
    special = CUSP if event.kind == FOLD else TURNING
    points = _sought(lambda: meeting_of_two(event, follower, second, second - before), special)
    if event.kind == FOLD:
        meetings = (_meeting_of_fold(follower, after, before) for before, after in reversed([*pairwise(rows[-_BACK:])]))
        points += next((meeting for meeting in meetings if meeting), [])
        points += _sought(lambda: _turning(rows, across), TURNING)
    yield points


def _at_doubling(follower: Follower, rows: list[_Row]) -> list[_Row]:
    """The point at which folding or grazing motions come to repeat after half of their periods; none if none is near.

    Where a fold stays at a grazing, that comes to it as well.
    """
    missed = {row.second: float(np.linalg.norm(row.missed[0])) for row in rows}
    if missed[rows[-1].second] > _NEAR_HALF:
        return []
    spaced = list[_Row]()
    for row in reversed(rows):
        if missed[row.second] > (2.0 * missed[spaced[-1].second] if spaced else _NOT_ROUNDING):
            spaced.append(row)
    for row in spaced[:_BACK]:
        step, farthest = _TRIED * (rows[-1].second - row.second), _STAYS * missed[row.second]
        known = {row.second: row.event} if row.event.kind == GRAZING else _grazings_near(follower, farthest, row)
        if points := _sought(partial(grazing_at_doubling, known, follower, step), GRAZING_AT_DOUBLING):
            return points
    if rows[0].event.kind != FOLD:
        return []
    folds = [(missed[row.second], row.second, row.event) for row in spaced[:_PREDICTED_FROM]]
    points = _sought(lambda: fold_at_doubling(folds), FOLD_AT_DOUBLING)
    return [point for point in points if (point.second - folds[0][1]) * (rows[-1].second - rows[0].second) > 0.0]


def _sought(find: Callable[[], tuple[float, Event]], special: str) -> list[_Row]:
    """The special point that is sought; none where there is none near."""
    with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
        return [_Row(*find(), special)]
    return []


def _meeting_of_fold(follower: Follower, row: _Row, other: _Row) -> list[_Row]:
    """The point near a row of a fold, and another one, at which it meets a grazing; none if none is near."""
    known, step = _grazings_near(follower, np.inf, row, other), _TRIED * abs(other.second - row.second)
    points = _sought(lambda: meeting_of_grazing(known, follower, step), MEETING)
    return [replace(point, event=replace(point.event, kind=FOLD)) for point in points]


def _grazings_near(follower: Follower, farthest: float, *rows: _Row) -> dict[float, Event]:
    """By second value, the grazings nearest to folds, at an arclength of no more than the farthest."""
    known = dict[float, Event]()
    for row in rows:
        with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
            grazing = grazing_near(row.event, follower(row.second))
            if grazing and abs(grazing.point.length) < farthest:
                known[row.second] = grazing
    return known


def _turning(rows: list[_Row], across: Across) -> tuple[float, Event]:
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
    return point.parameter, replace(last.event, point=replace(point, parameter=value))


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


def _turning_of_end(rows: list[_Row]) -> tuple[float, Event]:
    """The point ahead at which a curve of ends of families turns back: the length of the family has no slope there.

    The second value has an extremum over that slope, so it is extrapolated over its square and cube.
    """
    spaced = [rows[-1]]
    for row in reversed(rows):
        if abs(row.slope) > _SPACED * abs(spaced[-1].slope):
            spaced.append(row)
    if len(spaced) < _PREDICTED_FROM or abs(rows[-1].slope) > _LEVEL * abs(spaced[-1].slope):
        raise ConvergenceError("the length of the family keeps its slope")
    known = spaced[:_PREDICTED_FROM]
    powers = np.array([row.slope for row in known])[:, None] ** (0, 2, 3)
    second = float(np.linalg.solve(powers, [row.second for row in known])[0])
    value = float(polynomial_at([(row.slope, np.array([row.event.point.parameter])) for row in known], 0.0)[0])
    last = rows[-1].event
    return second, replace(last, point=replace(last.point, parameter=value))


def _one_way(follower: Follower, event: Event, ends: tuple[float, float], progress: Progress) -> list[_Row]:
    """The event from a start value to an end value, as far as it exists."""
    start, end = ends
    located = [_row(event, follower(start), start)]
    even = (end - start) / _STEPS
    step = _FIRST * even
    while located[-1].second != end and abs(step) >= _SHORTEST * abs(even) and len(located) < _MOST:
        progress((located[-1].second - start) / (end - start))
        following = located[-1].second + step
        if (end - following) * (end - start) <= 0.0:
            following = end
        row, growth = None, 0.0
        with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
            row, growth = _moved(located, follower(following), following, abs(step) <= _SHORT * abs(even))
        if row is None or _repeats_sooner(located, row):
            step *= 0.5
            continue
        located.append(row)
        longest = min(2.0 * abs(even), max(_to_meeting(located), _SHORTEST * abs(even)))
        step = float(np.clip(growth * step, -longest, longest))
    return located


def _row(event: Event, curve: Continuation, second: float) -> _Row:
    """The row of an event: what tells it from others that lie near."""
    slope = np.nan
    if event.kind == EDGE:
        slope = slope_of_length(event.point, curve)
    elif event.kind != GRAZING:  # whose depth is no smooth function beyond it
        with suppress(ConvergenceError):  # a fold so sharp that no motion is near
            slope = slope_along(event, curve)
    cycles = curve.family.cycles
    fewer = [number for number in range(cycles // 2, 0, -1) if cycles % number == 0]
    size = max(1.0, float(np.linalg.norm(event.point.w[:-1])))
    missed = tuple(missed_after(curve.family, event.point, number) / size for number in fewer)
    return _Row(second, event, slope=slope, word=word_but_for_touch(event), missed=missed)


def _repeats_sooner(located: list[_Row], row: _Row) -> bool:
    """Whether a motion repeats after fewer periods, or comes near to that, unlike those before.

    A grazing may pass the point where it repeats after half of them.
    """
    least = _REPEATS if _turns_around(located[-1], row) else max(_FALL * _missed(located[-1]), _REPEATS)
    return _missed(located[0]) > _REPEATS and _missed(row) < least


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
    before = _compared(last.event)
    change = np.zeros_like(before)
    if len(located) > 1:
        known = [(row.second, _compared(row.event)) for row in located[-_PREDICTED_FROM:]]
        change = polynomial_at(known, second) - before
    moved = change[: last.event.point.w.size]
    is_end = last.event.kind == EDGE
    event = end_again(last.event, curve, moved) if is_end else relocated(last.event, curve, moved, _FARTHEST)
    row = _row(event, curve, second)
    growth = _growth(_compared(event) - before, change, is_short)
    may_change = is_short or row.word == last.word or _turns_around(last, row)
    if not may_change or row.slope * last.slope < 0.0:
        growth = 0.0
    return (row if growth else None), growth


def _compared(event: Event) -> Array:
    """What is compared with its prediction: the w of an event, and of a pair on the unit circle its real part."""
    w = event.point.w
    return np.append(w, _PAIR * nearest_pair(event.point)[0].real) if event.kind == NEIMARK_SACKER else w


def _growth(move: Array, change: Array, is_short: bool) -> float:
    """How many times as long the step after a move that was predicted may be; 0: it led to another event."""
    distance, off = (float(np.linalg.norm(way)) for way in (move, move - change))
    if not change.any() or off > _OFF * distance + _ROUNDING:
        return 1.5 if is_short and distance <= _FARTHEST_SHORT else 0.0
    if distance > _FARTHEST:
        return 0.0
    if distance > _EASY:
        return 1.0
    return 3.0 if off < _STRAIGHT * distance else 1.5


DRAWN = (FOLD, GRAZING, EDGE)
"""Kinds of events whose curves are followed."""
_SAME = 1e-5  # of both ranges: special points of two curves that lie nearer are the same
_LOST = "not found further"
_BEYOND = "beyond the range of the first value"


@dataclass(frozen=True)
class Border:
    """An event over the second value.

    Attributes
    ----------
    event
        its row in the events of the branch.
    kind
        of event.
    clearance
        what grazes; empty for another event.
    second, value
        (N,) the second value, ascending, and the first one at the event [SI].
    ends_below, ends_above
        why it ends inside the range there: a special point, "beyond the range of the first value", where it is not
        followed to the end, or "not found further"; empty where it does not.
    """

    event: int
    kind: str
    clearance: str
    second: Array
    value: Array
    ends_below: str
    ends_above: str


@dataclass(frozen=True)
class SpecialPoint:
    """A point at which curves of events end or meet.

    Attributes
    ----------
    kind
        one of ``special`` in ``Branch.boundary``.
    value, second
        where [SI].
    """

    kind: str
    value: float
    second: float


def borders_of(
    events: pd.DataFrame,
    boundary: Callable[[int], xr.Dataset],
    ranges: tuple[tuple[float, float], tuple[float, float]],
    progress: Progress,
    shown: Callable[[float], str],
) -> tuple[list[Border], list[SpecialPoint], list[str]]:
    """Follow every fold, grazing and end of a family of a branch.

    ``ranges``: ascending ends of the value and of the second one [SI].
    The curves, their special points, and notes on events that could not be followed.
    """
    is_drawn, jumps = events["kind"].isin(DRAWN), events["grazing"].isin([JUMP, RELEASE])
    chosen = events.index[is_drawn & ~events["collision"] & ~jumps]
    borders, curves = list[Border](), list["xr.Dataset"]()
    notes = [
        f"The grazing at {shown(value)} is not followed: the motion or its gradient jumps there."
        for value in events.loc[is_drawn & jumps, "value"].tolist()
    ]
    spans = ranges[0][1] - ranges[0][0], ranges[1][1] - ranges[1][0]
    for done, row in enumerate(chosen, 1):
        kind, clearance = str(events["kind"][row]), str(events["clearance"][row])
        try:
            curve = boundary(int(row))
        except (ConvergenceError, np.linalg.LinAlgError) as error:
            notes.append(f"The {kind} at {shown(float(events['value'][row]))} was not followed: {error}.")
            continue
        curves.append(curve)
        second, special = curve["second"].values, [str(kind) for kind in curve["special"].values]
        is_inside = second[0] > ranges[1][0] + _SAME * spans[1], second[-1] < ranges[1][1] - _SAME * spans[1]
        in_range = [ranges[0][0] <= curve["value"].values[i] <= ranges[0][1] for i in (0, -1)]
        reasons = [
            (special[i] or (_LOST if in_plane else _BEYOND)) if inside else ""
            for i, inside, in_plane in zip((0, -1), is_inside, in_range, strict=True)
        ]
        borders.append(Border(int(row), kind, clearance, second, curve["value"].values, reasons[0], reasons[1]))
        progress(done / len(chosen))
    progress(1.0)  # where no event was there, or the last one could not be followed
    return borders, special_points_of(curves, spans), notes


def special_points_of(curves: Sequence[xr.Dataset], spans: tuple[float, float]) -> list[SpecialPoint]:
    """Return the special points of curves, once each: a cusp is the end of two folds.

    ``spans``: lengths of the ranges of value and second [SI].
    """
    points: list[SpecialPoint] = []
    for curve in curves:
        columns = (curve[name].values.tolist() for name in ("special", "value", "second"))
        for kind, value, second in zip(*columns, strict=True):
            is_known = any(
                point.kind == kind
                and abs(point.value - value) < _SAME * spans[0]
                and abs(point.second - second) < _SAME * spans[1]
                for point in points
            )
            if kind and not is_known:
                points.append(SpecialPoint(str(kind), float(value), float(second)))
    return points
