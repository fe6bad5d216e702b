"""One branch of periodic motions: its points in order, what happens between them, and why it ends where it does."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation, WrongBranch
from gearrattle.engine.periodic.events.event_record import BREAKING, FOLD, GRAZING, Event
from gearrattle.engine.periodic.events.events_of_step import changes_between, events_between
from gearrattle.engine.periodic.events.grazing import RELEASE, Grazing
from gearrattle.engine.periodic.events.location import zero_between
from gearrattle.engine.periodic.events.slider_release import end_in_release, is_near_release, is_release, passes_begin
from gearrattle.engine.periodic.events.symmetry_breaking import as_fixed_point, breaking_near
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.branch_points import Home, events_beside_joint, told_apart, unknown_home
from gearrattle.orbits.family_ends import followed_through_families
from gearrattle.orbits.orbit import is_stable
from gearrattle.orbits.progress import Progress, part_of, silent
from gearrattle.wording import counted

Array = NDArray[np.float64]

_MOST_POINTS = 20_000
_CREEPING = 250  # points that must come somewhere
_NOWHERE = 1e-5  # arclength that they must pass
_ROUNDING = 1e-12  # of the parameter
_GROWN = 1e4  # multiplier: from it on motions may end where a visit beyond a corner vanishes
_AT_BREAKING = 1e-7  # arclength to a breaking from a motion that is the same to rounding
_NEARER = 0.05  # of a step that has gone to another branch: the next one
_LARGE = 1000.0  # times the first motion, and the largest corner: motions that are larger have left all clearances


@dataclass(frozen=True)
class Unlocated:
    """A step of a branch whose events could not be located."""

    # its points. The branch is sure to lead from one to the other: followed with shorter steps, where there are any,
    # it does so again
    before: Point
    after: Point
    reason: str  # why they could not
    shown: Callable[[float], str]  # writes a parameter value

    @property
    def note(self) -> str:
        """What the user must know of it."""
        between = f"between {self.shown(self.before.parameter)} and {self.shown(self.after.parameter)}"
        seen = ", ".join(changes_between(self.before, self.after)) or "no change"
        return f"Events {between} are not located ({self.reason}); its two ends show: {seen}."


@dataclass(frozen=True)
class Curve:
    """One branch."""

    cycles: int  # periods after which its motions repeat
    points: tuple[Point, ...]  # in order
    events: tuple[Event, ...]  # between them, in order
    note: str = ""  # why it ends inside the range; empty where it does not
    origin: str = ""  # kind of the event at which it leaves another branch, its first point; empty where it leaves none
    unlocated: tuple[Unlocated, ...] = ()  # steps whose events could not be located, in order

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user must know of it."""
        return (*(step.note for step in self.unlocated), *([self.note] if self.note else []))

    @cached_property
    def stable(self) -> tuple[bool, ...]:
        """Of every point whether its motion is; where the branch leaves or joins another one that of its neighbour."""
        stable = [is_stable(point.multipliers, point.free) for point in self.points]
        if len(stable) > 1 and self.is_joint(0):
            stable[0] = stable[1]
        if len(stable) > 1 and self.is_joint(-1):
            stable[-1] = stable[-2]
        return tuple(stable)

    def is_joint(self, end: int) -> bool:
        """Return whether the branch leaves or joins another one at its first (0) or its last (-1) point."""
        return bool(self.origin and end == 0) or self.happens_at(end)

    def happens_at(self, end: int) -> bool:
        """Return whether the first (0) or the last (-1) event is at that end."""
        return bool(self.events) and self.events[end].point.w is self.points[end].w

    def motions_at(self, follower: Continuation, value: float) -> Iterator[tuple[int, Point]]:
        """Yield the motions at a parameter value [SI]: index of the point before, and the motion."""
        for i, point in enumerate(self.points):
            if point.parameter == value:
                yield i, point
        special = [event.point for event in self.events if event.kind in (FOLD, BREAKING)]
        is_joint = {0: bool(self.origin) or self.happens_at(0), len(self.points) - 2: self.happens_at(-1)}
        for i, (first, last) in enumerate(self.steps()):
            within = [point for point in special if first.length < point.length < last.length]
            for before, after in pairwise([first, *within, last]):
                if (before.parameter - value) * (after.parameter - value) < 0.0:
                    with suppress(ConvergenceError):  # a fold very near
                        yield i, _motion_between(follower, before, after, value, is_joint.get(i, False))

    def steps(self) -> Iterator[tuple[Point, Point]]:
        """Yield the pairs of consecutive points."""
        return pairwise(self.points)


