"""Time in which kernels are being compiled in this process: no forecast counts it as work.

A kernel is compiled once, when it is first called after an installation, and kept on disk.
"""

from __future__ import annotations

import threading
import time


class Stopwatch:
    """Adds up the time within ``with`` blocks, of all threads; where blocks overlap it counts once.

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
        """Time since a thread entered the blocks under way [s]; 0 where none is."""
        with self._lock:
            return time.monotonic() - self._begin if self._blocks else 0.0

    @property
    def seconds(self) -> float:
        """Time within blocks so far [s]."""
        with self._lock:
            return self._spent + (time.monotonic() - self._begin if self._blocks else 0.0)


COMPILATION = Stopwatch()
"""Of the compilation of kernels."""
