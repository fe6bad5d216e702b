"""One branch of periodic motions: its points in order, what happens between them, and why it ends where it does.

Takes a Continuation and a point; gives a Curve.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.breaking import breaking_near, symmetric_curve
from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events import BREAKING, FOLD, GRAZING, Event, changes_between, events_between
from gearrattle.engine.periodic.grazing import COMPLIANT
from gearrattle.engine.periodic.point import Point, halves_apart
from gearrattle.engine.periodic.symmetry import HalfPeriodMap
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.edges import followed_through_families
from gearrattle.orbits.orbit import is_stable
from gearrattle.wording import counted

Array = NDArray[np.float64]

_MOST_POINTS = 20_000
_CREEPING, _NOWHERE = 250, 1e-5  # so many points, and the arclength that they must pass
_ROUNDING = 1e-12  # of the parameter
_HALVES = 1e-3  # of the size of the state: halves of a motion that differ by less may be the same
_SAME_HALVES = 1e-5  # the same: they are
_NEARER = 0.2  # of how far halves are apart beside a fold: by so much they are in one at which they become the same
_AT_HOME = 1e-9  # the same, where a motion is one of half as many periods: near a doubling halves are known less well
_ABOUT = 1e-3  # of the periods of a motion: instants that differ by more are not the same
_AT_JOINT = 1e-8  # arclength: what touches so near to where a branch joins another does so there, but for rounding
_NEAR_JOINT = 1e-3  # of w: so near to a period doubling a fold at which halves become the same is that one
_IN_JUMP = 1e-8  # of w: so near to a jump of the gradient a branch that goes no further has come to it
_NEAR_HOME = 10.0  # steps: so near lies the period doubling at which a branch joins another one


class Home(NamedTuple):
    """The branch that another one has left, or joins, where its period doubles or its symmetry breaks."""

    curve: Continuation  # of its motions
    events: Sequence[Event]  # as far as it is known
    kind: str  # period doubling or symmetry breaking

    def image(self, point: Point) -> Array:
        """Return (N,) what a motion comes to after half of its periods, or its mirror image; both are motions too."""
        period_map = self.curve.family.map_at(point.parameter)
        if self.kind == BREAKING:
            period_map = HalfPeriodMap(period_map.system, period_map.cycles)
        return period_map.later(point.motion.start).y


@dataclass(frozen=True)
class Unlocated:
    """A step of a branch whose events could not be located.

    Attributes
    ----------
    before, after
        its points. The branch is sure to lead from one to the other: followed with shorter steps, where there are any,
        it does so again.
    reason
        why they could not.
    """

    before: Point
    after: Point
    reason: str

    @property
    def note(self) -> str:
        """What the user must know of it."""
        between = f"between {self.before.parameter:.9g} and {self.after.parameter:.9g}"
        seen = ", ".join(changes_between(self.before, self.after)) or "no change"
        return f"Events {between} are not located ({self.reason}); its two ends tell of: {seen}."


@dataclass(frozen=True)
class Curve:
    """One branch.

    Attributes
    ----------
    cycles
        periods after which its motions repeat.
    points
        in order.
    events
        between them, in order.
    note
        why it ends inside the range; empty where it does not.
    origin
        kind of the event at which it leaves another branch, its first point; empty where it leaves none.
    unlocated
        steps whose events could not be located, in order.
    """

    cycles: int
    points: tuple[Point, ...]
    events: tuple[Event, ...]
    note: str = ""
    origin: str = ""
    unlocated: tuple[Unlocated, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user must know of it."""
        return (*(step.note for step in self.unlocated), *([self.note] if self.note else []))

    @cached_property
    def stable(self) -> tuple[bool, ...]:
        """Of every point whether its motion is; where the branch leaves or joins another one that of its neighbour."""
        stable = [is_stable(point.multipliers, point.free) for point in self.points]
        if len(stable) > 1 and (self.origin or self._happens_at(0)):
            stable[0] = stable[1]
        if len(stable) > 1 and self._happens_at(-1):
            stable[-1] = stable[-2]
        return tuple(stable)

    def _happens_at(self, end: int) -> bool:
        """Whether the first (0) or the last (-1) event is at that end."""
        return bool(self.events) and self.events[end].point.w is self.points[end].w

    def motions_at(self, follower: Continuation, value: float) -> Iterator[tuple[int, Point]]:
        """Yield the motions at a parameter value: index of the point before, and the motion.

        Parameters
        ----------
        follower
            the Continuation of the branch.
        value
            the parameter [SI].
        """
        for i, point in enumerate(self.points):
            if point.parameter == value:
                yield i, point
        for i, (before, after) in enumerate(self.steps()):
            if (before.parameter - value) * (after.parameter - value) < 0.0:
                with suppress(ConvergenceError):  # a fold very near
                    yield i, follower.at_parameter(before, after, value)

    def steps(self) -> Iterator[tuple[Point, Point]]:
        """Yield the pairs of consecutive points."""
        return pairwise(self.points)


