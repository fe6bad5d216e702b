"""Processes that end with the one that started them, however early that ends.

A spawned process imports the main module of its parent and what its task needs: seconds in which the parent may be
killed. Therefore it watches its parent before it imports any of that. Unpickling a ``Worker`` begins with ``_arrived``,
which gets the parent's id. ``multiprocessing`` would import the main module even earlier, so that module is hidden from
it, and ``_arrived`` imports it.

On Linux, processes can be forked from one that has imported what they use: ``multiprocessing``'s fork server. It has
one thread, so that a fork is safe. On macOS, libraries of the system are not safe after a fork.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import spawn
from multiprocessing.context import BaseContext, SpawnContext, SpawnProcess
from multiprocessing.process import BaseProcess
from typing import Any, ClassVar

_LOOKING = 0.2  # seconds between two looks at whether the parent lives
_FORKED_FROM = threading.Event()
"""Set where other processes are forked from this one, which therefore has one thread and no children of its own."""
_HIDDEN = threading.Lock()
"""Held while the main module is hidden, so that of two threads that start processes the second finds it again."""


class _Process(BaseProcess):
    """A process that ends with the one that started it, and leaves Ctrl-C to it."""

    imports_main: ClassVar[bool] = True
    """Whether it imports the main module of its parent."""

    is_child: ClassVar[bool] = True
    """Whether its parent is the process that started it, and not one that it is forked from."""

    def start(self) -> None:
        """Start it; ``multiprocessing`` does not see a main module meanwhile."""
        with _HIDDEN:
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

    def __reduce__(self) -> tuple[Callable[..., BaseProcess], tuple[Any, ...], dict[str, Any]]:
        """Let the new process watch this one before it imports or reads anything else."""
        return _arrived, (type(self), os.getpid() if self.is_child else None, self._main), self.__dict__


class Worker(_Process, SpawnProcess):
    """A spawned process."""


class Workers(SpawnContext):
    """Starts such processes."""

    Process = Worker


class _Apart(Worker):
    """A spawned process that imports nothing of the main module."""

    imports_main: ClassVar[bool] = False


class WorkersWithoutMain(Workers):
    """Starts processes that import nothing of the main module."""

    Process = _Apart


if sys.platform == "linux":
    from multiprocessing.context import ForkServerContext, ForkServerProcess

    class _Forked(_Process, ForkServerProcess):
        """A process that is forked from the fork server."""

        imports_main: ClassVar[bool] = False
        is_child: ClassVar[bool] = False

    class _Forking(ForkServerContext):
        Process = _Forked


def warm_processes(module: str) -> BaseContext:
    """Return a context whose processes import nothing of the main module."""
    if sys.platform != "linux":
        return WorkersWithoutMain()
    context = _Forking()
    context.set_forkserver_preload([module])
    return context


@contextmanager
def becoming_warm() -> Iterator[None]:
    """Within it the process that others are to be forked from ends with its parent, and leaves Ctrl-C to it.

    Afterwards it has no other thread; the fork server ends when nobody can ask it any more.
    """
    _FORKED_FROM.set()
    interrupted = signal.signal(signal.SIGINT, signal.SIG_IGN)
    is_warm = threading.Event()
    watching = threading.Thread(target=_leave_with, args=(os.getppid(), is_warm))
    watching.start()
    try:
        yield
    finally:
        is_warm.set()
        watching.join()
        signal.signal(signal.SIGINT, interrupted)


def may_start_others() -> bool:
    """Whether this process may start others for its own work: it is none that others started or are forked from."""
    return multiprocessing.parent_process() is None and not _FORKED_FROM.is_set()


def _arrived(kind: type[BaseProcess], parent: int | None, main: dict[str, Any]) -> BaseProcess:
    """Begin a process: watch the parent, then import its main module; the rest is not read yet."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_leave_with, args=(parent or os.getppid(), threading.Event()), daemon=True).start()
    spawn.prepare(main)
    return kind.__new__(kind)


def _leave_with(parent: int, no_more: threading.Event) -> None:
    """End this process once its parent is no more: its results would be lost."""
    while not no_more.wait(_LOOKING):
        if _has_gone(parent):
            os._exit(1)


def _has_gone(parent: int) -> bool:
    """Whether the parent has ended; where a process keeps the id of a dead parent, its end of a pipe tells."""
    leader = multiprocessing.parent_process()
    return os.getppid() != parent or (leader is not None and not leader.is_alive())
