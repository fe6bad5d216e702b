"""Where a run leaves a motion that has ended, or has become unstable.

Events at which motions end are the losses of stability of ``stability``; those from which a stable motion leads on
are left out. A run was on the motion that ends if, at the start of one of the periods before that, its state is nearer
to that motion than to any other one, stable or not, and would settle there, held at this speed. So it
does not matter how far the run lags behind the motion, or how it or the branch is sampled. Beside a fold a run that
lags may have passed the unstable motion already, so periods ever farther before it are tried.

Where a run leaves a motion is found by the shape of its deflections, not by their swing: a motion that folds often goes
on to one with nearly the same swing, and a run that lags has another swing than either. The run and the motions are
compared part by part of a period (``branch_parts``); deflections of a clearance count by the largest swing of the
motions that are stable at the event.

The jump is where the run becomes nearer to another motion, at the speed of the run, than to the motion which has ended:
to what is left of it, unstable, or else to its end. It is the first part in which it is nearer, and from which on it is
nearer over a period: parts in which the motions do not differ tell nothing. On the other motion, where that is stable,
the run must be beyond the event, as it was on the first. Where that one is unstable at the jump, the run settles on it
only later. A run that is nearer to the other motion already when it passes the event has no delay that could be found.

A jump belongs to one event: the last one before it at which a motion ended that the run was on. So a run that is on the
motion again where that is stable beyond the event did not jump there, and neither did one that has gone on to another
motion which ends as well before the jump, or within a period of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from gearrattle.assembly import assemble, period_of
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.periodic.point import Point
from gearrattle.errors import ConvergenceError
from gearrattle.model import Model
from gearrattle.orbits.attractors import Attractor, passes_to_settle
from gearrattle.orbits.branch_parts import BranchPart, DeflectionsAlong
from gearrattle.orbits.orbit import Orbit
from gearrattle.orbits.stability import Loss, losses_of

if TYPE_CHECKING:
    from gearrattle.orbits.branch import Branch

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
_SAME_STATE = 1e-4  # of the units of a motion: states that differ by less are one
_MOST_PASSES = 2000  # of a motion in which a run is held, where another motion of the part needs no more
_SHARES = (0.125, 0.25, 0.5)  # of the width of a part, from the end that the run passes last
_SAME = 1e-6  # of the swings at an event: motions that differ by less are copies
_NEAR = 0.5  # of the distance of two motions: a run is near to one of them, or has left it
_BLOCK = 256  # parts of a run that are compared at once
_TINY = 1e-9  # of the largest scale: a swing below it is rounding
_NONE_KNOWN = "no other stable motion is known there"
NOT_ON = "the run was not on the motion that ends there"
_NOT_YET = "the run ends before it jumps"
_EARLY = "the run is nearer to another motion already where that one ends"
_ELSEWHERE = "the run leaves for no stable motion that is known"
_AGAIN = "the run is still on the motion where that is stable again"
_ANOTHER = "the run goes on to another motion, which ends as well before it jumps"
_LEFT_LATER = frozenset({"", _NOT_YET, _ELSEWHERE})
"""Where there is a jump, or one of these words, the run was on the motion up to its end."""


@dataclass(frozen=True)
class RunParts:
    """A run in parts of a period."""

    upward: bool  # whether the speed grows
    per_period: int  # parts of a period T
    value: Array  # (Q,) in the middle of every part [SI]
    deflection: Array  # (Q, M, K) at M instants of every part, evenly spread from its begin on [rad or m]
    starts: Array  # (P,) at the starts of the periods T, in the order of the run [SI]
    # gives, for a value and a period map, the state at the start of the period in which the value is reached
    state_before: Callable[[float, PeriodMap], State]

    @property
    def grid(self) -> tuple[int, int]:
        """The instants of a period: how many parts it has, and how many instants every part."""
        return self.per_period, self.deflection.shape[1]

    def passed(self, value: float) -> NDArray[np.bool_]:
        """(Q,) whether the middle of a part lies beyond a value."""
        return self.value > value if self.upward else self.value < value


class _Compared(NamedTuple):
    """What a run is compared with at a value."""

    value: float  # of the branch [SI]
    own: Orbit  # the motion of the part
    passes: int  # after which motions have settled in it
    all: tuple[Orbit, ...]  # motions of all branches


def was_on(branch: Branch, run: RunParts, part: BranchPart, beyond: float | None = None) -> bool:
    """Return whether a run was on a motion of a part, beyond a value.

    Motions that settle too slowly are left out, unless all of those that are tried do.
    """
    slowly = list[_Compared]()
    is_slow = True
    for value in _values_tried(run, part, beyond):
        compared = _compared_at(branch, part, value)
        if compared is None:
            continue
        if compared.passes > _MOST_PASSES:
            slowly.append(compared)
        elif _is_on(run, compared):
            return True
        else:
            is_slow = False
    fastest = min(slowly, key=lambda one: one.passes, default=None)
    return is_slow and fastest is not None and _is_on(run, fastest)


def _values_tried(run: RunParts, part: BranchPart, beyond: float | None) -> Iterator[float]:
    """Values in a part beyond a value, at starts of periods if it has any: the last, and each next one twice as far."""
    low = float(part.value[0])
    high = float(part.value[-1])
    if beyond is not None:
        low, high = (max(low, beyond), high) if run.upward else (low, min(high, beyond))
    if low >= high:
        return
    starts = run.starts[(low <= run.starts) & (run.starts <= high)][::-1]
    if not starts.size:
        last, first = (high, low) if run.upward else (low, high)
        yield from (last + share * (first - last) for share in _SHARES)
    for n in range(len(starts).bit_length()):
        yield float(starts[2**n - 1])


def _compared_at(branch: Branch, part: BranchPart, value: float) -> _Compared | None:
    """The motion of a part at a value, and all that are known there; None: Newton's method gives none."""
    lengths = sorted((part.nodes[0].length, part.nodes[-1].length))
    own = list[tuple[Orbit, Point]]()
    orbits = list[Orbit]()
    for number, curve in enumerate(branch.curves):
        for _, point in curve.motions_at(branch.follower(curve), value):
            orbits.append(branch.orbit_at(point, curve.cycles))
            if number == part.branch and lengths[0] <= point.length <= lengths[1]:
                own.append((orbits[-1], point))
    if not own:
        return None
    orbit, point = own[0]
    return _Compared(value, orbit, passes_to_settle(point.multipliers, point.free), tuple(orbits))


