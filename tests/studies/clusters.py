"""Dask schedulers and workers as processes to be killed; outputs that are slow, deadly or fill the disk."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from gearrattle.results import Run
from gearrattle.studies.study_store import Store

FULL = "GEARRATTLE_TEST_FULL"
"""Environment variable with the path of a file that, while it exists, makes the disk full at the next write."""


def slow(run: Run) -> dict[str, float]:
    """Take long enough to be killed meanwhile."""
    time.sleep(0.04)
    return {"one": 1.0}


def deadly(run: Run) -> dict[str, float]:
    """Kill any worker at one torque."""
    import multiprocessing

    if abs(run.model.torques[0].mean - 0.8) < 1e-9 and multiprocessing.parent_process() is not None:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"alive": 1.0}


def filling(run: Run) -> dict[str, float]:
    """Let the next chunk of this process find no space, once, if the file is there: it is removed."""
    flag = Path(os.environ.get(FULL, "/nowhere"))
    if flag.exists():
        flag.unlink(missing_ok=True)
        Store.keep = full_once(Store.keep)  # type: ignore[method-assign]
    return {"one": 1.0}


def full_once(keep: Callable[..., None]) -> Callable[..., None]:
    """Return ``Store.keep`` that says once that the disk is full, then works."""
    left = [1]

    def keeping(*arguments: object) -> None:
        if left:
            left.clear()
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        keep(*arguments)

    return keeping


@dataclass
class Dask:
    """A scheduler and workers without nannies.

    Attributes
    ----------
    address, scheduler
        of the scheduler.
    workers
        those hired so far that nobody has dismissed.
    hire
        starts one more.
    """

    address: str
    scheduler: subprocess.Popen[bytes]
    workers: list[subprocess.Popen[bytes]]
    hire: Callable[[], None]


@contextmanager
def dask(folder: Path, workers: int, threads: int = 1) -> Iterator[Dask]:
    """Start a scheduler and workers, all to be killed in the end."""
    file = folder / "scheduler.json"
    with (folder / "dask.log").open("wb") as log:

        def start(*words: str) -> subprocess.Popen[bytes]:
            return subprocess.Popen([sys.executable, "-m", *words], stdout=log, stderr=log)

        def hire() -> None:
            more = ["--nthreads", str(threads), "--no-nanny", "--no-dashboard", "--local-directory", str(folder)]
            hired.append(start("distributed.cli.dask_worker", "--scheduler-file", str(file), *more))

        where = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)]
        scheduler = start("distributed.cli.dask_scheduler", *where)
        hired: list[subprocess.Popen[bytes]] = []
        try:
            deadline = time.monotonic() + 60.0
            while not (file.exists() and file.stat().st_size) and time.monotonic() < deadline:
                time.sleep(0.05)
            for _ in range(workers):
                hire()
            yield Dask(json.loads(file.read_text())["address"], scheduler, hired, hire)
        finally:
            for process in (*hired, scheduler):
                process.kill()
                process.wait()
