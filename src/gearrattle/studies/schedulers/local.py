"""Local processes: this one, or several on this machine, whose death does not end the study.

Workers are processes: a chunk goes out by its number, and every worker keeps it in the store itself. A few chunks a
worker are under way at once, so that memory does not grow with the study. If a worker is killed all are replaced, and
the chunks under way go out again; a chunk that has lost ``PATIENCE`` workers is written off. If ``PATIENCE`` times in a
row no worker begins a chunk, none can, and the study ends.

A spawned process imports the main module of its parent again, which fails for a script from standard input or a
notebook, and runs a script without ``if __name__ == "__main__":`` once more. A store needs nothing of that module but a
user's function that stands there, so for every other study workers do not import it.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import sys
from collections.abc import Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

from gearrattle.errors import GearRattleError, ModelError, Problem
from gearrattle.processes import Workers, WorkersWithoutMain
from gearrattle.studies.schedulers.scheduler import PATIENCE, TICK, WINDOW, Scheduler, Tick, Wanted, write_off
from gearrattle.studies.study_store import Store
from gearrattle.threads import ONE_THREAD

_IS_WORKER = "GEARRATTLE_STUDY_WORKER"
"""Environment variable of worker processes."""
_LEFT = 86
"""Exit code of a worker that was about to begin the study anew: the main module has no guard."""

_held: list[Store] = []


@contextmanager
def local(wanted: Wanted) -> Iterator[Scheduler]:
    """Open processes, as many as are wanted or pay; for one alone this process does.

    ModelError: several are wanted for a study that only this process sees.
    """
    if not wanted.shared and (wanted.workers or 1) > 1:
        rule = "other processes do not see the memory of this one"
        raise ModelError(Problem("workers", str(wanted.workers), rule, 'leave it out, or take scheduler="threads"'))
    yield partial(_either, (wanted.workers or wanted.sensible) if wanted.shared else 1)


def unreachable(function: Any) -> str:
    """Why other processes cannot have a user's function; empty where they can, and for None."""
    try:
        pickled = pickle.dumps(function)
    except (pickle.PicklingError, AttributeError, TypeError):
        return "is made inside another function or on the spot, and other processes cannot have it"
    main = sys.modules["__main__"]
    is_script = main.__spec__ is not None or Path(getattr(main, "__file__", None) or "").is_file()
    if b"__main__" in pickled and not is_script:
        return "stands in a main module that other processes cannot import: standard input, a notebook or a console"
    return ""


def leave_if_imported() -> None:
    """End a worker process that has come here by importing a main module without a guard; its parent tells why."""
    if _IS_WORKER in os.environ and getattr(multiprocessing.current_process(), "_inheriting", False):
        raise SystemExit(_LEFT)


def _either(count: int, store: Store, chunks: Sequence[int], tick: Tick) -> Generator[int, None, None]:
    count = min(count, max(1, len(chunks)))
    if count > 1 and (reason := unreachable(store.outputs.function)):
        remedy = 'put it into a module of its own, or take scheduler="threads" or workers=1'
        raise ModelError(Problem("function", _name_of(store.outputs.function), reason, remedy))
    return here(store, chunks, tick) if count == 1 else processes(store, chunks, count, tick)


def here(store: Store, chunks: Iterable[int], tick: Tick) -> Generator[int, None, None]:
    """Compute chunks in this process, one after the other; ``tick`` is called after every case, and may raise."""
    for chunk in chunks:
        store.keep(chunk, store.compute(chunk, lambda share, chunk=chunk: tick({chunk: share})))  # type: ignore[misc]
        yield chunk


def _take(store: Store) -> None:
    _held[:] = [store]


def _work(chunk: int) -> int:
    (store,) = _held
    store.begin(chunk)
    store.keep(chunk, store.compute(chunk))
    return chunk


def _name_of(function: Any) -> str:
    return str(getattr(function, "__qualname__", type(function).__name__))


def _cannot_start(store: Store) -> GearRattleError:
    """Return the error where no worker lives long enough to begin a chunk."""
    if not _needs_main(store):
        return GearRattleError(
            "no worker process of the study can start: each ended before it began a chunk, with whatever it wrote "
            'above; take scheduler="threads" or workers=1'
        )
    rule = "stands in the main module, which every worker imports again, and none came through that import"
    remedy = (
        'begin the study under if __name__ == "__main__":, put the function into a module of its own, or take '
        'scheduler="threads"'
    )
    return ModelError(Problem("function", _name_of(store.outputs.function), rule, remedy))


def processes(store: Store, chunks: Iterable[int], count: int, tick: Tick) -> Generator[int, None, None]:
    """Compute chunks in other processes, yielding each as it is done; ``tick`` is called now and then, and may raise.

    Where a worker ends, it is unknown which of the chunks that had been begun killed it: these go out again one at a
    time, and only a worker that ends with one chunk counts against that chunk.
    """
    # chunks that wait, and deaths of workers by chunk
    waiting: Iterator[int] = iter(chunks)
    deaths: dict[int, int] = {}
    suspects: list[int] = []
    stillborn = 0
    # deal chunks out until all are done or a worker dies
    while True:
        under_way: dict[int, Future[int] | None] = {}
        with _pool(store, count) as pool:
            try:
                for chunk in _dealt(pool, under_way, (suspects, waiting, WINDOW * count), tick):
                    stillborn = 0
                    yield chunk
                return
            except BrokenProcessPool:
                left = sorted(under_way)
                workers = list((pool._processes or {}).values())
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                _kill(pool)
                raise
        # no worker begins a chunk: none can
        done = store.done()
        begun = [chunk for chunk in left if store.was_begun(chunk)]
        stillborn = 0 if begun else stillborn + 1
        if stillborn == PATIENCE or any(worker.exitcode == _LEFT for worker in workers):
            raise _cannot_start(store)
        # what was kept, and what goes out again
        yield from (chunk for chunk in left if chunk in done)
        begun = [chunk for chunk in begun if chunk not in done]
        waiting = chain([chunk for chunk in left if chunk not in done and chunk not in begun], waiting)
        # chunks under suspicion go out alone; write off those that kill workers
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
    """Give chunks to a pool until none is left: suspects alone, the others as many at once as there is room."""
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
        done, _ = wait([future for future in under_way.values() if future], timeout=TICK, return_when=FIRST_COMPLETED)
        for future in done:
            chunk = future.result()
            del under_way[chunk]
            yield chunk


def _needs_main(store: Store) -> bool:
    """Whether a store holds something of the main module."""
    return b"__main__" in pickle.dumps(store.outputs.function)


@contextmanager
def _pool(store: Store, count: int) -> Iterator[ProcessPoolExecutor]:
    """Fresh processes of one thread each: matrices here are small, and cores are for cases."""
    before = {name: os.environ.get(name) for name in (*ONE_THREAD, _IS_WORKER)}
    os.environ.update(dict.fromkeys(before, "1"))
    context = Workers() if _needs_main(store) else WorkersWithoutMain()
    try:
        with ProcessPoolExecutor(count, context, _take, (store,)) as pool:
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
