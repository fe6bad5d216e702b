"""How long the main thread does not hear Ctrl-C: spans of processor time between two looks of Python at signals."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable
from types import FrameType

_TICK = 0.002  # seconds of processor time of the process
ANSWER = 0.5
"""Seconds within which Ctrl-C must be heard on an idle machine."""


def longest_deafness(work: Callable[[], object]) -> tuple[float, str]:
    """Do some work; return the longest processor time [s] of this thread between two signals heard, and where it ended.

    The work sees signals of a timer all the time; Python looks at them between two lines, not within one of NumPy.
    """
    assert threading.current_thread() is threading.main_thread()
    longest, last = (0.0, ""), time.thread_time()

    def hear(_: int, frame: FrameType | None) -> None:
        nonlocal longest, last
        now = time.thread_time()
        if now - last > longest[0] and frame is not None:
            longest = now - last, f"{frame.f_code.co_filename}:{frame.f_lineno}"
        last = now

    before = signal.signal(signal.SIGPROF, hear)
    signal.setitimer(signal.ITIMER_PROF, _TICK, _TICK)
    try:
        work()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
    return longest
