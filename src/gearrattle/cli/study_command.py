"""``gearrattle study``: many variants of one driveline, defined in a study file."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from gearrattle.cli import assignments
from gearrattle.cli.background import watched
from gearrattle.cli.emit import print_result
from gearrattle.cli.shared_options import Changes, Json, Whole
from gearrattle.errors import Cancelled, GearRattleError, ModelError, Problem, SchedulerLost
from gearrattle.json_types import json_text
from gearrattle.writing import disk_is_full, staged

if TYPE_CHECKING:
    from gearrattle.cli.background import Watch
    from gearrattle.report.study_report import StudyReport
    from gearrattle.studies.kinds import StudySpec
    from gearrattle.studies.prepared import Done
    from gearrattle.studies.storage import Storage
    from gearrattle.studies.study_call import Study

_GRACE = 2.0  # seconds after Ctrl-C in which workers may be stopped


def study(
    study: Path,
    /,
    *,
    output: Annotated[str | None, Parameter(name=["--output", "-o"])] = None,
    scheduler: str | None = None,
    workers: Whole | None = None,
    resume: bool = False,
    retry_failed: bool = False,
    estimate: bool = False,
    function: str | None = None,
    changes: Changes = (),
    json: Json = False,
) -> None:
    """Simulate and judge many variants of one driveline; what is done survives whatever stops it.

    Parameters
    ----------
    study
        Study file (TOML).
    output
        Folder or address, s3://BUCKET/NAME, for the results: results.zarr with all numbers and, once
        all is done, a page; default: the study file's name with "-study", here.
    scheduler
        Who computes: "local", "threads", or "tcp://HOST:PORT", a Dask cluster; default: what suits the outputs.
    workers
        Processes or threads; default: as many as there are cores. A cluster has its own number.
    resume
        Go on with what the folder holds.
    retry_failed
        With --resume: compute chunks with failed cases anew.
    estimate
        Print how many cases there are and what they would cost, and stop.
    json
        Print the answer, or the estimate, as JSON: values in SI, by the paths of the model file.
    function
        MODULE:NAME of a Python function that takes a run and returns numbers by name: further outputs.
    """
    from gearrattle.studies.schedulers import check_scheduler
    from gearrattle.studies.storage import storage_of
    from gearrattle.studies.storage_claim import check_storage
    from gearrattle.studies.stored_studies import check_zarr
    from gearrattle.studies.study_file import read_study

    # study file with changes, options and folder of results
    asked = read_study(study).changed(assignments.changes("--set", changes))
    options = _options(asked.spec, function)
    folder = _outliving(storage_of(output or f"{study.stem}-study"))
    check_scheduler(scheduler, workers)
    if not estimate:
        check_zarr()
        check_storage(folder, resume=resume)
    how = {"scheduler": scheduler, "workers": workers, "resume": resume, "retry_failed": retry_failed}
    under_way: list[Study] = []

    # estimate the cost, then compute all cases
    def work(watch: Watch) -> tuple[Done, StudyReport] | None:
        watch.enter("looking at the study")
        prepared = asked.prepare(**options)
        cost = prepared.estimate(workers, scheduler)
        if estimate:
            print(json_text(cost.to_dict()) if json else f"{cost}{_divided(scheduler)}")
            return None
        print(f"{cost}{_divided(scheduler)}", file=sys.stderr)
        return _carried_out(watch, prepared, folder, asked.name, under_way, **how)

    # watch it; after a failure say what is kept
    try:
        done = watched(work, _GRACE)
    except (KeyboardInterrupt, Exception) as error:
        raise _with_what_is_kept(error, under_way, folder) from error
    if done is not None:
        _print_answer(*done, folder, json=json)


def _outliving(folder: Storage) -> Storage:
    """Refuse a storage location that is gone when the command ends."""
    if folder.address.startswith("memory://"):
        rule = "is the memory of this process, and is gone when the command ends"
        raise ModelError(Problem("--output", folder.address, rule, "give a folder, or an address such as s3://BUCKET"))
    return folder


def _divided(scheduler: str | None) -> str:
    """Words that an estimate adds for a cluster, whose number of workers is not known before the study runs."""
    return f"; divide by the number of threads of {scheduler}" if "://" in (scheduler or "") else ""


def _carried_out(
    watch: Watch, prepared: Study, folder: Storage, title: str, under_way: list[Study], **how: Any
) -> tuple[Done, StudyReport]:
    """Compute the cases that are not done, and write the page."""
    from gearrattle.studies.schedulers import opened

    workers = prepared.estimate(how["workers"], how["scheduler"]).workers
    with opened(
        how["scheduler"] or prepared.scheduler, how["workers"], prepared.sensible(), shared=folder.shared
    ) as compute:
        under_way.append(prepared)
        watch.enter("computing cases")
        done = prepared.carry_out(
            folder, compute, resume=how["resume"], retry_failed=how["retry_failed"], progress=watch, workers=workers
        )
    watch.enter("writing the page")
    return done, _page(done, folder, title)


def _with_what_is_kept(error: BaseException, under_way: list[Study], folder: Storage) -> BaseException:
    """Return the error with a text on which cases are saved and how to resume, if any are."""
    kept = under_way[0].kept(folder) if under_way else ""
    if not kept:
        return error
    if isinstance(error, KeyboardInterrupt | Cancelled):
        return Cancelled(kept=f"interrupted: {kept}; --resume goes on")
    if isinstance(error, SchedulerLost):
        return SchedulerLost(f"{error}; {kept}; --resume goes on once there is another")
    if disk_is_full(error):
        return GearRattleError(f"the disk is full; {kept}; --resume goes on when there is space again")
    return error


def _page(done: Done, folder: Storage, title: str) -> StudyReport:
    """Write page, summary and figures into the folder, whole or not at all."""
    from gearrattle.report.study_report import StudyReport

    facts = {"folder": folder.address, **done.summary}
    report = StudyReport(done.data, done.messages, title=title, cost=done.cost, facts=facts, remarks=done.notes)
    with staged(folder.local, folder.take) as path:
        report.fill(path)
    folder.remove("study.html")  # the page of earlier versions
    return report


def _options(spec: StudySpec, function: str | None) -> dict[str, Any]:
    """Options of the command line for ``spec.prepare``."""
    if function is None:
        return {}
    if "function" not in spec.options:
        rule = f'a study of the kind "{spec.kind}" takes no function'
        raise ModelError(Problem("--function", function, rule, "leave it out"))
    return {"function": _function(function)}


def _function(named: str) -> Any:
    """Find a function by MODULE:NAME, modules of the working folder included."""
    from importlib import import_module

    module, _, name = named.partition(":")
    if not module or not name:
        raise ModelError(Problem("--function", named, "must be MODULE:NAME", "for example my_outputs:loudness"))
    if str(Path.cwd()) not in sys.path:
        sys.path.insert(0, str(Path.cwd()))  # workers need it as well: they inherit the path
    try:
        function = getattr(import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise ModelError(Problem("--function", named, f"cannot be found: {error}")) from None
    if not callable(function):
        raise ModelError(Problem("--function", named, "is no function"))
    return function


def _print_answer(done: Done, report: StudyReport, folder: Storage, *, json: bool) -> None:
    from gearrattle.report.saved import PAGE
    from gearrattle.studies.storage import File

    if not json:
        print(done.outcome_counts)
    print_result(report, File(folder, PAGE), json=json)
    if not json:
        print(f"results: {File(folder, 'results.zarr')}")
