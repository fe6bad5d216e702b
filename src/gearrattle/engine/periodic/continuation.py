"""Continuation: periodic motions followed over a parameter, through folds, by pseudo-arclength.

A branch is a curve in w = (u, p / unit): u the balanced state at the start of a period over the size, p the parameter.

    F(w) = P(u; p) - u = 0,      t . (w - w_predicted) = 0,      [dF/du, dF/dp] t = 0,  |t| = 1

dF/du = M - I is exact, and so is dF/dp for drivelines of laws and harmonics (``families``). Newton's method solves
both. Where a turning point of a deflection comes to its corner within a step the branch is first followed to the motion
that grazes (``turning_points``), and from there on: the tangents of motions that touch vary like the root of the
distance.

A step is taken if Newton's method converges, the tangent turns little, and the chord between both points is the mean of
their tangents: a nearby branch has another direction. The two legs of a sharp fold have the same direction. So the
determinant of [dF/du, dF/dp; t] is watched too: along a branch it keeps its sign until another branch crosses, where it
passes zero. A step on which it jumps from one sign to the other is not taken. A fold may be so sharp that it seems to
pass zero there: so over the shortest steps it may change its sign only if the branch has no corner to turn back at.

H. B. Keller, in Applications of Bifurcation Theory, ed. P. H. Rabinowitz, Academic Press 1977, 359-384.
"""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.periodic.equations import Bordered
from gearrattle.engine.periodic.families import Family
from gearrattle.engine.periodic.motion import State, Touch
from gearrattle.engine.periodic.newton import Corrector, norm_of
from gearrattle.engine.periodic.point import (
    Guess,
    Point,
    appended,
    halves_apart,
    interpolated,
    turned_around,
)
from gearrattle.engine.periodic.turning_points import (
    agreeing_step,
    first_step_beyond,
    grazing_ahead,
    landed,
    rise_beyond,
)
from gearrattle.errors import ConvergenceError

Array = NDArray[np.float64]

_EASY = 3  # iterations: a step that needs no more may grow
_TURN = 0.9  # least cosine between the tangents at both ends of a step
_DEFECT = 0.08  # largest difference between a chord and the mean of both tangents
_BISECTIONS = 7  # after which a determinant that passes zero has fallen below a share of what it was
_LEFT = 0.1  # that share
_KINK = 1e-6  # a step shorter than this may turn by any angle: the branch has a corner there
_SHORTEST = 1e-10  # step
_CORNER = 1e-10  # from a grazing: a motion nearer to it that touches may have any tangent
_NEARER = 0.9  # of the way to a grazing that is too far: the step from motions that touch
_HALF = 0.5  # the same, from others
_OVERSHOOT = 1.5  # steps: a grazing farther away is another one
_RISE = 4.0  # times what it is at a grazing: slope of the depth at the end of the first step beyond, at most
_AFTER_TOUCH = 16.0  # steps before a grazing: the next try where motions no longer touch
_AHEAD = tuple(10.0**power for power in range(-9, -3))  # beyond a corner of the branch
_NEAR_CORNER = 10.0  # steps: a point farther from a corner lies elsewhere
_GROWTH = 4.0  # of a step after one that was easy, at most
_LEAST_GROWTH = 1.6  # of a step after one that was easy and shorter than a kink
_SAFE = 0.9  # of the step up to which depths agree: the next one
_LEAST_SHARE = 0.1  # of a step that was not taken: the next try, at least
_FIRST = 0.1  # of the longest step
_SHARE = 0.5  # of the norm of a state: counts as its unit if that is less
_SAME_HALVES = 1e-9  # of the length of a motion: halves that are no farther apart are the same
_JOINED = 1e-3  # of how far they were apart, the same
_CLOSED = 1e-3  # of the longest step: a branch that passes its first point nearer than this is closed
_SHORTER = 0.2  # of a step: the shorter steps by which it is checked
_MOST_SHORTER = 100  # how many they are, at most
_DETOUR = 3.0  # of the step: their way, at most
_SAME = 1e-2  # of a step: shorter steps that pass its end nearer than this lead there


