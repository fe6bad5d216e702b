"""``study``: many variants of one driveline, each simulated and judged, as one labelled Dataset.

All arguments are checked first, one case is run to learn the outputs and the cost of a case, then chunks go out to
workers until all are done. A study that is kept on disk can be resumed after any interruption.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from gearrattle.errors import ConvergenceError, ModelError, Problem
from gearrattle.model import Model
from gearrattle.model.path_values import Varied
from gearrattle.model.table import shown
from gearrattle.model.value_kinds import SEED, Count, argument_problems
from gearrattle.results import Run
from gearrattle.simulation.settings import settled
from gearrattle.simulation.simulate import simulate
from gearrattle.studies.case_batches import FEWEST, can_follow
from gearrattle.studies.designs import design_of
from gearrattle.studies.distributions import distributions_of, sampled
from gearrattle.studies.outputs import DEFAULT, Function, check_list, check_names, outputs_of
from gearrattle.studies.plan import Plan, Samples
from gearrattle.studies.prepared import Prepared, Progress, fit_size, span
from gearrattle.studies.structures import structures_of
from gearrattle.studies.study_axes import Axis, axes_of, check_once
from gearrattle.studies.study_call import conduct
from gearrattle.studies.study_cost import seconds_alone, seconds_together, serial_share
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

T = TypeVar("T")
MOST = 1_000_000
CASES = Count(1)
"""Number of cases allowed."""


class _Refused:
    """Problems of several parts of a study, so that all of them are reported at once."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []

    def by(self, make: Callable[[], T], otherwise: T) -> T:
        """Return what is made; ``otherwise``, and the problems kept, where it is refused."""
        try:
            return make()
        except ModelError as error:
            self.problems += error.problems
            return otherwise


def prepare(
    model: Model,
    axes: Mapping[str, object] | None = None,
    outputs: Sequence[str] = DEFAULT,
    *,
    vary: Mapping[str, object] | None = None,
    samples: int = 0,
    method: str = "latin-hypercube",
    seed: int = 0,
    fixed: Mapping[str, object] | None = None,
    function: Function | None = None,
    most: int = MOST,
) -> Prepared:
    """Check all arguments of a study, and run one case of it. Arguments and errors as ``study``."""
    # check the arguments, all refusals together
    if problems := argument_problems({"seed": (SEED, seed), "most": (CASES, most)}):
        raise ModelError(problems)
    refused = _Refused()
    base = refused.by(lambda: settled(model.with_(fixed) if fixed else model, {}), settled(model, {}))
    none: tuple[Axis, ...] = ()
    swept_axes = refused.by(lambda: axes_of(axes or {}, base), none)
    refused.by(lambda: len(distributions_of(vary or {}, base)), 0)
    refused.by(lambda: design_of(method, samples, len(vary or {})), None)
    refused.by(lambda: check_list(outputs, function), None)
    if refused.problems:
        raise ModelError(refused.problems)
    # plan of cases
    points = _points(vary or {}, samples, method, seed, base)
    check_once([*(path for axis in swept_axes for path in axis.values), *(points.values if points else ())])
    plan = Plan(base, swept_axes, points, 1)
    if not plan.dimensions:
        raise ModelError(Problem("axes", "none", "a study needs an axis, or something that scatters"))
    # outputs of every structure of the driveline
    structures = structures_of(plan)
    check_names(outputs, structures, function)
    if plan.count > most:
        raise ModelError(_wrong_count(plan, base, most))
    # the outputs by one case, the time of a case by some more
    run, seconds = first_run(plan)
    kept_outputs = outputs_of(outputs, run, function, structures)
    serial = 0.0
    fewest = 1
    if can_follow(kept_outputs, plan):
        seconds = seconds_together(plan, kept_outputs, seconds)
        serial = serial_share(plan, kept_outputs, seconds)
        fewest = FEWEST
    else:
        seconds = seconds_alone(plan, kept_outputs.of, run, seconds, kept_outputs.known if function is None else None)
    size = fit_size(seconds, plan.count, fewest)
    return Prepared(Plan(base, swept_axes, points, size), kept_outputs, seconds, serial=serial)


