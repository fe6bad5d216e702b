"""Messages and exit codes of failures.

A message states the failure, its place, and a remedy. An unexpected exception is reported as an internal error;
GEARRATTLE_DEBUG=1 shows its traceback.
"""

from __future__ import annotations

import _thread
import contextlib
import errno
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator

from gearrattle.errors import Cancelled, GearRattleError, ModelError, shown_problems
from gearrattle.writing import disk_is_full

DONE = 0
FAILED = 1
MISUSED = 2
INTERRUPTED = 130
TERMINATED = 143
WORKER = "gearrattle-worker"
"""Name of the thread that computes."""
_AGAIN = 0.01  # s, until a lost interruption is raised again


class Terminated(KeyboardInterrupt):
    """SIGTERM, as sent by a batch queue or a container: it has the same effects as Ctrl-C."""


def guarded(work: Callable[[], object]) -> int:
    """Run ``work``; convert every error to a message and an exit code."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError, ValueError):
            stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    try:
        with _terminated_cleanly(), _interruptions_kept():
            work()
        sys.stdout.flush()
        return DONE
    except BrokenPipeError:
        _discard_output()
        return FAILED
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else MISUSED
    except BaseException as error:
        code, message = explain(error)
        if os.environ.get("GEARRATTLE_DEBUG") == "1":
            import traceback

            traceback.print_exception(error)
        print(message, file=sys.stderr)
        if code in (INTERRUPTED, TERMINATED):
            _leave_at_once(code)
        return code


@contextlib.contextmanager
def _terminated_cleanly() -> Iterator[None]:
    """Raise ``Terminated`` on the first SIGTERM."""
    in_charge = threading.current_thread() is threading.main_thread()
    if not in_charge or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return
    signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextlib.contextmanager
def _interruptions_kept() -> Iterator[None]:
    """Context in which an interruption is raised again if Python loses it.

    Python loses interruptions in ``__del__`` and in callbacks of weak references or of C code. Such functions are
    called often during imports, and by h5py and llvmlite.
    """
    before = sys.unraisablehook

    def keep(lost: sys.UnraisableHookArgs) -> None:
        if not isinstance(lost.exc_value, KeyboardInterrupt):
            before(lost)
            return
        number = signal.SIGTERM if isinstance(lost.exc_value, Terminated) else signal.SIGINT
        if number == signal.SIGTERM:
            signal.signal(number, _terminate)
        again = threading.Timer(_AGAIN, _thread.interrupt_main, [number])
        again.daemon = True
        again.start()

    sys.unraisablehook = keep
    try:
        yield
    finally:
        sys.unraisablehook = before


def _terminate(*_: object) -> None:
    """Raise ``Terminated``, and ignore further signals, because cleaning up takes a moment."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise Terminated


def explain(error: BaseException) -> tuple[int, str]:
    """Return the exit code and the message of an error."""
    chain = _chain(error)
    if any(isinstance(one, KeyboardInterrupt | Cancelled) for one in chain):
        terminated = any(isinstance(one, Terminated) for one in chain)
        word = "terminated" if terminated else "interrupted"
        return TERMINATED if terminated else INTERRUPTED, getattr(error, "kept", "") or f"{word}: nothing was written"
    if isinstance(error, ModelError):
        return MISUSED, "\n".join(f"error: {problem}" for problem in shown_problems(error.problems))
    if type(error).__module__.startswith("cyclopts"):
        return MISUSED, f"error: {' '.join(str(error).split())}\ntry: gearrattle --help"
    if isinstance(error, NotADirectoryError | IsADirectoryError):
        return MISUSED, f"error: {error.filename}: {error.strerror}; choose another place with -o"
    return FAILED, f"error: {_reason(error)}"


def _chain(error: BaseException) -> list[BaseException]:
    """Return an error and its causes; an interruption while a class is made arrives as a RuntimeError."""
    chain = [error]
    while (cause := chain[-1].__cause__) is not None and cause not in chain:
        chain.append(cause)
    return chain


def _reason(error: BaseException) -> str:
    """Say why a computation or the machine failed, and what to try."""
    number = getattr(error, "errno", None)
    if disk_is_full(error):
        return "the disk is full; nothing was written. Free some space, or choose another place with -o"
    if isinstance(error, OSError):
        cause = error.filename or "the machine refused"
        remedy = "; choose another place with -o" if number in (errno.EACCES, errno.EPERM, errno.EROFS) else ""
        return f"{cause}: {(error.strerror or str(error)).lower()}{remedy}"
    if isinstance(error, MemoryError):
        return "out of memory; ask for fewer cycles or fewer samples_per_cycle"
    if isinstance(error, GearRattleError):
        return str(error)
    root = _chain(error)[-1]
    because = "" if root is error else f", because of {type(root).__name__}: {root}"
    return (
        f"internal error, {type(error).__name__}: {error}{because}\nThis is a bug in gearrattle, not in your model. "
        "Please report it with the model file; GEARRATTLE_DEBUG=1 shows where it happened."
    )


def _discard_output() -> None:
    """Redirect the output of the interpreter to the null device, because its reader has ended."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _leave_at_once(code: int) -> None:
    """End the process now if a computation is still busy in compiled code, which nothing else could stop."""
    if any(thread.name == WORKER for thread in threading.enumerate()):
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
