"""Dask cluster: workers on any number of machines that see the study's folder; a few chunks per worker are under way.

The study is handed over as one file in its folder, so a worker that cannot see the folder says so with its first chunk,
and workers that come later need nothing more. Chunks are sent by number and every worker keeps its own; results are not
sent. Dask repeats the tasks of dead workers but does not say which chunk killed them. So every attempt at a chunk is
noted when it begins. A task that finds its own attempt noted has lost a worker before: it computes nothing, and the
chunk is sent again, alone in its process. Each such death counts against the chunk.

dask.distributed: M. Rocklin, "Dask: parallel computation with blocked algorithms and task scheduling", SciPy 2015.
"""

from __future__ import annotations

import logging
import time
import warnings
from collections import Counter
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any
from uuid import uuid4

from gearrattle.errors import Cancelled, ModelError, NotInstalled, Problem, SchedulerLost
from gearrattle.studies.schedulers.hand_over import Handed, LostBefore, handed_over, work
from gearrattle.studies.schedulers.scheduler import PATIENCE, TICK, WINDOW, Scheduler, Tick, Wanted, write_off
from gearrattle.studies.study_store import Store

_PATIENCE_CONNECTING = 10.0  # seconds
_COUNTING = 2.0  # seconds between two looks at how many workers there are
_LOGGING = ("client", "core", "utils", "comm", "comm.tcp")  # parts of a client that log what goes wrong with it
_PATIENCE_ALONE = 20.0  # seconds without any worker until that is reported


@contextmanager
def cluster(wanted: Wanted) -> Iterator[Scheduler]:
    """Connect to a cluster, or take a client that is connected.

    Raises
    ------
    NotInstalled
        dask.distributed is not here.
    ModelError
        nobody answers, it is no client, or a number of workers was asked for.
    """
    # what a cluster needs
    try:
        from distributed import Client
    except ImportError:
        rule = "needs dask.distributed, which is not installed"
        named = wanted.address if isinstance(wanted.address, str) else type(wanted.address).__name__
        raise NotInstalled.of("studies", "scheduler", named, rule) from None
    if wanted.workers is not None:
        rule = "a cluster has its own number of workers"
        raise ModelError(Problem("workers", str(wanted.workers), rule, "leave it out, or scale the cluster"))
    if not wanted.shared:
        rule = "workers elsewhere do not see the memory of this process"
        raise ModelError(Problem("output", "memory://", rule, "give a folder or an address that all of them see"))
    # a client that is connected
    if not isinstance(wanted.address, str):
        if not isinstance(wanted.address, Client) or wanted.address.asynchronous:
            rule = "must be a name, an address or a distributed.Client that is not asynchronous"
            raise ModelError(Problem("scheduler", type(wanted.address).__name__, rule))
        yield partial(_dealt, wanted.address)
        return
    # connect by address
    with _without_tracebacks():
        try:
            client = Client(wanted.address, timeout=_PATIENCE_CONNECTING, set_as_default=False)
        except (OSError, ValueError) as error:
            rule = f"no scheduler answers: {' '.join(str(error).split()) or type(error).__name__}"
            raise ModelError(Problem("scheduler", wanted.address, rule, "start one with `dask scheduler`")) from None
        try:
            yield partial(_dealt, client)
        finally:
            with suppress(Exception):
                client.close(timeout=1.0)


@contextmanager
def _without_tracebacks() -> Iterator[None]:
    """Keep the client from logging the tracebacks of a lost connection: ``SchedulerLost`` says what happened."""
    loggers = [logging.getLogger(f"distributed.{name}") for name in _LOGGING]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def _dealt(client: Any, store: Store, chunks: Sequence[int], tick: Tick) -> Generator[int, None, None]:
    """Hand the study over, and distribute its chunks."""
    with handed_over(store) as handed:
        dealer = _Dealer(client, handed, store)
        try:
            yield from dealer.deal(iter(chunks), tick)
        finally:
            dealer.stop()


