"""Where a branch joins another one: where its motions become those of the other, of half the period, or symmetric.

A motion of 2 n periods has an image: the same motion n periods later. A motion without symmetry, of a symmetric
driveline, has its mirror image half of its length later. Both are motions of the same driveline, and where they become
the same the branch joins that of motions of n periods, or of symmetric ones. There it passes over into its own images:
the difference between a motion and its image goes through zero. So a step holds a joint if that difference is zero at
its end or has turned around. The other branch tells where: its own equations are regular there (``symmetry_breaking``).
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import BREAKING, DOUBLING, FOLD, GRAZING, Event
from gearrattle.engine.periodic.events.events_of_step import events_between
from gearrattle.engine.periodic.events.symmetry_breaking import breaking_near, half_curve
from gearrattle.engine.periodic.families import half_of
from gearrattle.engine.periodic.point import Point, halves_apart
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

_SAME_HALVES = 1e-5  # of the size of the state: a motion and its image that differ by less are the same
_AT_HOME = 1e-9  # the same, where a motion is one of the other branch: near a joint both are known less well
_ABOUT = 1e-3  # of the periods of a motion: instants that differ by more are not the same
_AT_JOINT = 1e-8  # arclength: what touches so near to where a branch joins another does so there, except for rounding
_NEAR_JOINT = 1e-3  # of w: so far at least a joint that is not known is sought
_IN_JUMP = 1e-8  # of w: so near to a jump of the gradient a branch that goes no further has come to it
_NEAR_HOME = 10.0  # steps: so near lies the joint of a step onto the other branch
_ON_THE_WAY = 1.5  # steps: the way over a joint, from the begin of a step to its end
_NEARER_BY = 0.1  # share of the way to a joint that is left by every part of it
_SINGULAR = 1e-4  # of w: so near to a joint the equations of the branch are nearly singular
_FLAT = 1e-4  # share of the way to a joint by which the parameter changes up to a fold that may be the joint itself
_ROUNDING = 4e-13  # the same, times the square of that way [w]: a residual over what moves it like a cube


class Home:
    """The branch that another one has left, or joins, where its period doubles or its symmetry breaks."""

    def __init__(self, curve: Continuation, events: Sequence[Event] = ()) -> None:
        self.events = events
        self._curve = curve
        self._half = half_of(curve.family)
        self._kind = DOUBLING if curve.cycles % 2 == 0 else BREAKING
        self._last: tuple[Point, Array] | None = None

    def apart(self, point: Point) -> float:
        """Return how far apart a motion and its image are, over the size of the state."""
        size = max(self._curve.family.size, float(np.linalg.norm(point.state * point.scale)))
        return float(np.linalg.norm(self._gap(point))) / size

    def is_of(self, point: Point) -> bool:
        """Return whether a motion is one of the branch."""
        motion = point.motion  # of a doubled one both halves cross the same corners at about the same instants
        may_be = self._kind == BREAKING or halves_apart(motion) < _ABOUT or not len(motion.crossings.time)
        return may_be and self.apart(point) <= _AT_HOME

    def arrival(self, before: Point, after: Point) -> list[Event] | None:
        """Return the events of a step on which the branch joins this one, up to there; None: it does not.

        Raises ConvergenceError: the step leads to a motion of this branch, and no joint is known.
        """
        # a motion and its image change places over the step, or are the same at its end
        if float(self._gap(before) @ self._gap(after)) >= 0.0 and not self.is_of(after):
            return None
        joint = self._joint_between(before, after)
        if joint is None:
            if self.is_of(after):
                raise ConvergenceError(f"its motions become those of another branch, where no {self._kind} is known")
            return None
        ends = self._shared_end(before, joint)
        events = _events_up_to(self._curve, before, ends[-1].point)
        if len(ends) > 1:  # what touches there is named by the other branch
            last = ends[-1].point.length - _AT_JOINT
            events = [event for event in events if event.kind != GRAZING or event.point.length < last]
        return [*events, *ends]

    def arrival_in_jump(self, point: Point) -> list[Event] | None:
        """Return the events where the branch comes to a jump of the gradient in which this one doubles its period.

        Beyond there is this branch alone, in a direction that need not be ahead. None: the branch is not there.
        """
        nearest, distance = self._nearest(point)
        if nearest is None or not nearest.is_collision or distance > _IN_JUMP:
            return None
        return self._shared_end(point, nearest)

    def _joint_between(self, before: Point, after: Point) -> Event | None:
        """The joint of a step over which a motion and its image change places; None where none is known."""
        step = float(np.linalg.norm(after.w - before.w))
        turns = float(self._gap(before) @ self._gap(after)) < 0.0
        joint, distance = self._nearest(before)
        if joint is not None:
            over = distance + float(np.linalg.norm(after.w - joint.point.w))
            if over <= _ON_THE_WAY * step or (not turns and distance <= _NEAR_HOME * step):
                return joint
        gaps = [float(np.linalg.norm(self._gap(point))) for point in (before, after)]
        with suppress(ConvergenceError):
            middle = self._curve.between(before, after, gaps[0] / (gaps[0] + gaps[1]))
            breaking = breaking_near(self._curve, middle, max(_NEAR_JOINT, 0.5 * step))
            if breaking is not None:
                return Event(self._kind, breaking)
        return None

    def _gap(self, point: Point) -> Array:
        """(N,) a motion's image less the motion, balanced."""
        if self._last is None or self._last[0] is not point:
            image, _ = self._half.follow(point.motion.start, point.parameter)
            self._last = point, (image.end.y - point.state) * point.scale
        return self._last[1]

    def _nearest(self, point: Point) -> tuple[Event | None, float]:
        """The nearest event at which branches may join this one, and how near it is [w]."""
        distances = [
            (float(np.linalg.norm(event.point.w - point.w)), i)
            for i, event in enumerate(self.events)
            if event.kind == self._kind
        ]
        distance, nearest = min(distances, default=(np.inf, -1))
        return (self.events[nearest] if distances else None), distance

    def _shared_end(self, before: Point, joint: Event) -> list[Event]:
        """A joint, and what grazes with it, as the end of the branch that joins this one."""
        at_once = [event for event in self.events if event.point is joint.point and event.kind in (GRAZING, self._kind)]
        at_once = at_once or [joint]  # this branch is not known yet
        return [shared_with(self._curve, event, before, is_end=True) for event in at_once]