class Work(NamedTuple):
    """Reports how far branches are followed, and what they are so far."""

    progress: Progress = silent
    so_far: Callable[[Sequence[Curve]], None] | None = None

    def part(self, number: int, count: int) -> Work:
        """Return the work of part ``number``, from 0, of ``count`` equal ones."""
        return self._replace(progress=part_of(self.progress, number, count))

    def beside(self, complete: Sequence[Curve]) -> Work:
        """Return the work on branches that are reported with those that are complete."""
        return self.telling(lambda growing: [*complete, *growing])

    def telling(self, words: Callable[[Sequence[Curve]], Sequence[Curve]]) -> Work:
        """Return the work on branches that are reported as something else."""
        so_far = self.so_far
        return self if so_far is None else self._replace(so_far=lambda growing: so_far(words(growing)))


UNTOLD = Work()
"""Work that is reported to nobody."""


def followed(
    curve: Continuation,
    begin: Point,
    ends: tuple[float, float],
    *,
    home: Home | None = None,
    origin: Event | None = None,
    work: Work = UNTOLD,
) -> Curve:
    """Follow one branch to an end of the range, whose ``ends`` ascend, and locate what happens along it.

    A branch of doubled period or broken symmetry has left another one, its ``home``, at an event, its ``origin``, whose
    motion is given over as many periods. It ends where its motions are those of that branch again.
    """
    walk = _Walk(curve, begin, home, origin)
    steps = curve
    for is_last in (False, False, True):
        try:
            for point, known in _followed(steps, walk.points[-1], ends):
                walk.take(point, known)
                if walk.is_done:
                    break
                work.progress(min(1.0, abs(point.parameter - begin.parameter) / (ends[1] - ends[0])))
                if work.so_far is not None:
                    work.so_far([walk.curve])
        except ConvergenceError as error:
            walk.stop()
            if isinstance(error, WrongBranch) and not (walk.is_done or is_last):
                steps = curve.beginning_with(_NEARER * error.distance)
                continue
            if not walk.is_done:
                walk.note = f"A branch ends inside the range: {error.message}."
        break
    return walk.curve


class _Walk:
    """A branch while it is followed."""

    def __init__(self, follower: Continuation, begin: Point, home: Home | None, origin: Event | None) -> None:
        self._follower = follower
        self._origin = origin
        begin, self._at_begin = (begin, []) if origin is not None else _at_breaking(follower, begin)
        self.points = [begin]
        self.events = [*self._at_begin]
        self.unlocated = list[Unlocated]()
        self.note = ""
        self.is_done = False
        self._home = unknown_home(follower, begin) if home is None else home
        if origin is not None:
            begin = replace(begin, length=float(np.linalg.norm(begin.w - origin.point.w)))
            self.points = [origin.point, begin]
            self.events = events_beside_joint(follower, origin.point, begin)

    @property
    def curve(self) -> Curve:
        """The branch so far."""
        return Curve(
            cycles=self._follower.family.cycles,
            points=tuple(self.points),
            events=tuple(self.events),
            note=self.note,
            origin="" if self._origin is None else self._origin.kind,
            unlocated=tuple(self.unlocated),
        )

    def take(self, point: Point, known: Sequence[Event] | None) -> None:
        """Go on to a point, with the events before it; None: they are to be located.

        Raises ConvergenceError: the branch does not lead there.
        """
        if bool(point.free) != bool(self.points[-1].free) and (self._home is None or not self._home.events):
            self._home = unknown_home(self._follower, point)
        joint = None if self._home is None else self._home.arrival(self.points[-1], point)
        if joint is not None:
            self.events = told_apart(self.events, joint[-1].point)
            self._end_at(joint)
            return
        located = _located(self._follower, self.points[-1], point) if known is None else ([point], [*known], [])
        if located[2] and self._may_have_ended():
            limit = self._follower.family.shown(self.points[-1].parameter)
            message = f"the motion may jump beyond {limit}, where a slider is let go"
            raise WrongBranch(message, float(np.linalg.norm(point.w - self.points[-1].w)))
        self.points += located[0]
        self.events += _without(self._at_begin, located[1])
        self.unlocated += located[2]
        if abs(point.multipliers[0]) > _GROWN:
            self._end_in_release()
        if not self.is_done:
            self.note = _why_left(self.points, self._follower.family.shown)
            self.is_done = bool(self.note)

    def stop(self) -> None:
        """End where the branch cannot be followed any further, if it is known why."""
        joint = None if self._home is None else self._home.arrival_in_jump(self.points[-1])
        if joint is None:
            self._end_in_release()
        else:
            self._end_at(joint)

    def _end_at(self, joint: Sequence[Event]) -> None:
        """End where the branch joins another one."""
        self.events += joint
        self.points.append(joint[-1].point)
        self.is_done = True

    def _may_have_ended(self) -> bool:
        """Whether the last motion has a short visit that lets a slider go: where that vanishes the branch ends."""
        last = self.points[-1]
        family = self._follower.family
        return bool(family.memories) and is_near_release(family.map_at(last.parameter), last)

    def _end_in_release(self) -> None:
        """End where a slider is released with its torque, if one is."""
        release = self._release()
        if release is not None:
            self.events.append(release)
            self.points[-1] = release.point
            end = self._follower.family.shown(release.point.parameter)
            why = "a slider is let go with its torque, and the motion jumps"
            self.note = f"A branch ends inside the range at {end}: {why}."
            self.is_done = True

    def _release(self) -> Event | None:
        """The grazing at which the branch ends because a slider is released with torque; None: it ends otherwise."""
        family = self._follower.family
        if not family.memories or len(self.points) < 2:
            return None
        before, last = self.points[-2:]
        period_map = family.map_at(last.parameter)
        with suppress(ConvergenceError):
            if last.touch is not None and is_release(period_map, last, last.touch):
                return Event(GRAZING, last, last.touch.watch, touch=last.touch, grazing=Grazing(RELEASE))
        end = end_in_release(period_map, before, last)
        return None if end is None else Event(GRAZING, end[0], end[1].watch, touch=end[1], grazing=Grazing(RELEASE))


