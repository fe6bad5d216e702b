"""Prepared study whose cases form a grid: its cost, its execution and its storage.

Everything that can be wrong has been checked, and one case has been run. Kinds of studies that keep their results in a
Store derive from it and replace how a chunk is computed, and how the results are evaluated in the end.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from gearrattle.signals.wilson_interval import wilson
from gearrattle.studies.case_batches import can_batch
from gearrattle.studies.case_runs import OUTCOMES
from gearrattle.studies.designs import DESIGNS
from gearrattle.studies.outputs import Outputs
from gearrattle.studies.plan import Plan
from gearrattle.studies.probability import samples_needed
from gearrattle.studies.schedulers import Scheduler, unreachable
from gearrattle.studies.storage import Address
from gearrattle.studies.stored_studies import kept_in
from gearrattle.studies.study_cost import Cost, Pace, keeping, rounds, spread
from gearrattle.studies.study_store import Store, Work, case_by_case, check_array_names
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

Progress = Callable[[float], None]
CHUNK_SECONDS = 5.0
SHORTEST_CHUNK = 2.0
MOST_IN_CHUNK = 10_000
# of a study: enough to share among many workers; those of a study that is soon over
_CHUNKS = 64
_FEWEST_CHUNKS = 8
STARTING = 5.0
"""Seconds until a fresh process is warm."""


@dataclass(frozen=True)
class Done:
    """A study that has been carried out.

    ``messages`` say why cases failed, by their place in the grid of ``data["outcome"]``; ``summary`` has plain values
    by name, for machines.
    """

    data: xr.Dataset
    messages: Mapping[tuple[int, ...], str]
    outcome_counts: str
    cost: str
    summary: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Prepared:
    """Prepared study whose cases form a grid.

    Attributes
    ----------
    seconds
        time of one case, warm [s].
    serial
        share of it in which threads wait for each other (``study_cost.serial_share``).
    """

    plan: Plan
    outputs: Outputs
    seconds: float
    work: Work = case_by_case
    serial: float = 0.0

    def __post_init__(self) -> None:
        """Refuse names under which results cannot be stored. Errors as of ``check_array_names``."""
        check_array_names(self.plan, self.outputs)

    @property
    def scheduler(self) -> str:
        """Return the scheduler on this machine: threads for compiled code, processes for Python.

        A function that other processes cannot have goes to threads as well.
        """
        if unreachable(self.outputs.function):
            return "threads"
        return "threads" if can_batch(self.outputs, self.plan) and self.work is case_by_case else "local"

    def estimate(self, workers: int | None = None, scheduler: str | None = None) -> Cost:
        """Return the cost of all cases, by as many workers of a scheduler as are asked for, or as pay."""
        busy = max(1, min(workers or pays(scheduler, self.sensible()), self.plan.chunks))
        length = self.plan.count / self.plan.chunks * self.seconds
        used = scheduler or self.scheduler
        starting = STARTING if used == "local" and busy > 1 else 0.0
        serial = self.serial if used == "threads" else 0.0
        computing = max(rounds(self.plan.chunks, busy), serial * self.plan.chunks) * length
        total = starting + keeping(self.plan.chunks) + computing
        words = f"{self._counted()}, about {1e3 * self.seconds:.3g} ms each: {span(total)} in all "
        words += f"on {workers_said(busy)}"
        return Cost(self.plan.count, self.seconds, busy, total, f"{words}{self._width()}")

    def _counted(self) -> str:
        """Number of cases, in words."""
        return counted(self.plan.count, "case")

    def _width(self) -> str:
        """Half-width of a probability from these samples, and the number of samples for half of it, in words."""
        samples = self.plan.samples
        if samples is None or samples.method not in DESIGNS:
            return ""
        n = len(DESIGNS[samples.method].independent(len(samples.paths), len(samples.points)))
        if not n:
            return ""
        low, high = (float(limit) for limit in wilson(0.5 * n, n))
        half = 0.5 * (high - low)
        more = samples_needed(0.5 * half)
        return (
            f". The 95 % interval of a probability from {counted(n, 'sample')} is at most ±{100 * half:.2g} "
            f"percentage points; for ±{50 * half:.2g} take {counted(more, 'sample')}"
        )

    def sensible(self) -> int:
        """Return how many workers pay: as many as there are cores; one where starting others takes longer."""
        cores = available_cores()
        starting = 0.0 if self.scheduler == "threads" else STARTING
        return 1 if self.plan.chunks < 2 or self.plan.count * self.seconds < starting * 2 else cores

    def open(self, folder: Address, *, resume: bool) -> Store:
        """Open the folder the study is kept in. Errors as ``Store.open``."""
        return Store.open(folder, self.plan, self.outputs, self.work, resume=resume)

    def kept(self, folder: Address) -> str:
        """Return in words how much of a study a folder holds; empty if it holds none."""
        return kept_in(folder)

    def carry_out(
        self,
        folder: Address,
        compute: Scheduler,
        *,
        resume: bool = False,
        retry_failed: bool = False,
        progress: Progress | None = None,
        workers: int = 1,
    ) -> Done:
        """Compute what a folder does not hold yet, and return the whole.

        Parameters
        ----------
        resume
            whether the folder may hold a part of it already.
        progress
            called with the finished share; what it raises ends the work, and leaves whole chunks.

        Raises
        ------
        ModelError
            the folder holds something else.
        SchedulerLost
            the scheduler is gone.
        OSError
            the folder cannot be written.
        """
        store = self.open(folder, resume=resume)
        try:
            before = len(store.done())
            begun = time.perf_counter()
            length = self.plan.count / store.plan.chunks * self.seconds
            pace = (workers, length)
            damaged = carry_out(store, compute, retry_failed=retry_failed, progress=progress, pace=pace)
            data = self.completed(store)
            store.flush()
        finally:
            store.release()
        cost = self._cost(store, before if not damaged else 0, time.perf_counter() - begun)
        notes = (f"damaged chunks computed again: {len(damaged)}",) if damaged else ()
        counts = {word: int((data["outcome"] == code).sum()) for code, word in enumerate(OUTCOMES)}
        sizes = {str(name): int(size) for name, size in data.sizes.items()}
        summary = {"sizes": sizes, "outcomes": counts, "outputs": list(map(str, data))}
        outcome_counts = ", ".join(f"{count} {word}" for word, count in counts.items() if count)
        return Done(data, store.messages(), outcome_counts, cost, summary, notes)

    def completed(self, store: Store) -> xr.Dataset:
        """Return the results of a store all of whose chunks are done."""
        return store.dataset()

    def _cost(self, store: Store, before: int, seconds: float) -> str:
        """What a case takes, and what this run took, in a sentence; ``before`` chunks were there already."""
        sentence = f"A case takes about {1e3 * self.seconds:.3g} ms"
        chunks = store.plan.chunks
        if before == chunks:
            return f"{sentence}."
        left = f" for what was left, {before} of {counted(chunks, 'chunk')} were there" if before else ""
        return f"{sentence}; this run took {seconds:.3g} s{left}."


def carry_out(
    store: Store,
    compute: Scheduler,
    *,
    retry_failed: bool = False,
    progress: Progress | None = None,
    pace: tuple[int, float] = (1, 0.0),
) -> list[int]:
    """Compute whatever is not done, and return the chunks that were found damaged and computed again.

    Parameters
    ----------
    progress
        as in ``study``; its method ``expect``, if it has one, is called with the seconds that remain.
    pace
        workers of the scheduler, and the seconds that a chunk is expected to take.
    """
    # forget damaged chunks, and failed ones to be computed again
    damaged = store.damaged()
    for chunk in {*damaged, *(store.failed() if retry_failed else ())}:
        store.forget(chunk)
    # chunks left, spread over the grid
    done = store.done()
    chunks = store.plan.chunks
    left = [chunk for chunk in spread(chunks, chunks) if chunk not in done]
    clock = Pace(len(left), *pace)
    expect = getattr(progress, "expect", None)

    finished_share = 0.0

    # share and time that remains
    def tick(shares: Mapping[int, float] | None = None) -> None:
        nonlocal finished_share
        store.check_claim()
        if expect is not None:
            expect(clock.remaining(shares))
        if progress is not None:
            under_way = sum((shares or {}).values())
            share = (chunks - len(left) + clock.reached + under_way) / chunks
            finished_share = min(1.0, max(finished_share, share))
            progress(finished_share)

    # computing
    with closing(compute(store, left, tick)) as finished:
        for _ in finished:
            clock.chunk_done()
            if clock.reached == len(left):
                tick()
    return damaged


def available_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def fit_size(seconds: float, count: int, fewest: int = 1) -> int:
    """Return the number of cases of a chunk: a share of them that takes some two seconds, five at most.

    It is at least ``fewest``, so that cases are computed together, where these take five seconds at most.

    A power of two: machines of about one speed cut a study alike, and can go on with each other's.
    """
    per_case = max(seconds, 1e-6)
    share = max(count // _CHUNKS, min(SHORTEST_CHUNK / per_case, count // _FEWEST_CHUNKS))
    fitting = int(min(CHUNK_SECONDS / per_case, MOST_IN_CHUNK, max(1, share)))
    size = 1 << max(0, fitting.bit_length() - 1)
    return max(size, fewest) if fewest * per_case <= CHUNK_SECONDS and fewest <= count else size


def pays(scheduler: str | None, sensible: int) -> int:
    """Return the number of workers to assume where none is asked for: one of a cluster, whose number is not known."""
    return 1 if "://" in (scheduler or "") else sensible


def workers_said(count: int) -> str:
    """Return a number of workers in words."""
    return counted(count, "worker")


def span(seconds: float) -> str:
    """Return a length of time in the unit that suits it."""
    for unit, length in (("years", 31557600.0), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:.3g} {unit}"
    return f"{seconds:.2g} s"