def study(
    model: Model,
    axes: Mapping[str, object] | None = None,
    outputs: Sequence[str] = DEFAULT,
    *,
    vary: Mapping[str, object] | None = None,
    samples: int = 0,
    method: str = "latin-hypercube",
    seed: int = 0,
    fixed: Mapping[str, object] | None = None,
    function: Function | None = None,
    most: int = MOST,
    output: str | os.PathLike[str] | None = None,
    resume: bool = False,
    retry_failed: bool = False,
    workers: int | None = None,
    scheduler: object = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Simulate and judge many variants of a driveline.

    Parameters
    ----------
    model
        the driveline; its file's settings hold for every case.
    axes
        what is varied in order, all combinations: by path of the model file a list of values or a range
        ``{"from": ..., "to": ..., "count": ..., "spacing": "linear" | "log"}``; by another name a mapping from
        paths to lists, which then vary together. ``*`` in a path stands for any text: all values that are set there
        vary together. ``{"factor": ...}`` about a list or a range has factors of what the model says.
    outputs
        names of what is kept: quantities of criteria, "verdict", "crossings per cycle", ...
    vary
        what scatters: by path a mapping with ``distribution`` and its parameters (``studies.distributions``), or
        ``{"factor": ...}`` about it; what matches a pattern has one value, or one factor, in a sample.
    samples
        points drawn of all that scatters, for every combination of the axes.
    method
        "latin-hypercube", "sobol", "random"; "saltelli", "saltelli-pairs" (samples: a power of two) for Sobol'
        indices; "one-at-a-time" (no samples) for the ends of every value (``studies.designs``).
    seed
        of the points.
    fixed
        other values of the model, by path.
    function
        takes a Run, returns numbers by name: further outputs.
    most
        a study of more cases is refused.
    output
        folder or address ("s3://...", "memory://...") to keep it in; None: in memory.
    resume, retry_failed
        go on with what is there; and compute chunks with failed cases anew.
    workers
        processes or threads, results are the same; None: as many as cores, one for few cases.
    scheduler
        "local" (processes), "threads", "tcp://HOST:PORT" or a ``distributed.Client`` (Dask, whose workers
        must see ``output``); None: threads where cases are computed together, else processes.
    progress
        called with the finished share; what it raises ends the work, and leaves whole chunks in the folder.

    Returns
    -------
    xr.Dataset
        A Dataset with a dimension for every axis, "sample" for what scatters, "part" and "inertia" for subjects;
        ``outcome`` gives the outcome of every case, ``attrs["failures"]`` why some failed.

    Raises
    ------
    ModelError
        anything wrong with the study, or a library is not here; nothing has been computed then.
    ConvergenceError
        not even one case could be simulated.
    SchedulerLost
        the cluster has gone; ``resume`` goes on with what is kept.

    Examples
    --------
    >>> axes = {"mesh.gear.backlash": ["0.05 mm", "0.1 mm", "0.2 mm"]}
    >>> data = gr.study(gr.example("case3"), axes, outputs=["largest impact energy"], workers=1)
    >>> data["largest impact energy"].dims
    ('mesh.gear.backlash', 'part')
    """
    return conduct(prepare, **locals())  # every argument, by its name


def _points(vary: Mapping[str, Any], samples: int, method: str, seed: int, model: Model) -> Samples | None:
    design = design_of(method, samples, len(vary))
    distributions = distributions_of(vary, model)
    if not distributions:
        return None
    if design.cases(len(vary), samples) > MOST * 100:
        raise ModelError(Problem("samples", shown(samples), f"more than {MOST * 100} cases cannot be held"))
    varied = [distribution.varied for distribution in distributions]
    base = None if design.takes_samples else np.array([_own_value(one, model) for one in varied])
    return Samples.of(varied, sampled(distributions, samples, method, seed, base), method, model)


def _own_value(varied: Varied, model: Model) -> float:
    """The model's value, the base of one-at-a-time designs."""
    value = varied.own(model)
    if isinstance(value, bool) or not isinstance(value, int | float):
        rule = "one-at-a-time goes out from the model's own value, and it has no number there, or several"
        raise ModelError(Problem(varied.path, shown(value), rule, "give it in the model, or in fixed"))
    return float(value)


def _wrong_count(plan: Plan, model: Model, most: int) -> Problem:
    begun = time.perf_counter()
    simulate(model, audit=False)
    took = time.perf_counter() - begun
    sizes = " x ".join(map(str, plan.shape))
    cost = span(plan.count * took)
    rule = f"{counted(plan.count, 'case')} ({sizes}), more than the {most} allowed; on one core they would take {cost}"
    return Problem("study", "", rule, "make the axes shorter, or allow more with most")


def first_run(plan: Plan) -> tuple[Run, float]:
    """Return a run of the first case that can be simulated, warm, and how long it took [s]."""
    trouble: Exception | None = None
    at = (0,) * len(plan.shape)
    last = tuple(length - 1 for length in plan.shape)
    for index in (at, last, tuple(length // 2 for length in plan.shape)):
        try:
            changed = plan.model.with_(plan.changes(index))
            simulate(changed, audit=False)
            begun = time.perf_counter()
            run = simulate(plan.model.with_(plan.changes(index)), audit=False)
            return run, time.perf_counter() - begun
        except (ModelError, ConvergenceError) as error:
            trouble = trouble or error
    assert trouble is not None
    raise trouble
