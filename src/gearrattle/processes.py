"""Processes that end when the process that started them ends, even if that happens during their start.

A spawned process imports the main module of its parent and the modules for its task. This takes seconds, in which the
parent may be killed. Therefore the process watches its parent before these imports. Unpickling a ``Worker`` begins with
``_arrived``, which gets the parent's id. ``multiprocessing`` would import the main module even earlier, so the main
module is hidden from it, and ``_arrived`` imports it.

On Linux, processes can be forked from a process that has already imported the modules: the fork server of
``multiprocessing``. It has one thread, so a fork is safe. On macOS, libraries of the system are not safe after a fork.
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

_LOOKING = 0.2  # s, between two checks whether the parent lives
_FORKED_FROM = threading.Event()
"""Set in the process from which others are forked; it must have one thread and start no processes for its own work."""
_HIDDEN = threading.Lock()
"""Held while the main module is hidden, so that another thread that starts a process waits until it is back."""


class _Process(BaseProcess):
    """A process that ends with the process that started it, and ignores Ctrl-C, which that process handles."""

    imports_main: ClassVar[bool] = True
    """Whether the process imports the main module of its parent."""

    is_child: ClassVar[bool] = True
    """Whether the operating system's parent is the process that started it, not the one from which it is forked."""

    def start(self) -> None:
        """Start the process, with the main module hidden from ``multiprocessing``."""
        with _HIDDEN:
            known = spawn.get_preparation_data(self.name) if self.imports_main else {}
            self._main = {name: value for name, value in known.items() if name.startswith("init_main")}
            main = sys.modules["__main__"].__dict__
            hidden: dict[str, Any] = {name: main[name] for name in ("__spec__", "__file__") if name in main}
            try:
                main.update(dict.fromkeys(hidden.keys() & {"__spec__"}))
                # absent, not None: in other threads, inspect takes None for a built-in module
                main.pop("__file__", None)
                super().start()
            finally:
                main.update(hidden)

    def __reduce__(self) -> tuple[Callable[..., BaseProcess], tuple[Any, ...], dict[str, Any]]:
        """Return how to unpickle: the new process watches this one before it imports or reads anything else."""
        return _arrived, (type(self), os.getpid() if self.is_child else None, self._main), self.__dict__


class Worker(_Process, SpawnProcess):
    """A spawned process."""


class Workers(SpawnContext):
    """Context that starts ``Worker`` processes."""

    Process = Worker


class _WorkerWithoutMain(Worker):
    """A spawned process that does not import the main module."""

    imports_main: ClassVar[bool] = False


class WorkersWithoutMain(Workers):
    """Context that starts processes that do not import the main module."""

    Process = _WorkerWithoutMain


if sys.platform == "linux":
    from multiprocessing.context import ForkServerContext, ForkServerProcess

    class _Forked(_Process, ForkServerProcess):
        """A process that is forked from the fork server."""

        imports_main: ClassVar[bool] = False
        is_child: ClassVar[bool] = False

    class _Forking(ForkServerContext):
        Process = _Forked


def warm_processes(module: str) -> BaseContext:
    """Return a context whose processes do not import the main module, but on Linux begin with ``module`` imported."""
    if sys.platform != "linux":
        return WorkersWithoutMain()
    context = _Forking()
    context.set_forkserver_preload([module])
    return context


@contextmanager
def becoming_warm() -> Iterator[None]:
    """Context in which a process prepares to be the fork server: it ends with its parent and ignores Ctrl-C.

    After the context it has one thread again; the fork server ends when no process is connected to it.
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
    """Whether this process may start others for its own work: not in a child process, nor in the fork server."""
    return multiprocessing.parent_process() is None and not _FORKED_FROM.is_set()


def _arrived(kind: type[BaseProcess], parent: int | None, main: dict[str, Any]) -> BaseProcess:
    """Begin a process: watch the parent, then import its main module, before the rest of the pickle is read."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_leave_with, args=(parent or os.getppid(), threading.Event()), daemon=True).start()
    spawn.prepare(main)
    return kind.__new__(kind)


def _leave_with(parent: int, no_more: threading.Event) -> None:
    """End this process when its parent has ended, because nobody would receive its results."""
    while not no_more.wait(_LOOKING):
        if _has_gone(parent):
            os._exit(1)


def _has_gone(parent: int) -> bool:
    """Whether the parent has ended; on systems where the parent's id does not change then, a closed pipe shows it."""
    leader = multiprocessing.parent_process()
    return os.getppid() != parent or (leader is not None and not leader.is_alive())
