"""Long computations with a progress display, which the user can stop.

The computation runs in a separate thread. The main thread only shows progress and waits, so that Ctrl-C is handled at
once, even while a kernel is being compiled. Progress is shown on stderr after two seconds: as a bar on a terminal,
otherwise as single lines, without repetitions.
"""

from __future__ import annotations

import contextvars
import math
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

from gearrattle.cli.failures import WORKER
from gearrattle.compilation import COMPILATION
from gearrattle.errors import Cancelled

T = TypeVar("T")

_FIRST = "preparing"
_COMPILING = " (compiling, once after an installation)"
_LOADING = 0.5  # s; loading a kernel from the cache takes less
_TICK = 0.05  # s, between two checks of the work
_PATIENCE = 2.0  # s, before progress is shown, and before its rate is known
_GRACE = 0.25  # s, for the work to stop after Ctrl-C
_GRACE_FOR_KNOWN = 10.0  # s, for the work to stop after Ctrl-C and return a partial result
_LINE_EVERY = 5.0  # s between two plain lines


class Watch:
    """Progress of the work and the request to stop it; call it with the finished share, 0 to 1."""

    def __init__(self) -> None:
        self.phase = _FIRST
        self.fraction = 0.0
        self._since: tuple[float, float] | None = None
        self._expected: tuple[float, float] | None = None
        self.reason = ""
        self._stop = threading.Event()

    def __call__(self, fraction: float) -> None:
        """Store the finished share; raise Cancelled if the work should stop."""
        if self.phase == _FIRST:
            self.phase = "simulating"
        self.fraction = fraction
        if self._since is None:
            self._since = _working_time(), fraction
        if self._stop.is_set():
            raise Cancelled("stopped by the user")

    def enter(self, phase: str) -> None:
        """Begin another phase, named in a word or two."""
        self.phase = phase
        self._since = None
        self._expected = None
        self.reason = ""
        self(0.0)

    def expect(self, seconds: float) -> None:
        """Store the remaining time of the phase [s], if the work can estimate it; NaN: unknown."""
        self._expected = time.monotonic(), seconds

    def because(self, reason: str) -> None:
        """Store the reason in words why the phase takes long."""
        self.reason = reason

    def remaining(self) -> float | None:
        """Remaining time of this phase [s], estimated by the work or from the rate of progress so far; None if unknown.

        The rate does not count the time of compilation. While a kernel is being compiled the value is None.
        """
        if COMPILATION.current > _LOADING:
            return None
        if self._expected is not None:
            at, seconds = self._expected
            if math.isnan(seconds):
                return None
            return max(0.0, seconds - (time.monotonic() - at))
        if self._since is None or self.fraction <= self._since[1]:
            return None
        took = _working_time() - self._since[0]
        if took < _PATIENCE:
            return None
        return took * (1.0 - self.fraction) / (self.fraction - self._since[1])

    def words(self) -> str:
        """Return the phase, and whether kernels are compiled in it."""
        return self.phase + (_COMPILING if COMPILATION.current > _LOADING else "")

    def stop(self) -> None:
        """Ask the work to stop at its next report."""
        self._stop.set()


def watched(work: Callable[[Watch], T], grace: float = _GRACE, known: Callable[[T], None] | None = None) -> T:
    """Run ``work`` in the background, show its progress, and stop it on Ctrl-C.

    Parameters
    ----------
    grace
        time that the work may take to stop [s].
    known
        called after Ctrl-C with the result, if the work still returns one; it then has ``_GRACE_FOR_KNOWN`` seconds to
        stop.

    Raises
    ------
    KeyboardInterrupt
        on Ctrl-C or SIGTERM, when the work has stopped or its time to stop is over.
    Cancelled
        on Ctrl-C, after ``known`` was called.
    """
    watch = Watch()
    result = []
    failure = []

    def body() -> None:
        try:
            result.append(work(watch))
        except BaseException as error:
            failure.append(error)
        finally:
            ended.set()

    # start the work in a thread of its own
    ended = threading.Event()
    context = contextvars.copy_context()  # the thread may read the same files as its caller
    thread = threading.Thread(target=context.run, args=(body,), name=WORKER, daemon=True)
    display = _Display(watch)
    try:
        thread.start()
        # show progress until it ends; not thread.join: in CPython 3.11 an interrupted join marks the thread as ended
        while not ended.wait(_TICK):
            display.update()
    # on Ctrl-C: stop the work, and pass its partial result to ``known``
    except KeyboardInterrupt as interruption:
        watch.stop()
        if thread.ident is not None:  # else interrupted before it began
            ended.wait(grace if known is None else _GRACE_FOR_KNOWN)
        if known is not None and result:
            display.close()
            known(result[0])
            raise Cancelled(kept="interrupted: what was known by then is shown") from interruption
        raise
    finally:
        display.close()
    # hand on what the work returned or raised
    if failure:
        raise failure[0]
    return result[0]


def _working_time() -> float:
    """Return the time without that of compilation [s]."""
    return time.monotonic() - COMPILATION.seconds


class _Display:
    """Shows the progress of a watch on stderr, after ``_PATIENCE``."""

    def __init__(self, watch: Watch) -> None:
        self._watch = watch
        self._next = time.monotonic() + _PATIENCE
        self._bar: Any = None
        self._told = ""

    def update(self) -> None:
        """Show the present state if it is time."""
        now = time.monotonic()
        if now < self._next:
            return
        if sys.stderr.isatty():
            self._draw()
            return
        self._next = now + _LINE_EVERY
        self._print()

    def _print(self) -> None:
        share = f": {100.0 * self._watch.fraction:.0f} %" if self._watch.fraction else ""
        pace = f", {words}" if (words := self._left()) else ""
        if (line := f"{self._watch.words()}{share}{pace}") != self._told:
            print(line, file=sys.stderr, flush=True)
            self._told = line

    def _left(self) -> str:
        """Return in words the time left and the reason for its length; empty where neither is known, and at the end."""
        left = self._watch.remaining()
        pace = "" if left is None or left < 1.0 else f"about {_duration(left)} left"
        return "; ".join(words for words in (pace, self._watch.reason) if words)

    def _draw(self) -> None:
        if self._bar is None:
            from rich.console import Console
            from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

            texts = TextColumn("{task.description}"), TextColumn("{task.fields[left]}")
            self._bar = Progress(
                texts[0], BarColumn(), TaskProgressColumn(), texts[1], console=Console(stderr=True), transient=True
            )
            self._bar.start()
            self._bar.add_task(self._watch.words(), total=1.0, left="")
        watch = self._watch
        self._bar.update(0, description=watch.words(), completed=watch.fraction, left=self._left())

    def close(self) -> None:
        """Clear the bar."""
        if self._bar is not None:
            self._bar.stop()


def _duration(seconds: float) -> str:
    """Write a duration in the unit that fits."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.0f} {unit}"
    return f"{seconds:.0f} s"
