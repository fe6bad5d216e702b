"""Limits of computing time: long computations check them repeatedly and stop when the time is over.

A limit applies to all calls within its ``with`` block in this thread; ``carrying`` passes it to another thread. Time
spent compiling kernels, once after an installation, does not count.
"""

from __future__ import annotations

import contextvars
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from gearrattle.compilation import COMPILATION
from gearrattle.errors import Cancelled

T = TypeVar("T")


class OutOfTime(Cancelled):
    """The time limit of a computation is over, or another thread has stopped it."""


class TimeLimit:
    """A limit of computing time, in seconds from now; infinite for no limit."""

    def __init__(self, seconds: float = math.inf) -> None:
        self._end = _now() + seconds
        self._stopped = threading.Event()

    @property
    def left(self) -> float:
        """Time left [s]; 0 after ``stop``."""
        return 0.0 if self._stopped.is_set() else max(0.0, self._end - _now())

    def stop(self) -> None:
        """End the computation when it next checks the limit."""
        self._stopped.set()

    def check(self) -> None:
        """Raise OutOfTime if the time is over."""
        if not self.left:
            raise OutOfTime("the time is over")


_LIMITS: contextvars.ContextVar[tuple[TimeLimit, ...]] = contextvars.ContextVar("limits", default=())


@contextmanager
def limited(limit: TimeLimit) -> Iterator[None]:
    """Context in which ``check_time`` checks this limit, besides the limits of the contexts around it."""
    before = _LIMITS.set((*_LIMITS.get(), limit))
    try:
        yield
    finally:
        _LIMITS.reset(before)


def check_time() -> None:
    """Raise OutOfTime if a limit of one of the contexts around is over."""
    for limit in _LIMITS.get():
        limit.check()


def carrying(work: Callable[[], T]) -> Callable[[], T]:
    """Return a function for another thread that runs ``work`` under the limits of this thread."""
    context = contextvars.copy_context()
    return lambda: context.run(work)


def _now() -> float:
    """The time without the time spent compiling kernels [s]."""
    return time.monotonic() - COMPILATION.seconds
