"""Scheduler: it gets a store and numbers of chunks, has them computed, and yields each number when it is done.

A scheduler never sees a result: the worker keeps its chunk in the store, results first, then the marker. So workers, or
the scheduler itself, may end at any time, and the study goes on from the markers. A scheduler keeps three promises:

* chunks under way are few, ``WINDOW`` a worker, so that memory does not grow with the study;
* ``tick`` is called several times a second, and what it raises ends the work: nothing is begun any more;
* a chunk that kills ``PATIENCE`` workers which computed nothing else is written off, and the others go on.

To add a scheduler: its file with a function ``Wanted -> context manager of a Scheduler``, which looks for everything
that can be wrong, one line in the table in ``__init__``, and its test page.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

from gearrattle.studies.case_runs import WORKER_LOST, empty
from gearrattle.studies.study_store import Store

PATIENCE = 3
"""Workers that a chunk may kill, alone, before it is written off."""
WINDOW = 3
"""Chunks under way a worker: one computed, two at hand."""
TICK = 0.2
"""Seconds between two looks at whether to stop."""


class Tick(Protocol):
    """Callback, called several times a second; what it raises ends the work."""

    def __call__(self, shares: Mapping[int, float] | None = None, /) -> None:
        """Take the shares of the chunks under way, by number, where they are known."""


class Scheduler(Protocol):
    """Callable that has chunks computed."""

    def __call__(self, store: Store, chunks: Sequence[int], tick: Tick, /) -> Generator[int, None, None]:
        """Have chunks computed and kept, in any order; yield each once it is kept.

        Raises
        ------
        OSError
            the store cannot be written.
        SchedulerLost
            the scheduler is gone; what was kept stays.
        """


@dataclass(frozen=True)
class Wanted:
    """Request of a scheduler; without a number of workers the scheduler chooses it.

    ``sensible`` is the number of workers that pay on this machine; ``shared`` says whether other processes see where
    the study is kept.
    """

    address: Any
    workers: int | None
    sensible: int
    shared: bool = True


Opening = Callable[[Wanted], AbstractContextManager[Scheduler]]


def write_off(store: Store, chunk: int) -> None:
    """Store a chunk that no worker survives: all of its cases have the outcome "worker lost"."""
    store.keep(chunk, empty(store.plan, store.outputs, chunk, WORKER_LOST))
