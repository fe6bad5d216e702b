"""A warm process, which computes one request after the other and may be ended at any time.

A process is warm after it has imported gearrattle and loaded the compiled kernels, so that the first answer comes at
once; on Linux it is forked from a warm process (``template.py``). Compiled kernels cannot be interrupted, so a request
is cancelled by ending the process. The process is also ended if it exceeds its memory limit.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import threading
import time
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from dataclasses import replace
from functools import cache
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearrattle.errors import Cancelled, GearRattleError, ModelError, Problem
from gearrattle.files import allowed_root
from gearrattle.processes import warm_processes
from gearrattle.threads import one_thread
from gearrattle.workbench.job_files import problem_of

if TYPE_CHECKING:
    from gearrattle.model import Model

_LOOKED = 0.1  # s, between two checks of the memory
_TOLD = 0.1  # s, between two reports of progress
_STOP = "stop"
"""The message that stops the current work, which then answers with its partial result if it has one."""


class EndedError(GearRattleError):
    """The process ended before its answer: it was cancelled, crashed, or took too much memory."""


class FailedError(ModelError):
    """The work failed; its problems say why."""


Started = tuple[BaseProcess, Connection]


def _started() -> Future[Started]:
    """Return a process that is being started, and this end of its pipe; the first one waits for what it is forked from.

    A future that is cancelled ends it.
    """
    started: Future[Started] = Future()
    threading.Thread(target=_start, args=(started,), daemon=True).start()
    return started


def _start(started: Future[Started]) -> None:
    context: Any = warm_processes("gearrattle.workbench.jobs.template")
    here, there = context.Pipe()
    process = context.Process(target=_work, args=(there,), daemon=True)
    try:
        process.start()
    except (EOFError, OSError) as error:
        if started.set_running_or_notify_cancel():
            started.set_exception(EndedError(f"no process could be started: {error or 'it ended at once'}"))
        return
    finally:
        there.close()
    if started.set_running_or_notify_cancel():
        started.set_result((process, here))
    else:
        process.kill()


def _ended(started: Future[Started]) -> bool:
    """Whether nothing is to be expected of a process any more."""
    if not started.done():
        return False
    return started.cancelled() or started.exception() is not None or not started.result()[0].is_alive()


def _end(started: Future[Started]) -> None:
    """End a process at once."""
    if not started.cancel() and not _ended(started):
        process, _ = started.result()
        process.kill()
        process.join(5.0)


class Reserve:
    """One further warm process, so that the job after a cancelled one does not wait for a new process."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: Future[Started] | None = None
        self._is_open = True

    def take(self) -> Future[Started]:
        """Return the process in reserve, or a new one where there is none."""
        with self._lock:
            kept = self._process
            self._process = None
        return _started() if kept is None or _ended(kept) else kept

    def fill(self) -> None:
        """Have a process started, unless there is one."""
        with self._lock:
            if self._process is None and self._is_open:
                self._process = _started()

    def close(self) -> None:
        """End the process in reserve."""
        with self._lock:
            self._is_open = False
            if self._process is not None:
                _end(self._process)


class WarmProcess:
    """A process with a limit of memory [bytes], replaced from the reserve when it has ended."""

    def __init__(self, memory: float, reserve: Reserve) -> None:
        self._memory = memory
        self._reserve = reserve
        self._started: Future[Started] | None = None
        self._sending = threading.Lock()
        self._is_asked = False

    def start(self) -> Future[Started]:
        """Have it started, unless it runs; its end cancels that. To be called before each request."""
        if self._started is None or _ended(self._started):
            self._started = self._reserve.take()
        return self._started

    def ask(self, what: str, content: dict[str, Any], progress: Callable[[float], None] | None = None) -> Any:
        """Return the answer of the process that ``start`` has named, and of no other; EndedError if that process ends,
        even before it is asked, FailedError if the work failed.
        """
        # process that has been started
        if self._started is None:
            raise EndedError("its process was not started")
        try:
            process, connection = self._started.result()
        except CancelledError:
            raise EndedError("its process was ended before it was warm") from None
        # send the request
        try:
            with self._sending:
                connection.send((what, content))
                self._is_asked = True
            # pass progress on until the answer comes
            while True:
                while not connection.poll(_LOOKED):
                    self._check(process)
                kind, value = connection.recv()
                if kind == "warm":
                    self._reserve.fill()
                elif kind == "progress":
                    if progress is not None:
                        progress(value)
                elif kind == "failed":
                    raise FailedError(value)
                else:
                    return value
        # the process has ended
        except (EOFError, OSError):
            process.join(5.0)
            raise EndedError(_how(process.exitcode)) from None
        finally:
            with self._sending:
                self._is_asked = False

    def stop(self) -> None:
        """Have its work stop and answer with what is known; a process that was not asked yet ends."""
        with self._sending:
            if self._is_asked and self._started is not None:
                with contextlib.suppress(OSError):  # it has ended by itself
                    self._started.result()[1].send((_STOP, None))
                return
        self.end()

    def _check(self, process: BaseProcess) -> None:
        resident = resident_bytes(process.pid)
        if resident > self._memory:
            self.end()
            words = f"it held {resident / 1e9:.1f} GB of memory, of {self._memory / 1e9:.1f} GB that a job may hold"
            raise EndedError(words)

    def end(self) -> None:
        """End it at once; ``start`` begins another."""
        if self._started is not None:
            _end(self._started)


