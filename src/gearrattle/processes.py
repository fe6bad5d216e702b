"""Processes that end with the one that started them, however early that ends.

A spawned process imports the main module of its parent and what its task needs: seconds in which the parent may be
killed. Therefore it watches its parent before it imports any of that. Unpickling a ``Worker`` begins with ``_arrived``,
which gets the parent's id. ``multiprocessing`` would import the main module even before that, so it is not told of one:
``_arrived`` has it imported.

Takes nothing; gives a context for ``concurrent.futures.ProcessPoolExecutor``.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from multiprocessing import spawn
from multiprocessing.context import SpawnContext, SpawnProcess
from typing import Any, ClassVar

_LOOKING = 0.2  # seconds between two looks at whether the parent lives


class Worker(SpawnProcess):
    """A spawned process that ends with its parent, and leaves Ctrl-C to it."""

    imports_main: ClassVar[bool] = True
    """Whether it imports the main module of its parent."""

    def start(self) -> None:
        """Start it; ``multiprocessing`` is not told of a main module meanwhile."""
        known = spawn.get_preparation_data(self.name) if self.imports_main else {}
        self._main = {name: value for name, value in known.items() if name.startswith("init_main")}
        main = sys.modules["__main__"].__dict__
        hidden: dict[str, Any] = {name: main[name] for name in ("__spec__", "__file__") if name in main}
        try:
            main.update(dict.fromkeys(hidden.keys() & {"__spec__"}))
            main.pop(
                "__file__", None
            )  # absent, not None: inspect, in other threads, takes a module of None for built in
            super().start()
        finally:
            main.update(hidden)

    def __reduce__(self) -> tuple[Callable[..., Worker], tuple[int, dict[str, Any]], dict[str, Any]]:
        """Let the new process watch this one before it imports or reads anything else."""
        return _arrived, (os.getpid(), self._main), self.__dict__


class Workers(SpawnContext):
    """Starts such processes."""

    Process = Worker


def _arrived(parent: int, main: dict[str, Any]) -> Worker:
    """Begin a process: watch the parent, then import its main module; the rest is not read yet."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_leave_with, args=(parent,), daemon=True).start()
    spawn.prepare(main)
    return Worker.__new__(Worker)


def _leave_with(parent: int) -> None:
    """End this process once its parent is no more: its results would be lost."""
    while not _has_gone(parent):
        time.sleep(_LOOKING)
    os._exit(1)


def _has_gone(parent: int) -> bool:
    """Whether the parent has ended; where a process keeps the id of a dead parent, its end of a pipe tells."""
    leader = multiprocessing.parent_process()
    return os.getppid() != parent or (leader is not None and not leader.is_alive())
