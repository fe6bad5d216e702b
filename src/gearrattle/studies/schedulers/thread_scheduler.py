"""Threads of this process, which need neither start-up nor copies.

Chunks whose cases are computed together (``studies.case_batches``) are one compiled loop each, and run in parallel.
Cases computed alone are mostly Python, whose threads take turns. Measured: docs/reference/variants.md.
"""

from __future__ import annotations

import threading
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from functools import partial

from gearrattle.errors import Cancelled
from gearrattle.studies.schedulers.scheduler import TICK, WINDOW, Scheduler, Tick, Wanted
from gearrattle.studies.study_store import Store


@contextmanager
def threads(wanted: Wanted) -> Iterator[Scheduler]:
    """Open a pool of threads, as many as are wanted or pay."""
    yield partial(_pooled, wanted.workers or wanted.sensible)


def _pooled(count: int, store: Store, chunks: Sequence[int], tick: Tick) -> Generator[int, None, None]:
    """Compute chunks in threads; one that is under way when the work ends stops after its case."""
    stop = threading.Event()
    shares = dict[int, float]()
    waiting = iter(chunks)
    under_way: set[Future[int]] = set()
    pool = ThreadPoolExecutor(count, thread_name_prefix="gearrattle-study")
    try:
        while True:
            while len(under_way) < WINDOW * count and (chunk := next(waiting, None)) is not None:
                under_way.add(pool.submit(_work, store, chunk, shares, stop))
            if not under_way:
                return
            tick(dict(shares))
            done, under_way = wait(under_way, timeout=TICK, return_when=FIRST_COMPLETED)
            for future in done:
                shares.pop(chunk := future.result(), None)
                yield chunk
    finally:
        stop.set()
        pool.shutdown(wait=True, cancel_futures=True)


def _work(store: Store, chunk: int, shares: dict[int, float], stop: threading.Event) -> int:
    def report_share(share: float) -> None:
        shares[chunk] = share
        if stop.is_set():
            raise Cancelled("the study has ended")

    store.keep(chunk, store.compute(chunk, report_share))
    return chunk
