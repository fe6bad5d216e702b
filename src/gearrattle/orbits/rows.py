"""The branches of a driveline at several values of a second number of its model, row by row.

The branches at the model's own second value are those of the first end of the range, and the one of the motion that
settles at its last end. The branches of a row end where the range of the first value ends. There each motion is
followed over the second value, the first one held, to the next row, and begins a branch of that row unless it lies on
one already. No other row is simulated.

Takes the branches at the model's own second value; gives Rows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.period_map import State
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError
from gearrattle.model import Model
from gearrattle.orbits.curve import Curve, followed
from gearrattle.orbits.family import follower_over
from gearrattle.orbits.find import periodic
from gearrattle.orbits.further import followers_of, further_curves
from gearrattle.orbits.search import Known

_MOST_POINTS = 400  # over the second value, from one row to the next


@dataclass(frozen=True)
class Plane:
    """Two values of a model, and the ranges in which motions of n periods are followed.

    Attributes
    ----------
    model
        the driveline.
    path, second
        of the values.
    ends, second_ends
        ascending ends of their ranges [SI].
    cycles
        n.
    """

    model: Model
    path: str
    second: str
    ends: tuple[float, float]
    second_ends: tuple[float, float]
    cycles: int

    def follower(self, second: float, cycles: int) -> Continuation:
        """Return what follows motions over the first value."""
        model = self.model.with_({self.second: second})
        return follower_over(model, self.path, self.ends, cycles, first=self.ends[0])

    def follower_across(self, first: float, second: float) -> Continuation:
        """Return what follows motions over the second value."""
        model = self.model.with_({self.path: first})
        return follower_over(model, self.second, self.second_ends, self.cycles, first=second)


@dataclass(frozen=True)
class Row:
    """The branches at one second value.

    Attributes
    ----------
    second
        the value [SI].
    curves
        the branches of n periods, and those of 2 n periods.
    lost
        how many ends of branches of the neighbouring row could not be followed to this one.
    """

    second: float
    curves: tuple[Curve, ...]
    lost: int = 0


def own_row(plane: Plane, second: float, curves: Sequence[Curve], last: float) -> Row:
    """Return the branches at the model's own second value, with that of the motion that settles at the last end.

    Beyond a fold the motions that settle are often not connected inside the range to those before it.

    Parameters
    ----------
    plane
        the two values.
    second
        the model's own second value [SI].
    curves
        the branches from the first end of the range.
    last
        the last end [SI].
    """
    try:
        state = periodic(plane.model.with_({plane.path: last}), plane.cycles).motion.start
    except ConvergenceError:
        return Row(second, tuple(curves))
    curve = plane.follower(second, plane.cycles)
    alike = [one for one in curves if one.cycles == plane.cycles]
    further = [] if _is_known(curve, alike, last, state) else _through(curve, state, last, plane.ends, None)
    return Row(second, (*curves, *further))


def rows_of(
    plane: Plane,
    own: Row,
    seconds: Sequence[float],
    *,
    isolated: bool,
    progress: Callable[[float], None] | None = None,
) -> list[Row]:
    """Return the branches at some second values, ascending.

    Parameters
    ----------
    plane
        the two values.
    own
        the branches at the model's own second value.
    seconds
        the second values, ascending [SI].
    isolated
        whether branches are sought in every row that are not connected to those of the row before.
    progress
        called with the finished share; an exception from it ends the work.
    """
    rows: dict[float, Row] = {}
    for values in ([s for s in seconds if s >= own.second], [s for s in reversed(seconds) if s < own.second]):
        row = own
        for second in values:
            done = len(rows) / len(seconds)
            row = _following(plane, row, second, isolated, _repeated(progress, done))
            rows[second] = row
            if progress is not None:
                progress(len(rows) / len(seconds))
    return [rows[second] for second in seconds]


def _repeated(progress: Callable[[float], None] | None, done: float) -> Callable[[float], None] | None:
    """What reports the same finished share again: a long row can be ended in between."""
    return None if progress is None else lambda _: progress(done)


def _following(plane: Plane, row: Row, second: float, isolated: bool, progress: Callable[[float], None] | None) -> Row:
    """The next row."""
    curve, curves, lost = plane.follower(second, plane.cycles), list[Curve](), 0
    for first, state in _starts(plane, row, second):
        if state is None:
            lost += 1
        elif not _is_known(curve, curves, first, state):
            curves += _through(curve, state, first, plane.ends, progress)
    followers = followers_of(plane.cycles, lambda n: plane.follower(second, n))
    curves += further_curves(followers, curves, plane.ends, isolated=isolated)
    return Row(second, tuple(curves), lost)


def _starts(plane: Plane, row: Row, second: float) -> Iterator[tuple[float, State | None]]:
    """Yield first values and motions of the next row there, from both ends of every branch of a row; None: it is lost.

    Where a branch ends inside the range another one goes on, from which it is followed in the next row.
    """
    for known in row.curves:
        if known.cycles != plane.cycles:
            continue
        is_closed = known.points[-1].w is known.points[0].w
        for point in known.points[:1] if is_closed else (known.points[0], known.points[-1]):
            if second == row.second:
                yield point.parameter, point.motion.start
                continue
            state = _across(plane, point, row.second, second)
            if state is not None or point.parameter in plane.ends:
                yield point.parameter, state


def _across(plane: Plane, point: Point, second: float, following: float) -> State | None:
    """The motion at the following second value to which one is followed, the first value held; None: to none."""
    across = plane.follower_across(point.parameter, second)
    ends = min(second, following), max(second, following)
    with suppress(ConvergenceError):
        begin = across.begin(point.motion.start, second, upward=following > second)
        last = [begin, *islice(across.follow(begin, *ends), _MOST_POINTS)][-1]
        return last.motion.start if last.parameter == following else None
    return None


def _is_known(curve: Continuation, curves: Sequence[Curve], first: float, state: State) -> bool:
    """Whether a motion lies on a branch."""
    known = Known(curve.family.map_at(first))
    for branch in curves:
        for _, point in branch.motions_at(curve, first):
            known.add(point.motion)
    return known.holds(state)


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
