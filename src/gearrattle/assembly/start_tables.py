"""Initial states as ``simulation.initial`` has them, and the coordinates of the system that they stand for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.prescribed_motion import free_of, prescribed_angles, with_prescribed
from gearrattle.assembly.sideways import directions_of
from gearrattle.model import Initial, Model
from gearrattle.trajectory import Trajectory

Array = NDArray[np.float64]
StartTable = dict[str, list[float]]


def start_table(model: Model, coordinates: Array, rates: Array) -> StartTable:
    """Return the table of a state of the system (N,) at t = 0; prescribed motions are added."""
    time = np.zeros(1)
    turning = free_of(model).size
    table = {}
    for order, (key, sideways, values) in enumerate(
        (("angle", "displacement", coordinates), ("velocity", "displacement_velocity", rates))
    ):
        table[key] = with_prescribed(model, values[None], prescribed_angles(model, time, order))[0].tolist()
        if directions_of(model):
            table[sideways] = values[turning:].tolist()
    return table


def start_at(trajectory: Trajectory, row: int) -> StartTable:
    """Return the table of the state at a sample."""
    table = {"angle": trajectory.angle[row].tolist(), "velocity": trajectory.velocity[row].tolist()}
    if trajectory.sideways is not None:
        table["displacement"] = trajectory.sideways.displacement[row].tolist()
        table["displacement_velocity"] = trajectory.sideways.velocity[row].tolist()
    return table


def coordinates_at_start(model: Model, initial: Initial) -> tuple[Array, Array]:
    """Return coordinates and rates of the system (N,) of a table; displacements that it lacks are zero."""
    free = free_of(model)
    none = (0.0,) * len(directions_of(model))
    return (
        np.append(np.array(initial.angle)[free], none if initial.displacement is None else initial.displacement),
        np.append(
            np.array(initial.velocity)[free],
            none if initial.displacement_velocity is None else initial.displacement_velocity,
        ),
    )
