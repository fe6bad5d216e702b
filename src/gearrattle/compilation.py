"""Time that this process spends compiling kernels; forecasts of computing time leave it out.

A kernel is compiled when it is first called after an installation, and then kept on disk.
"""

from __future__ import annotations

import threading
import time


class Stopwatch:
    """Adds up the time spent within ``with`` blocks of all threads; time in which blocks overlap counts once.

    Examples
    --------
    >>> from gearrattle.compilation import Stopwatch
    >>> stopwatch = Stopwatch()
    >>> with stopwatch:
    ...     0.0 <= stopwatch.current < 1.0
    True
    >>> stopwatch.current, 0.0 <= stopwatch.seconds < 1.0
    (0.0, True)
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._blocks = 0
        self._begin = 0.0
        self._spent = 0.0

    def __enter__(self) -> None:
        with self._lock:
            if self._blocks == 0:
                self._begin = time.monotonic()
            self._blocks += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._blocks -= 1
            if self._blocks == 0:
                self._spent += time.monotonic() - self._begin

    @property
    def current(self) -> float:
        """Time since the first of the current blocks was entered [s]; 0 outside all blocks."""
        with self._lock:
            return time.monotonic() - self._begin if self._blocks else 0.0

    @property
    def seconds(self) -> float:
        """Total time within blocks up to now [s]."""
        with self._lock:
            return self._spent + (time.monotonic() - self._begin if self._blocks else 0.0)


COMPILATION = Stopwatch()
"""Measures the compilation of kernels."""
