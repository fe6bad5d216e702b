"""``optimize``: values of a driveline found within ranges, so that outputs are small or large and others keep limits.

Designs are computed a generation at a time, each generation a study of its own in ``generations/``, by any scheduler.
After an interruption the optimiser gets the results that are kept, and asks for the same designs again: its own state
is never stored. In the end all designs are in one Dataset, with the front (``fronts``).
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.errors import ModelError, Problem
from gearrattle.formats import format_name, version_of
from gearrattle.model import Model
from gearrattle.model.value_kinds import (
    SEED,
    AnyTable,
    Count,
    argument_problems,
    checked,
)
from gearrattle.results import Run
from gearrattle.simulation.settings import settled
from gearrattle.simulation.simulate import simulate
from gearrattle.studies.case_batches import can_batch, can_follow
from gearrattle.studies.goals import Constraint, Objective, constraints_of, named_outputs, objectives_of
from gearrattle.studies.nsga2 import Evolution
from gearrattle.studies.outputs import Function, Outputs, check_list, check_names, outputs_of
from gearrattle.studies.pareto_front import VARIABLES, certificate_of, finished, valued, written
from gearrattle.studies.plan import Plan, Samples
from gearrattle.studies.prepared import Done, Progress, carry_out, fit_size, pays, span, workers_said
from gearrattle.studies.ranges import Range, first_points, own_values, ranges_of
from gearrattle.studies.schedulers import Scheduler, unreachable
from gearrattle.studies.storage import Address, Storage, storage_of
from gearrattle.studies.storage_claim import ABOUT, Claim, check_owner
from gearrattle.studies.stored_studies import failures_of, is_whole
from gearrattle.studies.structures import structures_of
from gearrattle.studies.study_call import conduct
from gearrattle.studies.study_cost import Cost, keeping, rounds, seconds_alone, seconds_together
from gearrattle.studies.study_store import Store, check_array_names
from gearrattle.wording import counted

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
POPULATION = 32
GENERATIONS = 20
MOST = 1_000_000
DESIGNS = Count(4, MOST)
TIMES = Count(1, MOST)
"""Number of designs of a generation, and number of generations."""
_STARTING = 3.0  # seconds until the fresh processes of a generation are warm
_PAYS = 10.0  # seconds of a generation, below which starting processes for it costs more


@dataclass(frozen=True)
class Optimization:
    """Prepared optimisation.

    Attributes
    ----------
    size
        designs of a generation, and generations.
    seconds
        time that one design takes, computed with the others of its generation [s].
    alone
        time that a single audited run takes [s].
    """

    model: Model
    ranges: tuple[Range, ...]
    goals: tuple[tuple[Objective, ...], tuple[Constraint, ...]]
    outputs: Outputs
    size: tuple[int, int]
    seed: int
    seconds: float
    alone: float = 0.0

    def estimate(self, workers: int | None = None, scheduler: str | None = None) -> Cost:
        """Return the cost of all designs, and of the runs that certify the front."""
        population, generations = self.size
        busy = min(workers or pays(scheduler, self.sensible()), self._generation_chunks())
        starting = _STARTING if (scheduler or self.scheduler) == "local" and busy > 1 else 0.0
        per_generation = starting + keeping(self._generation_chunks()) + self._generation_seconds(busy)
        total = generations * per_generation + self._certifying
        words = (
            f"{counted(population * generations, 'case')}, about {1e3 * self.seconds:.3g} ms each, in "
            f"{counted(generations, 'generation')} of {counted(population, 'design')}: "
            f"{span(total)} in all on {workers_said(busy)}"
        )
        return Cost(population * generations, self.seconds, busy, total, words)

    def _generation_chunks(self) -> int:
        """Chunks of a generation."""
        return -(-self.size[0] // fit_size(self.seconds, self.size[0]))

    def _generation_seconds(self, workers: int) -> float:
        """Time of a generation [s]."""
        chunks = self._generation_chunks()
        return rounds(chunks, workers) * self.size[0] / chunks * self.seconds

    @property
    def _certifying(self) -> float:
        """Time to certify the front [s], if half a generation stands on it: a run each, audited."""
        return 0.5 * self.size[0] * self.alone

    @property
    def scheduler(self) -> str:
        """Return the scheduler on this machine: threads where designs are computed together, else processes."""
        if unreachable(self.outputs.function):
            return "threads"
        return "threads" if can_batch(self.outputs, Plan(self.model, (), None, 1)) else "local"

    def sensible(self) -> int:
        """Return how many workers pay: one where a generation is quick, for it starts its own."""
        return 1 if self.size[0] * self.seconds < _PAYS else os.cpu_count() or 1

    def kept(self, folder: Address) -> str:
        """Return in words how many generations a storage location holds; empty if it holds no optimisation."""
        storage = storage_of(folder)
        if not storage.exists(ABOUT):
            return ""
        whole = 0
        while whole < self.size[1] and is_whole(_generation(storage, whole)):
            whole += 1
        return f"{whole} of {counted(self.size[1], 'generation')} are kept whole in {storage.address}"

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
        """Compute the generations a folder does not hold yet, and return the whole; as every study."""
        if retry_failed:
            rule = "an optimisation goes on from what failed designs have told it: they stay as they are"
            raise ModelError(Problem("retry_failed", "", rule, "leave it out, or begin in another folder"))
        storage = storage_of(folder)
        begun = time.perf_counter()
        claim = Claim(storage, resume=resume)
        try:
            self._begin(storage)
            parts, messages, damaged = self._evolved(storage, compute, progress, workers)
            settings = {"seed": self.seed, "population": self.size[0]}
            data = finished(parts, self.goals, self.ranges, (self.model, self.outputs), settings)
            data.attrs["failures"] = failures_of(messages)
            claim.check()
            written(data, self.model, self.ranges, storage)
        finally:
            claim.release()
        cost = f"A design takes about {1e3 * self.seconds:.3g} ms; this run took {time.perf_counter() - begun:.3g} s."
        notes = (f"damaged chunks computed again: {damaged}",) if damaged else ()
        return Done(data, messages, certificate_of(data), cost, _summary(data), notes)

    def _evolved(
        self, storage: Storage, compute: Scheduler, progress: Progress | None, workers: int
    ) -> tuple[list[xr.Dataset], dict[tuple[int, ...], str], int]:
        """Every generation's results, why designs failed, and how many chunks were damaged."""
        # first designs
        population, generations = self.size
        search = Evolution(first_points(self.ranges, self.model, population, self.seed), len(self.goals[0]), self.seed)
        begun = time.perf_counter()
        parts: list[xr.Dataset] = []
        messages: dict[tuple[int, ...], str] = {}
        damaged = 0
        count = 0
        # ask for the designs of a generation
        for g in range(generations):
            shares = search.ask()
            if not len(shares):
                break
            points = np.column_stack(
                [variable.at(share) for variable, share in zip(self.ranges, shares.T, strict=True)]
            )
            if g == 0:
                points[0] = own_values(self.ranges, self.model, points[0])
            # compute them as a study of their own
            plan = Plan(self.model, (), _designs(self.ranges, points, self.model), fit_size(self.seconds, population))
            store = Store.open(_generation(storage, g), plan, self.outputs, resume=True)
            shifted = None if progress is None else _Shifted(progress, g, generations, time.perf_counter() - begun)
            pace = (workers, self._generation_seconds(1) / store.plan.chunks)
            damaged += len(carry_out(store, compute, progress=shifted, pace=pace))
            data = store.dataset()
            # tell objectives and violations
            search.tell(*self._worth(data, plan))
            messages |= {(count + i,): text for (i,), text in store.messages().items()}
            count += len(points)
            parts.append(data)
        return parts, messages, damaged

    def _worth(self, data: xr.Dataset, plan: Plan) -> tuple[Array, Array]:
        """Objectives and violations of a generation; designs without a value are worst, with a large violation."""
        values, violation = valued(data, self.goals, lambda i: plan.model.with_(plan.changes((i,))))
        lost = ~np.isfinite(values).all(axis=1) | ~np.isfinite(violation)
        there = values[~lost]
        values[lost] = there.max(axis=0) if len(there) else 0.0
        return values, np.where(lost, _LOST, violation)

    def _begin(self, storage: Storage) -> None:
        """Begin in a storage location, or check that it holds this optimisation."""
        owner = self._owner()
        if storage.exists(ABOUT):
            check_owner(storage, owner, "optimization")
            return
        storage.put(ABOUT, json.dumps({"owner": owner}).encode(), new=True)
        storage.make("generations")

    def _owner(self) -> dict[str, str]:
        """Everything that decides what is computed; the number of generations does not: more of them go on."""
        function = self.outputs.function
        objectives, constraints = self.goals
        factors = [variable.path for variable in self.ranges if variable.varied.by_factor]
        return {
            "format": format_name("optimization"),
            "model": self.model.to_toml(),
            "variables": repr(self.ranges) + (f", factors {factors}" if factors else ""),
            "objectives": repr([(objective.quantity.label, objective.sense) for objective in objectives]),
            "constraints": repr(
                [(constraint.quantity.label, constraint.below, constraint.above) for constraint in constraints]
            ),
            "seed": str(self.seed),
            "population": str(self.size[0]),
            "outputs": json.dumps([output.name for output in self.outputs.all]),
            "function": "" if function is None else f"{function.__module__}.{getattr(function, '__qualname__', '')}",
            **{name: version_of(name) for name in ("gearrattle", "numpy", "numba", "pymoo")},
        }


