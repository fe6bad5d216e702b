"""An event of a branch followed over a second value of the model: the border of where motions exist, as a curve.

The second value is changed step by step. Each event is predicted by a parabola through the last three, then located
exactly. Other events of the same kind may lie near. So an event must be as near to its prediction as on a curve, and
its motion keeps its crossings, except in a short step: the first one has no prediction, and the curve may have a
corner. An event of motions of n periods is not one of motions of fewer.

Where two events of one kind meet, the slope of their test function along the branch vanishes like a root. So no step
leads farther than half the way to where the square of that slope would be zero: beyond there another event may lie.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import FOLD, GRAZING, NEIMARK_SACKER, Event
from gearrattle.engine.periodic.events.grazing import JUMP, RELEASE
from gearrattle.engine.periodic.events.neimark_sacker import nearest_pair
from gearrattle.engine.periodic.families import HalfPeriodFamily
from gearrattle.engine.periodic.two_parameters.event_gradient import slope_along
from gearrattle.engine.periodic.two_parameters.relocation import (
    missed_after,
    polynomial_at,
    relocated,
    word_but_for_touch,
)
from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model.factors import Written
from gearrattle.model.path_labels import path_label, shown_value
from gearrattle.model.value_kinds import CALLBACK, checked
from gearrattle.orbits.family_ends import EDGE, end_again, slope_of_length
from gearrattle.orbits.gradients import moved_as, second_of
from gearrattle.orbits.progress import Progress, never_falling, part_of
from gearrattle.orbits.two_parameters.special_points import (
    FARTHEST,
    PREDICTED_FROM,
    SAME,
    Follower,
    Located,
    OverBoth,
    SpecialPoint,
    special_points_of,
    with_special_points,
)
from gearrattle.orbits.value_family import family_like, family_of, watched_names

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from gearrattle.orbits.branch import Branch

Array = NDArray[np.float64]

_STEPS = 40.0  # over the range, at least
_MOST = 2000  # points on either side of the model's own value
_SHORTEST = 1e-4  # of an even step
_FARTHEST_SHORT = 1e-3  # the same in a short step that is not predicted: the first one, or over a corner of the curve
_EASY = 0.05  # a smaller distance than this: the step may grow
_FIRST = 1e-3  # of an even step: the first one, without a prediction
_REPEATS = 1e-7  # of the size of the state: a motion that misses its begin by so little after fewer periods repeats
_FALL = 0.2  # of how much a motion fails to repeat sooner: what is left after a step, at least
_OFF = 0.2  # of the distance: how far an event may be from its prediction
_STRAIGHT = 0.05  # of the distance: so near to its prediction, steps grow fast
_PAIR = 0.1  # how much the real part of a pair on the unit circle counts beside w
_ROUNDING = 1e-8  # of w: what lies so near to the prediction is near
_SHORT = 1e-2  # of an even step: the longest one in which the crossings may change, or the prediction fail
_TOWARDS = 0.5  # of the way to where two events would meet: the longest step
_BESIDE = 1e-6  # of the second value: a driveline so near has the same symmetry
DRAWN = (FOLD, GRAZING, EDGE)
"""Kinds of events whose curves are followed."""
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
    model = branch.model
    path = branch.path
    own, ends = second_of(model, path, second, range)
    chosen, curve = moved_as(*event)

    def follower(value: float) -> Continuation:
        return curve.of(family_like(curve.family, model.with_({second: value}), path, chosen.point.parameter))

    if isinstance(curve.family, HalfPeriodFamily):
        _check_symmetry(follower, second, own)

    def across(value: float, near: float) -> Continuation:
        family = family_of(model.with_({path: value}), second, near, curve.family.cycles, abs(own) or 1.0)
        return curve.of(family)

    # the event both ways, with special points
    work = never_falling(progress)
    parts = part_of(work, 0, 2), part_of(work, 1, 2)
    low, high = (_one_way(follower, chosen, (own, end), part) for end, part in zip(ends, parts, strict=True))
    sides = [
        with_special_points(OverBoth(follower, across), side, end) for side, end in ((low, ends[0]), (high, ends[1]))
    ]
    rows = [*reversed(sides[0][1:]), *sides[1]]
    work(1.0)
    # as a Dataset
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
    """Refuse a second value without which there is no symmetry that could break."""
    try:
        follower(own * (1.0 + _BESIDE))
    except ConvergenceError as error:
        rule = f"cannot be changed alone for a breaking of symmetry: {error.message}"
        raise ModelError(Problem("second", second, rule, "name another number")) from None


def _note(second: str, shown: Callable[[float], str], rows: list[Located]) -> str:
    """What is said of a curve that ends inside the range."""
    last = rows[-1]
    limit = f"{second} = {shown(last.second)}"
    if len(rows) >= _MOST:
        return f"The event is not followed beyond {limit}: more than {_MOST} points."
    reason = f": {last.special}" if last.special else ""
    return f"The event is not found beyond {limit}{reason}."


def _one_way(follower: Follower, event: Event, ends: tuple[float, float], progress: Progress) -> list[Located]:
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
        row = None
        growth = 0.0
        with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):
            row, growth = _moved(located, follower(following), following, abs(step) <= _SHORT * abs(even))
        if row is None or _repeats_sooner(located, row):
            step *= 0.5
            continue
        located.append(row)
        longest = min(2.0 * abs(even), max(_to_meeting(located), _SHORTEST * abs(even)))
        step = float(np.clip(growth * step, -longest, longest))
    return located


def _row(event: Event, curve: Continuation, second: float) -> Located:
    """The row of an event: by what it differs from others that lie near."""
    slope = np.nan
    if event.kind == EDGE:
        slope = slope_of_length(event.point, curve)
    elif event.kind != GRAZING:  # whose depth is no smooth function beyond it
        with suppress(ConvergenceError):  # a fold so sharp that no motion is near
            slope = slope_along(event, curve)
    cycles = curve.family.cycles
    fewer = [number for number in range(cycles // 2, 0, -1) if cycles % number == 0]
    missed = min((missed_after(curve.family, event.point, number) for number in fewer), default=np.inf)
    return Located(second, event, slope=slope, word=word_but_for_touch(event), missed=missed)


def _repeats_sooner(located: list[Located], row: Located) -> bool:
    """Whether a motion repeats after fewer periods, or comes near to that, unlike those before."""
    return located[0].missed > _REPEATS and row.missed < max(_FALL * located[-1].missed, _REPEATS)


def _to_meeting(located: list[Located]) -> float:
    """How far the next step may lead towards where the event would meet another one of its kind."""
    if len(located) < 2:
        return np.inf
    one, two = located[-2:]
    way = abs(two.second - one.second)
    fall = one.slope**2 - two.slope**2
    return _TOWARDS * way * two.slope**2 / fall if fall > 0.0 else np.inf


def _moved(located: list[Located], curve: Continuation, second: float, is_short: bool) -> tuple[Located | None, float]:
    """The next row of an event, None if that is another event's; how many times as long the step after it may be."""
    last = located[-1]
    before = _compared(last.event)
    change = np.zeros_like(before)
    if len(located) > 1:
        known = [(row.second, _compared(row.event)) for row in located[-PREDICTED_FROM:]]
        change = polynomial_at(known, second) - before
    moved = change[: last.event.point.w.size]
    is_end = last.event.kind == EDGE
    event = end_again(last.event, curve, moved) if is_end else relocated(last.event, curve, moved, FARTHEST)
    row = _row(event, curve, second)
    growth = _growth(_compared(event) - before, change, is_short)
    may_change = is_short or row.word == last.word
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
    if distance > FARTHEST:
        return 0.0
    if distance > _EASY:
        return 1.0
    return 3.0 if off < _STRAIGHT * distance else 1.5