def _is_on(run: RunParts, compared: _Compared) -> bool:
    """Whether a run is nearest to a motion, and settles there."""
    motion = Attractor(compared.own)
    state = run.state_before(compared.value, motion.orbit.period_map)
    try:
        if not motion.attracts(state, compared.passes):
            return False
    except ConvergenceError:
        return False
    rivals = [Attractor(other) for other in compared.all if not motion.is_near(other.motion.start, _SAME_STATE)]
    return all(motion.distance(state) < rival.distance(state) for rival in rivals)


@dataclass(frozen=True)
class Jump:
    """An event at which a motion ends, or becomes unstable, and that a run passes.

    Attributes
    ----------
    upward
        whether the speed grows.
    kind
        of the event.
    end
        value at the event [SI].
    value
        value at which the run jumps: it leaves the motion that has ended [SI]; NaN where it does not.
    delay
        the speed that the run passes in between, never negative [rad/s].
    periods
        the number of periods T in between.
    clearance
        in whose deflection the two motions differ most.
    words
        why there is no jump; empty where there is one.
    settles
        value from which on the motion that it leaves for is stable, not before the jump [SI]; NaN without one.
    """

    upward: bool
    kind: str
    end: float
    value: float
    delay: float
    periods: float
    clearance: str
    words: str = ""
    settles: float = np.nan


@dataclass(frozen=True)
class _Ending:
    """A loss of stability, and the other motions."""

    loss: Loss  # where the motion ends
    copies: tuple[BranchPart, ...]  # it and those with the same swings that end there, such as its mirror image
    others: tuple[BranchPart, ...]  # stable motions with other swings
    scale: Array  # (K,) by which swings of the clearances compare [rad or m]

    def decisive(self, other: Array) -> int:
        """The clearance whose swing differs most, relatively, between the ended motion and one with (K,) swings."""
        swing = self.copies[0].at(self.loss.value)
        larger = np.maximum(np.maximum(swing, other), _TINY * self.scale)
        return int(np.argmax(np.abs(other - swing) / larger))

    def nearest(self) -> BranchPart | None:
        """The other stable motion that is nearest to the ended one, at its end; None: none is known there."""
        end = self.loss.value
        swing = self.copies[0].at(end)
        at_end = [one for one in self.others if one.reaches(end)]
        distances = [float(np.sum(((one.at(end) - swing) / self.scale) ** 2)) for one in at_end]
        return at_end[int(np.argmin(distances))] if at_end else None


def speed_of(model: Model, path: str, value: float) -> float:
    """The speed at a value [rad/s]."""
    return model.with_({path: value}).excitation.omega


