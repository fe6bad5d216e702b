"""Processes that end with the one that started them, however early that ends.

A process that is spawned reads what it is to do, and for that imports this package: seconds in which whoever started it
may be killed. Therefore it looks after its parent before it imports anything else: unpickling a ``Worker`` begins with
``_arrived``, which is handed the parent's id.

Takes nothing; gives a context for ``concurrent.futures.ProcessPoolExecutor``.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any

_LOOKING = 0.2  # seconds between two looks at whether the parent lives


class Worker(SpawnProcess):
    """A spawned process that ends with its parent, and leaves Ctrl-C to it."""

    def __reduce__(self) -> tuple[Callable[[int], Worker], tuple[int], dict[str, Any]]:
        """Let the new process look after this one before it reads anything else."""
        return _arrived, (os.getpid(),), self.__dict__


class Workers(SpawnContext):
    """Starts such processes."""

    Process = Worker


def _arrived(parent: int) -> Worker:
    """Begin a process: the rest of it is not read yet."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_leave_with, args=(parent,), daemon=True).start()
    return Worker.__new__(Worker)


def _leave_with(parent: int) -> None:
    """End this process once its parent is no more: nobody would ever read what it computes."""
    while not _has_gone(parent):
        time.sleep(_LOOKING)
    os._exit(1)


def _has_gone(parent: int) -> bool:
    """Whether the parent has ended; where a process keeps the id of a dead parent, its end of a pipe tells."""
    leader = multiprocessing.parent_process()
    return os.getppid() != parent or (leader is not None and not leader.is_alive())