class WrongBranch(ConvergenceError):
    """A step has gone from one branch to another.

    distance: length of the step.
    """

    def __init__(self, message: str, distance: float) -> None:
        super().__init__(message, remedy="another start, or another range")
        self.distance = distance


class Continuation:
    """Follows branches of periodic motions.

    longest: longest step, in units of w; where a state is more than twice its unit, the share of half the state.
    step_limit: largest change of the parameter in a step [its own unit]; None: only ``longest`` limits steps.
    units: scale (N,) and size of the states, as in a Point; None: those of the family.
    """

    def __init__(
        self,
        family: Family,
        *,
        longest: float = 0.05,
        step_limit: float | None = None,
        units: tuple[Array, float] | None = None,
    ) -> None:
        self.family = family
        self._longest = longest
        self._step_limit = np.inf if step_limit is None else step_limit / family.unit
        self._units = (family.scale, family.size) if units is None else units
        self._corrector = Corrector(family, self._units)
        self._first = _FIRST * longest
        self._refused: Point | None = None  # a grazing ahead, too far for one step

    @property
    def cycles(self) -> int:
        """Periods after which its motions repeat."""
        return self.family.cycles

    def begin(self, state: State, parameter: float, *, upward: bool = True) -> Point:
        """Return the first point of a branch that goes on to larger or to smaller parameters.

        ConvergenceError: there is no periodic motion near the state.
        """
        w = np.append(state.y * self._corrector.scale, parameter / self.family.unit)
        direction = np.append(np.zeros(w.size - 1), 1.0 if upward else -1.0)
        guess = Guess(w, state.auxiliary_pieces)
        point = self._corrector.point(guess, direction, direction, with_turns=True)
        is_backward = (point.tangent[-1] > 0.0) != upward
        return replace(turned_around(point) if is_backward else point, parameter=parameter)

    def follow(self, begin: Point, lowest: float, highest: float) -> Iterator[Point]:
        """Yield the points of a branch after its first one, the last of them at an end of the range of the parameter.

        A closed branch ends with its first point again. The first step of one that leaves another branch is no longer
        than the way from there.
        """
        earlier = begin
        point = begin
        step = self._first
        if begin.length > 0.0:
            step = min(step, begin.length)
        self._refused = None
        while True:
            last = self._last(point, step, lowest, highest)
            if last is not None:
                yield last
                return
            following, next_step = self._next(earlier, point, step)
            if not lowest <= following.parameter <= highest:
                end = lowest if following.parameter < lowest else highest
                distance = float(np.linalg.norm(following.w - point.w))
                if point.parameter != end:
                    yield self.at_parameter(point, following, end)
                elif (point.tangent[-1] > 0.0) == (end == lowest) and distance > _SHORTEST:
                    step = _LEAST_SHARE * distance  # it turns back within the step
                    continue
                return
            step = next_step
            if self._closes(begin, point, following):
                yield replace(begin, length=point.length + float(np.linalg.norm(begin.w - point.w)))
                return
            yield following
            earlier = point
            point = following

    def with_shorter_steps(self, before: Point, after: Point) -> list[Point]:
        """Return the points of a branch from one of its points to the next, the last included, with shorter steps.

        Where these would be shorter than the shortest step there is no other point.

        WrongBranch: they do not lead there.
        """
        distance = after.length - before.length
        if _SHORTER * distance <= _SHORTEST:
            return [after]
        shorter = Continuation(self.family, longest=_SHORTER * distance, units=self._units)
        earlier = before
        point = before
        step = _SHORTER * distance
        points = list[Point]()
        while len(points) < _MOST_SHORTER and point.length - before.length < _DETOUR * distance:
            try:
                following, step = shorter._next(earlier, point, step)
            except ConvergenceError:
                break
            if shorter._passes(after, point, following, _SAME * distance):
                way = point.length - before.length + float(np.linalg.norm(after.w - point.w))
                share = distance / way  # several chords are longer than one
                return [*(replace(p, length=before.length + share * (p.length - before.length)) for p in points), after]
            points.append(following)
            earlier = point
            point = following
        shown = self.family.shown
        message = f"shorter steps do not lead from {shown(before.parameter)} to {shown(after.parameter)}"
        raise WrongBranch(message, distance)

    def between(self, before: Point, after: Point, share: float) -> Point:
        """Return the point at a share of the way between two points that follow one another."""
        if share <= 0.0 or share >= 1.0:
            return before if share <= 0.0 else after
        chord = (after.w - before.w) / np.linalg.norm(after.w - before.w)
        predicted = before.guess(interpolated(before, after, share))
        point = self._corrector.point(predicted, chord, before.tangent, with_turns=True)
        length = before.length + share * (after.length - before.length)
        return self.on_the_way(before, replace(point, length=length), after)

    def on_the_way(self, before: Point, point: Point, after: Point) -> Point:
        """Return a point between two others with its tangent along the way, which theirs do not determine near a fold.

        Orientations keep their sign, but between the two places where another branch leaves this one and joins it.
        """
        own = before.orientation
        if not own * after.orientation > 0.0 > own * point.orientation:
            return point
        is_along = min(float(point.tangent @ end.tangent) for end in (before, after)) > _TURN
        return point if is_along and self._keeps_way(before, point) else turned_around(point)

    def moved_along(self, point: Point, step: float) -> Point:
        """Return the point a short step along the branch [arclength], backwards if it is negative."""
        return self.near(point.w + step * point.tangent, point.tangent, point)

    def of(self, family: Family) -> Continuation:
        """Return a Continuation of another family, in the units of this one."""
        return Continuation(family, longest=self._longest, units=self._units)

    def beginning_with(self, step: float) -> Continuation:
        """Return the same with another length of the first step."""
        other = copy(self)
        other._first = step
        return other

    def in_plane(self, point: Point) -> Point:
        """Return the motion in the plane through a point (also of another driveline) at right angles to its tangent."""
        return self.near(point.w, point.tangent, point)

    def near(
        self, predicted: Array, normal: Array, like: Point, *, slack: float = 0.0, touch: Touch | None = None
    ) -> Point:
        """Return the motion in the plane through a prediction at right angles to a direction.

        predicted, normal: (N + 1,).
        slack: change of w at which Newton's method may end; the motion is then the last one followed.
        """
        return self._corrector.point(like.guess(predicted), normal, like.tangent, slack=slack, touch=touch)

    def beside(self, point: Point, direction: Array, distance: float) -> Point:
        """Return a point of another branch through a point, in a direction (N,) of balanced states, at a distance [w].

        ConvergenceError: there is none at that distance.
        """
        normal = np.append(direction / np.linalg.norm(direction), 0.0)
        return self._corrector.point(point.guess(point.w + distance * normal), normal, normal)

    def at_parameter(self, before: Point, after: Point, parameter: float) -> Point:
        """Return the point between two others at a parameter."""
        target = parameter / self.family.unit
        if after.w[-1] == before.w[-1]:
            raise ConvergenceError("the branch does not pass the parameter there")
        share = (target - before.w[-1]) / (after.w[-1] - before.w[-1])
        predicted = interpolated(before, after, share)
        predicted[-1] = target
        normal = np.append(np.zeros(predicted.size - 1), 1.0)
        point = self._corrector.point(before.guess(predicted), normal, before.tangent, with_turns=True)
        return replace(point, parameter=parameter, length=before.length + share * (after.length - before.length))

    def _next(self, earlier: Point, point: Point, step: float) -> tuple[Point, float]:
        """The point that follows two consecutive points, and the step to try next."""
        slope = abs(float(point.tangent[-1]))
        own_longest = self._longest * max(1.0, _SHARE * norm_of(point.w[:-1]))
        longest = min(own_longest, 0.95 * self._step_limit / max(slope, 1e-300))
        grazing, step = self._grazing_within(point, min(step, longest))
        if grazing is not None:
            return grazing, step
        if point.touch is not None:
            step = min(self._first_step(earlier, point, step), longest)
            earlier = point
        is_first = True
        crossing = None
        while step > _SHORTEST:
            try:
                predicted = point.guess(_predicted(earlier, point, step))
                following = self._corrector.point(
                    predicted, point.tangent, point.tangent, is_near=True, with_turns=True
                )
            except ConvergenceError:
                step = 0.4 * step
                is_first = False
                continue
            is_short = step < _KINK
            agreeing = agreeing_step(point, following)
            if point.touch is not None and not is_short:
                agreeing = min(agreeing, _RISE / rise_beyond(point, following))
            is_smooth = is_short or (_is_straight(point, following) and not self._joins_halves(point, following))
            is_taken = agreeing >= 1.0 and is_smooth and self._is_allowed(point, following)
            if is_taken and is_short and point.orientation * following.orientation < 0.0:  # a corner, or a crossing
                crossing = crossing or (appended(point, following), step)
                is_taken = False
            if is_taken:
                growth = _growth(point, following) if is_first and following.iterations <= _EASY else 1.0
                growth = min(max(growth, _LEAST_GROWTH) if is_short else growth, max(_SAFE * agreeing, 1.0))
                return appended(point, following), min(own_longest, growth * step)
            step = step * (0.5 if agreeing >= 1.0 else max(_SAFE * agreeing, _LEAST_SHARE))
            is_first = False
        try:
            return self._around_corner(point)
        except ConvergenceError:
            if crossing is None:
                raise
            return crossing

    def _grazing_within(self, point: Point, step: float) -> tuple[Point | None, float]:
        """The motion that grazes before a step ends; where there is none, or it is too far, the step to try."""
        refused = self._refused
        self._refused = None
        ahead = grazing_ahead(point)
        if ahead is None or ahead.distance >= step:
            return None, step
        if refused is None or not ahead.is_of(refused):
            refused = landed(self._corrector, point, ahead, _OVERSHOOT * step)
        if refused is None:
            return None, step
        grazing = appended(point, refused)
        distance = grazing.length - point.length
        agreeing = agreeing_step(point, grazing)
        is_straight = distance < _CORNER or _is_straight(point, grazing)
        if agreeing >= 1.0 and is_straight and self._is_allowed(point, grazing):
            return grazing, step
        self._refused = refused
        share = (_NEARER if ahead.touches else _HALF) if agreeing >= 1.0 else max(_SAFE * agreeing, _LEAST_SHARE)
        return None, min(step, share * distance)

    def _first_step(self, earlier: Point, point: Point, step: float) -> float:
        """The step to try from a motion that grazes."""
        if earlier.word != point.word:
            return _AFTER_TOUCH * step
        step = min(step, max(point.length - earlier.length, _KINK))
        return first_step_beyond(self._corrector, point, step, _SHORTEST)

    def _last(self, point: Point, step: float, lowest: float, highest: float) -> Point | None:
        """The point at an end of the range, if it is no more than a step ahead; None if it is not."""
        end = (highest if point.tangent[-1] > 0.0 else lowest) / self.family.unit
        ahead = end - point.w[-1]
        if ahead == 0.0 or abs(ahead) > step * abs(point.tangent[-1]):
            return None
        predicted = point.w + ahead / point.tangent[-1] * point.tangent
        predicted[-1] = end
        normal = np.append(np.zeros(predicted.size - 1), 1.0)
        try:
            last = self._corrector.point(point.guess(predicted), normal, point.tangent, with_turns=True)
        except ConvergenceError:
            return None
        agrees = agreeing_step(point, last) >= 1.0
        if not (agrees and _is_straight(point, last) and self._is_allowed(point, last)):
            return None
        return replace(appended(point, last), parameter=highest if point.tangent[-1] > 0.0 else lowest)

    def _is_allowed(self, point: Point, following: Point) -> bool:
        """Whether a step keeps its limit and its way."""
        return abs(following.w[-1] - point.w[-1]) <= self._step_limit and self._keeps_way(point, following)

    def _joins_halves(self, point: Point, following: Point) -> bool:
        """Whether both halves of a motion become the same over a step: it may lead to a branch of half as many periods.

        Where such a branch is joined smoothly, a step leads past the joint, and halves differ again.
        """
        if self.family.cycles % 2:
            return False
        before = halves_apart(point.motion)
        after = halves_apart(following.motion)
        return after < _SAME_HALVES < before and after < _JOINED * before

    def _around_corner(self, point: Point) -> tuple[Point, float]:
        """The point beyond a corner of the branch, where its motions begin to touch something; and the next step.

        The tangent beyond is that of a motion a little ahead, which touches; the determinant keeps its sign.
        """
        for ahead in _AHEAD:
            try:
                motion, slope = self._corrector.followed(point.guess(point.w + ahead * point.tangent))
            except ConvergenceError:
                continue
            matrix = self._corrector.matrix(motion, slope)
            tangent, _, orientation = Bordered(matrix, point.tangent).null_vector(point.tangent)
            if orientation * point.orientation < 0.0:
                tangent = -tangent
            along = tangent[: len(point.tangent)]
            for step in _AHEAD:
                try:
                    beyond = self._corrector.point(point.guess(point.w).moved(step * tangent), along, along)
                except ConvergenceError:
                    continue
                length = float(np.linalg.norm(beyond.w - point.w))
                if beyond.orientation * point.orientation > 0.0 and length < _NEAR_CORNER * step:
                    return replace(beyond, length=point.length + length), step
        message = f"the branch cannot be followed beyond {self.family.shown(point.parameter)}"
        raise ConvergenceError(message, remedy="another start, or another range")

    def _keeps_way(self, point: Point, following: Point) -> bool:
        """Whether two points lie on one branch, passed in the same direction: see the top of this file."""
        if point.orientation * following.orientation >= 0.0:
            return True
        length = float(np.linalg.norm(following.w - point.w))
        ends = (point, replace(following, length=point.length + length))
        try:
            for _ in range(_BISECTIONS):
                middle = self.between(*ends, 0.5)
                is_behind = middle.orientation * ends[0].orientation > 0.0
                ends = (middle, ends[1]) if is_behind else (ends[0], middle)
        except ConvergenceError:
            return False
        left = abs(ends[0].orientation) + abs(ends[1].orientation)
        is_reversed = float(ends[0].tangent @ ends[1].tangent) < 0.0  # the branch turns back there
        return not is_reversed and left < _LEFT * (abs(point.orientation) + abs(following.orientation))

    def _closes(self, begin: Point, point: Point, following: Point) -> bool:
        """Whether the branch passes its first point between two points."""
        return point.length > 0.0 and self._passes(begin, point, following, _CLOSED * self._longest)

    def _passes(self, target: Point, point: Point, following: Point, nearest: float) -> bool:
        """Whether the branch passes a point between two points, by less than a distance."""
        if float(following.tangent @ target.tangent) < _TURN:
            return False
        chord = following.w - point.w
        share = float(chord @ (target.w - point.w)) / float(chord @ chord)
        if not 0.0 < share <= 1.0:
            return False
        return bool(np.linalg.norm(interpolated(point, following, share) - target.w) < nearest)