def followed(
    curve: Continuation,
    begin: Point,
    ends: tuple[float, float],
    *,
    home: Home | None = None,
    origin: Event | None = None,
    progress: Callable[[float], None] | None = None,
    so_far: Callable[[Curve], None] | None = None,
) -> Curve:
    """Follow one branch to an end of the range, and locate what happens along it.

    Parameters
    ----------
    curve
        the Continuation that follows it.
    begin
        its first point.
    ends
        of the range, ascending.
    home
        for a branch of doubled period or broken symmetry: it ends where its motions are those of the branch again that
        it has left. None: any other branch.
    origin
        the event at which it leaves another branch, its motion over as many periods; the branch begins there.
    progress
        called with how far the parameter has come, as a share of the range.
    so_far
        called with the branch as far as it is followed, after every step.
    """
    points, events, note = [begin], [], ""
    unlocated: list[Unlocated] = []
    home = _symmetric_home(curve, begin) if home is None else home
    if origin is not None:
        begin = replace(begin, length=float(np.linalg.norm(begin.w - origin.point.w)))
        points, events = [origin.point, begin], _beside_joint(curve, origin.point, begin)
    try:
        for point, known in followed_through_families(curve, begin, ends):
            if bool(point.free) != bool(points[-1].free) and (home is None or not home.events):
                home = _symmetric_home(curve, point)
            passed, ahead, left = _passed(curve, home, points[-1], point) if known is None else ([point], [*known], [])
            last = None if home is None else _arrival(curve, home, points[-1], passed[-1], ahead)
            if last is not None:
                events += last
                points.append(last[-1].point)
                break
            events += ahead
            points += passed
            unlocated += left
            if progress is not None:
                progress(min(1.0, abs(point.parameter - begin.parameter) / (ends[1] - ends[0])))
            if so_far is not None:
                so_far(Curve(curve.family.cycles, tuple(points), tuple(events), "", _kind(origin), tuple(unlocated)))
            if len(points) >= _MOST_POINTS or _creeps(points):
                note = f"A branch was left after {counted(len(points), 'point')}."
                break
            if _stands(points):
                value = f"{points[-1].parameter:.9g}"
                note = f"A branch was left at {value}: its motions are one of a family that has no end in sight."
                break
    except ConvergenceError as error:
        last = None if home is None else _arrival_in_jump(curve, home, points[-1])
        if last is None:
            note = f"A branch ends inside the range: {error.message}."
        else:
            events += last
            points.append(last[-1].point)
    return Curve(curve.family.cycles, tuple(points), tuple(events), note, _kind(origin), tuple(unlocated))


def _symmetric_home(curve: Continuation, begin: Point) -> Home | None:
    """The symmetric branch that one without symmetry may join; None for other branches, and families."""
    if begin.free or symmetric_curve(curve, begin.parameter) is None:
        return None
    home = Home(curve, (), BREAKING)
    return home if _apart(home, begin) > _HALVES else None


def _kind(origin: Event | None) -> str:
    return "" if origin is None else origin.kind


