"""Dask schedulers and workers as processes to be killed; outputs that are slow, deadly or fill the disk."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from gearrattle.results import Run
from gearrattle.studies.store import Store

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


@contextmanager
def dask(folder: Path, workers: int, threads: int = 1) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A scheduler, its address, and workers without a nanny."""
    import json

    file = folder / "scheduler.json"
    log = (folder / "dask.log").open("wb")
    quiet = {"stdout": log, "stderr": log}
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    scheduler = subprocess.Popen([*command, "--no-dashboard", "--scheduler-file", str(file)], **quiet)  # type: ignore[call-overload]
    started = [scheduler]
    try:
        deadline = time.monotonic() + 60.0
        while not (file.exists() and file.stat().st_size) and time.monotonic() < deadline:
            time.sleep(0.05)
        address = json.loads(file.read_text())["address"]
        worker = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", str(threads)]
        for _ in range(workers):
            more = ["--no-nanny", "--no-dashboard", "--death-timeout", "60", "--local-directory", str(folder)]
            started.append(subprocess.Popen([*worker, *more], **quiet))  # type: ignore[call-overload]
        yield address, scheduler
    finally:
        for process in reversed(started):
            process.kill()
            process.wait()
        log.close()
