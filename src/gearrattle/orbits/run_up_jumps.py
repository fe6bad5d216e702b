"""Jumps of a run-up: the speed at which a run leaves a motion that has ended, or has become unstable.

*Events.* A motion ends at a loss of stability (``stability_ranges``). An event from which a stable motion leads on is
left out.

*Whether the run was on the ended motion.* At the start of some period before the event, the state of the run must be
nearer to that motion than to any other motion, stable or unstable, and must settle on that motion at constant speed. So
the answer does not depend on the lag of the run, nor on the sampling of run and branch. Near a fold a lagging run may
have passed the unstable motion already, so periods ever farther before the event are tried.

*The jump.* Run and motions are compared by the shape of their deflections, not by their swing: at a fold the run often
jumps to a motion with nearly the same swing, and a lagging run has yet another swing. The period is divided into parts
(``branch_parts``). The deflections of a clearance are scaled by the largest swing of the motions that are stable at the
event. The run jumps in the first part in which it is nearer to another motion at its speed than to the ended motion,
and over the period from that part on stays nearer: one part alone may be one in which the motions do not differ. Beyond
the event, the ended motion is its unstable continuation, or else its last motion. Where the other motion is stable, the
run must be on it beyond the event. Where the other motion is unstable at the jump, the run settles on it only later. A
run that is nearer to the other motion already at the event has no delay.

*Which event the jump belongs to.* It is the last event before the jump at which a motion ended that the run was on. A
run did not jump at an event if beyond it the motion becomes stable again and the run is on that motion; nor if the run
went on to another motion, which also ends before the jump, or within a period T of it.
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
from gearrattle.orbits.stability_ranges import StabilityLoss, losses_of

if TYPE_CHECKING:
    from gearrattle.orbits.branch import Branch

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
_SAME_STATE = 1e-4  # in the units of a motion: states that differ by less are the same state
_MOST_PASSES = 2000  # passes of the period map in which a motion must settle; slower motions only if all are slower
_SHARES = (0.125, 0.25, 0.5)  # shares of the width of a part, from the end that the run passes last
_SAME = 1e-6  # share of the swings at an event: motions that differ by less are copies
_NEAR = 0.5  # share of the distance between two motions: a run farther than this from one of them has left it
_BLOCK = 256  # parts of a run that are compared at once
_TINY = 1e-9  # share of the largest scale: a smaller swing is rounding
_NONE_KNOWN = "no other stable motion is known there"
NOT_ON = "the run was not on the motion that ends there"
_NOT_YET = "the run ends before it jumps"
_EARLY = "the run is nearer to another motion already where that one ends"
_ELSEWHERE = "the run leaves for no stable motion that is known"
_AGAIN = "the run is still on the motion where that is stable again"
_ANOTHER = "the run goes on to another motion, which ends as well before it jumps"
_LEFT_LATER = frozenset({"", _NOT_YET, _ELSEWHERE})
"""``RunUpJump.words`` of a run that was on the motion up to its end."""


@dataclass(frozen=True)
class RunParts:
    """A run, divided into Q parts; every period T has the same number of parts."""

    upward: bool  # whether the speed grows
    per_period: int  # parts of a period T
    value: Array  # (Q,) in the middle of every part [SI]
    deflection: Array  # (Q, M, K) at M instants of every part, evenly spread from its begin on [rad or m]
    starts: Array  # (P,) value at the starts of the periods T, in the order of the run [SI]
    # gives, for a value and a period map, the state at the start of the period in which the value is reached
    state_before: Callable[[float, PeriodMap], State]

    @property
    def grid(self) -> tuple[int, int]:
        """Number of parts in a period, and number of instants in a part."""
        return self.per_period, self.deflection.shape[1]

    def passed(self, value: float) -> NDArray[np.bool_]:
        """(Q,) whether the middle of a part lies beyond a value."""
        return self.value > value if self.upward else self.value < value


class _Compared(NamedTuple):
    """The motions with which a run is compared at one value of the branch's parameter."""

    value: float  # the parameter [SI]
    own: Orbit  # the motion of the part
    passes: int  # number of its periods after which a nearby motion has settled on it
    all: tuple[Orbit, ...]  # motions of all branches


