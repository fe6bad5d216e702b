"""This process, or others beside it on this machine that may die without taking the study along.

Workers are processes: a chunk goes out by its number, and every worker keeps it in the store itself. A few chunks a
worker are under way at once, so that memory does not grow with the study. If a worker is killed all are replaced, and
the chunks under way go out again; a chunk that has lost ``PATIENCE`` workers is written down as such.

Takes a Store; gives chunks as they are done.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from itertools import chain
from multiprocessing import get_context

from gearrattle.errors import ModelError, Problem
from gearrattle.studies.schedulers.base import PATIENCE, TICK, WINDOW, Scheduler, Tick, Wanted, write_off
from gearrattle.studies.store import Store

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

_held: list[Store] = []


@contextmanager
def local(wanted: Wanted) -> Iterator[Scheduler]:
    """Open processes, as many as are wanted or pay; for one alone this process does.

    Raises:
        ModelError: several are wanted for a study that only this process sees.
    """
    if not wanted.shared and (wanted.workers or 1) > 1:
        rule = "other processes do not see the memory of this one"
        raise ModelError(Problem("workers", str(wanted.workers), rule, 'leave it out, or take scheduler="threads"'))
    yield partial(_either, (wanted.workers or wanted.sensible) if wanted.shared else 1)


def _either(count: int, store: Store, chunks: Sequence[int], tick: Tick) -> Generator[int, None, None]:
    count = min(count, max(1, len(chunks)))
    return here(store, chunks, tick) if count == 1 else processes(store, chunks, count, tick)


def here(store: Store, chunks: Iterable[int], tick: Tick) -> Generator[int, None, None]:
    """Compute chunks in this process, one after the other; ``tick`` is called after every case, and may raise."""
    for chunk in chunks:
        store.keep(chunk, store.compute(chunk, lambda _: tick()))
        yield chunk


def _take(store: Store) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that leads
    threading.Thread(target=_leave_with, args=(os.getppid(),), daemon=True).start()
    _held[:] = [store]


def _leave_with(parent: int) -> None:
    """End this process once the one that leads has gone, killed perhaps: nobody would ever read its results."""
    while os.getppid() == parent:
        time.sleep(TICK)
    os._exit(1)


def _work(chunk: int) -> int:
    (store,) = _held
    store.begin(chunk)
    store.keep(chunk, store.compute(chunk))
    return chunk


def processes(store: Store, chunks: Iterable[int], count: int, tick: Tick) -> Generator[int, None, None]:
    """Compute chunks in other processes, yielding each as it is done; ``tick`` is called now and then, and may raise.

    Where a worker dies nobody knows which of the chunks that had been begun killed it: these go out again one at a
    time, and only what dies alone counts against a chunk.
    """
    waiting: Iterator[int] = iter(chunks)
    deaths: dict[int, int] = {}
    suspects: list[int] = []
    while True:
        under_way: dict[int, Future[int] | None] = {}
        with _pool(store, count) as pool:
            try:
                yield from _dealt(pool, under_way, (suspects, waiting, WINDOW * count), tick)
                return
            except BrokenProcessPool:
                left = sorted(under_way)
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                _kill(pool)
                raise
        done, begun = store.done(), [chunk for chunk in left if store.was_begun(chunk)]
        yield from (chunk for chunk in left if chunk in done)
        begun = [chunk for chunk in begun if chunk not in done]
        waiting = chain([chunk for chunk in left if chunk not in done and chunk not in begun], waiting)
        for chunk in begun:
            deaths[chunk] = deaths.get(chunk, 0) + (len(left) == 1)
            if deaths[chunk] < PATIENCE:
                suspects.append(chunk)
            else:
                write_off(store, chunk)
                yield chunk


def _dealt(
    pool: ProcessPoolExecutor,
    under_way: dict[int, Future[int] | None],
    cards: tuple[list[int], Iterator[int], int],
    tick: Tick,
) -> Generator[int, None, None]:
    """Deal chunks to a pool until none is left: suspects alone, the others as many at once as there is room."""
    suspects, waiting, room = cards
    more = True
    while suspects or more or under_way:
        chosen = [suspects.pop()] if suspects and not under_way else []
        while not suspects and not chosen and more and len(under_way) < room:
            chunk = next(waiting, None)
            more = chunk is not None
            if chunk is not None:
                under_way[chunk] = None
                under_way[chunk] = pool.submit(_work, chunk)
        for chunk in chosen:
            under_way[chunk] = None
            under_way[chunk] = pool.submit(_work, chunk)
        tick()
        done, _ = wait([each for each in under_way.values() if each], timeout=TICK, return_when=FIRST_COMPLETED)
        for future in done:
            chunk = future.result()
            del under_way[chunk]
            yield chunk


@contextmanager
def _pool(store: Store, count: int) -> Iterator[ProcessPoolExecutor]:
    """Fresh processes of one thread each: matrices here are small, and cores are for cases."""
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
    try:
        with ProcessPoolExecutor(count, get_context("spawn"), _take, (store,)) as pool:
            yield pool
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _kill(pool: ProcessPoolExecutor) -> None:
    for process in list((pool._processes or {}).values()):
        process.kill()
