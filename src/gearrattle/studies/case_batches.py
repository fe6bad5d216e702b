"""Cases of one structure computed together in the compiled loop over variants (``solvers.variants``).

The cases of a chunk differ in a few numbers. So they are assembled together (``assembly.variant_assembly``), integrated
and evaluated without a model, a system or a trajectory for each case; the results have the same bits as one case at a
time. Metrics and outputs that need samples are computed when a case leaves the loop (``studies.batch_outputs``).
Computed case by case are: outputs of a whole run or of a user's function, other algorithms, cases of another
structure, cases that fail.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble, coordinates_at_start, free_of
from gearrattle.assembly.variant_assembly import coefficients, static_velocities
from gearrattle.engine.kernels.variant_arrays import Tallies, picked, room_for
from gearrattle.engine.kernels.variants_march import AS_GIVEN, STATIC, STEADY
from gearrattle.engine.solvers.variants import Pattern, follow_variants, has_loop, march_variants
from gearrattle.errors import Cancelled, GearRattleError
from gearrattle.model import Initial, Model
from gearrattle.quantities.quantity_table import CROSSING_CRITERIA
from gearrattle.signals import gap_names, judged_arrays, parts_of, reduced_inertias
from gearrattle.studies.batch_outputs import Followed, is_followed
from gearrattle.studies.output import WORST, Output
from gearrattle.studies.outputs import Outputs
from gearrattle.studies.plan import Plan
from gearrattle.trajectory import Layout

Array = NDArray[np.float64]
Values = dict[str, NDArray[Any]]

FEWEST = 4
"""Least number of cases that are computed together."""
_STRUCTURES = 3  # largest number of structures tried in a chunk
_STARTS = {"steady": STEADY, "static": STATIC, "zero": AS_GIVEN}
_COUNTED = ("crossings per cycle", "function calls")


def can_batch(outputs: Outputs, plan: Plan) -> bool:
    """Whether compiled code alone gives these outputs: all come from crossings, and the cases can follow."""
    return all(is_of_crossings(output) for output in outputs.chosen) and can_follow(outputs, plan)


def can_follow(outputs: Outputs, plan: Plan) -> bool:
    """Whether the loop gives these outputs of such cases: of a plain grid, whose paths define a case completely."""
    are_known = all(is_of_crossings(output) or is_followed(output) for output in outputs.chosen)
    is_exact = plan.model.simulation.algorithm == "exact"
    is_grid = outputs.function is None and plan.is_grid
    return are_known and is_grid and is_exact and has_loop(assemble(plan.model).system)


def is_of_crossings(output: Output) -> bool:
    """Whether an output comes from the crossings alone."""
    return (output.criterion in CROSSING_CRITERIA or output.name in _COUNTED) and not output.over_all


def batched(
    plan: Plan, outputs: Outputs, chunk: int, progress: Callable[[float], None] | None = None
) -> tuple[Values, NDArray[np.bool_]]:
    """Compute the cases of a chunk that can be computed together.

    Parameters
    ----------
    progress
        called now and then with the share of the chunk's cases that are done; what it raises ends the work.

    Returns
    -------
    tuple[Values, NDArray[np.bool_]]
        Values by output, (cases, subjects) or (cases,), in the chunk's order, and (cases,) which of them are there.
    """
    # arrays of the outputs, still without results
    count = plan.cases_in(chunk)
    if not can_follow(outputs, plan):
        return {}, np.zeros(count, dtype=np.bool_)
    varied = plan.columns(chunk)
    values: Values = {}
    for output in outputs.all:
        shape = (count, len(output.subjects)) if output.dimension else (count,)
        values[output.name] = np.full(shape, output.nothing, output.dtype)
    # cases that wait, and outputs that need samples
    done = np.zeros(count, dtype=np.bool_)
    waiting = np.arange(count)
    of_each = [output for output in outputs.chosen if not is_of_crossings(output)]

    def report_share(share: float) -> None:
        if progress is not None:
            progress((done.sum() + share * waiting.size) / count)

    # one structure after the other
    for _ in range(_STRUCTURES):
        if waiting.size < FEWEST:
            break
        model = _pattern(plan.model, {path: column[waiting[0]] for path, column in varied.items()})
        if model is None or not assemble(model).system.is_plain:
            waiting = waiting[1:]
            continue
        # assemble the cases of this structure
        alike = _Alike.of(model, {path: column[waiting] for path, column in varied.items()}, waiting.size)
        chosen = waiting[alike.good]
        # march and judge them in one compiled loop
        if chosen.size and alike.pattern.can_march():
            if of_each:
                tallies, judged = _follow(values, Followed(of_each, model), alike, (varied, chosen), report_share)
            else:
                tallies, judged = alike.march(report_share)
            _keep(values, outputs, alike, tallies, (chosen, judged))
            done[chosen[judged]] = True
        waiting = waiting[~alike.good] if chosen.size else waiting[1:]
    return values, done


def _pattern(model: Model, changes: Mapping[str, Any]) -> Model | None:
    """The model of one case; None if there is none."""
    try:
        return model.with_(changes) if changes else model
    except GearRattleError:
        return None


@dataclass(frozen=True)
class _Alike:
    """Cases of one structure, assembled.

    ``good`` marks the cases asked for that could be assembled; ``numbers`` are their coefficients.
    """

    model: Model
    layout: Layout
    pattern: Pattern
    numbers: Any
    start: tuple[Array, Array]
    window: Array
    good: NDArray[np.bool_]

    @classmethod
    def of(cls, model: Model, varied: Mapping[str, NDArray[Any]], count: int) -> _Alike:
        """Assemble cases."""
        driveline = assemble(model)
        settings = model.simulation
        system = driveline.system
        layout = driveline.layout
        assert settings.cycles is not None and settings.discard is not None  # noqa: PT018 - the plan's model is settled
        assert settings.samples_per_cycle is not None
        start = _STARTS[settings.initial] if isinstance(settings.initial, str) else AS_GIVEN
        pattern = Pattern(system, start, settings.cycles, judged_arrays(layout))
        columns, is_number = _floats(varied, count)
        numbers, good = coefficients(model, columns, count)
        good &= is_number
        angle, velocity = np.zeros((2, count, system.size))
        if isinstance(settings.initial, Initial):
            angle[:], velocity[:] = coordinates_at_start(model, settings.initial)
        elif start != AS_GIVEN:
            fitting = {path: column[good] for path, column in columns.items()}
            velocity[good], level = static_velocities(model, fitting, int(good.sum()))
            good[good] = level
        period = numbers.period[good, 0]
        numbers = picked(numbers, good)
        angle = angle[good]
        velocity = velocity[good]
        samples = settings.cycles * settings.samples_per_cycle
        end = np.maximum(samples * (period / settings.samples_per_cycle), settings.cycles * period)
        window = np.stack([settings.discard * period, end, period], axis=1)
        return cls(model, layout, pattern, numbers, (angle, velocity), window, good)

    def march(self, progress: Callable[[float], None]) -> tuple[Tallies, NDArray[np.bool_]]:
        """March and judge them."""
        return march_variants(self.pattern, self.numbers, self.start, self.window, progress)

    @property
    def cycles(self) -> int:
        """Length of the steady part in periods."""
        return int(self.model.simulation.cycles or 0) - int(self.model.simulation.discard or 0)


def _floats(varied: Mapping[str, NDArray[Any]], count: int) -> tuple[dict[str, Array], NDArray[np.bool_]]:
    """Columns as floats, and which cases have nothing but numbers in them."""
    columns = {}
    good = np.ones(count, dtype=np.bool_)
    for path, column in varied.items():
        if column.dtype == object:
            fits = np.array([type(value) in (int, float) for value in column.tolist()])
            columns[path] = np.where(fits, column, np.nan).astype(float)
            good &= fits
        else:
            columns[path] = np.ascontiguousarray(column, dtype=float)
    return columns, good


def _follow(
    values: Values,
    followed: Followed,
    alike: _Alike,
    of: tuple[Mapping[str, NDArray[Any]], NDArray[Any]],
    progress: Callable[[float], None],
) -> tuple[Tallies, NDArray[np.bool_]]:
    """March and judge cases, and write the values of each; ``of``: varied values, and the cases' places."""
    varied, chosen = of
    judged = np.zeros(chosen.size, dtype=np.bool_)
    out = room_for(chosen.size, alike.pattern.judged)
    together = follow_variants(alike.pattern, alike.numbers, alike.start, alike.window, followed.kept)
    for variant, batch in together:
        out = batch.out
        at = chosen[variant]
        try:
            model = _pattern(followed.model, {path: _plain(column[at]) for path, column in varied.items()})
            of_case = None if model is None else followed.values(model, variant, batch)
        except Cancelled:
            raise
        except Exception:  # a case that fails is reported where it is simulated by itself
            of_case = None
        judged[variant] = of_case is not None
        for name, value in (of_case or {}).items():
            values[name][at] = value
        progress((variant + 1) / chosen.size)
    return out, judged