def _passed(
    curve: Continuation, home: Home | None, before: Point, after: Point
) -> tuple[Sequence[Point], list[Event], Sequence[Unlocated]]:
    """The same as ``_located``; but a step onto the branch that was left has no events of its own."""
    try:
        return _located(curve, before, after)
    except ConvergenceError:
        if home is None or not _is_of(home, after):
            raise
        return [after], [], []


def _located(
    curve: Continuation, before: Point, after: Point
) -> tuple[Sequence[Point], list[Event], Sequence[Unlocated]]:
    """The points of a step after its first one, its events, and where they could not be located.

    Where they cannot, shorter steps must lead to the same point; each of them is tried by itself.
    """
    with suppress(ConvergenceError):
        return [after], events_between(curve, before, after), []
    points = curve.with_shorter_steps(before, after)
    events: list[Event] = []
    unlocated = []
    for one, other in pairwise([before, *points]):
        try:
            events += events_between(curve, one, other)
        except ConvergenceError as error:
            unlocated.append(Unlocated(one, other, error.message))
    return points, events, unlocated


def _beside_joint(curve: Continuation, before: Point, after: Point) -> list[Event]:
    """The events between two points of a branch at one of which it leaves or joins another one.

    There det(I - M) is zero and the tangent that of a chord, so nothing is said of folds and symmetry breaking.
    """
    with suppress(ConvergenceError):
        return [event for event in events_between(curve, before, after) if event.kind not in (FOLD, BREAKING)]
    return []


def _creeps(points: list[Point]) -> bool:
    """Whether the last points have come nowhere."""
    return len(points) > _CREEPING and points[-1].length - points[-1 - _CREEPING].length < _NOWHERE


