"""Torques that keep prescribed motions.

    T = J theta'' + D theta' + T_drag + what the elements and Hooke joints take from the body

Takes a Model and a Trajectory of it; gives arrays.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.elements import inertia_of
from gearrattle.assembly.prescribed import places
from gearrattle.assembly.ripple import load_ripples
from gearrattle.assembly.signals import ramp_of, tones_of
from gearrattle.engine.system.specified import Swept
from gearrattle.model import Harmonic, Model
from gearrattle.trajectory import Trajectory

Array = NDArray[np.float64]


def drive_torque(model: Model, trajectory: Trajectory) -> Array:
    """(t, P) torque that keeps every prescribed motion [N m].

    Parameters
    ----------
    model
        the driveline.
    trajectory
        of all inertias.
    """
    out = np.empty((len(trajectory.time), len(model.motions)))
    layout = trajectory.layout
    inertia = inertia_of(model)
    ripples = load_ripples(model)
    for p, i in enumerate(places(model)):
        body = model.inertias[i]
        out[:, p] = inertia[i] * trajectory.acceleration[:, i] + body.drag * trajectory.velocity[:, i]
        out[:, p] += body.drag_torque - _sines(model, ripples.get(body.name, ()), trajectory.time)
        for k in np.flatnonzero(layout.rows[:, i]):
            out[:, p] += layout.rows[k, i] / layout.radii[k, 0] * trajectory.element_torque[:, k]
    return out


def _sines(model: Model, harmonics: Sequence[Harmonic], time: Array) -> Array:
    """(t,) their sum, along a sweep as well."""
    if (ramp := ramp_of(model)) is not None:
        return Swept(ramp, tones_of(harmonics, ramp), smooth=False).at(time)
    total, omega = np.zeros(time.shape), model.excitation.omega
    for harmonic in harmonics:
        total += harmonic.amplitude * np.sin(harmonic.order * omega * time + harmonic.phase)
    return total