def borders_of(
    events: pd.DataFrame,
    boundary: Callable[[int], xr.Dataset],
    ranges: tuple[tuple[float, float], tuple[float, float]],
    progress: Progress,
    shown: Callable[[float], str],
) -> tuple[list[Border], list[SpecialPoint], list[str]]:
    """Follow every fold, grazing and end of a family; return curves, special points, and notes on what is not followed.

    ``ranges`` are the ascending ends of the value and of the second one [SI].
    """
    is_drawn = events["kind"].isin(DRAWN)
    jumps = events["grazing"].isin([JUMP, RELEASE])
    chosen = events.index[is_drawn & ~events["collision"] & ~jumps]
    borders = list[Border]()
    curves = list["xr.Dataset"]()
    notes = [
        f"The grazing at {shown(value)} is not followed: the motion or its gradient jumps there."
        for value in events.loc[is_drawn & jumps, "value"].tolist()
    ]
    # the curve of every event
    spans = ranges[0][1] - ranges[0][0], ranges[1][1] - ranges[1][0]
    for done, row in enumerate(chosen, 1):
        kind = str(events["kind"][row])
        clearance = str(events["clearance"][row])
        try:
            curve = boundary(int(row))
        except (ConvergenceError, np.linalg.LinAlgError) as error:
            notes.append(f"The {kind} at {shown(float(events['value'][row]))} was not followed: {error}.")
            continue
        # why it ends inside the ranges
        curves.append(curve)
        second = curve["second"].values
        special = [str(kind) for kind in curve["special"].values]
        is_inside = second[0] > ranges[1][0] + SAME * spans[1], second[-1] < ranges[1][1] - SAME * spans[1]
        in_range = [ranges[0][0] <= curve["value"].values[i] <= ranges[0][1] for i in (0, -1)]
        reasons = [
            (special[i] or (_LOST if in_plane else _BEYOND)) if inside else ""
            for i, inside, in_plane in zip((0, -1), is_inside, in_range, strict=True)
        ]
        borders.append(Border(int(row), kind, clearance, second, curve["value"].values, reasons[0], reasons[1]))
        progress(done / len(chosen))
    progress(1.0)  # where no event was there, or the last one could not be followed
    return borders, special_points_of(curves, spans), notes
