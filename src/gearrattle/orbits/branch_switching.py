"""Isolated branches, and branches that leave another one where its period doubles or its symmetry breaks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.continuation import Continuation
from gearrattle.engine.periodic.events.event_record import BREAKING, DOUBLING, Event
from gearrattle.engine.periodic.events.symmetry_breaking import SAME, half_curve
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.point import Point, turned_around
from gearrattle.engine.periodic.symmetry import half_period_map
from gearrattle.errors import ConvergenceError
from gearrattle.orbits.branch_points import Home, shared_with
from gearrattle.orbits.followed_branch import UNTOLD, Curve, Work, followed
from gearrattle.orbits.known_motions import Known, search, starts_of
from gearrattle.orbits.orbit import CYCLES
from gearrattle.orbits.progress import silent
from gearrattle.wording import counted

Array = NDArray[np.float64]

_VALUES = 9
"""Number of parameter values, the ends of the range included, at which isolated branches are sought."""
_STARTS = 24
_SAME = 1e-6  # of the size of the state: motions nearer than this are the same
_SAME_BESIDE = 0.1  # of the distance from the motion of an event: those nearer than this are the same as well
_SAME_EVENT = 1e-6  # of the range: events of a kind nearer than this are the same
_DISTANCES = (2e-2, 5e-3, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
"""Of the first point from the branch that is left, in units of w."""
_MOST_NAMED = 3
"""Values that a note lists."""
_FARTHEST = 3.0  # distances: a motion whose state is farther away is of another branch
_FLAT = 1e-8  # of w: a change of the parameter that does not matter
_DEFECT = 0.01  # of the largest change: by so much a cubic may be off
_TURNS_FROM = 0.1  # of the way from the event: a turning point of the cubic nearer to it may be rounding
_BESIDE_JOINT = 1e-3  # of the parameter's unit: so far from a joint the branch of symmetric motions is begun
_ALONG = 1e-9  # cosine between a tangent and the direction in which a branch leaves that is rounding


@dataclass(frozen=True)
class Followers:
    """What follows motions over a range by the periods after which they repeat: n, 2 n, and n / 2 where n is even."""

    cycles: int  # n
    ends: tuple[float, float]  # of the range, ascending
    of: Mapping[int, Continuation]  # by periods; those of too many are missing

    def points_at(self, curves: Sequence[Curve], value: float) -> list[Point]:
        """Return the points of branches at a value of the parameter."""
        followed_ones = [known for known in curves if known.cycles in self.of]
        return [point for known in followed_ones for _, point in known.motions_at(self.of[known.cycles], value)]


def followers_of(cycles: int, ends: tuple[float, float], follower: Callable[[int], Continuation]) -> Followers:
    """Return what follows motions of some periods over a range, and those that these join or that leave them."""
    counts = [n for n in (cycles, 2 * cycles, cycles // 2) if n <= CYCLES.most]
    return Followers(cycles, ends, {n: follower(n) for n in (counts if cycles % 2 == 0 else counts[:2]) if n > 0})


def further_curves(
    followers: Followers,
    curves: Sequence[Curve],
    *,
    isolated: bool,
    others: Sequence[Curve] = (),
    work: Work = UNTOLD,
) -> list[Curve]:
    """Return the branches that leave known ones of n periods, and on request those that are connected to none.

    ``others`` are known as well, with what leaves them. Searches and branches that leave count as equal parts of work.
    """
    parts = 1 + 2 * isolated
    further = _leaving_all(followers, curves, others, work.part(0, parts))
    sought = [n for n in (followers.cycles, 2 * followers.cycles) if isolated and n in followers.of]
    for i, cycles in enumerate(sought, 1):
        known = [*others, *curves, *further]
        more = _isolated_curves(followers, followers.of[cycles], known, work.part(i, parts).beside(further))
        further += more
        further += _leaving_all(followers, more, known, work._replace(progress=silent).beside(further))
    return further


def _leaving_all(followers: Followers, curves: Sequence[Curve], others: Sequence[Curve], work: Work) -> list[Curve]:
    """The branches that leave some, and those that leave branches of broken symmetry; ``others`` are known as well."""
    further = list[Curve]()
    left = [*curves]
    for i, origin in enumerate(left):  # which grows
        known = [*others, *curves, *further]
        leaving = _branches_off(followers, origin, known, work.part(i, len(left)).beside(further))
        further += leaving
        left += [branch for branch in leaving if branch.cycles <= followers.cycles]
    return further


def _isolated_curves(followers: Followers, curve: Continuation, curves: Sequence[Curve], work: Work) -> list[Curve]:
    """Branches that are connected to none of the known ones; ``curve`` follows them."""
    further = list[Curve]()
    for i, value in enumerate(np.linspace(*followers.ends, _VALUES).tolist()):
        part = work.part(i, _VALUES)
        part.progress(0.0)
        # motions of the branches that are known
        period_map = curve.family.map_at(value)
        on_branches = Known(period_map)
        alike = [one for one in [*curves, *further] if curve.cycles % one.cycles == 0]
        for point in followers.points_at(alike, value):
            on_branches.add(point.motion)
        # motions from many starts
        known = Known(period_map, mirror=half_period_map(period_map.system))
        for state in starts_of(period_map, _STARTS):
            search(known, state)
        for motion, states, *_ in known.motions:
            if len(states) == curve.cycles and not on_branches.holds(motion.start):
                try:
                    isolated = _both_ways(curve, motion.start, value, followers.ends, part.beside(further))
                except ConvergenceError:
                    continue
                further.append(isolated)
                for point in followers.points_at([isolated], value):
                    on_branches.add(point.motion)
                on_branches.add(motion)
    return further


def _both_ways(curve: Continuation, state: State, value: float, ends: tuple[float, float], work: Work) -> Curve:
    """The branch through a motion, followed upward and downward and put together."""
    first = curve.begin(state, value)
    ahead = followed(curve, first, ends, work=work)
    if len(ahead.points) > 2 and ahead.points[-1].w is first.w:  # closed
        return ahead
    downward = curve.begin(state, value, upward=False)
    behind = followed(curve, downward, ends, work=work.telling(lambda growing: [_joined(growing[0], ahead)]))
    return _joined(behind, ahead)


def _joined(behind: Curve, ahead: Curve) -> Curve:
    """One branch from two that begin at the same motion, the first of them passed backwards."""
    length = behind.points[-1].length

    def backwards(point: Point) -> Point:
        return replace(turned_around(point), length=length - point.length)

    def onwards(point: Point) -> Point:
        return replace(point, length=length + point.length)

    points = [*map(backwards, reversed(behind.points[1:])), *map(onwards, ahead.points)]
    events = [replace(event, point=backwards(event.point)) for event in reversed(behind.events)]
    events += [replace(event, point=onwards(event.point)) for event in ahead.events]
    unlocated = [replace(step, before=step.after, after=step.before) for step in reversed(behind.unlocated)]
    note = behind.note or ahead.note
    return Curve(ahead.cycles, tuple(points), tuple(events), note, unlocated=(*unlocated, *ahead.unlocated))


def _branches_off(followers: Followers, known: Curve, curves: Sequence[Curve], work: Work) -> list[Curve]:
    """The branches that leave one of some known ones where its period doubles or its symmetry breaks."""
    further = list[Curve]()
    reached = list[tuple[str, float]]()
    same = _SAME_EVENT * float(np.ptp(followers.ends))
    events = [event for event in known.events if event.kind in (DOUBLING, BREAKING) and not event.is_collision]
    for i, event in enumerate(events):
        part = work.part(i, len(events))
        if event.point.w is known.points[-1].w or event.point.w is known.points[0].w:
            if not known.origin:
                further += _branch_joined(followers, known, event, [*curves, *further], part.beside(further))
            continue
        # which branches leave here, and have not been reached from their other end
        follower = followers.of.get(known.cycles * (2 if event.kind == DOUBLING else 1))
        is_reached = any(kind == event.kind and abs(event.point.parameter - end) < same for kind, end in reached)
        is_left = event.kind == BREAKING and known.origin == BREAKING  # the symmetric branch at the other end
        if is_reached or is_left or follower is None:
            continue
        # each of them
        leaving = _leaving(follower, event, followers.ends)
        for j, first in enumerate(leaving):
            if _is_known(follower, event, first, [*curves, *further]):
                continue
            home = None if half_curve(follower, event.point.parameter) is None else Home(follower, known.events)
            origin = shared_with(follower, event, first)
            own = part.part(j, len(leaving)).beside(further)
            branch = followed(follower, first, followers.ends, home=home, origin=origin, work=own)
            further.append(branch)
            if branch.events and branch.events[-1].kind == event.kind:
                reached.append((event.kind, branch.events[-1].point.parameter))
    return further


def _branch_joined(
    followers: Followers, known: Curve, joint: Event, curves: Sequence[Curve], work: Work
) -> list[Curve]:
    """The branch that another one joins at its end, if it is not known: of half its periods, or symmetric."""
    point = joint.point
    own = followers.of[known.cycles]
    follower = own if joint.kind == BREAKING else followers.of.get(known.cycles // 2)
    halves = half_curve(own, point.parameter)
    if halves is None or follower is None:
        return []
    along = np.append(np.zeros(len(point.state)), 1.0)
    for side in (-_BESIDE_JOINT, _BESIDE_JOINT):
        with suppress(ConvergenceError):
            first = halves.near(point.w + side * along, along, replace(point, later=None))
            if followers.ends[0] <= first.parameter <= followers.ends[1]:
                if _is_known(follower, joint, first, curves):
                    return []
                return [_both_ways(follower, first.motion.start, first.parameter, followers.ends, work)]
    return []


def doublings_left(curves: Sequence[Curve], cycles: int, shown: Callable[[float], str]) -> list[str]:
    """Return what the user must know of period doublings from which no branch is followed."""
    doublings = [
        event.point.parameter
        for known in curves
        for event in known.events
        if known.cycles > cycles and event.kind == DOUBLING and event.point is not known.points[-1]
    ]
    if not doublings:
        return []
    return [f"What leaves at {_counted(doublings, DOUBLING, ' of branches of doubled period', shown)} is not followed."]


def branches_missed(
    curves: Sequence[Curve], cycles: int, ends: tuple[float, float], shown: Callable[[float], str]
) -> list[str]:
    """Return what the user must know of events from which fewer branches are followed than leave there.

    Beside the ends of the range branches may leave it at once.
    """
    same = _SAME_EVENT * float(np.ptp(ends))
    notes = list[str]()
    for kind, leaving in ((DOUBLING, 1), (BREAKING, 2)):
        joints = np.array([value for known in curves for value in _joints(known, kind)])
        left = [known for known in curves if known.cycles <= cycles and not known.origin == kind == BREAKING]
        events = [event for known in left for event in known.events if event.kind == kind and not event.is_collision]
        at_ends = [point.w for known in left for point in (known.points[0], known.points[-1])]
        values = [e.point.parameter for e in events if not any(e.point.w is w for w in at_ends)]
        values = [value for value in values if min(abs(value - end) for end in ends) > same]
        nearby = [(np.abs(np.array(values) - value) < same).sum() for value in values]
        pairs = zip(values, nearby, strict=True)
        missed = [value for value, number in pairs if (np.abs(joints - value) < same).sum() < leaving * number]
        if missed:
            notes.append(f"Not everything that leaves at {_counted(missed, kind, '', shown)} is followed.")
    return notes


def _joints(known: Curve, kind: str) -> list[float]:
    """The parameters at which a branch leaves or joins another one in an event of a kind."""
    joints = [known.points[0].parameter] if known.origin == kind else []
    ends = [end for end in (0, -1) if known.happens_at(end) and known.events[end].kind == kind]
    return joints + [known.events[end].point.parameter for end in ends]


def _counted(values: Sequence[float], kind: str, of: str, shown: Callable[[float], str]) -> str:
    """Words for events of a kind, what they are of, and the first of their parameter values."""
    first = ", ".join(shown(value) for value in values[:_MOST_NAMED])
    more = f" and {len(values) - _MOST_NAMED} more" if len(values) > _MOST_NAMED else ""
    return f"{counted(len(values), kind)}{of} ({first}{more})"


def _is_known(follower: Continuation, event: Event, first: Point, curves: Sequence[Curve]) -> bool:
    """Whether a motion lies on a known branch, wherever it begins, or repeats after half its periods already."""
    scale = first.scale
    size = max(first.size, float(np.linalg.norm(first.state * scale)))
    away = first.size * float(np.linalg.norm(first.w[:-1] - event.point.w[:-1]))
    least = min(_SAME * size, _SAME_BESIDE * away)
    once = PeriodMap(follower.family.map_at(first.parameter).system)
    state = first.motion.start
    states = [first.state]
    for _ in range(follower.cycles - 1):
        state = once.later(state)
        states.append(state.y)
    if follower.cycles % 2 == 0 and np.linalg.norm((states[follower.cycles // 2] - states[0]) * scale) < least:
        return True
    alike = [curve for curve in curves if curve.cycles == follower.cycles]
    points = [point for one in alike for _, point in one.motions_at(follower, first.parameter)]
    return any(np.linalg.norm((p.state - state) * scale) < least for p in points for state in states)


def _leaving(curve: Continuation, event: Event, ends: tuple[float, float]) -> list[Point]:
    """First points of the branches that leave at an event: one where the period doubles, two otherwise.

    They lie inside the range. Of a symmetric driveline the second one is the mirror image of the first.
    """
    values, vectors = np.linalg.eig(event.point.gradient)
    multiplier, signs = (-1.0, (1.0,)) if event.kind == DOUBLING else (1.0, (1.0, -1.0))
    vector = vectors[:, np.argmin(np.abs(values - multiplier))].real
    points = []
    for sign in signs:
        first = _first_along(curve, event, ends, sign * vector / np.linalg.norm(vector))
        if first is not None:
            points.append(first)
        if first is not None and event.kind == BREAKING:
            with suppress(ConvergenceError):
                if (image := _mirror_image(curve, event, first)) is not None:
                    return [first, image]
    return points


def _first_along(curve: Continuation, event: Event, ends: tuple[float, float], direction: Array) -> Point | None:
    """The first point of the branch that leaves at an event in a direction; None: none lies inside the range.

    Newton's method may also find a motion of a branch that has nothing to do with the event, or one beyond a fold. So
    the motion at half the distance, and the tangents of both, must lie on the same curve from the event on.
    """
    for distance in _DISTANCES:
        point, nearer = (_motion_beside(curve, event, direction, share * distance) for share in (1.0, 0.5))
        if point is None or nearer is None:
            continue
        if not ends[0] <= point.parameter <= ends[1]:
            if distance <= SAME:  # in the range they are the same as those of the event
                return None
            continue
        if _is_one_curve(event, direction, distance, nearer, point):
            return point
    return None


def _mirror_image(curve: Continuation, event: Event, first: Point) -> Point | None:
    """The mirror image of a motion near one of an event, half of its length later; None: there is none."""
    halves = half_period_map(curve.family.map_at(first.parameter).system, curve.cycles)
    if halves is None:
        return None
    image = halves(first.motion.start).end
    w = np.append(image.y * first.scale / first.size, first.w[-1])
    away = (w - event.point.w) / np.linalg.norm(w - event.point.w)
    return curve.near(w, away, replace(event.point, tangent=away))


def _is_one_curve(event: Event, direction: Array, distance: float, nearer: Point, point: Point) -> bool:
    """Whether two motions near one of an event lie on a smooth curve from there that does not turn back.

    Along the distance the parameter is a cubic, of which both motions give the value and the slope, one number more
    than it has. Where the period doubles the curve begins at a right angle to the parameter.
    """
    along = [float(one.tangent[:-1] @ direction) for one in (nearer, point)]
    if min(map(abs, along)) < _ALONG:
        return False
    half, whole = (float(one.w[-1] - event.point.w[-1]) for one in (nearer, point))
    slope_half, slope = (
        distance * float(one.tangent[-1]) / part for one, part in zip((nearer, point), along, strict=True)
    )
    size = max(abs(half), abs(whole), abs(slope_half), abs(slope))
    if size < _FLAT:
        return True
    linear, square, cube = np.linalg.solve([[1.0, 1.0, 1.0], [1.0, 2.0, 3.0], [0.5, 0.25, 0.125]], [whole, slope, half])
    defects = [linear + square + 0.75 * cube - slope_half, linear if event.kind == DOUBLING else 0.0]
    if max(map(abs, defects)) > max(_DEFECT * size, _FLAT):
        return False
    turns = np.roots([3.0 * cube, 2.0 * square, linear])
    return not np.any((np.abs(turns.imag) == 0.0) & (turns.real > _TURNS_FROM) & (turns.real <= 1.0))


def _motion_beside(curve: Continuation, event: Event, direction: Array, distance: float) -> Point | None:
    """The motion near one of an event, at a distance; None if none is found whose state is about so far away."""
    try:
        point = curve.beside(event.point, direction, distance)
    except ConvergenceError:
        return None
    return point if np.linalg.norm(point.w[:-1] - event.point.w[:-1]) < _FARTHEST * distance else None
