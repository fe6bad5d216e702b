"""The branches of a driveline at several values of a second number of its model, row by row.

The branches at the model's own second value are those of the first end of the range, and those of the motions that
settle at both ends. The branches of a row end where the range of the first value ends. There each motion is
followed over the second value, the first one held, to the next row, and begins a branch of that row unless it lies on
one already. So does the motion in which a simulation settles at an end of the range, if it settles soon. Where the
signs of the motions at an end show that one is missing, they are followed over the speed. What rows
have of their own in this way is followed back to the rows on the other side.

A pair of motions that is born inside the plane may still be missed. Of those in which no corner is passed none is,
without sliders: there is one or none, that of the linear driveline, and ``in_contact`` gives it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import islice, pairwise

import numpy as np

from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.period_map import State
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError, ModelError
from gearrattle.model import Model
from gearrattle.orbits.all_motions import OverSpeed
from gearrattle.orbits.branch_switching import Followers, followers_of, further_curves
from gearrattle.orbits.curve import Curve, followed
from gearrattle.orbits.find import periodic
from gearrattle.orbits.known_motions import Known, states_of_periods
from gearrattle.orbits.orbit import contact_state, is_stable, settled_state
from gearrattle.orbits.over_value import follower_over
from gearrattle.orbits.start_states import state_of

_MOST_POINTS = 400  # over the second value, from one row to the next


@dataclass(frozen=True)
class Plane:
    """Two values of a model, and the ranges in which motions of n periods are followed."""

    model: Model  # the driveline
    path: str  # of the values
    second: str
    ends: tuple[float, float]  # ascending ends of their ranges [SI]
    second_ends: tuple[float, float]
    cycles: int  # n

    def model_at(self, first: float, second: float) -> Model:
        """Return the driveline at a point of the plane."""
        return self.model.with_({self.path: first, self.second: second})

    def follower(self, second: float, cycles: int) -> Continuation:
        """Return what follows motions over the first value."""
        model = self.model.with_({self.second: second})
        return follower_over(model, self.path, self.ends, cycles, first=self.ends[0])

    def followers(self, second: float) -> Followers:
        """Return what follows motions over the first value, and those that these join or that leave them."""
        return followers_of(self.cycles, lambda cycles: self.follower(second, cycles))

    def follower_across(self, first: float, second: float) -> Continuation:
        """Return what follows motions over the second value."""
        model = self.model.with_({self.path: first})
        return follower_over(model, self.second, self.second_ends, self.cycles, first=second)


@dataclass(frozen=True)
class Row:
    """The branches at one second value."""

    second: float  # the value [SI]
    curves: tuple[Curve, ...]  # the branches of n periods, and those of 2 n periods
    lost: int = 0  # how many ends of branches of the neighbouring row could not be followed to this one


def own_row(
    plane: Plane,
    second: float,
    curves: Sequence[Curve],
    last: float,
    *,
    isolated: bool,
    progress: Callable[[float], None] | None = None,
) -> Row:
    """Return the branches at the model's own second value, with those of the motions that settle at both ends.

    Beyond a fold the motions that settle are often not connected inside the range to those before it.

    ``second``: the model's own second value [SI]; ``last``: the last end [SI].
    """
    report = _repeated(progress, 0.0)
    followers, row = plane.followers(second), [*curves]
    with suppress(ConvergenceError):
        state = periodic(plane.model_at(last, second), plane.cycles).motion.start
        _add_through(followers.of[plane.cycles], state, last, row, plane.ends, progress=report)
    _add_settled(plane, followers, row, second, report)
    row += _completing(plane, _alike(row, plane.cycles), second, report)
    begun = row[len(curves) :]
    row += further_curves(followers, begun, plane.ends, isolated=isolated, others=curves, progress=report)
    return Row(second, tuple(row))


def rows_of(
    plane: Plane,
    own: Row,
    seconds: Sequence[float],
    *,
    isolated: bool,
    progress: Callable[[float], None] | None = None,
) -> list[Row]:
    """Return the branches at some second values, ascending.

    ``seconds``: the second values, ascending [SI].
    """
    rows = _Rows(plane, own, seconds)
    up = [s for s in rows.seconds if s >= own.second]
    down = [s for s in reversed(rows.seconds) if s <= own.second]
    steps = [*pairwise(up), *pairwise(down)]
    work = 3 * len(steps) or 1
    for done, (before, second) in enumerate(steps):
        report = _repeated(progress, done / work)
        rows.lead(rows.curves[before], before, second, report)
        rows.seek(second, report, isolated=isolated)
    done = len(steps)
    for values in (rows.seconds, rows.seconds[::-1]):  # what the rows have of their own, towards the first row and on
        arrived: list[Curve] = []
        for before, second in pairwise(values):
            is_outward = (second - before) * (before - own.second) >= 0.0
            report = _repeated(progress, done / work)
            arrived = rows.lead(arrived if is_outward else [*arrived, *rows.sought[before]], before, second, report)
            if arrived:
                rows.add_further(second, arrived, report)
            done += 1
            if progress is not None:
                progress(done / work)
    return [Row(second, tuple(rows.curves[second]), rows.lost[second]) for second in seconds]


def _repeated(progress: Callable[[float], None] | None, done: float) -> Callable[[float], None] | None:
    """What reports the same finished share again: a long row can be ended in between."""
    return None if progress is None else lambda _: progress(done)


class _Rows:
    """Rows while branches are added to them.

    ``seconds``: the second values, with the model's own one, ascending [SI].
    """

    def __init__(self, plane: Plane, own: Row, seconds: Sequence[float]) -> None:
        self._plane = plane
        self.seconds = sorted({*seconds, own.second})
        self.curves: dict[float, list[Curve]] = {second: [] for second in self.seconds}
        self.curves[own.second] = [*own.curves]
        self.sought: dict[float, list[Curve]] = {second: [] for second in self.seconds}
        self.lost = Counter[float]()

    def lead(
        self, known: Sequence[Curve], before: float, second: float, progress: Callable[[float], None] | None
    ) -> list[Curve]:
        """Follow branches of a row to another one; return those that begin there."""
        plane, curves, first_new = self._plane, self.curves[second], len(self.curves[second])
        curve = plane.follower(second, plane.cycles)
        for first, state in _starts(plane, known, before, second):
            if state is None:
                self.lost[second] += 1
            else:
                _add_through(curve, state, first, curves, plane.ends, progress=progress)
        return curves[first_new:]

    def seek(self, second: float, progress: Callable[[float], None] | None, *, isolated: bool) -> None:
        """Add the branches that no neighbouring row leads to, and those that leave others."""
        plane, curves = self._plane, self.curves[second]
        followers, led = plane.followers(second), len(curves)
        _add_settled(plane, followers, curves, second, progress)
        curves += _completing(plane, _alike(curves, plane.cycles), second, progress)
        curves += further_curves(followers, curves, plane.ends, isolated=isolated, progress=progress)
        self.sought[second] = _alike(curves[led:], plane.cycles)

    def add_further(self, second: float, begun: Sequence[Curve], progress: Callable[[float], None] | None) -> None:
        """Add the branches that leave the last ones of a row."""
        plane, curves = self._plane, self.curves[second]
        followers, others = plane.followers(second), curves[: -len(begun)]
        curves += further_curves(followers, begun, plane.ends, isolated=False, others=others, progress=progress)


def _alike(curves: Sequence[Curve], cycles: int) -> list[Curve]:
    """The branches of so many periods."""
    return [known for known in curves if known.cycles == cycles]


def in_contact(plane: Plane, row: Row, first: float) -> list[Curve]:
    """Return the branch through the motion of a row that passes no corner; empty where there is none, or it is known.

    It begins and ends at folds, so it need not lead to an end of the range, nor to the next row.
    """
    curve = plane.follower(row.second, plane.cycles)
    period_map = curve.family.map_at(first)
    try:
        rest = state_of(plane.model_at(first, row.second), period_map, "static")
    except ModelError:
        return []
    state = contact_state(period_map, rest)
    if state is None or _known_at(curve, _alike(row.curves, plane.cycles), first).holds(state):
        return []
    return _through(curve, state, first, plane.ends, None)


def _starts(
    plane: Plane, curves: Sequence[Curve], before: float, second: float
) -> Iterator[tuple[float, State | None]]:
    """Yield first values and motions of a row there, from both ends of branches of another row; None: it is lost.

    Where a branch ends inside the range another one goes on, from which it is followed in the other row.
    """
    for known in curves:
        if known.cycles != plane.cycles:
            continue
        is_closed = known.points[-1].w is known.points[0].w
        for point in known.points[:1] if is_closed else (known.points[0], known.points[-1]):
            try:
                state = _across(plane, point, before, second)
            except ConvergenceError:
                if point.parameter in plane.ends:
                    yield point.parameter, None
                continue
            if state is not None:
                yield point.parameter, state


def _add_settled(
    plane: Plane,
    followers: Followers,
    curves: list[Curve],
    second: float,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Add the branches of the motions in which a simulation settles at the ends of the range, of n or 2 n periods."""
    for first in plane.ends:
        model = plane.model_at(first, second)
        for cycles in (plane.cycles, 2 * plane.cycles):
            if cycles not in followers.of:
                continue
            curve = followers.of[cycles]
            period_map = curve.family.map_at(first)
            with suppress(ConvergenceError, ModelError, np.linalg.LinAlgError):  # there may be no rest to begin from
                orbit = shooting.shoot(period_map, settled_state(model, period_map))
                if len(states_of_periods(period_map, orbit.motion)) == cycles:
                    _add_through(curve, orbit.motion.start, first, curves, plane.ends, progress=progress)
                if is_stable(orbit.multipliers, orbit.free.shape[1]):
                    break