def _at_breaking(curve: Continuation, begin: Point) -> tuple[Point, list[Event]]:
    """The first point of a branch and, where it is the same as a breaking of symmetry, that."""
    fixed = as_fixed_point(curve, begin, upward=bool(begin.tangent[-1] > 0.0))
    breaking = None if fixed is begin else breaking_near(curve, fixed, _AT_BREAKING)
    return fixed, [] if breaking is None else [Event(BREAKING, replace(breaking, length=0.0))]


def _without(at_begin: Sequence[Event], events: Sequence[Event]) -> list[Event]:
    """The events of a step except for a breaking that has been named at the begin of the branch."""
    return [e for e in events if not at_begin or e.kind != BREAKING or e.point.length > _AT_BREAKING]


def _followed(
    curve: Continuation, begin: Point, ends: tuple[float, float]
) -> Iterator[tuple[Point, Sequence[Event] | None]]:
    """Yield the points of a branch and what is known before them; a symmetric one at an end of the range is exact."""
    for point, known in followed_through_families(curve, begin, ends):
        is_last = point.parameter in ends
        yield as_fixed_point(curve, point, upward=point.parameter == ends[1]) if is_last else point, known


def _motion_between(follower: Continuation, before: Point, after: Point, value: float, is_beside_joint: bool) -> Point:
    """The motion of a step at a parameter value; along the branch where it leaves another one like a root.

    At a given parameter Newton's method may find a motion of the other branch there.
    """
    if not is_beside_joint:
        with suppress(ConvergenceError):
            return follower.at_parameter(before, after, value)
    return zero_between(follower, before, after, lambda point: point.parameter - value)[0]


def _located(
    curve: Continuation, before: Point, after: Point
) -> tuple[Sequence[Point], list[Event], Sequence[Unlocated]]:
    """The points of a step after its first one, its events, and where they could not be located.

    Where they cannot, shorter steps must lead to the same point; each of them is tried by itself. Where the state at
    the begin of the period jumps nothing can be located in between, and both ends must show no change.
    """
    with suppress(ConvergenceError):
        return [after], events_between(curve, before, after), []
    points = curve.with_shorter_steps(before, after)
    events: list[Event] = []
    unlocated = []
    for one, other in pairwise([before, *points]):
        if passes_begin(curve.family.map_at(one.parameter), one, other) and not changes_between(one, other):
            continue
        try:
            events += events_between(curve, one, other)
        except ConvergenceError as error:
            unlocated.append(Unlocated(one, other, error.message, curve.family.shown))
    return points, events, unlocated


def _why_left(points: list[Point], shown: Callable[[float], str]) -> str:
    """The note of a branch that is not followed any further; empty while it is."""
    last = points[-1]
    recent = points[-1 - _CREEPING :] if len(points) > _CREEPING else []
    if len(points) >= _MOST_POINTS or (recent and last.length - recent[0].length < _NOWHERE):
        return f"A branch was left after {counted(len(points), 'point')}."
    values = np.array([point.parameter for point in recent[:: _CREEPING // 10]])
    if recent and np.ptp(values) <= _ROUNDING * np.abs(values).max():
        return (
            f"A branch was left at {shown(last.parameter)}: its motions are one of a family that has no end in sight."
        )
    first_size, last_size = (float(np.linalg.norm(point.w[:-1])) for point in (points[0], last))
    if last_size > _LARGE * max(1.0, first_size):
        return f"A branch was left at {shown(last.parameter)}: its motions have grown a thousandfold."
    return ""
