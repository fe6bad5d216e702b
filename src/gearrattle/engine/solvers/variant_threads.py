"""Many variants of a driveline by ``exact``, in threads: the same bits as one at a time, in the order they were given.

A thread takes a task, marches it to its end and hands the motion to a function that keeps what is wanted of it; the
motion itself is let go. So a few motions are held at a time, however many variants there are. The march and the
building of regions let go of the interpreter (``kernels``); the little Python between them is what threads share.
Regions of earlier systems (``slots.slots_of``) are not looked up: thousands of variants would displace them.

A variant that fails - crossings that pile up, a state or a region that is not finite - is an outcome among the others.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from gearrattle.engine.solvers.exact import ExactMarch
from gearrattle.engine.solvers.scheme_choice import is_large
from gearrattle.engine.solvers.slots import fresh_slots
from gearrattle.engine.solvers.solver import Marching, Motion, Position, Task
from gearrattle.engine.solvers.sweep import SweepMarch
from gearrattle.engine.system.region_store import Capacity
from gearrattle.errors import ConvergenceError
from gearrattle.outcome import Outcome

T = TypeVar("T")

_WAITING = 4  # tasks a thread may have ahead of the one whose result is asked for


@dataclass(frozen=True)
class Ended(Generic[T]):
    """Outcome of one variant."""

    index: int  # which, counted from 0 in the order given
    outcome: Outcome  # DONE, or what stopped it: CHATTER, NON_FINITE
    kept: T | None  # what was kept of its motion; None if it failed
    position: Position | None = None  # where it stopped; None if it is done, or could not begin
    reason: str = ""  # words for what could not be computed at all; empty otherwise


def march_all(tasks: Iterable[Task], keep: Callable[[Motion], T], threads: int | None = None) -> Iterator[Ended[T]]:
    """March every task and keep something of each motion, in the order given.

    The tasks are drawn as threads become free: a generator may assemble them on the way. A result is the same for any
    number of threads.

    tasks: what to integrate, each on its own.
    keep: called in the thread that made the motion; what it raises is raised here, when its turn comes.
    threads: how many; as many as the machine has cores by default.
    """
    count = threads or os.cpu_count() or 1
    numbered = enumerate(tasks)
    capacities = deque[Capacity](maxlen=1)
    if count == 1:
        for index, task in numbered:
            yield march_one(index, task, keep, capacities)
        return
    ahead: deque[Future[Ended[T]]] = deque()
    with ThreadPoolExecutor(count) as pool:
        try:
            for index, task in numbered:
                ahead.append(pool.submit(march_one, index, task, keep, capacities))
                if len(ahead) >= _WAITING * count:
                    yield ahead.popleft().result()
            while ahead:
                yield ahead.popleft().result()
        finally:
            for future in ahead:
                future.cancel()


def march_one(index: int, task: Task, keep: Callable[[Motion], T], capacities: deque[Capacity]) -> Ended[T]:
    """March one task to its end, alone with its regions; ``capacities`` tells how much capacity the last one took."""
    # the sweep or tables, alone with its regions
    march: Marching
    try:
        with np.errstate(all="ignore"):  # what is not finite is told by the outcome
            if is_large(task.system):
                march = SweepMarch(task)
            else:
                march = ExactMarch(task, fresh_slots(task.system, next(iter(capacities), None)))
    except (ConvergenceError, FloatingPointError, ArithmeticError, ValueError) as error:
        return Ended(index, Outcome.NON_FINITE, None, reason=str(error))
    try:
        # march to the end
        outcome = march.advance()
        while outcome is Outcome.SLICE_SPENT:
            outcome = march.advance()
    except (ConvergenceError, FloatingPointError) as error:
        return Ended(index, Outcome.NON_FINITE, None, march.position(), str(error))
    if outcome is not Outcome.DONE:
        return Ended(index, outcome, None, march.position())
    # the next variant of this thread begins with as much capacity
    if isinstance(march, ExactMarch):
        capacities.append(march.slots.store.capacity())
    return Ended(index, outcome, keep(march.motion()))
