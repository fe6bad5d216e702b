"""Along branches of periodic motions: ranges of one stability, and where a motion jumps.

A branch is walked from node to node: its points, and the events between them. The stability changes at an event: a
fold, a period doubling, a symmetry breaking, a Neimark-Sacker bifurcation. Between a point and the nearest such event
it is that of the point, between two of them that of the motion halfway. Where no event was located a range ends halfway
between two points. At a fold the parameter turns back, so a range ends at every fold: over each range the parameter
only grows, or only falls. A range without width, such as that of a vertical branch, does not count.

Where the parameter runs over a fold the motion jumps, and so it does where a slider is released with its torque
(``release``). Which way the fold lies follows from the next motion that differs from it by more than rounding: a
grazing may lie at the fold itself. Where the parameter runs over a period doubling or a symmetry breaking, the motion
goes on along what leaves there, if that is stable just beyond (a *soft* loss of stability); if it is unstable, leads
backwards or is vertical, the motion jumps (a *hard* loss). Of a Neimark-Sacker bifurcation nothing is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import BREAKING, DOUBLING, FOLD, GRAZING, NEIMARK_SACKER
from gearrattle.engine.periodic.events.grazing import RELEASE
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.family_ends import EDGE
from gearrattle.orbits.orbit import is_stable

if TYPE_CHECKING:
    from gearrattle.orbits.branch import Branch

CHANGES = frozenset({FOLD, DOUBLING, BREAKING, NEIMARK_SACKER, EDGE})
"""Events at which the stability may change."""
_NO_WIDTH = 1e-9  # of the range, and arclength: what differs by less is one, as along a vertical branch
_SAME = 1e-6  # of swings: motions that differ by less are one


@dataclass(frozen=True)
class Range:
    """Neighbouring points of a branch with the same stability and no fold between them."""

    branch: int  # number of the branch
    begin: float  # values of the parameter at its two ends, in the order of the branch [SI]
    end: float
    stable: bool  # whether the motions are
    points: int  # how many
    cause: str  # of its end: the kind of an event, or what else ends it


@dataclass(frozen=True)
class Loss:
    """An event at which stable motions end, or become unstable, as the value slowly goes one way."""

    event: int  # its row in ``Branch.events``
    branch: int  # number of the branch
    kind: str  # of the event
    value: float  # of the parameter [SI]
    upward: bool  # whether it is met with a growing value
    jumps: bool | None = True  # whether the motion jumps there; None: that is not known


@dataclass(frozen=True)
class Course:
    """A branch from node to node."""

    # its N points and events: a point and -1, or the point before an event and the event
    nodes: tuple[tuple[int, int], ...]
    value: NDArray[np.float64]  # (N,) of the parameter [SI]
    kinds: tuple[str, ...]  # N kinds of events; empty for points
    stable: tuple[bool, ...]  # (N - 1,) whether motions are, between every node and the next

    def points_of(self, first: int, end: int) -> int:
        """How many of the nodes from ``first`` up to ``end`` are points."""
        return sum(not kind for kind in self.kinds[first:end])


def slices_of(branch: Branch) -> list[slice]:
    """Return the points of every branch."""
    ends = np.cumsum([0, *(len(curve.points) for curve in branch.curves)]).tolist()
    return [slice(a, b) for a, b in pairwise(ends)]


def courses_of(branch: Branch) -> list[Course]:
    """Return every branch from node to node."""
    values = branch.data["value"].values
    events = branch.events
    kinds = events["kind"].tolist()
    event_values = events["value"].to_numpy(np.float64)
    of_steps: dict[int, list[int]] = {}
    for event, point in enumerate(events["point"].tolist()):
        of_steps.setdefault(point, []).append(event)
    courses = []
    for number, part in enumerate(slices_of(branch)):
        nodes = list[tuple[int, int]]()
        steps = list[bool]()
        for i in range(part.start, part.stop):
            own = of_steps.get(i, [])
            nodes += [(i, -1), *((i, e) for e in own)]
            steps += _stability_of_step(branch, number, i, own) if i + 1 < part.stop else []
        steps += steps[-1:] * (len(nodes) - 1 - len(steps))  # what happens at the very end
        value = np.array([values[i] if e < 0 else event_values[e] for i, e in nodes])
        courses.append(Course(tuple(nodes), value, tuple(kinds[e] if e >= 0 else "" for _, e in nodes), tuple(steps)))
    return courses


def _stability_of_step(branch: Branch, number: int, point: int, events: Sequence[int]) -> list[bool]:
    """Whether motions are stable before, between and after the events of a step."""
    if not events:
        return [bool(branch.data["stable"].values[point])]
    stable = branch.data["stable"].values
    part = slices_of(branch)[number]
    curve = branch.curves[number]
    kinds = branch.events["kind"].iloc[list(events)].tolist()
    changes = [k for k, kind in enumerate(kinds) if kind in CHANGES]
    changes = changes or [k for k, kind in enumerate(kinds) if kind == GRAZING][:1]
    parts = [bool(stable[point + (k > 0)]) for k in range(len(changes) + 1)]
    is_joint = point == part.start and curve.is_joint(0), point + 2 == part.stop and curve.is_joint(-1)
    if len(changes) > 1 or (changes and any(is_joint)):
        first, last = curve.points[point - part.start : point - part.start + 2]
        located = [event.point for events in branch.events_of_curves for event in events]
        passed = [first, *(located[events[k]] for k in changes), last]
        unknown = slice(0 if is_joint[0] else 1, None if is_joint[1] else -1)
        for k, pair in list(enumerate(pairwise(passed)))[unknown]:
            middle = halfway(branch.follower(curve), *pair)
            parts[k] = parts[k] if middle is None else is_stable(middle.multipliers, middle.free)
    return [parts[k] for k in (0, *np.searchsorted(changes, np.arange(len(events)), side="right"))]


def halfway(curve: Continuation, first: Point, last: Point) -> Point | None:
    """Return the motion halfway between two of a branch; None where nothing lies between them, or it is not found."""
    if last.length - first.length <= _NO_WIDTH:
        return None
    try:
        return curve.between(first, last, 0.5)
    except ConvergenceError:
        return None


def ranges_of(branch: Branch) -> list[Range]:
    """Return ranges of one stability that end at folds, branch by branch, in the order of each."""
    ranges = list[Range]()
    stable = branch.data["stable"].values
    for number, course in enumerate(courses_of(branch)):
        own = list[Range]()
        first = 0
        begin = float(course.value[0])
        for i in range(1, len(course.nodes) - 1):
            if course.stable[i - 1] != course.stable[i] or course.kinds[i] == FOLD:
                at, cause = _change(course, i)
                own.append(Range(number, begin, at, course.stable[first], course.points_of(first, i), cause))
                first = i
                begin = at
        last = float(course.value[-1])
        is_stable = bool(stable[course.nodes[-1][0]])
        points = course.points_of(first, len(course.nodes))
        own.append(Range(number, begin, last, is_stable, points, _end(branch, number, last)))
        wide = [one for one in own if abs(one.end - one.begin) > _no_width(branch)]
        ranges += wide or own[:1]
    return ranges


def _no_width(branch: Branch) -> float:
    return _NO_WIDTH * abs(branch.range[1] - branch.range[0])


def _change(course: Course, i: int) -> tuple[float, str]:
    """Where the stability changes or the branch turns back at a node, and by what."""
    if course.kinds[i] in CHANGES or course.kinds[i] == GRAZING:
        return float(course.value[i]), course.kinds[i]
    return float(0.5 * (course.value[i - 1] + course.value[i])), "not located"


def _end(branch: Branch, number: int, value: float) -> str:
    """What ends a branch: the range, the event at which it joins another one, or something else."""
    if value in branch.range:
        return "end of the range"
    curve = branch.curves[number]
    return curve.events[-1].kind if curve.happens_at(-1) else "end of the branch"


def losses_of(branch: Branch) -> list[Loss]:
    """Return the events at which stable motions end or lose their stability, by their values."""
    losses = list[Loss]()
    courses = courses_of(branch)
    for number, course in enumerate(courses):
        for i in range(1, len(course.nodes) - 1):
            before = course.stable[i - 1]
            after = course.stable[i]
            is_fold = course.kinds[i] == FOLD
            if course.kinds[i] not in CHANGES or not (before or after) or (before and after and not is_fold):
                continue
            stable, other = (i - 1, i + 1) if before else (i + 1, i - 1)
            change = float(course.value[other] - course.value[stable])
            if is_fold:
                change = -_first_change(course.value[i::-1] if before else course.value[i:], _no_width(branch))
            if is_fold or abs(change) > _no_width(branch):
                event = course.nodes[i][1]
                value = float(course.value[i])
                loss = Loss(event, number, course.kinds[i], value, change >= 0.0)
                losses.append(replace(loss, jumps=_jumps(branch, courses, loss)))
        losses += _ends_in_release(branch, number, course)
    return sorted(losses, key=lambda loss: loss.value)


def _first_change(value: NDArray[np.float64], least: float) -> float:
    """From the first of (N,) values to the next one that differs by more than rounding."""
    change = value - value[0]
    return float(change[np.argmax(np.abs(change) > least)])


def _ends_in_release(branch: Branch, number: int, course: Course) -> list[Loss]:
    """The end of a branch whose stable motions let a slider go with its torque there."""
    event = course.nodes[-1][1]
    if event < 0 or branch.events["grazing"].iloc[event] != RELEASE or not course.stable[-1]:
        return []
    before, end = course.value[-2:].tolist()
    return [Loss(event, number, GRAZING, end, end >= before)]


def _jumps(branch: Branch, courses: Sequence[Course], loss: Loss) -> bool | None:
    """Whether the motion jumps at an event; None: not known."""
    if loss.kind == FOLD:
        return True
    beyond = [] if loss.kind == NEIMARK_SACKER else _stable_beyond(branch, courses, loss)
    return not any(beyond) if beyond else None


def _stable_beyond(branch: Branch, courses: Sequence[Course], loss: Loss) -> list[bool]:
    """Of every branch that leaves or ends at an event whether its motions are stable just beyond that."""
    swings = branch.data["peak_to_peak"].values
    least = _no_width(branch)
    apart = _SAME * float(swings.max(initial=0.0))
    own = branch.event_levels[loss.event, 1] - branch.event_levels[loss.event, 0]
    cycles = branch.curves[loss.branch].cycles * (2 if loss.kind == DOUBLING else 1)
    beyond = []
    for number, (course, curve) in enumerate(zip(courses, branch.curves, strict=True)):
        if number == loss.branch or curve.cycles != cycles:
            continue
        for inwards in (slice(None), slice(None, None, -1)):
            nodes = course.nodes[inwards]
            away = course.value[inwards] - loss.value
            stable = course.stable[inwards]
            if abs(away[0]) > least or np.abs(swings[nodes[0][0]] - own).max() > apart:
                continue
            next_node = int(
                np.argmax(np.append(away != away[0], True))
            )  # what happens at the end itself lies before it
            is_next = next_node < len(nodes) and abs(away[next_node]) > least  # else it is vertical
            beyond.append(bool(is_next and stable[next_node - 1] and (away[next_node] > 0.0) == loss.upward))
    return beyond
