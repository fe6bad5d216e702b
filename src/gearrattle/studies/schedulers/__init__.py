"""Schedulers, which have the chunks of a study computed, by their names in calls and on the command line."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

from gearrattle.errors import ModelError, Problem
from gearrattle.model.value_kinds import Count, argument_problems
from gearrattle.studies.schedulers.cluster import cluster
from gearrattle.studies.schedulers.local import leave_if_imported, local, unreachable
from gearrattle.studies.schedulers.scheduler import Opening, Scheduler, Wanted
from gearrattle.studies.schedulers.thread_scheduler import threads

SCHEDULERS: dict[str, Opening] = {
    "local": local,
    "threads": threads,
    "tcp://": cluster,
    "tls://": cluster,
}
"""Name, or beginning of an address, -> function that opens it."""

__all__ = ["SCHEDULERS", "Scheduler", "Wanted", "check_scheduler", "opened", "unreachable"]


def opened(
    address: Any, workers: int | None, sensible: int, *, shared: bool = True
) -> AbstractContextManager[Scheduler]:
    """Open a scheduler.

    Parameters
    ----------
    address
        "local", "threads", "tcp://HOST:PORT", "tls://HOST:PORT" or a ``distributed.Client``.
    workers
        how many are wanted; None for as many as make sense.
    sensible
        how many pay on this machine.
    shared
        whether other processes see where the study is kept.

    Raises
    ------
    ModelError
        there is no such scheduler, nobody answers there, or it cannot be had as asked.
    NotInstalled
        it needs a library that is not here.
    """
    leave_if_imported()
    check_scheduler(address, workers)
    if not isinstance(address, str):
        return cluster(Wanted(address, workers, sensible, shared))
    head, mark, _ = address.partition("://")
    return SCHEDULERS[head + mark](Wanted(address, workers, sensible, shared))


def check_scheduler(address: Any, workers: int | None) -> None:
    """Refuse an unknown scheduler, and an invalid number of workers.

    Parameters
    ----------
    address
        as of ``opened``; None for none.

    Raises
    ------
    ModelError
        the scheduler is unknown, or the number invalid; nothing is opened.
    """
    if workers is not None and (problems := argument_problems({"workers": (Count(1), workers)})):
        raise ModelError(problems)
    if not isinstance(address, str):
        return
    head, mark, rest = address.partition("://")
    if head + mark not in SCHEDULERS or (mark and not rest):
        names = ", ".join(f"{name}HOST:PORT" if name.endswith("//") else name for name in SCHEDULERS)
        raise ModelError(Problem("scheduler", f'"{address}"', f"must be one of {names}"))