def _predicted(earlier: Point, point: Point, step: float) -> Array:
    """(N + 1,) a step from a point: along its tangent, curved like the cubic through the last two points.

    Along free directions tangents are zero, and the cubic's extrapolation would enlarge every shift fivefold a step.
    """
    last = point.length - earlier.length
    along = point.w + step * point.tangent
    if last <= 0.0 or step > 2.0 * last or point.free:
        return np.asarray(along)
    share = (last + step) / last
    cubic = interpolated(earlier, point, share)
    bend = cubic - along
    return np.asarray(along + bend - (bend @ point.tangent) * point.tangent)


def _is_straight(point: Point, following: Point) -> bool:
    """Whether the tangent turns little between two points, and their chord is the mean of both tangents."""
    distance = following.w - point.w
    chord = distance / np.linalg.norm(distance)
    defect = float(np.linalg.norm(chord - 0.5 * (following.tangent + point.tangent)))
    return float(following.tangent @ point.tangent) > _TURN and defect < _DEFECT


def _growth(point: Point, following: Point) -> float:
    """By how much a step may grow: to where the tangent turns by half the angle that it may turn by."""
    turn = max(1.0 - float(point.tangent @ following.tangent), 1e-12)
    return float(np.clip(np.sqrt(0.25 * (1.0 - _TURN) / turn), 1.0, _GROWTH))
