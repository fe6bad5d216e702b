"""Where a run leaves a motion that has ended in a fold.

A run was on the motion that ends at a fold if over the last periods before it the distance between both is at most half
of that from this motion to any other one. The distance is that of peak-to-peak deflections, each over the largest of
the motions that are stable at the fold, the root of the sum of squares over the clearances. The jump is where the run
becomes nearer to a stable motion that goes on, at the speed of the run, than to the motion which has ended, at its
fold; with one clearance, where it passes the middle between both.

Windows as long as the motions slide over the parts of a run. Where the swing grows by the jump a window notices it with
its last part; where the swing shrinks, when the last large part leaves it at its begin. The middle of that part is the
instant.

Takes a Branch and a run in parts of a period; gives Jumps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from math import lcm

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from gearrattle.assembly import assemble, period_of
from gearrattle.engine.periodic.events import FOLD
from gearrattle.orbits.followed import Followed
from gearrattle.orbits.stable_ranges import courses_of

Array = NDArray[np.float64]

_SAME = 1e-6  # of a fold's value and of the swings there: motions that differ by less are copies
_ROUNDING = 1e-13  # of a value: a smaller step does not turn back
_WINDOWS = 2  # so many in a row before a fold must lie near the motion that ends there
_NEAR = 0.5  # of the distance to another motion: a run that is farther away is not on a motion
_TINY = 1e-9  # of the largest scale: a swing below it is rounding
_NONE_KNOWN = "no other stable motion is known at the fold"
_NOT_ON = "the run was not clearly on the motion that ends there"
_NOT_YET = "the run ends before it jumps"
_ELSEWHERE = "the run leaves for no stable motion that is known"


@dataclass(frozen=True)
class Jump:
    """A fold that a run passes.

    Attributes
    ----------
    upward
        whether the speed grows.
    fold
        value at the fold [SI].
    value
        value at which the run jumps [SI]; NaN where it does not.
    delay
        the speed that the run passes in between, never negative [rad/s].
    periods
        the number of periods T in between.
    clearance
        whose deflection tells the two motions apart most.
    words
        why there is no jump; empty where there is one.
    """

    upward: bool
    fold: float
    value: float
    delay: float
    periods: float
    clearance: str
    words: str = ""


@dataclass(frozen=True)
class BranchPart:
    """A part of a branch of one stability over which its value grows.

    Attributes
    ----------
    is_stable
        whether its motions are.
    line
        a number: parts of one line follow each other with no fold in between.
    cycles
        periods T after which its motions repeat.
    value
        (N,) growing [SI].
    peak_to_peak
        (N, K) deflections of the K clearances [rad or m].
    folds
        its ends that are folds.
    """

    is_stable: bool
    line: int
    cycles: int
    value: Array
    peak_to_peak: Array
    folds: tuple[float, ...]

    def at(self, value: float | Array) -> Array:
        """(..., K) peak-to-peak deflections at values; those of the end beyond it."""
        swings: Array = np.stack([np.interp(value, self.value, column) for column in self.peak_to_peak.T], axis=-1)
        return swings

    def reaches(self, value: float) -> bool:
        """Whether there is a motion at a value; ends but for rounding included."""
        rounding = _SAME * abs(value)
        return bool(self.value[0] - rounding <= value <= self.value[-1] + rounding)


@dataclass(frozen=True)
class RunParts:
    """A run in parts of a period.

    Attributes
    ----------
    upward
        whether the speed grows.
    first_value, first_swing
        of the motion on which it begins: value [SI], (K,) peak-to-peak deflections [rad or m].
    per_period
        parts of a period T.
    value
        (Q,) in the middle of every part [SI].
    highest, lowest
        (Q, K) deflections in every part [rad or m].
    """

    upward: bool
    first_value: float
    first_swing: Array
    per_period: int
    value: Array
    highest: Array
    lowest: Array

    def width(self, periods: int) -> int:
        """Parts in a window of so many periods; all of them where the run is shorter."""
        return min(len(self.value), periods * self.per_period)

    def swings(self, periods: int) -> Array:
        """(Q - W + 1, K) peak-to-peak deflection of every window of W parts."""
        return self.largest(self.highest, periods) + self.largest(-self.lowest, periods)

    def largest(self, levels: Array, periods: int) -> Array:
        """(Q - W + 1, K) largest of (Q, K) levels in every window of W parts."""
        if not len(levels):
            return levels
        largest: Array = np.max(sliding_window_view(levels, self.width(periods), axis=0), axis=-1)
        return largest

    def passed(self, fold: float) -> NDArray[np.bool_]:
        """(Q,) whether the middle of a part lies beyond a fold."""
        return self.value > fold if self.upward else self.value < fold


@dataclass(frozen=True)
class _Ending:
    """A fold at which a motion ends, and the other motions.

    Attributes
    ----------
    fold
        its value [SI].
    own, whole
        the motion that ends, and its line, unstable parts included.
    rivals, others
        motions with other swings, stable or not; the stable ones of them.
    scale
        (K,) by which swings of the clearances compare [rad or m].
    """

    fold: float
    own: BranchPart
    whole: BranchPart
    rivals: tuple[BranchPart, ...]
    others: tuple[BranchPart, ...]
    scale: Array

    @property
    def swing(self) -> Array:
        """(K,) peak-to-peak deflections of the motion at its fold."""
        return self.own.at(self.fold)

    @property
    def at_fold(self) -> tuple[BranchPart, ...]:
        """The other stable motions that are known at the fold."""
        return tuple(one for one in self.others if one.reaches(self.fold))

    def distance(self, one: Array, other: Array) -> Array:
        """Distance between (..., K) swings."""
        distance: Array = np.sqrt(np.sum(((one - other) / self.scale) ** 2, axis=-1))
        return distance

    def decisive(self, other: Array) -> int:
        """The clearance whose swing differs most, relatively, between the ended motion and one with (K,) swings."""
        larger = np.maximum(np.maximum(self.swing, other), _TINY * self.scale)
        return int(np.argmax(np.abs(other - self.swing) / larger))

    def nearest(self) -> BranchPart:
        """The other stable motion that is nearest to the ended one, at the fold."""
        return min(self.at_fold, key=lambda one: float(self.distance(one.at(self.fold), self.swing)))


def speed_of(branch: Followed, value: float) -> float:
    """The speed at a value [rad/s]."""
    return branch.model.with_({branch.path: value}).excitation.omega


def branch_parts(branch: Followed) -> Sequence[BranchPart]:
    """The parts of all branches of one stability, ends at events included."""
    swings, event_swings = branch.data["peak_to_peak"].values, branch.event_levels[:, 1] - branch.event_levels[:, 0]
    motions, first_line = list[BranchPart](), 0
    for course, curve in zip(courses_of(branch), branch.curves, strict=True):
        lines = first_line + _turns(course.value)
        first_line = int(lines[-1]) + 1 if course.stable else first_line
        steps = enumerate(zip(course.stable, lines.tolist(), strict=True))
        for (is_stable, line), group in groupby(steps, key=lambda step: step[1]):
            numbers = [number for number, _ in group]
            part = slice(numbers[0], numbers[-1] + 2)
            value, nodes = course.value[part], course.nodes[part]
            swing = np.array([swings[i] if e < 0 else event_swings[e] for i, e in nodes])
            order = np.argsort(value, kind="stable")
            folds = tuple(float(value[i]) for i in (0, -1) if course.kinds[part][i] == FOLD)
            motions.append(BranchPart(is_stable, line, curve.cycles, value[order], swing[order], folds))
    return motions


def _turns(value: Array) -> NDArray[np.int64]:
    """(N - 1,) how often (N,) values have turned back before each of their steps."""
    steps = np.diff(value)
    signs = np.sign(np.where(np.abs(steps) <= _ROUNDING * np.abs(value[1:]), 0.0, steps))
    moved = np.maximum.accumulate(np.where(signs != 0.0, np.arange(len(signs)), 0))
    filled = signs[moved]
    return np.concatenate([[0], np.cumsum(filled[1:] * filled[:-1] < 0.0)])[: len(steps)]


def jumps_of(branch: Followed, run: RunParts, motions: Sequence[BranchPart], rate: float) -> list[Jump]:
    """The folds that a run passes, in its order; folds of copies of a motion once."""
    ended = [
        (fold, own)
        for own in motions
        if own.is_stable
        for fold in own.folds
        if fold == (own.value[-1] if run.upward else own.value[0])
    ]
    endings: list[_Ending] = []
    for fold, own in sorted(ended, key=lambda pair: pair[0], reverse=not run.upward):
        if not any(_is_copy(own, ending.own, ending.fold) for ending in endings):
            endings.append(_ending(fold, own, motions))
    return [_jump(branch, run, ending, rate) for ending in endings]


def _is_copy(one: BranchPart, own: BranchPart, fold: float) -> bool:
    """Whether motions have the same swings at the fold of one of them."""
    swing = own.at(fold)
    return one.reaches(fold) and bool(np.allclose(one.at(fold), swing, rtol=_SAME, atol=_TINY * float(swing.max())))


def _ending(fold: float, own: BranchPart, motions: Sequence[BranchPart]) -> _Ending:
    """A fold with the other motions; copies of the ended one, and the unstable one that ends with it, are left out."""
    line = sorted((one for one in motions if one.line == own.line), key=lambda one: float(one.value[0]))
    value = np.concatenate([one.value for one in line])
    whole = replace(own, value=value, peak_to_peak=np.concatenate([one.peak_to_peak for one in line]))
    rivals = tuple(one for one in motions if one.line != own.line and not _is_copy(one, own, fold))
    others = tuple(one for one in rivals if one.is_stable)
    swings = [own.at(fold), *(one.at(fold) for one in others if one.reaches(fold))]
    scale = np.max(swings, axis=0)
    return _Ending(
        fold, own, whole, rivals, others, np.maximum(scale, max(_TINY * float(scale.max()), np.finfo(float).tiny))
    )


def _jump(branch: Followed, run: RunParts, ending: _Ending, rate: float) -> Jump:
    """Where a run jumps after a fold."""
    fold, names = ending.fold, assemble(branch.model).layout.clearance_names

    def without(words: str, clearance: str = "") -> Jump:
        return Jump(run.upward, fold, np.nan, np.nan, np.nan, clearance, words)

    if not ending.at_fold:
        return without(_NONE_KNOWN)
    neighbour = ending.nearest()
    apart_most = names[ending.decisive(neighbour.at(fold))]
    if not _was_on(run, ending):
        return without(_NOT_ON, apart_most)
    crossings = [(value, other) for other in ending.others if (value := _crossing(run, ending, other)) is not None]
    if not crossings:
        return without(_ELSEWHERE if _has_left(run, ending, neighbour) else _NOT_YET, apart_most)
    value, other = (min if run.upward else max)(crossings, key=lambda pair: pair[0])
    speeds = speed_of(branch, value), speed_of(branch, fold)
    delay = speeds[0] - speeds[1] if run.upward else speeds[1] - speeds[0]
    turns = period_of(branch.model).period * branch.model.excitation.omega
    periods = delay / rate * 0.5 * (speeds[0] + speeds[1]) / turns
    return Jump(run.upward, fold, value, delay, periods, names[ending.decisive(other.at(value))])


def _was_on(run: RunParts, ending: _Ending) -> bool:
    """Whether before a fold a run was on the motion that ends there."""
    before = int(np.argmax(np.append(run.passed(ending.fold), True)))
    approach = replace(run, value=run.value[:before], highest=run.highest[:before], lowest=run.lowest[:before])
    value = float(approach.value[-1]) if before else run.first_value
    known = [one for one in ending.rivals if one.reaches(value) or one.reaches(ending.fold)]
    return all(_is_nearer(approach, ending, rival) for rival in known)


def _is_nearer(approach: RunParts, ending: _Ending, rival: BranchPart) -> bool:
    """Whether a run, at its end, is far nearer to the motion that ends than that is to another one."""
    if not len(approach.value):
        value = np.array([approach.first_value])
        run, own, other = approach.first_swing, ending.whole.at(value), rival.at(value)
    else:
        periods = lcm(ending.own.cycles, rival.cycles)
        value, run, own, other = (
            levels[:: -approach.width(periods)][:_WINDOWS]
            for levels in (
                approach.value,
                approach.swings(periods),
                approach.largest(ending.whole.at(approach.value), periods),
                approach.largest(rival.at(approach.value), periods),
            )
        )
        value = value[: len(run)]
    is_near = ending.distance(run, own) <= _NEAR * ending.distance(own, other)
    is_before_own = (value < ending.own.value[0]) | (value > ending.own.value[-1])
    return bool(is_near[0] and np.all(is_near | is_before_own))


def _crossing(run: RunParts, ending: _Ending, other: BranchPart) -> float | None:
    """Value at which, beyond the fold, a run becomes nearer to another motion than to the ended one; None: nowhere."""
    swings = run.swings(lcm(ending.own.cycles, other.cycles))
    following = other.at(ending.fold)
    clearance = ending.decisive(following)
    grows = following[clearance] > ending.swing[clearance]
    part = slice(len(run.value) - len(swings), None) if grows else slice(0, len(swings))
    value, passed = run.value[part], run.passed(ending.fold)[part]
    nearer = ending.distance(swings, ending.swing) ** 2 - ending.distance(swings, other.at(value)) ** 2
    nearer /= np.maximum(ending.distance(other.at(value), ending.swing), _TINY)
    goes_on = (other.value[0] <= value) & (value <= other.value[-1])
    crossed = np.flatnonzero(passed & goes_on & (nearer > 0.0))
    if not crossed.size:
        return None
    k = int(crossed[0])
    share = nearer[k - 1] / (nearer[k - 1] - nearer[k]) if k and nearer[k - 1] < 0.0 else 1.0
    crossing = float(value[k] + (share - 1.0) * (value[k] - value[max(k - 1, 0)]))
    return max(crossing, ending.fold) if run.upward else min(crossing, ending.fold)


def _has_left(run: RunParts, ending: _Ending, neighbour: BranchPart) -> bool:
    """Whether at its end a run is no longer near the ended motion."""
    away = ending.distance(run.swings(ending.own.cycles)[-1:], ending.swing)
    return bool(np.any(away > _NEAR * ending.distance(neighbour.at(ending.fold), ending.swing)))