def _plain(value: Any) -> Any:
    """A value as a case changes it."""
    return value.item() if isinstance(value, np.generic) else value


def _keep(
    values: Values, outputs: Outputs, alike: _Alike, tallies: Tallies, places: tuple[NDArray[Any], NDArray[np.bool_]]
) -> None:
    """Write the values of the cases that are judged."""
    # tallies and reduced inertias of the cases judged
    chosen, judged = places
    tally = picked(tallies, judged)
    at = chosen[judged]
    duration = (alike.window[:, 1] - alike.window[:, 0])[judged]
    inertia = np.repeat(alike.layout.inertia[None], judged.sum(), axis=0)
    free = free_of(alike.model)
    inertia[:, free] = alike.numbers.inertia[judged, : free.size]
    layout = parts_of(alike.layout)
    mass = reduced_inertias(layout, layout.clearance.tolist(), inertia)
    sums = {**tally._asdict(), "mass": mass}
    gaps = gap_names(layout)
    by_criterion: dict[str, Mapping[tuple[str, str], Array]] = {}
    # values of outputs, criterion by criterion
    for output in filter(is_of_crossings, outputs.chosen):
        # counts of the loop
        if output.name in _COUNTED:
            counted = tally.crossings / alike.cycles if output.name == _COUNTED[0] else tally.calls
            values[output.name][at] = counted[:, 0]
            continue
        # quantities over crossings, computed once a criterion
        if output.criterion not in by_criterion:
            criterion = CROSSING_CRITERIA[output.criterion]
            by_criterion[criterion.name] = criterion.values(sums, layout, alike.cycles, duration)
        measures = by_criterion[output.criterion]
        # worst gap
        if output.name in WORST:
            of_gaps = [value for (part, what), value in measures.items() if what == output.quantity and part in gaps]
            values[output.name][at] = np.max(np.nan_to_num(of_gaps), axis=0, initial=0)
            continue
        # values by subject
        values[output.name][at] = output.before
        for i, subject in enumerate(output.subjects):
            if (subject, output.quantity) in measures:
                values[output.name][at, i] = measures[subject, output.quantity]
