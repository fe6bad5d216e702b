"""Limits of computing time: long computations check them now and then, and stop when the time is up.

A limit holds for all calls within its block, in this thread; ``carrying`` takes it to another thread. The time in which
kernels are compiled, once after an installation, does not count.
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
    """The time that work may take is over, or somebody has stopped it."""


class TimeLimit:
    """A time at which work ends, in seconds from now; infinite for none."""

    def __init__(self, seconds: float = math.inf) -> None:
        self._end = _now() + seconds
        self._stopped = threading.Event()

    @property
    def left(self) -> float:
        """Seconds that are left; 0 where it was stopped."""
        return 0.0 if self._stopped.is_set() else max(0.0, self._end - _now())

    def stop(self) -> None:
        """End the work at its next look."""
        self._stopped.set()

    def check(self) -> None:
        """Raise OutOfTime if the time is over."""
        if not self.left:
            raise OutOfTime("the time is over")


_LIMITS: contextvars.ContextVar[tuple[TimeLimit, ...]] = contextvars.ContextVar("limits", default=())


@contextmanager
def limited(limit: TimeLimit) -> Iterator[None]:
    """Within the block ``check_time`` heeds a limit, beside those of blocks around it."""
    before = _LIMITS.set((*_LIMITS.get(), limit))
    try:
        yield
    finally:
        _LIMITS.reset(before)


def check_time() -> None:
    """Raise OutOfTime if one of the limits of the blocks around is over."""
    for limit in _LIMITS.get():
        limit.check()


def carrying(work: Callable[[], T]) -> Callable[[], T]:
    """Return work for another thread, in which the limits of this one hold as well."""
    context = contextvars.copy_context()
    return lambda: context.run(work)


def _now() -> float:
    """The time that goes by while nothing is compiled [s]."""
    return time.monotonic() - COMPILATION.seconds
