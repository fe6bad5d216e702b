"""Execution of a study of any kind by a call: the options for storage and computing that all calls share."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Protocol

from gearrattle.model import Model, check_model
from gearrattle.model.value_kinds import CALLBACK, FLAG, check_arguments
from gearrattle.studies.prepared import Done, Progress
from gearrattle.studies.schedulers import Scheduler, check_scheduler, opened
from gearrattle.studies.storage import Address, Storage, storage_of
from gearrattle.studies.storage_claim import check_storage
from gearrattle.studies.stored_studies import check_zarr
from gearrattle.studies.study_cost import Cost
from gearrattle.wording import counted
from gearrattle.writing import temporary_folder

if TYPE_CHECKING:
    import xarray as xr


class Study(Protocol):
    """Protocol of a prepared study."""

    def estimate(self, workers: int | None = None, scheduler: str | None = None) -> Cost:
        """Return the cost on as many workers as are asked for, or as pay."""

    @property
    def scheduler(self) -> str:
        """Return the scheduler to use on this machine where none is asked for."""

    def sensible(self) -> int:
        """Return the number of workers that pay on this machine."""

    def kept(self, folder: Address) -> str:
        """Return in words how much of it a folder holds; empty if it holds none."""

    def carry_out(
        self,
        folder: Address,
        compute: Scheduler,
        *,
        resume: bool = False,
        retry_failed: bool = False,
        progress: Progress | None = None,
        workers: int = 1,
    ) -> Done:
        """Compute what a folder does not hold yet, and return the whole.

        ``done.data.attrs["kind"]`` is the kind's name. What ``progress`` raises ends the work; what is kept by then a
        later call with ``resume`` goes on from, to the same bits.

        Raises
        ------
        ModelError
            the folder holds something else.
        SchedulerLost
            the scheduler is gone.
        OSError
            the folder cannot be written.
        """


def conduct(
    prepare: Callable[..., Study],
    /,
    *,
    model: Model,
    output: Address | None,
    scheduler: Any,
    workers: int | None,
    progress: Progress | None,
    resume: bool,
    retry_failed: bool = False,
    **asked: Any,
) -> xr.Dataset:
    """Prepare a study and carry it out; options and errors as of ``study``, ``asked``: the others, of ``prepare``."""
    check_model(model)
    check_arguments(resume=(FLAG, resume), retry_failed=(FLAG, retry_failed), progress=(CALLBACK, progress))
    with _storage_for(output, scheduler, workers, resume=resume) as storage:
        study = prepare(model, **asked)
        count = workers or study.sensible()
        with opened(scheduler or study.scheduler, workers, study.sensible(), shared=storage.shared) as compute:
            done = study.carry_out(
                storage, compute, resume=resume, retry_failed=retry_failed, progress=progress, workers=count
            )
    _warn_of_failures(done)
    return done.data


def _warn_of_failures(done: Done) -> None:
    """Warn that cases failed: the results have none for these."""
    if not done.messages:
        return
    at, first = next(iter(done.messages.items()))
    words = f"the answer goes on without {counted(len(done.messages), 'case')} ({done.outcome_counts})"
    warnings.warn(f'{words}; {at}: {first}; attrs["failures"] holds every reason', RuntimeWarning, stacklevel=4)


@contextmanager
def _storage_for(output: Address | None, scheduler: Any, workers: int | None, *, resume: bool) -> Iterator[Storage]:
    """Give the storage location that was asked for, or a temporary one.

    Refuses at once what needs no computation to be refused: errors as of ``check_scheduler``, ``storage_of`` and
    ``check_storage``, NotInstalled without Zarr.
    """
    check_zarr()
    check_scheduler(scheduler, workers)
    if output is not None:
        storage = storage_of(output)
        check_storage(storage, resume=resume)
        yield storage
        return
    with temporary_folder() as home:
        yield storage_of(home / "study")
