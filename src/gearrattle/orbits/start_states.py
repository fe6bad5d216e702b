"""States of a model at the start of a period, as users write them and as the period map takes them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import assemble, coordinates_of, period_of, refuse_unsteady, start_table
from gearrattle.engine.periodic.motion import State
from gearrattle.engine.periodic.period_map import PeriodMap
from gearrattle.engine.system.coordinates import relative_coordinates
from gearrattle.errors import ModelError, Problem
from gearrattle.model import Initial, Model
from gearrattle.model.table import shown
from gearrattle.results import Run
from gearrattle.simulation.limits import check_memory
from gearrattle.simulation.simulate import Plan, prepare
from gearrattle.trajectory import Trajectory
from gearrattle.wording import measured

Array = NDArray[np.float64]
Start = str | Mapping[str, Sequence[float]] | Run
"""A start: "steady", "static", "zero", angles and velocities of all inertias [rad, rad/s], or a run: its end."""

_BALANCED = 1e-12  # of the sum of all mean torques


def check_repeats(model: Model) -> None:
    """Refuse a model whose inputs do not repeat, or that mean torques drive away.

    Raises ModelError: records, sweeps, orders without a common period; mean torques on a train that turns freely
    without drag.
    """
    refuse_unsteady(model, "a periodic motion")
    if notes := period_of(model).notes:
        rule = "a periodic motion needs a common period of all orders"
        remedy = "give orders p/q with small p and q"
        raise ModelError(Problem("excitation", notes[0], rule, remedy))
    system = assemble(model).system
    motion = relative_coordinates(system).angle_from_reference
    mean = motion.T @ system.inputs.mean
    size = np.abs(motion.T) @ np.abs(system.inputs.mean)
    has_drag = (np.abs(motion.T) @ system.drag) > 0.0
    for torque, total, is_held in zip(mean, size, has_drag, strict=True):
        if abs(torque) > _BALANCED * total and not is_held:
            rule = "the mean torques on a train that turns freely without drag must balance"
            remedy = 'say mean = "balance" in one torque of the train, or give an inertia of it a drag'
            left = measured(float(torque), "N m" if model.units == "SI" else "", 6)
            raise ModelError(Problem("torque", f"{left} left over", rule, remedy))


def state_of(model: Model, period_map: PeriodMap, start: Start | None) -> State:
    """Return the state of a start; None is that of the model.

    Raises ModelError: the start is not valid, or the model has no static equilibrium.
    """
    if isinstance(start, Run):
        return _end_of(model, period_map, start)
    settings = {"algorithm": "exact"} if start is None else {"algorithm": "exact", "initial": start}
    try:
        task = prepare(model, settings, audit=False).task
    except ModelError as error:
        raise _about_start(error, start) from None
    return period_map.state_of(task.angle, task.velocity)


def check_inertias(model: Model, other: Model, value: str) -> None:
    """Refuse a motion of a model with other inertias as a start; ``value`` is how it is shown.

    Raises ModelError: the names of the inertias differ.
    """
    names = [inertia.name for inertia in model.inertias]
    if [inertia.name for inertia in other.inertias] != names:
        rule = f"must be a motion of the same inertias, {', '.join(names)}"
        raise ModelError(Problem("start", value, rule, "simulate this model"))


def has_same_sliders(model: Model, other: Model) -> bool:
    """Return whether two models have the same sliders; if not, all of them are unloaded in a start from the other."""
    names, others = (assemble(one).layout.auxiliary_names for one in (model, other))
    return names == others


def _about_start(error: ModelError, start: object) -> ModelError:
    """The same error, about the argument and not about the model, where the start is no word or table for one."""
    if start is None or isinstance(start, Mapping):
        return error
    is_own = [problem.place.endswith("simulation.initial") for problem in error.problems]
    if not all(is_own):
        return error
    rule = 'must be "steady", "static", "zero", "linear", a run, an orbit, or angles and velocities of all inertias'
    return ModelError(Problem("start", shown(start), rule, 'such as {"angle": [0.1], "velocity": [0.0]}'))


def _end_of(model: Model, period_map: PeriodMap, run: Run) -> State:
    """The state in which a run ends."""
    trajectory = run.trajectory
    check_inertias(model, run.model, repr(run))
    if not has_same_sliders(model, run.model):
        trajectory = replace(trajectory, auxiliaries=None)
    return state_at(period_map, model, trajectory, trajectory.end)


def state_at(period_map: PeriodMap, model: Model, trajectory: Trajectory, time: float) -> State:
    """Return the state of a simulated motion at an instant [s], between samples by cubic polynomials."""
    from scipy.interpolate import CubicHermiteSpline

    i = int(np.clip(np.searchsorted(trajectory.time, time, side="right") - 1, 0, len(trajectory.time) - 2))
    rows = slice(i, i + 2)
    angle, velocity, acceleration = (coordinates_of(model, trajectory, order, rows) for order in range(3))
    angle_then, velocity_then = (
        CubicHermiteSpline(trajectory.time[rows], values, slopes)(time)
        for values, slopes in ((angle, velocity), (velocity, acceleration))
    )
    state = period_map.state_of(angle_then, velocity_then)
    auxiliaries = trajectory.auxiliaries
    if auxiliaries is None:
        return state
    share = (time - trajectory.time[i]) / (trajectory.time[i + 1] - trajectory.time[i])
    memories = auxiliaries.memory[rows][:, list(period_map.system.memories)]
    memory = memories[0] + share * (memories[1] - memories[0])
    y = np.concatenate([state.y[: state.y.size - memory.size], memory])
    return State(y, period_map.kept_pieces(np.asarray(auxiliaries.piece[i + round(share)], dtype=np.int64)))


def initial_of(model: Model, period_map: PeriodMap, state: State) -> dict[str, list[float]]:
    """Return a state as ``simulate`` takes it: angles and velocities of all inertias, references at zero.

    The memories of sliders have no room in it: ``simulate`` begins with all of them unloaded.
    """
    task = period_map.task(state, 1)
    return start_table(model, task.angle, task.velocity)


def plan_from(model: Model, orbit: tuple[PeriodMap, State], settings: dict[str, Any]) -> Plan:
    """Return the simulation by ``exact`` from a state of a periodic motion, memories of its sliders included.

    Raises ModelError: as of ``simulate``.
    """
    begun = orbit[0].task(orbit[1], 1)
    initial = initial_of(model, *orbit)
    plan = prepare(model, {**settings, "algorithm": "exact", "initial": initial}, audit=False)
    task = replace(plan.task, memory=begun.memory, auxiliary_pieces=begun.auxiliary_pieces)
    check_memory(task.system, task.cycles, task.samples_per_cycle, "simulation.cycles")
    return replace(plan, task=task)


def plan_of(model: Model, period_map: PeriodMap, state: State, samples_per_cycle: int) -> Plan:
    """Return the simulation of one pass from a state, memories included."""
    settled = model.with_simulation({"initial": "zero"}) if isinstance(model.simulation.initial, Initial) else model
    grid = {"cycles": period_map.cycles, "discard": 0, "samples_per_cycle": samples_per_cycle}
    plan = prepare(settled, {**grid, "algorithm": "exact", "initial": "zero"}, audit=False)
    return replace(plan, task=period_map.task(state, period_map.cycles, samples_per_cycle))