def _stands(points: list[Point]) -> bool:
    """Whether over the last points the parameter has not changed but for rounding."""
    if len(points) <= _CREEPING:
        return False
    values = np.array([point.parameter for point in points[-1 - _CREEPING :: _CREEPING // 10]])
    return bool(np.ptp(values) <= _ROUNDING * np.abs(values).max())


def _arrival(
    curve: Continuation, home: Home, before: Point, after: Point, ahead: Sequence[Event]
) -> list[Event] | None:
    """The events of a step on which a branch joins the one that it has left, up to there; None: it does not.

    Its motions and their images become the same in a fold, or in a jump of the gradient beyond which they stay so. Or
    the step goes past the fold and leads to a motion of the branch that was left.
    """
    for i, event in enumerate(ahead):
        if event.kind == FOLD and _is_joint(home, event.point, [before, *(other.point for other in ahead), after]):
            return [*ahead[:i], _joint(curve, home, before, event)]
        if event.grazing is not None and event.grazing.kind != COMPLIANT and _apart(home, after) < _SAME_HALVES:
            return [*ahead[: i + 1], Event(home.kind, event.point, is_collision=True)]
    if not _is_of(home, after):
        return None
    nearest, distance = _nearest_joint(home, before)
    if nearest is None or distance > _NEAR_HOME * float(np.linalg.norm(after.w - before.w)):
        raise ConvergenceError(f"its motions become those of another branch, where no {home.kind} is known")
    ends = _shared_end(curve, home, before, nearest)
    events = _beside_joint(curve, before, ends[-1].point)
    if len(ends) > 1:  # what touches there is named by the other branch
        last = ends[-1].point.length - _AT_JOINT
        events = [event for event in events if event.kind != GRAZING or event.point.length < last]
    return [*events, *ends]


def _arrival_in_jump(curve: Continuation, home: Home, point: Point) -> list[Event] | None:
    """The events where a branch comes to a jump of the gradient in which the one that it has left doubles its period.

    Beyond there is the other branch alone, in a direction that need not be ahead. None: the branch is not there.
    """
    nearest, distance = _nearest_joint(home, point)
    if nearest is None or not nearest.is_collision or distance > _IN_JUMP:
        return None
    return _shared_end(curve, home, point, nearest)


def _shared_end(curve: Continuation, home: Home, before: Point, joint: Event) -> list[Event]:
    """An event of the branch that was left, and what grazes with it, as the end of the one that joins it."""
    at_once = [event for event in home.events if event.point is joint.point and event.kind in (GRAZING, home.kind)]
    at_once = at_once or [joint]  # the other branch is not known yet
    return [shared_with(curve, event, before, is_end=True) for event in at_once]


def _nearest_joint(home: Home, point: Point) -> tuple[Event | None, float]:
    """The nearest event of the other branch at which branches may join it, and how near it is [w]."""
    distances = [
        (float(np.linalg.norm(event.point.w - point.w)), i)
        for i, event in enumerate(home.events)
        if event.kind == home.kind
    ]
    distance, nearest = min(distances, default=(np.inf, -1))
    if distance > _NEAR_JOINT and home.kind == BREAKING:
        breaking = breaking_near(home.curve, point, _NEAR_JOINT)
        if breaking is not None:
            return Event(BREAKING, breaking), float(np.linalg.norm(breaking.w - point.w))
    return (home.events[nearest] if distances else None), distance


def _joint(curve: Continuation, home: Home, before: Point, fold: Event) -> Event:
    """The event at which a branch joins the one that it has left in a fold.

    There both branches cross, and the other one tells better where: its own equations are regular. Not where it grazes
    in between.
    """
    nearest, distance = _nearest_joint(home, fold.point)
    if nearest is not None and distance < _NEAR_JOINT:
        joint = shared_with(curve, nearest, before, is_end=True)
        if joint.point.word == fold.point.word:
            return joint
    return replace(fold, kind=home.kind)


def shared_with(curve: Continuation, event: Event, neighbour: Point, *, is_end: bool = False) -> Event:
    """Return the event at which a branch leaves or joins another one, with its motion over as many periods.

    Its tangent is the chord to or from a neighbouring point, for its own equations are those of both branches.

    Parameters
    ----------
    curve
        the Continuation of the branch.
    event
        of the other branch.
    neighbour
        the point of the branch next to it.
    is_end
        whether the branch ends there.
    """
    motion, slope = curve.family.follow(event.point.motion.start, event.point.parameter)
    chord = (event.point.w - neighbour.w) * (1.0 if is_end else -1.0)
    distance = float(np.linalg.norm(chord))
    length, orientation = neighbour.length + distance if is_end else 0.0, neighbour.orientation
    own = replace(event.point, motion=motion, slope=slope, tangent=chord / distance)
    return replace(event, point=replace(own, orientation=orientation, length=length))


def _is_joint(home: Home, fold: Point, others: Sequence[Point]) -> bool:
    """Whether a motion and its image become the same in a fold.

    They are apart by what the fold is off, as well as it is located. So where they are not quite the same, they must be
    far nearer than just before and behind it, and no farther than from an event at which branches may join.
    """
    apart = _apart(home, fold)
    if not _SAME_HALVES < apart < _HALVES:
        return apart <= _SAME_HALVES
    if _nearest_joint(home, fold)[1] > apart * max(1.0, float(np.linalg.norm(fold.w[:-1]))):
        return False
    earlier = [point for point in others if point.length < fold.length - _AT_JOINT]
    later = [point for point in others if point.length > fold.length + _AT_JOINT]
    neighbours = earlier[-1:] + later[:1]
    return len(neighbours) == 2 and all(apart < _NEARER * _apart(home, point) for point in neighbours)


def _is_of(home: Home, point: Point) -> bool:
    """Whether a motion is one of the branch that was left."""
    may_be = home.kind == BREAKING or _has_equal_halves(point)
    return may_be and _apart(home, point) <= _AT_HOME


def _has_equal_halves(point: Point) -> bool:
    """Whether both halves of a motion cross the same corners in the same order, at about the same instants."""
    return halves_apart(point.motion) < _ABOUT or not len(point.motion.crossings.time)


def _apart(home: Home, point: Point) -> float:
    """How far apart a motion and its image are, over the size of the state."""
    gap = (home.image(point) - point.state) * point.scale
    size = max(home.curve.family.size, float(np.linalg.norm(point.state * point.scale)))
    return float(np.linalg.norm(gap)) / size
