"""The branches of a driveline at several values of a second number of its model, row by row.

The branches at the model's own second value are those of the first end of the range, and those of the motions that
settle at both ends. The branches of a row end where the range of the first value ends. There each motion is
followed over the second value, the first one held, to the next row, and begins a branch of that row unless it lies on
one already. So does the motion in which a simulation settles at an end of the range, if it settles soon. Where the
signs of the motions at an end show that one is missing, they are followed over the speed. What rows have of their own
in this way is followed back to the rows on the other side.

A pair of motions that is born inside the plane may still be missed. Of those in which no corner is passed none is,
without sliders: there is one or none, that of the linear driveline, and ``Row.add_in_contact`` adds it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from itertools import islice, pairwise

import numpy as np

from gearrattle.engine.periodic import shooting
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError, ModelError
from gearrattle.model import Model
from gearrattle.orbits.all_motions import OverSpeed
from gearrattle.orbits.branch_switching import followers_of, further_curves
from gearrattle.orbits.followed_branch import Curve, Work, followed
from gearrattle.orbits.known_motions import Known, states_of_periods
from gearrattle.orbits.orbit import CYCLES, contact_state, is_stable, settled_state
from gearrattle.orbits.periodic_search import periodic
from gearrattle.orbits.progress import Progress
from gearrattle.orbits.start_states import state_of
from gearrattle.orbits.value_family import follower_over

_MOST_POINTS = 400  # over the second value, from one row to the next


@dataclass(frozen=True)
class Plane:
    """Two values of a model, and the ranges in which motions of n periods are followed."""

    model: Model
    path: str
    second: str
    ends: tuple[float, float]  # of the range of the first value, ascending [SI]
    second_ends: tuple[float, float]  # of that of the second one
    cycles: int  # n

    def model_at(self, first: float, second: float) -> Model:
        """Return the driveline at a point of the plane."""
        return self.model.with_({self.path: first, self.second: second})

    def across(self, point: Point, second: float, following: float) -> State | None:
        """Follow a motion from one second value to another, the first value held; None: it folds before.

        Raises ConvergenceError: it is lost on the way.
        """
        model = self.model.with_({self.path: point.parameter})
        follower = follower_over(model, self.second, self.second_ends, self.cycles, first=second)
        ends = min(second, following), max(second, following)
        begin = follower.begin(point.motion.start, second, upward=following > second)
        last = [begin, *islice(follower.follow(begin, *ends), _MOST_POINTS)][-1]
        if last.parameter not in ends:
            raise ConvergenceError(f"the motion is lost at {follower.family.shown(last.parameter)}")
        return last.motion.start if last.parameter == following else None


class Row:
    """The branches at one second value, of n and of 2 n periods, to which further ones are added."""

    def __init__(self, plane: Plane, second: float, curves: Sequence[Curve] = ()) -> None:
        self.plane = plane
        self.second = second
        self.curves = [*curves]
        self.sought = list[Curve]()  # those of n periods to which none of a neighbouring row led
        self.lost = 0  # ends of branches of neighbouring rows that could not be followed to this one
        self.model = plane.model.with_({plane.second: second})
        self.follower = cache(self._follower)

    def _follower(self, cycles: int) -> Continuation:
        """What follows motions over the first value."""
        return follower_over(self.model, self.plane.path, self.plane.ends, cycles, first=self.plane.ends[0])

    def _known_at(self, first: float, cycles: int) -> Known:
        """The motions of branches of so many periods at a first value."""
        follower = self.follower(cycles)
        known = Known(follower.family.map_at(first))
        for curve in self.curves:
            if curve.cycles == cycles:
                for _, point in curve.motions_at(follower, first):
                    known.add(point.motion)
        return known

    def _add_through(self, state: State, first: float, cycles: int, work: Work) -> None:
        """Add the branch through a motion, in one or two parts, unless it lies on one that is known."""
        if self._known_at(first, cycles).holds(state):
            return
        follower = self.follower(cycles)
        ends = self.plane.ends
        parts = list[Curve]()
        for upward, end in ((True, ends[1]), (False, ends[0])):
            is_closed = bool(parts) and parts[0].points[-1].w is parts[0].points[0].w
            if first != end and not is_closed:
                with suppress(ConvergenceError):
                    parts.append(followed(follower, follower.begin(state, first, upward=upward), ends, work=work))
        self.curves += parts

    def add_at_end(self, last: float, work: Work) -> None:
        """Add the branch of the motion that is found at an end of the range."""
        with suppress(ConvergenceError):
            state = periodic(self.plane.model_at(last, self.second), self.plane.cycles).motion.start
            self._add_through(state, last, self.plane.cycles, work)

    def add_settled(self, work: Work) -> None:
        """Add the branches of the motions in which a simulation settles at both ends, of n or 2 n periods."""
        n = self.plane.cycles
        for first in self.plane.ends:
            model = self.plane.model_at(first, self.second)
            for cycles in (n, 2 * n) if 2 * n <= CYCLES.most else (n,):
                period_map = self.follower(cycles).family.map_at(first)
                with suppress(
                    ConvergenceError, ModelError, np.linalg.LinAlgError
                ):  # there may be no rest to begin from
                    orbit = shooting.shoot(period_map, settled_state(model, period_map))
                    if len(states_of_periods(period_map, orbit.motion)) == cycles:
                        self._add_through(orbit.motion.start, first, cycles, work)
                    if is_stable(orbit.multipliers, orbit.free.shape[1]):
                        break

    def complete(self, work: Work) -> None:
        """Follow the motions at both ends over the speed while their signs show that one is missing."""
        n = self.plane.cycles
        for first in self.plane.ends:
            known = self._known_at(first, n)
            if known.not_counted or known.index() == 1:
                continue
            over_speed = OverSpeed(self.plane.model_at(first, self.second), n, partial(work.progress, 0.0))
            for motion, *_ in [*known.motions]:
                if known.index() == 1:
                    break
                for other in over_speed.met_again(motion):
                    if known.add(other):
                        self._add_through(other.start, first, n, work)

    def add_leaving(self, begun: Sequence[Curve], work: Work, *, isolated: bool = False) -> None:
        """Add the branches that leave some of the last ones, and on request those connected to none."""
        others = self.curves[: len(self.curves) - len(begun)]
        followers = followers_of(self.plane.cycles, self.plane.ends, self.follower)
        self.curves += further_curves(followers, begun, isolated=isolated, others=others, work=work)

    def add_in_contact(self, first: float) -> bool:
        """Add the branch through the motion that passes no corner; False where there is none, or it is known.

        It begins and ends at folds, so it need not lead to an end of the range, nor to the next row.
        """
        n = self.plane.cycles
        count = len(self.curves)
        period_map = self.follower(n).family.map_at(first)
        with suppress(ModelError):
            state = contact_state(period_map, state_of(self.plane.model_at(first, self.second), period_map, "static"))
            if state is not None:
                self._add_through(state, first, n, Work())
        return len(self.curves) > count

    def lead(self, known: Sequence[Curve], before: float, work: Work) -> list[Curve]:
        """Follow branches of another row to this one; return those that begin here."""
        count = len(self.curves)
        for first, state in self._arriving(known, before):
            if state is None:
                self.lost += 1
            else:
                self._add_through(state, first, self.plane.cycles, work)
        return self.curves[count:]

    def _arriving(self, curves: Sequence[Curve], before: float) -> Iterator[tuple[float, State | None]]:
        """Yield first values and motions there, from both ends of branches of another row; None: it is lost.

        Where a branch ends inside the range another one goes on, from which it is followed here.
        """
        for known in curves:
            if known.cycles != self.plane.cycles:
                continue
            is_closed = known.points[-1].w is known.points[0].w
            for point in known.points[:1] if is_closed else (known.points[0], known.points[-1]):
                try:
                    state = self.plane.across(point, before, self.second)
                except ConvergenceError:
                    if point.parameter in self.plane.ends:
                        yield point.parameter, None
                    continue
                if state is not None:
                    yield point.parameter, state

    def seek(self, work: Work, *, isolated: bool) -> None:
        """Add the branches that no neighbouring row leads to, and those that leave others."""
        led = len(self.curves)
        self.add_settled(work)
        self.complete(work)
        self.add_leaving(self.curves, work, isolated=isolated)
        self.sought = [curve for curve in self.curves[led:] if curve.cycles == self.plane.cycles]


def own_row(
    plane: Plane, second: float, curves: Sequence[Curve], last: float, *, isolated: bool, progress: Progress
) -> Row:
    """Return the branches at the model's own second value, with those of the motions that settle at both ends.

    Beyond a fold the motions that settle are often not connected inside the range to those before it. ``last`` is the
    last end of the range, in the direction of the branches.
    """
    row = Row(plane, second, curves)
    work = Work(_repeated(progress, 0.0))
    row.add_at_end(last, work)
    row.add_settled(work)
    row.complete(work)
    row.add_leaving(row.curves[len(curves) :], work, isolated=isolated)
    return row


def rows_of(own: Row, seconds: Sequence[float], *, isolated: bool, progress: Progress) -> list[Row]:
    """Return the branches at some second values, ascending, from those at the model's own one.

    With ``isolated`` branches are sought in every row that are not connected to those of the row before.
    """
    values = sorted({*seconds, own.second})
    rows = {second: own if second == own.second else Row(own.plane, second) for second in values}
    # away from the model's own second value, up and down
    up = [second for second in values if second >= own.second]
    down = [second for second in reversed(values) if second <= own.second]
    steps = [*pairwise(up), *pairwise(down)]
    count = 3 * len(steps) or 1
    for done, (before, second) in enumerate(steps):
        work = Work(_repeated(progress, done / count))
        rows[second].lead(rows[before].curves, before, work)
        rows[second].seek(work, isolated=isolated)
    # what the rows have of their own, towards the model's own second value and on
    done = len(steps)
    for way in (values, values[::-1]):
        arrived = list[Curve]()
        for before, second in pairwise(way):
            is_outward = (second - before) * (before - own.second) >= 0.0
            work = Work(_repeated(progress, done / count))
            arrived = rows[second].lead(arrived if is_outward else [*arrived, *rows[before].sought], before, work)
            if arrived:
                rows[second].add_leaving(arrived, work)
            done += 1
            progress(done / count)
    return [rows[second] for second in seconds]


def _repeated(progress: Progress, done: float) -> Progress:
    """What reports the same finished share again: a long row can be ended in between."""
    return lambda _: progress(done)
