"""Search for the change at which a target begins to hold: a scan of the range, then halving.

Runs at different values are independent and run in threads, because the engine releases the interpreter lock. Only
motions that begin with the final state of a neighbour are computed one after the other, from the model's own value on.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf
from threading import Lock
from typing import Any

from gearrattle.design.kept_motions import Keep, kept_or_moved
from gearrattle.design.motions import BEFORE, PUSHED, REST, STARTS, Asked, Motion, State
from gearrattle.design.target import Target
from gearrattle.design.variable import Variable
from gearrattle.errors import Cancelled, ConvergenceError, ModelError
from gearrattle.model import Model

_MOST_HALVINGS = 40
_NONE: Mapping[str, Any] = {}


@dataclass
class Tried:
    """One value, and the motions simulated at this value."""

    value: float
    target: Target
    motions: list[Motion] = field(default_factory=list)
    failure: str = ""

    @property
    def holds(self) -> bool:
        """Whether the target holds for all motions simulated at the value."""
        return bool(self.motions) and not self.failure and not self.failing

    @property
    def failing(self) -> list[Motion]:
        """Motions for which the target does not hold."""
        return [motion for motion in self.motions if not self.target.holds(motion.values)]

    @property
    def hardest(self) -> Motion:
        """The motion farthest from the target; of equal ones the first in the order of ``STARTS``."""
        in_order = sorted(self.motions, key=lambda motion: STARTS.index(motion.start))
        return max(in_order, key=lambda motion: self.target.distance(motion.values))

    @property
    def distance(self) -> tuple[float, float]:
        """Distance of the hardest motion from the target; infinite without a motion."""
        return self.target.distance(self.hardest.values) if self.motions else (inf, inf)


@dataclass(frozen=True)
class Work:
    """Settings of a search.

    Attributes
    ----------
    count
        number of values of the scan.
    width
        width of a bracket, as a share of the value.
    conditions
        further changes of the model, such as other speeds; the target must hold under each of them, too.
    is_lean
        whether no further motion is simulated at a value after the first for which the target does not hold.
    keep
        folder of computed motions; None: none.
    starts
        starts from which every value is simulated; an event has only its own start.
    """

    count: int
    width: float
    conditions: tuple[Mapping[str, Any], ...] = ()
    is_lean: bool = False
    keep: Keep | None = None
    starts: tuple[str, ...] = STARTS


class Search:
    """Search along one variable: the values simulated, and the changes of the answer between them."""

    def __init__(self, model: Model, variable: Variable, target: Target, work: Work, report: Report) -> None:
        self.model = model
        self.variable = variable
        self.target = target
        self.tried: list[Tried] = []
        self.notes: list[str] = []
        self.is_stopped = False
        self._work = work
        self._report = report

    @property
    def is_begun(self) -> bool:
        """Whether a value other than the model's own was simulated."""
        return any(variant.motions and variant.value != self.variable.own for variant in self.tried)

    def run(self, pool: Executor, own: Tried | None = None) -> list[tuple[Tried, Tried]]:
        """Scan the range, halve the nearest change on either side of the model's own value; return all changes.

        ``Cancelled`` ends the search with the result so far, if there is any. ``own`` holds the motions at the model's
        own value, if these were simulated before.
        """
        try:
            self._scan(pool, own)
            for below, above in self._nearest():
                self._halve(pool, below, above)
        except Cancelled:
            if not any(variant.motions for variant in self.tried):
                raise
            self.is_stopped = True
        self.tried = [variant for variant in self.tried if variant.motions or variant.failure]
        failures = [variant for variant in self.tried if variant.failure]
        self.notes += [f"{self.variable.shown(variant.value)}: {variant.failure}" for variant in failures[:3]]
        return self._changes()

    def _scan(self, pool: Executor, own: Tried | None) -> None:
        """Simulate values from end to end: from rest, from the motions of neighbours outward, and after a push."""
        values = self.variable.spread(self._work.count).tolist()
        first = values.index(self.variable.own) if self.variable.own in values else 0
        self.tried = [Tried(value, self.target) for value in values]
        # from rest, the model's own value first: a failure there ends the search
        if own is None:
            self._move(self.tried[first], REST, None, must=True)
        else:
            self.tried[first] = own
        others = [variant for variant in self.tried if variant is not self.tried[first]]
        finish([pool.submit(self._move, variant, REST, None) for variant in others])

        def follow(chain: list[Tried]) -> None:
            for before, variant in pairwise(chain):
                if before.motions and (variant.holds or not self._work.is_lean):
                    self._move(variant, BEFORE, before.hardest.end)

        if BEFORE in self._work.starts:
            finish([pool.submit(follow, chain) for chain in (self.tried[first:], self.tried[first::-1])])
        # a push, and other conditions, at values at which the target holds so far
        finish([pool.submit(self._challenge, variant) for variant in self.tried if variant.holds])

    def _halve(self, pool: Executor, below: Tried, above: Tried) -> None:
        """Halve the interval of a change of the answer until it is narrow enough."""
        for _ in range(_MOST_HALVINGS):
            if above.value - below.value <= self._work.width * max(abs(below.value), abs(above.value)):
                break
            middle = Tried(self.variable.between(below.value, above.value), self.target)
            failing = below if above.holds else above
            self.tried.insert(self.tried.index(above), middle)
            if BEFORE in self._work.starts:
                # if the target fails for the motion continued from the failing side, no other start is needed
                self._move(middle, BEFORE, failing.hardest.end)
                if middle.holds:
                    finish([pool.submit(self._move, middle, REST, None), pool.submit(self._challenge, middle)])
            else:
                self._move(middle, REST, None)
                if middle.holds:
                    self._challenge(middle)
            if middle.holds == above.holds:
                above = middle
            else:
                below = middle

    def _nearest(self) -> list[tuple[Tried, Tried]]:
        """The nearest changes of the answer on either side of the model's own value."""
        own = self.variable.own if self.variable.own is not None else self.variable.low
        changes = self._changes()
        above = [pair for pair in changes if pair[1].value > own]
        below = [pair for pair in changes if pair[1].value <= own]
        return above[:1] + below[-1:]

    def _changes(self) -> list[tuple[Tried, Tried]]:
        """Pairs of neighbouring values with different answers."""
        known = [variant for variant in self.tried if variant.motions]
        return [(one, other) for one, other in pairwise(known) if one.holds != other.holds]

    def _challenge(self, variant: Tried) -> None:
        """Simulate the motion after a push, and motions under other conditions until the target fails."""
        starts = [start for start in (REST, PUSHED) if start in self._work.starts]
        if PUSHED in starts:
            self._move(variant, PUSHED, None)
        for condition in self._work.conditions:
            for start in starts:
                if variant.holds:
                    self._move(variant, start, None, condition)

    def _move(
        self,
        variant: Tried,
        start: str,
        initial: State | None,
        condition: Mapping[str, Any] = _NONE,
        *,
        must: bool = False,
    ) -> None:
        """Simulate one motion; a failure is recorded, or raised if ``must`` is set."""
        self._report.add(0.0)
        try:
            model = self.model.with_({**self.variable.changes(variant.value), **condition})
            asked = Asked(model, start, initial, self.target.outputs, self.target.samples)
            variant.motions.append(kept_or_moved(asked, self._work.keep, self._report))
        except (ConvergenceError, ModelError) as error:
            if must:
                raise
            variant.failure = " ".join(f"{error}".split())


def finish(futures: list[Future[Any]]) -> None:
    """Wait until all futures have ended; then raise the first exception of one."""
    errors = [future.exception() for future in futures]
    for error in errors:
        if error is not None:
            raise error


class Report:
    """Finished share of the work, reported by many threads: finished motions over expected motions.

    At least one more motion is always expected, so the share never falls and never reaches one early.
    """

    def __init__(self, progress: Callable[[float], None] | None, expected: float) -> None:
        self._progress = progress
        self._expected = expected
        self._lock = Lock()
        self._done = 0.0
        self._share = 0.0
        self._stopped = False

    def add(self, part: float) -> None:
        """Count a part of a motion; Cancelled if the work is to stop."""
        with self._lock:
            self._done += part
            self._share = max(self._share, self._done / (self._done + max(self._expected - self._done, 1.0)))
            if self._stopped:
                raise Cancelled("stopped")
            if self._progress is not None:
                try:
                    self._progress(self._share)
                except Cancelled:
                    self._stopped = True
                    raise