def _across(plane: Plane, point: Point, second: float, following: float) -> State | None:
    """The motion at the following second value to which one is followed, the first value held; None: it folds before.

    Raises ConvergenceError: it is lost on the way.
    """
    across = plane.follower_across(point.parameter, second)
    ends = min(second, following), max(second, following)
    begin = across.begin(point.motion.start, second, upward=following > second)
    last = [begin, *islice(across.follow(begin, *ends), _MOST_POINTS)][-1]
    if last.parameter not in ends:
        raise ConvergenceError(f"the motion is lost at {across.family.shown(last.parameter)}")
    return last.motion.start if last.parameter == following else None


def _known_at(curve: Continuation, curves: Sequence[Curve], first: float) -> Known:
    """The motions of branches at a first value."""
    known = Known(curve.family.map_at(first))
    for branch in curves:
        for _, point in branch.motions_at(curve, first):
            known.add(point.motion)
    return known


def _completing(
    plane: Plane, curves: Sequence[Curve], second: float, progress: Callable[[float], None] | None
) -> list[Curve]:
    """Further branches of a row, where the signs of the motions at an end of the range show that one is missing.

    The motions there are followed over the speed: what folds comes back.
    """
    curve, further = plane.follower(second, plane.cycles), list[Curve]()
    for first in plane.ends:
        known = _known_at(curve, [*curves, *further], first)
        if known.not_counted or known.index() == 1:
            continue
        at_point = None if progress is None else partial(progress, 0.0)
        over_speed = OverSpeed(plane.model_at(first, second), plane.cycles, at_point)
        for motion in [*known.passes]:
            if known.index() == 1:
                break
            for other in over_speed.met_again(motion):
                if known.add(other):
                    further += _through(curve, other.start, first, plane.ends, progress)
    return further


def _add_through(
    curve: Continuation,
    state: State,
    first: float,
    curves: list[Curve],
    ends: tuple[float, float],
    *,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Add the branch through a motion to those of a row, unless it lies on one of them."""
    if not _known_at(curve, _alike(curves, curve.family.cycles), first).holds(state):
        curves += _through(curve, state, first, ends, progress)


def _through(
    curve: Continuation,
    state: State,
    first: float,
    ends: tuple[float, float],
    progress: Callable[[float], None] | None,
) -> list[Curve]:
    """The branch through a motion, in one or two parts."""
    parts: list[Curve] = []
    for upward, end in ((True, ends[1]), (False, ends[0])):
        is_closed = bool(parts) and parts[0].points[-1].w is parts[0].points[0].w
        if first != end and not is_closed:
            with suppress(ConvergenceError):
                parts.append(followed(curve, curve.begin(state, first, upward=upward), ends, progress=progress))
    return parts
