"""Stable motions over a value of a model, by sweeps up and down with exact runs.

Where branches cannot be followed, because of friction, chaos or many impacts, exact runs still say which motions a
driveline shows: at every value a run begins with the state, and at the phase of the excitation, at which the one at
the neighbouring value ended. Going up and going down differ where motions coexist, and a motion that ends makes the
driveline jump.

1. A coarse grid of values is gone through in parts, each of which begins with the model's own start: upwards, and from
   every value one step down. Where neighbours show different motions although one did not begin from the other, the
   run is done again from the neighbour, and so on until all agree: then both directions are as if gone through in one
   piece.
2. Where both directions differ, or neighbours do, both are followed on, so that chance is excluded.
3. The grid is halved.
4. Between neighbours that differ, values are halved until the jump is known to a thousandth of the range.
5. The grid is halved once more, with the jumps that this shows.

Every run knows which neighbour it began from. If a nearer one has come between, and it shows another motion, the run is
done again from there: a large step may leave a motion too early.

Takes a Model, a path and a range; gives Sweeps.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

import numpy as np

from gearrattle.errors import Cancelled, ConvergenceError
from gearrattle.model import Model
from gearrattle.orbits.exact_runs import BLOCKS, ExactRun, carried, exact_run, map_of_one_period
from gearrattle.orbits.start_states import state_of
from gearrattle.orbits.swept_motions import Jump, Sweeps
from gearrattle.time_limits import OutOfTime, TimeLimit, carrying, limited

Progress = Callable[[float], None]

COARSE = 24
HALVINGS = 2
"""Intervals of the first grid, and how often it is halved."""
RESOLUTION = 1e-3
"""Of the range: a jump is not narrowed further."""
_PARTS_OF_CORE = 2  # parts of the first grid for every core
_WIDE_STEP = 0.6  # of the widest step of the grid: those that are narrower are not halved
_EXPECTED = 2.0 * (2**HALVINGS * COARSE + 16)  # runs at the end, for the progress
_TICK = 0.1  # seconds between two looks at whether the work is to stop
_ABRUPT = 1.5  # ratio of rms of neighbours from which the change may be a jump
_LEAST = 1.05  # the same at the end of a range of two motions
_MOST_JUMPS = 12  # in one direction that are narrowed, the largest first
_MOST_UNDECIDED = 2  # neighbours in a row that may be on the way from one motion to another
_MOST_LONGER = 4  # times that such a motion is followed for longer


@dataclass
class Way:
    """One direction: its motions so far, from which motion each began, and which of them were followed on.

    ``longer`` counts how often a motion was followed for longer because it was still on its way to another one.
    """

    upward: bool
    runs: dict[float, ExactRun] = field(default_factory=dict)
    origin: dict[float, ExactRun | None] = field(default_factory=dict)
    followed_on: set[float] = field(default_factory=set)
    longer: dict[float, int] = field(default_factory=dict)

    @property
    def so_far(self) -> dict[float, ExactRun]:
        """A copy of the motions, for other threads may add to them meanwhile."""
        return self.runs.copy()

    @property
    def ordered(self) -> list[ExactRun]:
        """The motions in the order of the sweep."""
        known = self.so_far
        return [known[value] for value in sorted(known, reverse=not self.upward)]

    @property
    def steps(self) -> Iterator[tuple[ExactRun, ExactRun]]:
        """Each motion with the next one."""
        return pairwise(self.ordered)

    @property
    def decided_steps(self) -> Iterator[tuple[ExactRun, ExactRun]]:
        """Each motion with the next one, without those that are still on their way from one motion to another.

        Such a motion scatters so much that it differs neither from its predecessor nor from its successor, although
        these differ: with it a jump would be two steps, none of them sure.
        """
        motions = self.ordered
        i = 0
        while i + 1 < len(motions):
            following = i + 1
            for j in range(i + 2, min(i + 2 + _MOST_UNDECIDED, len(motions))):
                between = motions[i + 1 : j]
                if motions[i].differs(motions[j]) and all(
                    self._is_undecided(one, motions[i], motions[j]) for one in between
                ):
                    following = j
                    break
            yield motions[i], motions[following]
            i = following

    def _is_undecided(self, motion: ExactRun, before: ExactRun, after: ExactRun) -> bool:
        """Whether a motion may still be on its way; one that has been followed for long is what it is."""
        is_alike = not any(np.any(motion.differences(other, _LEAST) > 1.0) for other in (before, after))
        return is_alike and self.longer.get(motion.value, 0) < _MOST_LONGER

    def nearest(self, value: float) -> ExactRun | None:
        """The motion at the nearest value."""
        known = self.so_far
        return known[min(known, key=lambda one: abs(one - value))] if known else None

    def before(self, value: float) -> ExactRun | None:
        """The motion from which a value is reached."""
        earlier = [run for run in self.ordered if run.value != value and (run.value < value) == self.upward]
        return earlier[-1] if earlier else None


Job = tuple[Way, float, ExactRun | None]
"""A run to be done: direction, value, and the motion from whose end it begins; None: from the model's own start."""


