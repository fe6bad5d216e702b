"""``gearrattle study``: many variants of one driveline, from a file that says which."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from gearrattle.cli.options import Json

if TYPE_CHECKING:
    import xarray as xr

    from gearrattle.cli.background import Watch
    from gearrattle.studies import Prepared
    from gearrattle.studies.store import Store

_SHOWN = 5
_GRACE = 2.0  # seconds after Ctrl-C in which workers may be told to stop
Done = tuple["xr.Dataset", Mapping[tuple[int, ...], str], list[int]]


def study(
    study: Path,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    scheduler: str = "local",
    workers: int | None = None,
    resume: Annotated[bool, Parameter(negative="")] = False,
    retry_failed: Annotated[bool, Parameter(negative="")] = False,
    estimate: Annotated[bool, Parameter(negative="")] = False,
    function: str | None = None,
    json: Json = False,
) -> None:
    """Simulate and judge many variants of one driveline; what is done survives whatever stops it.

    Into the folder go results.zarr and, once all is done, a page, study.html, with figures/.

    Parameters
    ----------
    study
        Study file (TOML).
    output
        Folder for the results; default: the study file's name with "-study", here.
    scheduler
        Who computes: "local" processes, "threads", or "tcp://HOST:PORT", a Dask cluster that sees the output folder.
    workers
        Processes or threads; default: as many as there are cores. A cluster has its own number.
    resume
        Go on with what the folder holds.
    retry_failed
        With --resume: compute chunks with failed cases anew.
    estimate
        Say how many cases there are and what they would cost, and stop.
    function
        MODULE:NAME of a Python function that takes a run and returns numbers by name: further outputs.
    """
    from gearrattle.cli.background import watched
    from gearrattle.studies import prepare
    from gearrattle.studies.file import read_study, study_name

    given = read_study(study) | ({} if function is None else {"function": _function(function)})
    folder = output or Path(f"{study.stem}-study")
    under_way: list[Store] = []

    def work(watch: Watch) -> Done | None:
        watch.enter("looking at the study")
        found = prepare(**given)
        print(found.estimate(workers or 1), file=sys.stderr)
        if estimate:
            return None
        how = {"scheduler": scheduler, "workers": workers, "resume": resume, "retry_failed": retry_failed}
        return _carried_out(watch, found, folder, study_name(study), under_way, **how)

    try:
        done = watched(work, _GRACE)
    except (KeyboardInterrupt, Exception) as error:
        raise _with_what_is_kept(error, under_way) from error
    if done is not None:
        _tell(*done, folder, json=json)


def _carried_out(watch: Watch, found: Prepared, folder: Path, title: str, under_way: list[Store], **how: Any) -> Done:
    """Compute what is not done, and write the page."""
    import time

    from gearrattle.studies import carry_out, opened
    from gearrattle.studies.store import Store

    with opened(how["scheduler"], how["workers"], found.sensible()) as compute:
        store = Store.open(folder, found.plan, found.outputs, resume=how["resume"])
        under_way.append(store)
        watch.enter("computing cases")
        before, begun = len(store.done()), time.perf_counter()
        damaged = carry_out(store, compute, retry_failed=how["retry_failed"], progress=watch)
    data, messages = store.dataset(), store.messages()
    watch.enter("writing the page")
    cost = _cost(found, store, before if not damaged else 0, time.perf_counter() - begun)
    _page(data, messages, folder, title, cost)
    return data, messages, damaged


def _with_what_is_kept(error: BaseException, under_way: list[Store]) -> BaseException:
    """Say what is kept and how to go on, if anything is."""
    from gearrattle.cli.failures import disk_is_full
    from gearrattle.errors import Cancelled, GearRattleError, SchedulerLost

    if not under_way:
        return error
    store = under_way[0]
    kept = f"{len(store.done())} of {store.plan.chunks} chunks are kept in {store.folder}; --resume goes on"
    if isinstance(error, KeyboardInterrupt | Cancelled):
        return Cancelled(kept=f"interrupted: {kept}")
    if isinstance(error, SchedulerLost):
        return SchedulerLost(f"{error}; {kept} once there is another")
    if disk_is_full(error):
        return GearRattleError(f"the disk is full; {kept} when there is space again")
    return error


def _cost(found: Prepared, store: Store, before: int, seconds: float) -> str:
    """What a case takes, and what this run took, in a sentence; ``before`` chunks were there already."""
    each, chunks = f"A case takes about {1e3 * found.seconds:.3g} ms", store.plan.chunks
    if before == chunks:
        return f"{each}."
    left = f" for what was left, {before} of {chunks} chunks were there" if before else ""
    return f"{each}; this run took {seconds:.3g} s{left}."


def _page(data: xr.Dataset, messages: Mapping[tuple[int, ...], str], folder: Path, title: str, cost: str) -> None:
    """Write the page and its figures into the folder, whole or not at all."""
    from gearrattle.report.staging import Staging
    from gearrattle.report.study import fill_study

    with Staging(folder) as staging:
        fill_study(data, messages, staging.path, title=title, cost=cost)
        staging.commit()


def _function(named: str) -> Any:
    """Find a function by MODULE:NAME, modules of the working folder included."""
    from importlib import import_module

    from gearrattle.errors import ModelError, Problem

    module, _, name = named.partition(":")
    if not module or not name:
        raise ModelError(Problem("--function", named, "must be MODULE:NAME", "for example my_outputs:loudness"))
    if str(Path.cwd()) not in sys.path:
        sys.path.insert(0, str(Path.cwd()))  # workers need it as well: they inherit the path
    try:
        found = getattr(import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise ModelError(Problem("--function", named, f"cannot be found: {error}")) from None
    if not callable(found):
        raise ModelError(Problem("--function", named, "is no function"))
    return found


def _tell(
    data: xr.Dataset, messages: Mapping[tuple[int, ...], str], damaged: list[int], folder: Path, *, json: bool
) -> None:
    from gearrattle.cli.columns import json_text
    from gearrattle.studies.cases import OUTCOMES

    counts = {word: int((data["outcome"] == code).sum()) for code, word in enumerate(OUTCOMES)}
    if damaged:
        print(f"note: damaged chunks computed again: {len(damaged)}", file=sys.stderr)
    for place, text in list(messages.items())[:_SHOWN]:
        at = ", ".join(f"{name} {i}" for name, i in zip(data["outcome"].dims, place, strict=True))
        print(f"note: case {at}: {text}", file=sys.stderr)
    if len(messages) > _SHOWN:
        print(f"note: {len(messages) - _SHOWN} more cases failed; their messages are in done/", file=sys.stderr)
    if json:
        sizes = {str(name): int(size) for name, size in data.sizes.items()}
        print(json_text({"folder": str(folder), "sizes": sizes, "outcomes": counts, "outputs": list(map(str, data))}))
        return
    print(", ".join(f"{count} {word}" for word, count in counts.items() if count))
    print(f"results: {folder / 'results.zarr'}")
    print(f"page: {folder / 'study.html'}")