class _Dealer:
    """Chunks under way, and the deaths of workers counted against some of them."""

    def __init__(self, client: Any, handed: Handed, store: Store) -> None:
        self._client = client
        self._handed = handed
        self._store = store
        self._under_way: dict[str, tuple[int, Any]] = {}
        self._ended: SimpleQueue[Any] = SimpleQueue()
        self._again: list[int] = []
        self._suspected: set[int] = set()
        self._deaths: Counter[int] = Counter()
        self._never_begun: Counter[int] = Counter()
        self._room = WINDOW
        self._counted = float("-inf")
        self._manned = time.monotonic()

    def deal(self, waiting: Iterator[int], tick: Tick) -> Generator[int, None, None]:
        """Keep the window full until no chunk is left."""
        while True:
            while len(self._under_way) < self._size_of_window():
                chunk = self._again.pop() if self._again else next(waiting, None)
                if chunk is None:
                    break
                self._submit(chunk)
            if not self._under_way:
                return
            tick()
            try:
                future = self._ended.get(timeout=TICK)
            except Empty:
                self._look_for_the_scheduler()
                continue
            chunk, _ = self._under_way.pop(future.key)
            if self._is_kept(chunk, future):
                yield chunk

    def stop(self) -> None:
        """Begin no further chunk; chunks under way stop by themselves once the hand-over is gone."""
        left = [future for _, future in self._under_way.values()]
        self._under_way.clear()
        if left and self._client.status == "running":
            with suppress(Exception):
                self._client.cancel(left, force=True)

    def _submit(self, chunk: int) -> None:
        attempt = uuid4().hex
        alone = chunk in self._suspected
        key = f"gearrattle-{chunk}-{attempt}"
        try:
            future = self._client.submit(
                work, self._handed, chunk, attempt, alone, key=key, pure=False, retries=0, priority=int(alone)
            )
        except (OSError, RuntimeError, ValueError) as error:
            raise self._lost() from error
        self._under_way[key] = (chunk, future)
        future.add_done_callback(self._ended.put)

    def _is_kept(self, chunk: int, future: Any) -> bool:
        """Whether a chunk that has come back is stored; if not it is sent again, or written off."""
        from distributed import KilledWorker

        if future.status == "finished":
            return True
        if future.status != "error":
            raise self._lost()
        error = future.exception()
        if not isinstance(error, LostBefore | KilledWorker):
            raise _error_of_client(error, self._client)
        if isinstance(error, KilledWorker) and not self._store.attempt(chunk).startswith(_attempt(future.key)):
            self._never_begun[chunk] += 1
            if self._never_begun[chunk] >= PATIENCE:
                raise SchedulerLost("workers die before they begin a chunk: see their logs") from error
        else:
            self._deaths[chunk] += chunk in self._suspected
            self._suspected.add(chunk)
        if self._deaths[chunk] >= PATIENCE:
            write_off(self._store, chunk)
            return True
        self._again.append(chunk)
        return False

    def _size_of_window(self) -> int:
        """Chunks to have under way: some a thread of every worker there is now; a few even if there is none."""
        if time.monotonic() - self._counted > _COUNTING:
            try:
                threads = sum(self._client.nthreads().values())
            except (OSError, RuntimeError, ValueError) as error:
                raise self._lost() from error
            self._room = WINDOW * max(1, threads)
            self._counted = time.monotonic()
            if threads:
                self._manned = self._counted
            elif self._counted - self._manned > _PATIENCE_ALONE:
                self._manned = float("inf")
                warning = f"the cluster at {_address(self._client)} has no workers: the study waits for some"
                warnings.warn(warning, RuntimeWarning, stacklevel=2)
        return self._room

    def _look_for_the_scheduler(self) -> None:
        if self._client.status != "running":
            raise self._lost()

    def _lost(self) -> SchedulerLost:
        return SchedulerLost(f"the scheduler at {_address(self._client)} has gone, or has dropped the study")


def _attempt(key: str) -> str:
    return key.rpartition("-")[2]


def _address(client: Any) -> str:
    return str(getattr(getattr(client, "scheduler", None), "address", "") or client._start_arg)


def _error_of_client(error: BaseException, client: Any) -> BaseException:
    """Error of a worker, as an error of this package."""
    if isinstance(error, ImportError):
        rule = f"a worker cannot import what it needs: {error}"
        remedy = "install the same versions there, gearrattle[studies] included"
        return ModelError(Problem("scheduler", _address(client), rule, remedy))
    if isinstance(error, Cancelled):
        return SchedulerLost(f"a worker of {_address(client)} no longer finds the study: its hand-over was removed")
    return error
