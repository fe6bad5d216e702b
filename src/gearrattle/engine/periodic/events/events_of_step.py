"""Events between two points of a branch that follow one another: which kinds, in which order, and where."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import compress, pairwise

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic import patterns
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import (
    BREAKING,
    DOUBLING,
    FOLD,
    GRAZING,
    NEIMARK_SACKER,
    PATTERN,
    Event,
)
from gearrattle.engine.periodic.events.fold import VERTICAL, along_parameter, hidden_fold, is_vertical
from gearrattle.engine.periodic.events.grazing import JUMP, RELEASE, RIGID, Search, grazing_of
from gearrattle.engine.periodic.events.location import zero_between
from gearrattle.engine.periodic.events.losses import LOSSES
from gearrattle.engine.periodic.events.neimark_sacker import (
    crossing_after,
    has_pair_on_circle,
    is_ambiguous,
    may_hide_pair,
    may_return,
    pairs_crossed,
)
from gearrattle.engine.periodic.events.pattern import View, exchange_between, exchanged_at, time_between
from gearrattle.engine.periodic.events.symmetry_breaking import breaking_between
from gearrattle.engine.periodic.grazing_depth import with_corner
from gearrattle.engine.periodic.motion import Touch
from gearrattle.engine.periodic.multiplier_counts import is_conservative, number_outside
from gearrattle.engine.periodic.point import Point
from gearrattle.engine.periodic.symmetry import is_symmetric
from gearrattle.engine.periodic.turning_points import hidden_between, way_beyond
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]
_DEEPEST = 12  # halvings of a step that holds more than one change of the pattern
_PARABOLAS = 12  # to the minimum of a test function
_SAME = 1e-9  # of a step: a minimum is not known better
_NEAR_ONE = 0.5  # sum of the distances of a multiplier from 1 at the ends of a step in which a symmetry may break twice
_DEEP = 0.5  # of its least value so far: a minimum above that is no sign of two zeros
_TOWARDS = 0.1  # of the way from a motion that touches to a grazing is left by the next one
_APART = 1e-9  # arclength beyond which two events are not one
_SHORT = 1e-6  # arclength: a step in which multipliers that move far are not looked for in between
_MOST_DIVIDED = 8  # divisions of a step in which multipliers move far, or of one that holds several events
_ASIDE = 1e-8  # arclength from a change to the points on either side
_SAME_EVENT = 3e-8  # arclength from an event to the same one, located again from there


def events_between(curve: Continuation, before: Point, after: Point, depth: int = 0) -> list[Event]:
    """Locate what happens between two points that follow one another, in the order of the branch."""
    hidden = hidden_between(before, after) or exchange_between(before, after)
    if hidden is not None and depth < _DEEPEST:
        return _events_of_parts(curve, before, after, hidden, depth)
    view = _view_of(curve, before, after)
    if not patterns.is_one_change(view(before), view(after)) and depth < _DEEPEST:
        return _events_of_parts(curve, before, after, 0.5, depth)
    try:
        changes = list(_changes_of_pattern(curve, before, after, view))
    except ConvergenceError:
        if depth >= _DEEPEST:
            raise
        return _events_of_parts(curve, before, after, 0.5, depth)
    crosses_more = any(len(view(point)) < len(point.word) for point in (before, after))
    if crosses_more and view.watches is not None and depth < _DEEPEST:
        sides = _sides(curve, before, after, changes[0].point)
        if before.word != sides[0].word or sides[1].word != after.word:  # a slider or a limiter changes as well
            parts = pairwise([before, *sides, after])
            return [event for pair in parts for event in events_between(curve, *pair, depth + 1)]
    if len(changes) == 1 and changes[0].grazing is not None and changes[0].grazing.kind == JUMP:
        # the gradient jumps: what happens there is known by the signs of the test functions on either side
        left, right = _sides(curve, before, after, changes[0].point)
        smooth = [*_losses(curve, before, left), *_losses(curve, right, after)]
        changes += [Event(kind, changes[0].point, is_collision=True) for kind in _changed(left, right)]
    else:
        smooth = _smooth_events(curve, before, after, changes)
    return sorted([*changes, *smooth], key=lambda event: event.point.length)


def changes_between(before: Point, after: Point) -> list[str]:
    """Return the kinds of events between two points, without locating them."""
    kinds = _changed(before, after)
    if before.word != after.word:
        kinds.append(PATTERN if sorted(before.word) == sorted(after.word) else GRAZING)
    return kinds


def _view_of(curve: Continuation, before: Point, after: Point) -> View:
    """What two patterns are compared by: crossings of clearances, or where these are the same all of them."""
    if before.word == after.word:
        return View()
    corners = View(curve.family.clearances)
    return View() if corners(before) == corners(after) else corners


def _events_of_parts(curve: Continuation, before: Point, after: Point, share: float, depth: int) -> list[Event]:
    """The events of both parts of a step, up to a share of the way and from there on."""
    middle = curve.between(before, after, share)
    return [*events_between(curve, before, middle, depth + 1), *events_between(curve, middle, after, depth + 1)]


def _smooth_events(curve: Continuation, before: Point, after: Point, changes: list[Event]) -> list[Event]:
    """The events of a step with a smooth test function, up to its grazing and from there on."""
    points = [before, after]
    if len(changes) == 1 and changes[0].kind == GRAZING:
        grazing = changes[0].point
        if before.length < grazing.length < after.length:
            points.append(replace(grazing, touch=changes[0].touch))
        touching = after if len(after.word) > len(before.word) else before
        points += _beside_grazing(curve, changes[0], touching)
    points.sort(key=lambda point: point.length)
    return [event for pair in pairwise(points) for event in _losses(curve, *pair)]


def _beside_grazing(curve: Continuation, grazing: Event, touching: Point) -> Iterator[Point]:
    """Yield motions that touch between a grazing and one that touches, ever nearer to the grazing.

    The trace of the gradient changes with the root of the distance. So close to the grazing multipliers may go to the
    unit circle and back: up to where that root moves them by less than they are from it.
    """
    point = grazing.point
    root = _root_of(grazing)
    way = min(loss.nearest(point)[1] for loss in LOSSES.values() if loss.nearest is not None)
    distance = abs(touching.parameter - point.parameter)
    share = _TOWARDS
    shortest = _APART / max(abs(touching.length - point.length), _APART)
    while distance > 0.0 and root * np.sqrt(share * distance) > way and share > shortest:
        try:
            is_behind = touching.length > point.length
            yield curve.between(point, touching, share) if is_behind else curve.between(touching, point, 1.0 - share)
        except ConvergenceError:
            return
        share *= _TOWARDS


def _root_of(grazing: Event) -> float:
    """How strong the root of a grazing is; infinite where it is rigid, a release or vertical, NaN where it has none."""
    if grazing.grazing is None:
        return np.nan
    is_vertical = abs(along_parameter(grazing.point)) < VERTICAL
    return np.inf if grazing.grazing.kind in (RELEASE, RIGID) or is_vertical else abs(grazing.grazing.root)


def _losses(curve: Continuation, before: Point, after: Point, depth: int = 0) -> Iterator[Event]:
    """Yield the folds, doublings, breakings and Neimark-Sacker bifurcations between two points.

    Where these do not explain how many multipliers lie outside the unit circle at both ends, others are hidden: a
    fold and a breaking within one step leave det(I - M) as it is, and pairs may cross on both sides of a fold.
    """
    if after.length <= before.length:  # a change at an end of the step leaves no part on one side of it
        return
    hidden = hidden_fold(curve, before, after) or _hidden_loss(curve, before, after)
    if hidden is None and _may_hide_pair(before, after, depth):
        hidden = curve.between(before, after, 0.5)
    if hidden is None:
        located = [_located_loss(curve, before, after, kind) for kind in _changed(before, after)]
        events = [event for event in located if event.kind != NEIMARK_SACKER or _crosses(event.point)]
        if len(events) < len(located) and _lies_within(before, located[-1].point, after):
            hidden = located[-1].point  # two real ones have left through -1, one after the other
    if hidden is not None:
        yield from _losses(curve, before, hidden, depth + 1)
        yield from _losses(curve, hidden, after, depth + 1)
    elif depth < _MOST_DIVIDED and (len(events) > 1 or (events and not _tells_all(before, events[0], after))):
        yield from _apart(curve, before, after, events, depth)
    else:
        yield from events


def _may_hide_pair(before: Point, after: Point, depth: int) -> bool:
    """Whether a step must be divided to show which pairs cross the unit circle within it."""
    length = after.length - before.length
    if length > _APART and is_ambiguous(before, after):
        return True
    return depth < _MOST_DIVIDED and length > _SHORT and may_hide_pair(before, after)


def _apart(curve: Continuation, before: Point, after: Point, events: list[Event], depth: int) -> list[Event]:
    """The events of a step up to one of them, which is located, and from there on."""
    event = next((one for one in events if _lies_within(before, one.point, after)), None)
    if event is None:
        return events
    try:
        left, right = _sides(curve, before, after, event.point)
        others = [*_losses(curve, before, left, depth + 1), *_losses(curve, right, after, depth + 1)]
    except ConvergenceError:
        return events
    is_new = [o.kind != event.kind or abs(o.point.length - event.point.length) > _SAME_EVENT for o in others]
    return [event, *compress(others, is_new)]


def _lies_within(before: Point, point: Point, after: Point) -> bool:
    """Whether a point lies so far from both ends of a step that there is a part on either side."""
    return before.length + _SAME_EVENT < point.length < after.length - _SAME_EVENT


def _tells_all(before: Point, event: Event, after: Point) -> bool:
    """Whether the multipliers outside the unit circle at both ends of a step differ by those that cross at an event."""
    if event.is_collision or is_conservative(event.point):
        return not event.is_collision
    crossing = LOSSES[event.kind].crossing(event.point)
    others = number_outside(event.point, crossing)
    ends = [number_outside(point) for point in (before, after)]
    return sorted(ends) == [others, others + len(crossing)]


def _located_loss(curve: Continuation, before: Point, after: Point, kind: str) -> Event:
    """The fold, doubling, breaking or Neimark-Sacker bifurcation between two points."""
    if kind != NEIMARK_SACKER:
        return _located(curve, before, after, kind, LOSSES[kind].test)
    event = _located(curve, before, after, kind, crossing_after(before))
    return replace(event, is_collision=event.is_collision and not is_conservative(event.point))


def _crosses(point: Point) -> bool:
    """Whether a pair crosses the unit circle; where nothing is lost two of them meet on it."""
    return is_conservative(point) or has_pair_on_circle(point)


def _changed(before: Point, after: Point) -> list[str]:
    """The kinds of events whose test functions have different signs at two points."""
    signs = {kind: LOSSES[kind].test(before) * LOSSES[kind].test(after) for kind in (FOLD, DOUBLING, BREAKING)}
    kinds = [kind for kind, sign in signs.items() if sign < 0.0]
    if is_vertical(before, after):
        kinds = [kind for kind in kinds if kind not in (FOLD, BREAKING)]
    if FOLD in kinds and BREAKING in kinds:  # at a fold det(I - M) is zero as well
        kinds.remove(BREAKING)
    if pairs_crossed(before, after):
        kinds.append(NEIMARK_SACKER)
    return kinds


def _hidden_loss(curve: Continuation, before: Point, after: Point) -> Point | None:
    """A point at which a test function has another sign than at both ends of a step; None if there is none.

    Two doublings, two Neimark-Sacker bifurcations, or two breakings of a symmetric driveline may lie within one step: a
    multiplier comes to the unit circle and back.
    """
    for kind, loss in LOSSES.items():
        if loss.nearest is None or loss.test(before) * loss.test(after) <= 0.0:
            continue
        ends = loss.nearest(before), loss.nearest(after)
        if kind == BREAKING:  # a multiplier that leaves the circle at 1 comes back without a fold
            is_near = may_return(*ends, near=_NEAR_ONE)
            is_near = is_near and is_symmetric(curve.family.map_at(before.parameter).system)
        else:
            is_near = may_return(*ends)
        point = _beyond_zero(curve, before, after, loss.test) if is_near else None
        if point is not None:
            return point
    return None


def _beyond_zero(curve: Continuation, before: Point, after: Point, test: Callable[[Point], float]) -> Point | None:
    """A point at which a test function has another sign than at both ends of a step; None if there is none.

    Parabolas through its three least values lead to its minimum, while they have a minimum much smaller than those.
    """
    sign = np.sign(test(before))
    share = 0.5
    values = {0.0: abs(test(before)), 1.0: abs(test(after))}
    for _ in range(_PARABOLAS):
        point = curve.between(before, after, share)
        values[share] = sign * test(point)
        if values[share] < 0.0:
            return point
        nodes = sorted(values, key=lambda node: values[node])[:3]
        bend, slope, level = np.polyfit(nodes, [values[node] for node in nodes], 2)
        if bend <= 0.0 or level - slope**2 / (4.0 * bend) > _DEEP * values[nodes[0]]:
            return None
        share = float(-slope / (2.0 * bend))
        if not 0.0 < share < 1.0 or min(abs(share - node) for node in values) < _SAME:
            return None
    return None


def _sides(curve: Continuation, before: Point, after: Point, change: Point) -> tuple[Point, Point]:
    """The points just before and just beyond a change between two points."""
    step = after.length - before.length
    share = (change.length - before.length) / step
    aside = min(_ASIDE / step, 1e-3)
    left, right = (curve.between(before, after, share + side * aside) for side in (-1.0, 1.0))
    return left, right


def _located(curve: Continuation, before: Point, after: Point, kind: str, test: Callable[[Point], float]) -> Event:
    """The event where a test function changes its sign."""
    if kind == BREAKING:
        breaking = breaking_between(curve, before, after)
        if breaking is not None:
            return Event(kind, breaking)
    point, jumps = zero_between(curve, before, after, test)
    return Event(kind, point, is_collision=jumps and kind in LOSSES)


def _changes_of_pattern(curve: Continuation, before: Point, after: Point, view: View) -> Iterator[Event]:
    """Yield the grazing or the exchange of two crossings between two points whose patterns differ."""
    one = view(before)
    other = view(after)
    if one == other:
        return
    known = _known_grazing(before, after, view)
    if known is not None:
        yield _event_of_grazing(curve, *known)
        return
    fewer, more = sorted((one, other), key=len)
    lone = patterns.lone(fewer, more)
    if lone:
        event = _located(curve, before, after, PATTERN, lambda point: _sign(view(point) == one))
        yield replace(event, watch=patterns.watch_of(lone[0]), is_collision=False)
        return
    if len(one) != len(other):  # by more than two crossings: several touch at once
        yield _event_of_grazing(curve, *Search(curve, before, after, view).grazing())
        return
    swaps = patterns.swaps(one, other)
    if not swaps:
        event = _located(curve, before, after, PATTERN, lambda p: _sign(view(p) == one))
        yield Event(PATTERN, event.point, exchanged_at(event.point, view) if sorted(one) == sorted(other) else -1)
        return

    def apart_by(point: Point) -> float:
        pattern = view(point)
        if pattern not in (one, other):
            raise ConvergenceError("more than one thing changes between two points")
        return time_between(point, other, view) if pattern == one else -time_between(point, one, view)

    i = swaps[0]
    watch = min(patterns.watch_of(one[i]), patterns.watch_of(one[(i + 1) % len(one)]))  # whichever way it is passed
    yield replace(_located(curve, before, after, PATTERN, apart_by), watch=watch, is_collision=False)


def _known_grazing(before: Point, after: Point, view: View) -> tuple[Point, Touch] | None:
    """The one of two points that grazes what the other one touches, and the touch; None if neither does."""
    for apart, touching in ((before, after), (after, before)):
        is_longer = len(view(touching)) == len(view(apart)) + 2
        if apart.touch is not None and is_longer and way_beyond(apart, touching) > 0.0:
            return apart, apart.touch
    return None


def _event_of_grazing(curve: Continuation, point: Point, touch: Touch) -> Event:
    """The event of a motion that grazes."""
    if touch.watch < curve.family.clearances:
        touch = with_corner(curve.family.map_at(point.parameter), point.motion, touch)
    return Event(GRAZING, point, touch.watch, touch=touch, grazing=grazing_of(curve, point, touch))


def _sign(holds: bool) -> float:
    return 1.0 if holds else -1.0
