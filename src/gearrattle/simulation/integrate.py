"""Loop that drives every solver: time slices, progress, cancelling, failures in words, and the trajectory."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gearrattle.compilation import COMPILATION
from gearrattle.engine.solvers import SOLVERS
from gearrattle.engine.solvers.solver import Marching, Motion, Position, Task
from gearrattle.errors import ConvergenceError
from gearrattle.outcome import Outcome
from gearrattle.slices import slices
from gearrattle.trajectory import Cost, EventLog, Layout, Sideways, Trajectory

Progress = Callable[[float], None]
_UNTIL_JUDGED = 2.0  # time after which a run is checked for being slow [s]
_SLOW = 60.0  # time of a cycle from which on a run is slow; usually it takes milliseconds [s]


def integrate(
    task: Task, layout: Layout, algorithm: str, discard: int = 0, progress: Progress | None = None
) -> Trajectory:
    """Integrate a task; return the trajectory under the names of the driveline.

    A ConvergenceError, with time, state and remedy, reports that the algorithm became unstable or stalled.

    ``progress`` is called with the finished fraction after every slice; an exception from it ends the run. Its method
    ``because``, if it has one, is called once after two seconds: with the reason if a cycle takes minutes, otherwise
    with an empty text.
    """
    begin = time.perf_counter()
    march = SOLVERS[algorithm](task)
    return finish(march, task, layout, algorithm, discard=discard, progress=progress, begin=begin)


def finish(
    march: Marching,
    task: Task,
    layout: Layout,
    algorithm: str,
    *,
    discard: int,
    progress: Progress | None,
    begin: float,
    first_cycle: int = 0,
) -> Trajectory:
    """Drive a solver to the end of its task, and return the trajectory; see ``integrate``.

    Parameters
    ----------
    task
        the task; its ``cycles`` are those of this trajectory.
    begin
        reading of the clock from which the wall time counts [s].
    first_cycle
        number of whole cycles before the first sample.
    """
    because = getattr(progress, "because", None)
    since = time.perf_counter() - COMPILATION.seconds
    while (outcome := march.advance()) is not Outcome.DONE:
        if outcome is not Outcome.SLICE_SPENT:
            raise failure(march.position(), outcome, algorithm, layout)
        if progress is not None:
            progress(march.fraction())
            took = time.perf_counter() - COMPILATION.seconds - since
            if because is not None and took > _UNTIL_JUDGED:
                position = march.position()
                because(_reason(position, layout, took / _SLOW, position.time / layout.period - first_cycle))
                because = None
    motion = march.motion()
    grid = Grid(task.samples_per_cycle, task.cycles, first_cycle, discard)
    return named(motion, layout, grid, cost_of(motion, algorithm, time.perf_counter() - begin - motion.aside))


def _reason(position: Position, layout: Layout, least: float, cycles: float) -> str:
    """Return why a run with fewer cycles than ``least`` is slow; empty if it is not, or if the reason is unknown."""
    if cycles >= least or position.fastest is None:
        return ""
    return f"a cycle takes minutes: {layout.element_names[position.fastest]} moves very fast for its inertias"


def failure(position: Position, outcome: Outcome, algorithm: str, layout: Layout) -> ConvergenceError:
    """Return the error for a march that ended early: what happened, where, and what to try."""
    names = layout.clearance_names
    where = "" if position.last_crossed is None else f" in {names[position.last_crossed]}"
    fastest = (
        ""
        if position.fastest is None
        else f": {layout.element_names[position.fastest]} moves too fast for its inertias"
    )
    what = {
        Outcome.NO_PROGRESS: f"the motion needs too many steps{fastest},",
        Outcome.AUDIT_TOO_LONG: f"the energy audit needs too many steps{fastest}; it was refused",
        Outcome.TOO_MANY_REGIONS: f"the motion visits too many regions for so many inertias{where}",
        Outcome.CHATTER: f"crossings pile up{where}",
        Outcome.NON_FINITE: "the state is no longer finite (unstable)",
        Outcome.NO_CONVERGENCE: "failed to converge: no step, however short, passes the error test,",
    }
    state = {f"deflection.{name}": float(value) for name, value in zip(names, position.deflection, strict=True)}
    message = f"{algorithm}: {what.get(outcome, outcome.name)} at t = {position.time:.9g} s"
    of_tolerance = outcome is Outcome.NO_PROGRESS and position.fastest is None  # steps are chosen by their error
    remedy = Outcome.NO_CONVERGENCE.advice if of_tolerance else outcome.advice
    return ConvergenceError(message, time=position.time, state=state, remedy=remedy)


def cost_of(motion: Motion, algorithm: str, wall: float) -> Cost:
    """Return the cost of a motion; ``wall`` is its computing time [s]."""
    return Cost(
        algorithm=algorithm,
        steps=motion.steps,
        function_calls=motion.function_calls,
        jacobian_calls=motion.jacobian_calls,
        events=len(motion.crossings.time),
        average_step=float(motion.average_step),
        average_trial_step=float(motion.average_trial_step),
        wall_time=wall,
        energy_residual=None if motion.energy is None else motion.energy.relative_residual,
        rejected_steps=motion.rejected_steps,
        smallest_step=motion.smallest_step,
    )


class Grid(NamedTuple):
    """Output grid of a trajectory."""

    samples_per_cycle: int
    cycles: int
    first_cycle: int  # number of cycles before the first sample
    discard: int  # number of cycles that the criteria leave out


def named(motion: Motion, layout: Layout, grid: Grid, cost: Cost) -> Trajectory:
    """Return the trajectory of a motion, with the names of the driveline."""
    # labels of regions from indices of pieces
    first = layout.region_of_first_piece
    crossings = motion.crossings
    label = first[crossings.clearance] if len(crossings.clearance) else np.zeros(0, np.int64)
    # time, forces of clearances, regions and torques, slice by slice
    per_cycle = grid.samples_per_cycle
    samples = len(motion.angle)
    time = np.empty(samples)
    torque = np.empty_like(motion.force)
    force = np.empty((len(layout.clearance), samples)).T  # one clearance after the other, as criteria read them
    region = np.empty(motion.piece.shape, motion.piece.dtype)
    for part in slices(samples, 4 * len(layout.radii) + 1):
        index = grid.first_cycle * per_cycle + np.arange(part.start, part.stop, dtype=float)
        time[part] = index * (layout.period / per_cycle)
        force[part] = motion.force[part][:, layout.clearance]
        region[part] = motion.piece[part] + first
        torque[part] = motion.force[part] * layout.radii[:, 0]
    # angles of bodies, then displacements
    turning = motion.angle.shape[1] - len(layout.direction_names)
    sideways = None
    if layout.direction_names:
        sideways = Sideways(
            displacement=motion.angle[:, turning:],
            velocity=motion.velocity[:, turning:],
            acceleration=motion.acceleration[:, turning:],
            bearing_force=motion.force @ layout.bearing_rows.T,
            casing_force=motion.force @ layout.casing_rows.T,
        )
    # trajectory under the names of the driveline
    return Trajectory(
        layout=layout,
        time=time,
        angle=motion.angle[:, :turning],
        velocity=motion.velocity[:, :turning],
        acceleration=motion.acceleration[:, :turning],
        deflection=motion.deflection,
        force=force,
        region=region,
        element_torque=torque,
        events=EventLog(
            time=crossings.time,
            clearance=crossings.clearance,
            from_region=crossings.from_piece + label,
            to_region=crossings.to_piece + label,
            velocity=crossings.velocity,
            force_integral=crossings.force_integral,
        ),
        initial_region=motion.initial_piece + first,
        final_force_integral=motion.final_force_integral,
        samples_per_cycle=per_cycle,
        cycles=grid.cycles,
        discard=grid.discard,
        cost=cost,
        notes=motion.notes,
        energy=motion.energy,
        first_cycle=grid.first_cycle,
        auxiliaries=motion.auxiliaries,
        sideways=sideways,
    )