def periods_between(model: Model, speeds: tuple[float, float], rate: float) -> float:
    """Return the periods T that a run takes from one speed to another [rad/s] at a rate with its sign [rad/s^2]."""
    turned = period_of(model).period * model.excitation.omega  # by the reference shaft in a period T [rad]
    return 0.5 * (speeds[1] ** 2 - speeds[0] ** 2) / (turned * rate)


def jumps_of(branch: Branch, run: RunParts, motions: Sequence[BranchPart], rate: float) -> list[Jump]:
    """The losses of stability that a run passes, in its order; those of copies of a motion once."""
    return _Jumps(branch, run, motions, rate).all()


def _is_copy(one: BranchPart, own: BranchPart, end: float) -> bool:
    """Whether motions have the same swings at the end of one of them."""
    swing = own.at(end)
    return one.reaches(end) and bool(np.allclose(one.at(end), swing, rtol=_SAME, atol=_TINY * float(swing.max())))


class _Jumps:
    """A run and the motions of a branch, which ``rate`` passes [rad/s^2]."""

    def __init__(self, branch: Branch, run: RunParts, motions: Sequence[BranchPart], rate: float) -> None:
        self._branch = branch
        self._run = run
        self._motions = motions
        self._rate = rate
        self._sign = 1.0 if run.upward else -1.0
        # the motions of every line, unstable ones included
        of_line = {line: [one for one in motions if one.line == line] for line in {one.line for one in motions}}
        self._courses = {line: DeflectionsAlong(branch, parts, run.grid) for line, parts in of_line.items()}

    def all(self) -> list[Jump]:
        """Return the jumps in the order of the run; a jump belongs to the last event before it."""
        ended = list[tuple[Loss, list[BranchPart]]]()
        upward = self._run.upward
        losses = [loss for loss in losses_of(self._branch) if loss.upward == upward and loss.jumps is not False]
        for loss in losses if upward else losses[::-1]:
            for own in [one for one in self._motions if one.is_stable and loss.event in one.events][:1]:
                known = next((owns for other, owns in ended if _is_copy(own, owns[0], other.value)), None)
                if known is None:
                    ended.append((loss, [own]))
                else:
                    known.append(own)
        jumps = [self._jump(self._ending(loss, owns)) for loss, owns in ended]
        return [self._once(one, jumps[k + 1 :]) for k, one in enumerate(jumps)]

    def _ending(self, loss: Loss, copies: Sequence[BranchPart]) -> _Ending:
        """A loss with the other stable motions; copies of the ended one, and what leaves it there, are left out."""
        own = copies[0]
        others = tuple(
            one
            for one in self._motions
            if one.is_stable and one.line != own.line and not _is_copy(one, own, loss.value)
        )
        swings = [own.at(loss.value), *(one.at(loss.value) for one in others if one.reaches(loss.value))]
        scale = np.max(swings, axis=0)
        least = max(_TINY * float(scale.max()), np.finfo(float).tiny)
        return _Ending(loss, tuple(copies), others, np.maximum(scale, least))

    def _jump(self, ending: _Ending) -> Jump:
        """Where the run jumps after a motion has ended."""
        branch = self._branch
        run = self._run
        loss = ending.loss
        names = assemble(branch.model).layout.clearance_names
        none = Jump(run.upward, loss.kind, loss.value, np.nan, np.nan, np.nan, "")
        neighbour = ending.nearest()
        if neighbour is None:
            return replace(none, words=_NONE_KNOWN)
        none = replace(none, clearance=names[ending.decisive(neighbour.at(loss.value))])
        if not any(was_on(branch, run, one) for one in ending.copies):
            return replace(none, words=NOT_ON)
        crossings = [
            (value, other)
            for other in ending.others
            if (value := self._crossing(ending, other)) is not None and was_on(branch, run, other, beyond=loss.value)
        ]
        # the parts of a line share their crossing: of those that of the part which the run meets first
        first = min(crossings, key=lambda pair: (self._sign * pair[0], self._ahead(pair[1], pair[0])), default=None)
        if self._is_on_again(ending, first[0] if first else float(run.value[-1])):
            return replace(none, words=_AGAIN)
        if first is None:
            return replace(none, words=_ELSEWHERE if self._has_left(ending, neighbour) else _NOT_YET)
        value, other = first
        if value == loss.value:
            return replace(none, words=_EARLY)
        jumped, lost = (speed_of(branch.model, branch.path, one) for one in (value, loss.value))
        ahead = self._ahead(other, value)
        return replace(
            none,
            value=value,
            delay=abs(jumped - lost),
            periods=self._periods(loss.value, value),
            clearance=names[ending.decisive(other.at(value))],
            settles=value + self._sign * ahead if np.isfinite(ahead) else value,
        )

    def _once(self, jump: Jump, later: Sequence[Jump]) -> Jump:
        """A jump, unless it belongs to a later event: the run was on what ends there, or jumps there within T."""
        if any(
            (one.words in _LEFT_LATER and self._sign * one.end < self._sign * jump.value)
            or self._periods(one.value, jump.value) < 1.0
            for one in later
        ):
            return replace(jump, value=np.nan, delay=np.nan, periods=np.nan, settles=np.nan, words=_ANOTHER)
        return jump

    def _periods(self, *values: float) -> float:
        """The periods T that the run takes from one value to another; NaN where one is."""
        if np.isnan(values).any():
            return np.nan
        first, last = (speed_of(self._branch.model, self._branch.path, value) for value in values)
        return abs(periods_between(self._branch.model, (first, last), self._rate))

    def _ahead(self, part: BranchPart, value: float) -> float:
        """How far beyond a value the run meets a part: zero where that is on it, infinite where it has been passed."""
        low = float(part.value[0])
        high = float(part.value[-1])
        begin, end = (low - value, high - value) if self._run.upward else (value - high, value - low)
        return np.inf if end < 0.0 else max(begin, 0.0)

    def _is_on_again(self, ending: _Ending, value: float) -> bool:
        """Whether, beyond the loss and before a value, the motion is stable again and the run on it."""
        low, high = sorted((ending.loss.value, value))
        begin = 0 if self._run.upward else -1
        lines = {one.line for one in ending.copies}
        again = [one for one in self._motions if one.is_stable and one.line in lines]
        return any(low < one.value[begin] < high and was_on(self._branch, self._run, one) for one in again)

    def _lean(self, ending: _Ending, other: DeflectionsAlong, parts: IntArray) -> Array:
        """How much nearer to another motion than to the one that has ended the run is: a difference of squares.

        Where there is no motion on the other course it is as far as can be.
        """
        value = self._run.value[parts]
        compared = self._run.deflection[parts], value, parts % self._run.per_period, ending.scale
        left = np.min([self._courses[one.line].off(*compared) for one in ending.copies], axis=0)
        return np.where(other.reaches(value), left - other.off(*compared), -np.inf)

    def _crossing(self, ending: _Ending, other: BranchPart) -> float | None:
        """Value at which, beyond the end of a motion, the run becomes nearer to another one than to it; None: nowhere.

        Where it is nearer already in the last part before, it is the end.
        """
        run = self._run
        end = ending.loss.value
        last = len(run.value)
        width = run.per_period
        compared = [self._courses[line] for line in {other.line, *(one.line for one in ending.copies)}]
        for begin in np.flatnonzero(run.passed(end))[::_BLOCK].tolist():
            parts = np.arange(max(begin - 1, 0), min(begin + _BLOCK + width, last))
            while True:
                # the first part in which it is nearer, and from which on it is nearer over a period
                lean = self._lean(ending, self._courses[other.line], parts)
                over_period = sliding_window_view(np.concatenate([lean, np.zeros(width - 1)]), width).sum(axis=1)
                crossed = np.flatnonzero((lean > 0.0) & (over_period > 0.0))
                if not crossed.size:
                    break
                k = int(crossed[0])
                if sum(course.refine(run.value[parts[max(k - 1, 0) : k + width]]) for course in compared):
                    continue
                # where between it and the part before
                before = run.value[parts[max(k - 1, 0)]]
                after = run.value[parts[k]]
                share = lean[k - 1] / (lean[k - 1] - lean[k]) if k and -np.inf < lean[k - 1] < 0.0 else 1.0
                crossing = float(before + share * (after - before))
                return max(crossing, end) if run.upward else min(crossing, end)
        return None

    def _has_left(self, ending: _Ending, neighbour: BranchPart) -> bool:
        """Whether at its end the run is farther from the ended motion than the middle to its neighbour at the event."""
        run = self._run
        parts = np.arange(len(run.value))[-run.per_period :]
        phase = parts % run.per_period
        value = run.value[parts]
        at_end = np.full(len(parts), ending.loss.value)
        lost = [self._courses[one.line] for one in ending.copies]
        while any(one.refine(value) for one in lost):
            pass
        away = np.min([one.off(run.deflection[parts], value, phase, ending.scale) for one in lost], axis=0)
        there = np.swapaxes(self._courses[neighbour.line].at(at_end, phase), 0, 1)
        between = [lost[0].off(one, at_end, phase, ending.scale) for one in there]
        return bool(np.sum(away) > _NEAR**2 * np.sum(np.min(between, axis=0)))