def resident_bytes(process: int | None) -> int:
    """Return the memory that a process holds; 0 where the machine does not say."""
    try:
        pages = int(Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")


def _how(code: int | None) -> str:
    if code is not None and code < 0:
        return f"its process was ended by signal {-code}"
    return f"its process ended with code {code}"


def _work(connection: Connection) -> None:
    """Answer requests until the pipe ends, on one thread: matrices here are small, and cores are for jobs."""
    one_thread()
    warm_up()
    connection.send(("warm", None))
    while True:
        try:
            what, content = connection.recv()
        except (EOFError, OSError):
            return
        if what == _STOP:  # of work that has ended before it heard of it
            continue
        connection.send(_answer(connection, what, content))


def _answer(connection: Connection, what: str, content: dict[str, Any]) -> tuple[str, Any]:
    last_report = 0.0

    def progress(fraction: float) -> None:
        nonlocal last_report
        if connection.poll():  # nothing else is sent while work is under way
            connection.recv()
            raise Cancelled("it was stopped")
        if time.monotonic() - last_report >= _TOLD:
            last_report = time.monotonic()
            connection.send(("progress", fraction))

    try:
        return "done", _REQUESTS[what](content, progress)
    except ModelError as error:
        return "failed", list(error.problems)
    except GearRattleError as error:
        return "failed", [Problem("computation", "", str(error), getattr(error, "remedy", ""))]
    except MemoryError:
        return "failed", [Problem("memory", "", "there is not enough", "ask for fewer cycles or samples")]
    except OSError as error:
        return "failed", [problem_of(error)]
    except Exception as error:  # a job's fault must not end the process
        return "failed", [Problem("internal error", type(error).__name__, str(error), "please report it")]


@cache
def warm_up() -> None:
    """Import what jobs use and load compiled loops, by a short run."""
    from gearrattle.model.examples import example
    from gearrattle.workbench.slider_run import live_view

    live_view(example("rattle_oscillator"), {})


def _job(content: dict[str, Any], progress: Callable[[float], None]) -> str:
    """Compute a job and keep it in its folder; return its sentence."""
    from gearrattle.model import load
    from gearrattle.report.result_kinds import presentation_of
    from gearrattle.workbench.job_inputs import INPUTS, NAME
    from gearrattle.workbench.jobs.tasks import carry_out
    from gearrattle.workbench.kept_results import PARTIAL, keep

    folder: Path = content["folder"]
    inputs = folder / INPUTS
    try:
        with allowed_root(inputs):
            model = load(inputs / NAME)
            result = carry_out(content["task"], model, content["options"], (inputs, folder / PARTIAL), progress)
    except ModelError as error:
        raise _as_named(error, inputs, content["file"]) from error
    keep(result, folder)
    shutil.rmtree(folder / PARTIAL, ignore_errors=True)
    return presentation_of(result).sentence


def _as_named(error: ModelError, inputs: Path, file: str) -> ModelError:
    """Return an error in a file among the inputs with the name that the file has in the workspace folder."""
    from gearrattle.workbench.job_inputs import MEASURED, NAME

    names = {f"{inputs / NAME}": file or NAME, f"{inputs / MEASURED}/": "", f"{inputs}/": ""}
    problems = []
    for problem in error.problems:
        words = problem.place
        for path, name in names.items():
            words = words.replace(path, name)
        problems.append(replace(problem, place=words))
    return ModelError(problems)


def _live(content: dict[str, Any], progress: Callable[[float], None]) -> dict[str, Any]:
    del progress
    from gearrattle.workbench.slider_run import live_view

    return live_view(_model_asked(content), content["values"])


def _estimate(content: dict[str, Any], progress: Callable[[float], None]) -> dict[str, Any]:
    """Return what a study would cost as a job."""
    del progress
    from gearrattle.studies.conditions_study import prepare as prepare_conditions
    from gearrattle.studies.study import prepare as prepare_grid

    prepare = prepare_conditions if content["task"] == "conditions" else prepare_grid
    return prepare(_model_asked(content), **content["options"]).estimate(workers=1).to_dict()


def _model_asked(content: dict[str, Any]) -> Model:
    """Return the model that a question is about."""
    from gearrattle.workbench.job_inputs import model_of

    with contextlib.ExitStack() as stack:
        for root in content["roots"]:
            stack.enter_context(allowed_root(root))
        return model_of(content["text"], content["folder"], content["file"])


_REQUESTS: dict[str, Callable[[dict[str, Any], Callable[[float], None]], Any]] = {
    "job": _job,
    "live": _live,
    "estimate": _estimate,
}