def unknown_home(curve: Continuation, begin: Point) -> Home | None:
    """Return the branch that one of even periods, or without symmetry, may join; None for others, and families."""
    if begin.free or half_curve(curve, begin.parameter) is None:
        return None
    home = Home(curve)
    return home if home.apart(begin) > _SAME_HALVES else None


def shared_with(curve: Continuation, event: Event, neighbour: Point, *, is_end: bool = False) -> Event:
    """Return the event at which a branch leaves or joins another one, with its motion over as many periods.

    Its tangent is the chord to or from a neighbouring point, for its own equations are those of both branches.
    """
    motion, slope = curve.family.follow(event.point.motion.start, event.point.parameter)
    chord = (event.point.w - neighbour.w) * (1.0 if is_end else -1.0)
    distance = float(np.linalg.norm(chord))
    length = neighbour.length + distance if is_end else 0.0
    orientation = neighbour.orientation
    own = replace(event.point, motion=motion, slope=slope, tangent=chord / distance)
    return replace(event, point=replace(own, orientation=orientation, length=length))


def events_beside_joint(curve: Continuation, before: Point, after: Point) -> list[Event]:
    """Return the events between two points of a branch at one of which it leaves or joins another one.

    There det(I - M) is zero and the tangent that of a chord, so nothing is said of folds and symmetry breaking.
    """
    with suppress(ConvergenceError):
        return [event for event in events_between(curve, before, after) if event.kind not in (FOLD, BREAKING)]
    return []


def told_apart(events: Sequence[Event], joint: Point) -> list[Event]:
    """Return events without the folds and breakings so near to a joint that they are the joint itself, by rounding."""

    def is_joint(event: Event) -> bool:
        change = event.point.w - joint.w
        distance = float(np.linalg.norm(change))
        is_flat = abs(float(change[-1])) * distance <= _FLAT * distance**2 + _ROUNDING
        return event.kind in (FOLD, BREAKING) and distance < _SINGULAR and is_flat

    return [event for event in events if not is_joint(event)]


def _events_up_to(curve: Continuation, before: Point, joint: Point) -> list[Event]:
    """The events between a point of a branch and its joint, those of the last small part as beside a joint."""
    points = [before]
    events = list[Event]()
    left = _NEARER_BY
    way = float(np.linalg.norm(joint.w - before.w))
    with suppress(ConvergenceError):
        while left * way > _NEARER_BY * _SINGULAR:
            points.append(curve.between(before, joint, 1.0 - left))
            left *= _NEARER_BY
        for one, other in pairwise(points):
            events += events_between(curve, one, other)
        return [*told_apart(events, joint), *events_beside_joint(curve, points[-1], joint)]
    return events_beside_joint(curve, before, joint)
