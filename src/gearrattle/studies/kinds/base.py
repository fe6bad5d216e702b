"""What a kind of study is: the form of its file, and a function that looks for everything that can be wrong with one.

A study file says ``kind = "..."``; what stands in it besides name, model and kind is the kind's own. ``prepare`` takes
the model and what the kind reads from the file, and gives something that tells its cost and carries itself out, by any
scheduler, into a folder that survives whatever stops it.

To add a kind: its file with a ``Kind``, one line in the table in ``__init__``, its page in ``report/study_pages`` with
one line there, and its test page. The laws over the table test it by its existing.

Takes nothing; the kinds beside it build on this, and do not see each other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from gearrattle.model.quantity import Reader
from gearrattle.studies.pace import Cost
from gearrattle.studies.places import Address
from gearrattle.studies.prepared import Done, Progress
from gearrattle.studies.schedulers import Scheduler


class Study(Protocol):
    """A study about to begin."""

    def estimate(self, workers: int | None = None, scheduler: str | None = None) -> Cost:
        """Return what it will cost on as many workers as are asked for, or pay."""

    @property
    def scheduler(self) -> str:
        """Return the scheduler to use on this machine where none is asked for."""

    def sensible(self) -> int:
        """Return how many workers pay on this machine."""

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

        Raises:
            ModelError: the folder holds something else.
            SchedulerLost: whoever computed has gone.
            OSError: the folder cannot be written.
        """


@dataclass(frozen=True)
class Kind:
    """A kind of study.

    Attributes:
        name: in the file.
        prepare: takes the model as ``model``, what ``arguments`` gives and the options; refuses with ModelError.
        arguments: from the tables of a file, whose form has been looked at, to arguments of ``prepare``.
        keys: of the file, besides schema, name, kind and model: the rule of each.
        tables: keys and rules of those tables that have a fixed form.
        needed: keys that a file must have.
        options: of the command line that ``prepare`` takes as well: "function".
    """

    name: str
    prepare: Callable[..., Study]
    arguments: Callable[[Mapping[str, Any]], dict[str, Any]]
    keys: Mapping[str, Reader]
    tables: Mapping[str, Mapping[str, Reader]] = field(default_factory=dict)
    needed: tuple[str, ...] = ()
    options: frozenset[str] = frozenset()