_LOST = 1e6


def prepare(
    model: Model,
    variables: Mapping[str, object],
    objectives: Mapping[str, str],
    *,
    constraints: Mapping[str, object] | None = None,
    outputs: Sequence[str] = (),
    population: int = POPULATION,
    generations: int = GENERATIONS,
    seed: int = 0,
    fixed: Mapping[str, object] | None = None,
    function: Function | None = None,
) -> Optimization:
    """Check all arguments of an optimisation, and run the model. Arguments, errors as ``optimize``."""
    # check sizes and tables
    _check_sizes(population, generations, seed)
    limits = constraints or {}
    for name, table in (("objectives", objectives), ("constraints", limits)):
        checked(AnyTable(), table, name)
    # ranges of the variables
    base = settled(model.with_(fixed) if fixed else model, {})
    ranges = ranges_of(variables, base)
    first_points(ranges, base, 2, seed)
    # names of outputs, checked at the corners of the ranges
    labels = [
        *objectives,
        *(label for label, table in limits.items() if not (isinstance(table, Mapping) and "of" in table)),
    ]
    if outputs:
        check_list(outputs)
    wanted = [*outputs, *named_outputs(labels)]
    structures = structures_of(_corners(base, ranges))
    if wanted and function is None:  # a function may return any of them
        _check_labels(outputs, labels, structures)
    # the outputs, by one run
    run, alone = _run_twice(base)
    extra = set(function(run)) if function is not None else set()
    wanted = [name for name in dict.fromkeys(wanted) if name not in extra]
    kept_outputs = outputs_of(wanted, run, function, structures) if wanted or function is not None else Outputs(())
    # names of arrays, and the time of a design
    lowest = np.array([[variable.low for variable in ranges]])
    check_array_names(Plan(base, (), _designs(ranges, lowest, base), 1), kept_outputs, VARIABLES)
    seconds = _design_seconds(base, ranges, kept_outputs, (run, population, seed))
    # goals, and a trial of the optimiser
    goals = objectives_of(objectives, kept_outputs), constraints_of(limits, kept_outputs, base)
    Evolution(np.zeros((2, len(ranges))), len(goals[0]), seed)
    return Optimization(base, ranges, goals, kept_outputs, (population, generations), seed, seconds, alone)