def was_on(branch: Branch, run: RunParts, part: BranchPart, beyond: float | None = None) -> bool:
    """Return whether a run was on the motion of a part, at some value in the part; ``beyond`` a value if it is set.

    Values at which motions settle too slowly are left out, unless motions do so at every value tried.
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
    """Values in a part at which periods start: of the last, second, fourth, eighth ... period from its end.

    If no period starts in the part, values at some shares of its width.
    """
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
    """The motion of a part at a value, and the motions of all branches there; None if Newton's method finds none."""
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
    """Whether the state of a run is nearest to the motion of the part, and settles on it."""
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
class RunUpJump:
    """An event at which a motion ends, or becomes unstable, and that a run passes.

    Attributes
    ----------
    upward
        whether the speed grows.
    kind
        kind of the event.
    end
        value at the event [SI].
    value
        value at which the run leaves the ended motion [SI]; NaN if it does not jump.
    delay
        change of the speed between event and jump, never negative [rad/s].
    periods
        number of periods T between event and jump.
    clearance
        name of the clearance in whose deflection the two motions differ most.
    words
        why there is no jump; empty if there is one.
    settles
        value from which on the motion after the jump is stable, at or beyond the jump [SI]; NaN without a jump.
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
    """A motion that ends at a loss of stability, and the stable motions to which a run can jump."""

    loss: StabilityLoss  # event at which the motion ends
    copies: tuple[BranchPart, ...]  # the ended motion, and others with the same swings, such as its mirror image
    others: tuple[BranchPart, ...]  # stable motions with other swings
    scale: Array  # (K,) scale of the deflections of every clearance [rad or m]

    def decisive(self, other: Array) -> int:
        """Index of the clearance whose swing relatively differs most between the ended motion and (K,) other swings."""
        swing = self.copies[0].at(self.loss.value)
        larger = np.maximum(np.maximum(swing, other), _TINY * self.scale)
        return int(np.argmax(np.abs(other - swing) / larger))

    def nearest(self) -> BranchPart | None:
        """The other stable motion nearest to the ended motion, at the event; None if none is known there."""
        end = self.loss.value
        swing = self.copies[0].at(end)
        at_end = [one for one in self.others if one.reaches(end)]
        distances = [float(np.sum(((one.at(end) - swing) / self.scale) ** 2)) for one in at_end]
        return at_end[int(np.argmin(distances))] if at_end else None


def speed_of(model: Model, path: str, value: float) -> float:
    """The speed at a value [rad/s]."""
    return model.with_({path: value}).excitation.omega


def periods_between(model: Model, speeds: tuple[float, float], rate: float) -> float:
    """Return the number of periods T of a run between two speeds [rad/s]; the rate is below zero for a run-down."""
    angle = period_of(model).period * model.excitation.omega  # of the reference shaft in a period T [rad]
    return 0.5 * (speeds[1] ** 2 - speeds[0] ** 2) / (angle * rate)


def jumps_of(branch: Branch, run: RunParts, motions: Sequence[BranchPart], rate: float) -> list[RunUpJump]:
    """Return the losses of stability that a run passes, in the order of the run; copies of a motion count once."""
    return _Jumps(branch, run, motions, rate).all()


def _is_copy(one: BranchPart, own: BranchPart, end: float) -> bool:
    """Whether two motions have the same swings at the value ``end``."""
    swing = own.at(end)
    return one.reaches(end) and bool(np.allclose(one.at(end), swing, rtol=_SAME, atol=_TINY * float(swing.max())))


class _Jumps:
    """Jumps of one run over the motions of a branch; ``rate`` is the change of the speed [rad/s^2]."""

    def __init__(self, branch: Branch, run: RunParts, motions: Sequence[BranchPart], rate: float) -> None:
        self._branch = branch
        self._run = run
        self._motions = motions
        self._rate = rate
        self._sign = 1.0 if run.upward else -1.0
        # the motions of every line between two folds, unstable ones included
        of_line = {line: [one for one in motions if one.line == line] for line in {one.line for one in motions}}
        self._courses = {line: DeflectionsAlong(branch, parts, run.grid) for line, parts in of_line.items()}

    def all(self) -> list[RunUpJump]:
        """Return the jumps in the order of the run; every jump belongs to the last event before it."""
        ended = list[tuple[StabilityLoss, list[BranchPart]]]()
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

    def _ending(self, loss: StabilityLoss, copies: Sequence[BranchPart]) -> _Ending:
        """The ended motion and the other stable motions, without its copies and without parts of its line."""
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

    def _jump(self, ending: _Ending) -> RunUpJump:
        """The jump of the run after a motion has ended, or why there is none."""
        branch = self._branch
        run = self._run
        loss = ending.loss
        names = assemble(branch.model).layout.clearance_names
        none = RunUpJump(run.upward, loss.kind, loss.value, np.nan, np.nan, np.nan, "")
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
        # parts between the same two folds have the same crossing: of these take the part that the run meets first
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

    def _once(self, jump: RunUpJump, later: Sequence[RunUpJump]) -> RunUpJump:
        """The jump; without a value if it belongs to a later event.

        That is so if the run was on the motion that ends at the later event, or jumps there within a period T.
        """
        if any(
            (one.words in _LEFT_LATER and self._sign * one.end < self._sign * jump.value)
            or self._periods(one.value, jump.value) < 1.0
            for one in later
        ):
            return replace(jump, value=np.nan, delay=np.nan, periods=np.nan, settles=np.nan, words=_ANOTHER)
        return jump

    def _periods(self, *values: float) -> float:
        """Number of periods T of the run between two values; NaN if a value is NaN."""
        if np.isnan(values).any():
            return np.nan
        first, last = (speed_of(self._branch.model, self._branch.path, value) for value in values)
        return abs(periods_between(self._branch.model, (first, last), self._rate))

    def _ahead(self, part: BranchPart, value: float) -> float:
        """Distance from a value on to a part, in the direction of the run.

        It is zero where the value lies in the part, infinite where the run has passed the part.
        """
        low = float(part.value[0])
        high = float(part.value[-1])
        begin, end = (low - value, high - value) if self._run.upward else (value - high, value - low)
        return np.inf if end < 0.0 else max(begin, 0.0)

    def _is_on_again(self, ending: _Ending, value: float) -> bool:
        """Whether, between the event and a value, the motion becomes stable again and the run is on it."""
        low, high = sorted((ending.loss.value, value))
        begin = 0 if self._run.upward else -1
        lines = {one.line for one in ending.copies}
        again = [one for one in self._motions if one.is_stable and one.line in lines]
        return any(low < one.value[begin] < high and was_on(self._branch, self._run, one) for one in again)

    def _lean(self, ending: _Ending, other: DeflectionsAlong, parts: IntArray) -> Array:
        """Squared distance of the run from the ended motion less that from another motion, for every part.

        It is minus infinity where the other branch has no motion.
        """
        value = self._run.value[parts]
        compared = self._run.deflection[parts], value, parts % self._run.per_period, ending.scale
        left = np.min([self._courses[one.line].off(*compared) for one in ending.copies], axis=0)
        return np.where(other.reaches(value), left - other.off(*compared), -np.inf)

    def _crossing(self, ending: _Ending, other: BranchPart) -> float | None:
        """Value beyond the event at which another motion becomes nearer to the run than the ended one; None: nowhere.

        It is the value of the event if the run is nearer already in the last part before the event.
        """
        run = self._run
        end = ending.loss.value
        last = len(run.value)
        width = run.per_period
        compared = [self._courses[line] for line in {other.line, *(one.line for one in ending.copies)}]
        for begin in np.flatnonzero(run.passed(end))[::_BLOCK].tolist():
            parts = np.arange(max(begin - 1, 0), min(begin + _BLOCK + width, last))
            while True:
                # the first part in which the run is nearer to the other motion, and nearer over the next period too
                lean = self._lean(ending, self._courses[other.line], parts)
                over_period = sliding_window_view(np.concatenate([lean, np.zeros(width - 1)]), width).sum(axis=1)
                crossed = np.flatnonzero((lean > 0.0) & (over_period > 0.0))
                if not crossed.size:
                    break
                k = int(crossed[0])
                if sum(course.refine(run.value[parts[max(k - 1, 0) : k + width]]) for course in compared):
                    continue
                # interpolate between this part and the part before
                before = run.value[parts[max(k - 1, 0)]]
                after = run.value[parts[k]]
                share = lean[k - 1] / (lean[k - 1] - lean[k]) if k and -np.inf < lean[k - 1] < 0.0 else 1.0
                crossing = float(before + share * (after - before))
                return max(crossing, end) if run.upward else min(crossing, end)
        return None

    def _has_left(self, ending: _Ending, neighbour: BranchPart) -> bool:
        """Whether the run ends farther from the ended motion than half the distance to its neighbour at the event."""
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
