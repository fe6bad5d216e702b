"""Torques that enforce prescribed motions.

    T = J theta'' + D theta' + T_drag + torques of the elements and Hooke joints against the body

Along a sweep T_drag follows its table over the speed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.drag_torques import viscous_drags
from gearrattle.assembly.elements import inertia_of
from gearrattle.assembly.prescribed_motion import prescribed_indices
from gearrattle.assembly.ripple import load_ripples
from gearrattle.assembly.sines import sines
from gearrattle.model import Model
from gearrattle.trajectory import Trajectory

Array = NDArray[np.float64]


def drive_torque(model: Model, trajectory: Trajectory) -> Array:
    """(t, P) torque that enforces every prescribed motion [N m]."""
    out = np.empty((len(trajectory.time), len(model.motions)))
    layout = trajectory.layout
    inertia = inertia_of(model)
    drags = viscous_drags(model)
    ripples = load_ripples(model)
    ramp = layout.ramp
    speed = np.full(len(trajectory.time), layout.omega) if ramp is None else ramp.speed(trajectory.time)
    for p, i in enumerate(prescribed_indices(model)):
        body = model.inertias[i]
        out[:, p] = inertia[i] * trajectory.acceleration[:, i] + drags[i] * trajectory.velocity[:, i]
        out[:, p] += layout.drag_torque_at(i, speed) - sines(model, ripples.get(body.name, ()), trajectory.time)
        for k in np.flatnonzero(layout.rows[:, i]):
            out[:, p] += layout.rows[k, i] / layout.radii[k, 0] * trajectory.element_torque[:, k]
    return out