def optimize(
    model: Model,
    variables: Mapping[str, object],
    objectives: Mapping[str, str],
    *,
    constraints: Mapping[str, object] | None = None,
    outputs: Sequence[str] = (),
    population: int = POPULATION,
    generations: int = GENERATIONS,
    seed: int = 0,
    fixed: Mapping[str, object] | None = None,
    function: Function | None = None,
    output: Address | None = None,
    resume: bool = False,
    workers: int | None = None,
    scheduler: object = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Find values within ranges so that some outputs are small or large and others keep limits.

    Parameters
    ----------
    model
        the driveline; its own values are the first design, where they lie within the ranges.
    variables
        by path or pattern a pair (low, high), or ``{"from": ..., "to": ..., "spacing": "linear" | "log"}``; with
        ``{"factor": ...}`` about it factors of what the model says.
    objectives
        by output "min" or "max"; an output with a value for every part is named with its part, such as
        "gear: largest impact energy".
    constraints
        by output ``{"below": ..., "above": ...}``, SI, one of them or both; with ``"of"``, a function of
        the Model, under a name of one's own.
    outputs
        further outputs to keep.
    population, generations
        designs of a generation, and how many; more generations go on with what is kept.
    seed
        of all random numbers.
    fixed, function, output, resume, workers, scheduler, progress
        as in ``study``.

    Returns
    -------
    xr.Dataset
        A Dataset along "design", in the order computed: the outputs, the variables, ``born`` (its generation);
        ``value`` of every "objective", ``violation`` of the constraints (0: feasible; NaN: failed), ``front`` (on it),
        ``exact`` and ``certified`` (of the front, by runs of their own: algorithm "exact", energy audited); along
        "generation" ``best`` of every objective and ``hypervolume``, a share of the box between ``ideal`` and
        ``reference``. ``attrs["best"]`` is the design that comes nearest to the ideal, -1 if none is feasible.

    Raises
    ------
    ModelError
        anything wrong with the arguments, or a library is not here; nothing has been computed then.
    ConvergenceError
        the model itself cannot be simulated.
    SchedulerLost
        as in ``study``.

    Examples
    --------
    >>> front = gr.optimize(
    ...     gr.example("case3"),
    ...     {"mesh.gear.backlash": ("0.05 mm", "0.2 mm")},
    ...     {"gear: largest impact energy": "min"},
    ...     population=4,
    ...     generations=1,
    ...     fixed={"simulation.cycles": 20, "simulation.discard": 10},
    ...     workers=1,
    ... )
    >>> front.sizes["design"], front.attrs["senses"]
    (4, ['min'])
    """
    return conduct(prepare, **locals())  # every argument, by its name


def _check_labels(outputs: Sequence[str], labels: Sequence[str], models: Sequence[Model]) -> None:
    """Refuse outputs, objectives and constraints that name no output, each by the label that names it."""
    problems = []
    for label in dict.fromkeys([*outputs, *labels]):
        try:
            check_names([label] if label in outputs else named_outputs([label]), models)
        except ModelError as error:
            location = "outputs" if label in outputs else f"goal {label}"
            problems += [replace(problem, place=location) for problem in error.problems]
    if problems:
        raise ModelError(problems)


def _run_twice(model: Model) -> tuple[Run, float]:
    """A run of the model, and the time of a warm and audited one [s]."""
    run = simulate(model, algorithm="exact", audit=True) if model.simulation.algorithm == "exact" else simulate(model)
    begun = time.perf_counter()
    simulate(model, algorithm="exact", audit=True)
    return run, time.perf_counter() - begun


def _design_seconds(model: Model, ranges: tuple[Range, ...], outputs: Outputs, of: tuple[Run, int, int]) -> float:
    """Time of a design [s], from some of the first generation; ``of``: a run, the population, the seed."""
    run, population, seed = of
    shares = first_points(ranges, model, population, seed)
    points = np.column_stack([variable.at(share) for variable, share in zip(ranges, shares.T, strict=True)])
    plan = Plan(model, (), _designs(ranges, points, model), population)
    begun = time.perf_counter()
    simulate(model, audit=False)
    alone = time.perf_counter() - begun
    if can_follow(outputs, plan):
        return seconds_together(plan, outputs, alone)
    return seconds_alone(plan, outputs.of, run, alone)


def _corners(model: Model, ranges: tuple[Range, ...]) -> Plan:
    """The model itself, and each range's ends by themselves: among these is a design of every structure."""
    low = np.array([variable.low for variable in ranges])
    own = own_values(ranges, model, low)
    ends = [np.where(np.arange(len(ranges)) == i, end, own) for i, r in enumerate(ranges) for end in (r.low, r.high)]
    return Plan(model, (), _designs(ranges, np.array([own, *ends]), model), 1)


def _designs(ranges: tuple[Range, ...], points: NDArray[np.float64], model: Model) -> Samples:
    """Designs (n, d) as samples of the model."""
    return Samples.of([variable.varied for variable in ranges], points, "optimization", model)


def _check_sizes(population: int, generations: int, seed: int) -> None:
    problems = argument_problems(
        {"population": (DESIGNS, population), "generations": (TIMES, generations), "seed": (SEED, seed)}
    )
    if not problems and population * generations > MOST:
        problems.append(Problem("population", f"{population} x {generations}", f"more than {MOST} designs"))
    if problems:
        raise ModelError(problems)


def _generation(storage: Storage, number: int) -> Storage:
    return storage.under(f"generations/{number:04d}")


@dataclass(frozen=True)
class _Shifted:
    """Progress of one generation as that of the whole.

    Attributes
    ----------
    number, of
        of the generation, from 0, and how many there are.
    taken
        what those before took [s].
    """

    progress: Progress
    number: int
    of: int
    taken: float

    def __call__(self, share: float) -> None:
        """Tell the finished share of the whole."""
        self.progress((self.number + share) / self.of)

    def expect(self, seconds: float) -> None:
        """Report the remaining time: of this generation, and of as long ones after it."""
        expect = getattr(self.progress, "expect", None)
        if expect is not None:
            per_case = self.taken / self.number if self.number else seconds
            expect(seconds + (self.of - self.number - 1) * per_case)


def _summary(data: xr.Dataset) -> dict[str, Any]:
    """Summary for machines."""
    best = int(data.attrs["best"])
    front = np.flatnonzero(data["front"].values == 1)
    summary: dict[str, Any] = {"designs": int(data.sizes["design"]), "front": front.tolist(), "best": best}
    if best >= 0:
        summary["values"] = {str(name): float(data[name][best]) for name in data.attrs["variables"]}
        summary["objectives"] = {
            str(name): float(value)
            for name, value in zip(data["objective"].values, data["value"][best].values, strict=True)
        }
    return summary
