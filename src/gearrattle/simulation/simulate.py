"""Simulation of a model in time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import (
    Driveline,
    assemble,
    check_length,
    component_notes,
    decay_notes,
    lasts_as_the_run,
    period_of,
    record_notes,
    whole_trajectory,
)
from gearrattle.derived_values import kept
from gearrattle.engine.solvers import Task
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Model, check_model
from gearrattle.model.value_kinds import CALLBACK, FLAG, check_arguments
from gearrattle.results import Run
from gearrattle.simulation.initial_state import start_of
from gearrattle.simulation.integrate import integrate
from gearrattle.simulation.limits import check_memory, check_rates, check_tables
from gearrattle.simulation.mean_speed import mean_speed_notes
from gearrattle.simulation.settings import settled
from gearrattle.trajectory import Layout, Trajectory

Array = NDArray[np.float64]


def simulate(
    model: Model,
    algorithm: str | None = None,
    *,
    cycles: int | None = None,
    samples_per_cycle: int | None = None,
    discard: int | None = None,
    tolerance: float | None = None,
    step: float | str | None = None,
    initial: str | Mapping[str, Sequence[float]] | None = None,
    audit: bool = True,
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Integrate a model in time.

    Every setting left at None comes from the file, then from the defaults.

    Parameters
    ----------
    model
        the driveline.
    algorithm
        "exact" (event-driven, certified); "rk4", "rk2" (fixed step); "adams", "gear", "gear-events"
        (SUNDIALS), "dop853", "radau" (SciPy).
    cycles
        length of the run, in periods T of all orders together.
    samples_per_cycle
        output samples per period; the grid is t = k T / samples_per_cycle, both ends included.
    discard
        periods criteria leave out at the start.
    tolerance
        exact: bound on a crossing's residual relative to the element's largest corner.
    step
        fixed-step algorithms: the step [s] or a string with a unit.
    initial
        "steady" (the equilibrium under the means, every free train turning as in its periodic response, so that its
        mean fluctuation of speed is zero), "static" (the same with velocities zero), "zero" or {"angle": [...],
        "velocity": [...]} [rad, rad/s].
    audit
        whether to audit the energy (exact only; adds a tenth to two fifths to the time of a run).
    progress
        called with the fraction done, now and then; what it raises ends the run.

    Raises
    ------
    ModelError
        bad settings, or no static equilibrium.
    ConvergenceError
        the algorithm failed; carries time, state and what to try.

    Examples
    --------
    >>> run = gr.simulate(gr.example("case3"), cycles=20, discard=10)
    >>> run.data.sizes["time"], len(run.events) > 100
    (10241, True)
    """
    check_model(model)
    check_arguments(audit=(FLAG, audit), progress=(CALLBACK, progress))

    arguments = {
        "algorithm": algorithm,
        "cycles": cycles,
        "samples_per_cycle": samples_per_cycle,
        "discard": discard,
        "tolerance": tolerance,
        "step": step,
        "initial": initial,
    }
    plan = prepare(model, arguments, audit)
    check_memory(plan.task.system, plan.task.cycles, plan.task.samples_per_cycle, "simulation.cycles")
    trajectory = integrate(plan.task, plan.layout, plan.algorithm, plan.discard, progress)
    notes = mean_speed_notes(plan.model, plan.task.system, trajectory)
    return plan.run(trajectory, notes)


@dataclass(frozen=True)
class Plan:
    """A simulation about to begin: settings filled in, task, layout, key of ``SOLVERS``, cycles to discard, notes."""

    model: Model
    task: Task
    layout: Layout
    algorithm: str
    discard: int
    notes: tuple[str, ...]

    def run(self, trajectory: Trajectory, notes: tuple[str, ...] = ()) -> Run:
        """Run of a trajectory of this plan, with the notes of the plan."""
        every = whole_trajectory(self.model, trajectory)
        return Run(replace(every, notes=(*self.notes, *trajectory.notes, *notes)), self.model)


def prepare(model: Model, arguments: dict[str, Any], audit: bool) -> Plan:
    """Settle every setting, assemble the system and find the start; ModelError for bad settings, or without a static
    equilibrium.
    """
    used = settled(model, arguments)
    settings = used.simulation
    assert settings.algorithm is not None and settings.cycles is not None  # noqa: PT018 - settled() filled them in
    assert settings.samples_per_cycle is not None and settings.discard is not None  # noqa: PT018
    driveline = assemble(used if lasts_as_the_run(model) else model)
    check_length(model, settings.cycles * period_of(model).period)
    check_takes(driveline, settings.algorithm)
    check_rates(driveline)
    if settings.algorithm == "exact":
        check_tables(driveline.system)
    angle, velocity, notes = start_of(settings.initial, driveline)
    grid = (settings.cycles, settings.samples_per_cycle)
    task = Task(driveline.system, angle, velocity, *grid, settings.tolerance, settings.step, audit)
    return Plan(used, task, driveline.layout, settings.algorithm, settings.discard, (*_notes_of(model), *notes))


def check_takes(driveline: Driveline, algorithm: str) -> None:
    """Refuse another algorithm where only ``exact`` takes the model: friction, clipped contact damping, a torque over
    time or a sweep (ModelError).
    """
    if algorithm != "exact" and (reason := needs_exact(driveline)):
        remedy = 'algorithm = "exact", or take hysteresis and contact_damping out to compare algorithms'
        raise ModelError(Problem("algorithm", algorithm, reason, remedy if driveline.system.auxiliaries else ""))


def needs_exact(driveline: Driveline) -> str:
    """Reason why only ``exact`` takes a model; empty where every algorithm does."""
    if driveline.system.auxiliaries:
        name = driveline.layout.auxiliary_names[0]
        return f"friction, clipped contact damping and alternation need exact; the model has {name}"
    return "" if driveline.system.signals is None else "a torque or a motion over time, or a sweep, needs exact"


@kept
def _notes_of(model: Model) -> tuple[str, ...]:
    """Notes on every run of a model."""
    of_parts = (*component_notes(model), *decay_notes(model))
    return (*period_of(model).notes, *of_parts, *_sweep_notes(model), *record_notes(model))


def _sweep_notes(model: Model) -> tuple[str, ...]:
    """Notes on a sweep of the speed whose length is given in cycles."""
    sweep = model.excitation.sweep
    if sweep is None:
        return ()
    span = f"the speed goes from {sweep.begin:.6g} to {sweep.end:.6g} rad/s over {sweep.over:.6g} s"
    return (f"{span}: cycles and rates per cycle refer to the first speed.",)
