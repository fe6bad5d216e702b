"""Stream of a motion of any length: chunk by chunk, in the memory of one chunk.

The division into chunks changes no bit: samples, crossings and force integrals are those of one long run. (Only
crossings that coincide, to rounding, with each other and with the end of a chunk may be listed in another order.) The
sums of the criteria are continued from chunk to chunk (``quantities.evaluation.add``), so the verdict on a million
cycles needs no earlier chunk.

With a *store* every finished chunk becomes a file beside the state of the solver (``chunk_store``). However the program
ends, a later program goes on after the last complete chunk.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Self

from gearrattle.engine.solvers import SOLVERS, Extensible
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, check_model
from gearrattle.model.value_kinds import CALLBACK, FLAG, Count, argument_problems, check_arguments
from gearrattle.quantities.evaluation import add, verdict_of
from gearrattle.quantities.quantity import Sums
from gearrattle.quantities.verdict import Verdict
from gearrattle.results import Run
from gearrattle.signals import parts_of
from gearrattle.simulation.chunk_store import Store
from gearrattle.simulation.integrate import finish
from gearrattle.simulation.limits import check_memory
from gearrattle.simulation.simulate import Plan, prepare
from gearrattle.wording import counted

MOST_SAMPLES = 100_000
"""Number of samples of a chunk, about, by default."""
MOST_CYCLES = 5000
"""Largest number of cycles of a chunk by default."""


def stream(
    model: Model,
    algorithm: str | None = None,
    *,
    cycles: int | None = None,
    chunk: int | None = None,
    samples_per_cycle: int | None = None,
    discard: int | None = None,
    tolerance: float | None = None,
    step: float | str | None = None,
    initial: str | Mapping[str, Sequence[float]] | None = None,
    audit: bool = False,
    progress: Callable[[float], None] | None = None,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
) -> Stream:
    """Integrate a model over many cycles, chunk by chunk.

    Settings left at None come from the file, then from the defaults. A chunk is computed when it is asked for.

    Parameters
    ----------
    model
        the driveline.
    algorithm
        one that can go on where it ended: "exact".
    cycles
        length of the whole motion, in periods T of all orders together.
    chunk
        periods per chunk; the default makes chunks of about 100 000 samples, 5000 periods at most.
    samples_per_cycle
        output samples per period; 1 stores one state per period.
    discard
        periods criteria leave out at the start.
    tolerance
        exact: bound on a crossing's residual relative to the element's largest corner.
    step
        fixed-step algorithms: the step [s] or a string with a unit.
    initial
        "steady", "static", "zero" or {"angle": [...], "velocity": [...]} [rad, rad/s].
    audit
        whether to audit the energy of every chunk (adds an eighth to a quarter to its time).
    progress
        called with the fraction of the whole motion done; what it raises ends the call, not the motion: ask
        for the next chunk to go on.
    store
        folder that keeps every chunk as a file; None keeps nothing.
    resume
        go on with what the store holds (from the beginning where it holds nothing).

    Returns
    -------
    Stream
        An iterator of runs, one per chunk.

    Raises
    ------
    ModelError
        bad settings, no static equilibrium, an algorithm without chunks; a store that holds a run already
        (and ``resume`` is not set), or the run of another model, other settings or other versions.

    Examples
    --------
    >>> [len(run.events) > 0 for run in gr.stream(gr.example("case3"), cycles=20, chunk=10)]
    [True, True]
    """
    check_model(model)
    check_arguments(audit=(FLAG, audit), resume=(FLAG, resume), progress=(CALLBACK, progress))
    arguments = {
        "algorithm": algorithm,
        "cycles": cycles,
        "samples_per_cycle": samples_per_cycle,
        "discard": discard,
        "tolerance": tolerance,
        "step": step,
        "initial": initial,
    }
    plan = prepare(model, arguments, audit)
    if resume and store is None:
        raise ModelError(Problem("resume", "", "needs a store to go on with", "name the folder: store = ..."))
    chunk = _length(chunk, plan)
    check_memory(plan.task.system, min(chunk, plan.task.cycles), plan.task.samples_per_cycle, "chunk")
    march = _begun(plan, chunk)
    kept = None if store is None else Store.open(store, plan.model, {"chunk": chunk, "audit": audit}, resume=resume)
    return Stream(plan, march, chunk, progress, kept)


def _length(chunk: int | None, plan: Plan) -> int:
    """Number of periods of a chunk; ModelError unless it is an integer from 1 on."""
    if chunk is None:
        return max(1, min(MOST_CYCLES, MOST_SAMPLES // plan.task.samples_per_cycle))
    if problems := argument_problems({"chunk": (Count(1), chunk)}):
        raise ModelError(problems)
    return chunk


def _begun(plan: Plan, chunk: int) -> Extensible:
    """The solver, ready for the first chunk; ModelError if it cannot continue a run after its end."""
    task = replace(plan.task, cycles=min(chunk, plan.task.cycles))
    march = SOLVERS[plan.algorithm](task)
    if not isinstance(march, Extensible):
        rule = "cannot go on where it ended with this driveline, so it has no chunks"
        raise ModelError(Problem("simulation.algorithm", plan.algorithm, rule, "use simulate for a shorter run"))
    return march


class Stream:
    """A long motion: an iterator over the runs of its chunks, in order.

    The time of a run counts from the begin of the whole motion; its ``discard`` is the number of its cycles that the
    criteria leave out.

    Attributes
    ----------
    model
        the model with every setting filled in.
    cycles
        length of the whole motion, in periods.
    done
        periods computed so far, those of a resumed store included.

    Examples
    --------
    >>> stream = gr.stream(gr.example("case3"), cycles=20, chunk=10)
    >>> sum(len(run.events) for run in stream) > 100
    True
    """

    def __init__(
        self,
        plan: Plan,
        march: Extensible,
        chunk: int,
        progress: Callable[[float], None] | None,
        store: Store | None,
    ) -> None:
        self.model = plan.model
        self.cycles = plan.task.cycles
        self.done = 0
        self._plan = plan
        self._march = march
        self._chunk = chunk
        self._progress = progress
        self._store = store
        self._sums: Sums | None = None
        self._ready = True  # whether the solver is prepared for the next chunk
        state = None if store is None else store.state
        if state is not None:
            self.done = state.done
            self._sums = Sums.unpacked(state.sums, parts_of(plan.layout), plan.algorithm)
            if self.done < self.cycles:
                march.restore(state.march, self._next)

    @property
    def _next(self) -> int:
        """Periods of the next chunk."""
        return min(self._chunk, self.cycles - self.done)

    def __iter__(self) -> Self:
        """Return the stream itself."""
        return self

    def __next__(self) -> Run:
        """Compute, judge and store the next chunk.

        Raises
        ------
        ModelError
            another program writes into the store, or what was kept there has been removed.
        ConvergenceError
            the algorithm failed.
        """
        # end of the motion
        if self.done >= self.cycles:
            if self._store is not None:
                self._store.release()
            raise StopIteration
        if self._store is not None:
            self._store.check_there()
        # prepare the next chunk, unless a failed call has done so
        plan = self._plan
        cycles = self._next
        if not self._ready:
            self._march.extend(cycles)
            self._ready = True
        # compute the chunk
        discard = min(max(plan.discard - self.done, 0), cycles)
        run = plan.run(
            finish(
                self._march,
                replace(plan.task, cycles=cycles),
                plan.layout,
                plan.algorithm,
                discard=discard,
                progress=None if self._progress is None else self._report,
                begin=time.perf_counter(),
                first_cycle=self.done,
            )
        )
        # add it to the sums of the criteria, and store it before it counts
        sums = add(run.trajectory, self._sums)
        if self._store is not None:
            self._store.keep(run, self._march.snapshot(), sums.packed(), self.done + cycles)
        self._sums = sums
        self._ready = False
        self.done = self.done + cycles
        return run

    def close(self) -> int:
        """Keep no further chunk, whatever another thread still computes; return the periods kept."""
        return 0 if self._store is None else self._store.close()

    def _report(self, fraction: float) -> None:
        assert self._progress is not None
        self._progress((self.done + fraction * self._next) / self.cycles)

    def verdict(self) -> Verdict:
        """Judge all chunks so far as one motion.

        Raises
        ------
        ModelError
            no cycle after the discarded ones has been computed yet.
        """
        if self._sums is None or self._sums.scope is None:
            remedy = "ask for more chunks first, or discard fewer cycles"
            raise ModelError(
                Problem("discard", f"{counted(self.done, 'cycle')} so far", "nothing is left to judge", remedy)
            )
        return verdict_of(self._sums, units=self.model.units)