class Sweeper:
    """Sweeps under way.

    Parameters
    ----------
    ends
        of the range, ascending [SI].
    limit
        of the time.
    progress
        called with the finished share; ``Cancelled`` from it ends the work with what is known. Its method ``because``,
        if it has one, is called with what is known so far, in words.
    words
        says what is known so far.

    Attributes
    ----------
    is_stopped
        whether somebody stopped the work.
    """

    def __init__(
        self,
        model: Model,
        path: str,
        ends: tuple[float, float],
        *,
        limit: TimeLimit,
        progress: Progress | None = None,
        words: Callable[[Sweeps], str] | None = None,
    ) -> None:
        self.model = model
        self.path = path
        self.ends = ends
        self._limit = limit
        self._progress = progress
        self._words = words
        self._ways = {upward: Way(upward) for upward in (True, False)}
        self._failures: dict[float, str] = {}
        self._is_complete = False
        self.is_stopped = False

    def sweep(self) -> Sweeps:
        """Carry the sweeps out, and return what is known at the end or when the time is over."""
        try:
            self._first_grid(np.linspace(*self.ends, COARSE + 1).tolist())
            for _ in range(HALVINGS):
                self._halve()
                self._refine(RESOLUTION)
            self._is_complete = True
        except OutOfTime:
            pass
        except (Cancelled, KeyboardInterrupt):
            self.is_stopped = True
        return self.so_far

    @property
    def so_far(self) -> Sweeps:
        """What is known so far."""
        up, down = (sorted(way.so_far.values(), key=lambda run: run.value) for way in self._ways.values())
        jumps = sorted((jump for way in self._ways.values() for jump in self._jumps(way)), key=lambda jump: jump.value)
        failures = tuple(sorted(self._failures.copy().items()))
        return Sweeps(tuple(up), tuple(down), tuple(jumps), self.ends, self._is_complete, failures)

    def _first_grid(self, values: Sequence[float]) -> None:
        """Go through the first grid in both directions."""
        parts = np.array_split(np.array(values), _PARTS_OF_CORE * _cores())
        self._carry_out([partial(self._go_through, part.tolist()) for part in parts])
        up = self._ways[True]
        down = self._ways[False]
        # the last value of every part, reached from the part above
        missing = [run for run in up.ordered if run.value not in down.runs]
        later = {first.value: last for first, last in up.steps}
        self._run_all([(down, run.value, later.get(run.value, run)) for run in missing])
        self._agree()

    def _go_through(self, values: Sequence[float]) -> None:
        """Go up through values from the model's own start, and one step down from each: they share what is built."""
        up = self._ways[True]
        down = self._ways[False]
        before: ExactRun | None = None
        for value in values:
            self._run(up, value, before)
            run = up.runs.get(value)
            if run is not None and before is not None:
                self._run(down, before.value, run)
            before = run or before

    def _refine(self, width: float) -> None:
        """Halve the steps with jumps until they are narrower than a share of the range."""
        while True:
            self._follow_on()
            middles = [
                (way, 0.5 * (first.value + last.value), first)
                for way in self._ways.values()
                for first, last in self._wide_steps(way, width)
            ]
            new = [job for job in middles if job[1] not in job[0].runs]
            undecided = [(way, value) for way, value, _ in middles if value in way.runs]
            again = [(way, value) for way, value in undecided if way.longer.get(value, 0) < _MOST_LONGER]
            if not new and not again:
                return
            self._carry_out([partial(self._go_longer, way, value) for way, value in again])
            self._run_all(new)
            self._agree()

    def _halve(self) -> None:
        """Put a value into the middle of every step of the grid, in both directions."""
        both = [up.value for up, _ in self.so_far.of_both]
        least = _WIDE_STEP * max((high - low for low, high in pairwise(both)), default=0.0)
        middles = [0.5 * (low + high) for low, high in pairwise(both) if high - low > least]
        self._run_all([(way, value, way.before(value)) for value in middles for way in self._ways.values()])
        self._agree()

    def _agree(self) -> None:
        """Do runs again that a nearer neighbour in another motion has come before, until all agree."""
        while True:
            jobs: list[Job] = []
            for way in self._ways.values():
                for first, last in way.steps:
                    if way.origin[last.value] is first:
                        continue
                    if first.differs(last):
                        jobs.append((way, last.value, first))
                    else:
                        way.origin[last.value] = first
            if not jobs:
                return
            self._run_all(jobs)

    def _follow_on(self) -> None:
        """Follow motions on where both directions differ, or neighbours do, so that chance is excluded."""
        steps = [(way, first, last) for way in self._ways.values() for first, last in way.steps]
        doubtful = {
            (way.upward, run.value)
            for way, first, last in steps
            if _is_abrupt(first, last) and not first.differs_clearly(last)
            for run in (first, last)
        }
        doubtful |= {
            (upward, up.value)
            for up, down in self.so_far.of_both
            if up.differs(down) and not up.differs_clearly(down)
            for upward in (True, False)
        }
        chosen = [(self._ways[upward], value) for upward, value in sorted(doubtful)]
        left = [(way, value) for way, value in chosen if value not in way.followed_on and not way.runs[value].cycles]
        self._carry_out([partial(self._go_on, way, value) for way, value in left])

    def _wide_steps(self, way: Way, width: float) -> list[tuple[ExactRun, ExactRun]]:
        """Steps with a jump that is not narrow yet; the largest changes first, and not all of many."""
        least = width * (self.ends[1] - self.ends[0])
        jumps = sorted(self._jumps(way), key=lambda jump: -abs(jump.before.ratios(jump.after)[jump.clearance]))
        return [(jump.before, jump.after) for jump in jumps[:_MOST_JUMPS] if 2.0 * jump.error > least]

    def _jumps(self, way: Way) -> list[Jump]:
        """The jumps of a direction, in its order: abrupt changes, and where it leaves a range of two motions."""
        other = self._ways[not way.upward]
        jumps = []
        for first, last in way.decided_steps:
            opposite = other.nearest(first.value), other.nearest(last.value)
            if opposite[0] is None or opposite[1] is None:
                sides = [False, False]
                is_end = False
            else:
                sides = [first.differs(opposite[0]), last.differs(opposite[1])]
                is_end = sides[0] and not sides[1] and _change(first, last) > _change(opposite[0], opposite[1])
                is_end = is_end and bool(np.any(first.differences(last, _LEAST) > 1.0))
            if _is_abrupt(first, last) or is_end:
                sizes = first.differences(last, _LEAST)
                clearance = int(np.argmax(sizes if np.any(sizes > 1.0) else np.abs(first.ratios(last))))
                jumps.append(Jump(way.upward, first, last, clearance, has_return=any(sides)))
        return jumps

    def _run_all(self, jobs: Sequence[Job]) -> None:
        """Do runs; those at one value one after the other in one thread, for they share what is built."""
        of_value: dict[float, list[Job]] = {}
        for job in jobs:
            of_value.setdefault(job[1], []).append(job)

        def do(own: Sequence[Job]) -> None:
            for job in own:
                self._run(*job)

        self._carry_out([partial(do, own) for own in of_value.values()])

    def _run(self, way: Way, value: float, before: ExactRun | None) -> None:
        """Follow the motion at a value from the end of another; None: from the model's own start."""
        model = self.model.with_({self.path: value})
        try:
            period_map = map_of_one_period(model)
            if before is None:
                start = state_of(model, period_map, None)
                run = exact_run(model, period_map, start, value, blocks=2 * BLOCKS)
            else:
                earlier = map_of_one_period(self.model.with_({self.path: before.value}))
                run = exact_run(model, period_map, carried(before.end, earlier, period_map), value, like=before)
        except ConvergenceError as error:
            self._failures[value] = error.message
            return
        way.origin[value] = before
        way.followed_on.discard(value)
        way.runs[value] = run

    def _go_on(self, way: Way, value: float) -> None:
        """Follow the motion at a value on."""
        model = self.model.with_({self.path: value})
        run = way.runs[value]
        way.followed_on.add(value)
        try:
            later = exact_run(model, map_of_one_period(model), run.end, value)
        except ConvergenceError as error:
            self._failures[value] = error.message
            return
        way.runs[value] = run.with_more(later)

    def _go_longer(self, way: Way, value: float) -> None:
        """Follow the motion at a value for longer: what it was on its way no longer counts."""
        model = self.model.with_({self.path: value})
        way.longer[value] = way.longer.get(value, 0) + 1
        try:
            way.runs[value] = exact_run(model, map_of_one_period(model), way.runs[value].end, value)
        except ConvergenceError as error:
            self._failures[value] = error.message

    def _carry_out(self, jobs: Sequence[Callable[[], None]]) -> None:
        """Do jobs in threads, and report the progress; runs that are done are kept.

        OutOfTime where the time is over, Cancelled where somebody stops the work.
        """
        pool = ThreadPoolExecutor(_cores(), thread_name_prefix="gearrattle-sweep")
        try:
            with limited(self._limit):
                left: set[Future[None]] = {pool.submit(carrying(job)) for job in jobs}
            known = -1
            while left:
                done, left = wait(left, timeout=_TICK, return_when=FIRST_COMPLETED)
                for future in done:
                    future.result()
                count = sum(len(way.runs) for way in self._ways.values())
                if count != known:
                    known = count
                    self._tell()
                if self._progress is not None:
                    self._progress(min(0.99, count / _EXPECTED))
        except BaseException:
            self._limit.stop()
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)

    def _tell(self) -> None:
        """Say what is known so far."""
        because = getattr(self._progress, "because", None)
        if because is not None and self._words is not None:
            because(self._words(self.so_far))


def _is_abrupt(first: ExactRun, last: ExactRun) -> bool:
    """Whether neighbours differ by so much that the motion may have jumped."""
    return bool(np.any(first.differences(last) >= _ABRUPT))


def _change(first: ExactRun, last: ExactRun) -> float:
    """By how much neighbours differ at most."""
    return float(np.abs(first.ratios(last)).max(initial=0.0))


def _cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
