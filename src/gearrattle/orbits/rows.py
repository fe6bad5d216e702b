"""The branches of a driveline at several values of a second number of its model, row by row.

The branches of a row end where the range of the first value ends. There each motion is followed over the second value,
the first one held, to the next row, and begins a branch of that row unless it lies on one already. No row is
simulated.

Takes the branches at the model's own second value; gives Rows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.period_map import State
from gearrattle.errors import ConvergenceError
from gearrattle.model import Model
from gearrattle.orbits.curve import Curve, followed
from gearrattle.orbits.family import follower_over
from gearrattle.orbits.further import Followers, further_curves
from gearrattle.orbits.orbit import CYCLES
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
    """

    second: float
    curves: tuple[Curve, ...]


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
    curve, curves = plane.follower(second, plane.cycles), list[Curve]()
    for first, state in _starts(plane, row, second):
        if not _is_known(curve, curves, first, state):
            curves += _through(curve, state, first, plane.ends, progress)
    has_doubled = 2 * plane.cycles <= CYCLES.most
    doubled = plane.follower(second, 2 * plane.cycles) if has_doubled else None
    curves += further_curves(Followers(curve, doubled), curves, plane.ends, isolated=isolated)
    return Row(second, tuple(curves))


def _starts(plane: Plane, row: Row, second: float) -> Iterator[tuple[float, State]]:
    """Yield first values and motions of the next row there, from both ends of every branch of a row."""
    for known in row.curves:
        if known.cycles != plane.cycles:
            continue
        is_closed = known.points[-1].w is known.points[0].w
        for point in known.points[:1] if is_closed else (known.points[0], known.points[-1]):
            if second == row.second:
                yield point.parameter, point.motion.start
                continue
            across = plane.follower_across(point.parameter, row.second)
            ends = min(row.second, second), max(row.second, second)
            with suppress(ConvergenceError):
                last = across.begin(point.motion.start, row.second, upward=second > row.second)
                for following in islice(across.follow(last, *ends), _MOST_POINTS):
                    last = following
                if last.parameter == second:
                    yield point.parameter, last.motion.start


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
