"""Prescribed motions: inertias that are no degrees of freedom, and stand among the others in what comes out.

The angle theta_a(t) of such an inertia is a spline through a record, or the integral of one. Its column leaves W, and
an element at it sees it as a transmission error, e_k = -w_ka theta_a(t). After a run its angle, speed and acceleration,
exact from the spline, are put back in their place, so that everything that judges a motion finds all inertias.

Angles count from the start of the run, and from the uniform rotation ``about``.

Takes a Model; gives indices, channels and whole trajectories.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.splines import Recorded, mean, spline
from gearrattle.engine.system.channels import Channel
from gearrattle.model import Model, Motion
from gearrattle.remember import kept
from gearrattle.trajectory import Trajectory

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


def free_of(model: Model) -> IntArray:
    """Indices of the inertias that are degrees of freedom, ascending."""
    moved = {motion.on for motion in model.motions}
    return np.array([i for i, inertia in enumerate(model.inertias) if inertia.name not in moved], dtype=np.int64)


def free_names(model: Model) -> tuple[str, ...]:
    """Names of the inertias that are degrees of freedom, in file order."""
    return tuple(model.inertias[i].name for i in free_of(model))


@kept
def angle_of(motion: Motion) -> Channel:
    """The angle over the time of the run, from zero on [rad]."""
    record = spline(motion.signal)
    if motion.speed is not None:
        about = mean(record) if motion.about is None else motion.about
        return record.plus(-about).integral()
    first, last = record.at(record.knots[[0, -1]])
    about = float(last - first) / float(record.knots[-1]) if motion.about is None else motion.about
    coefficients = record.coefficients.copy()
    coefficients[:, 0] -= first + about * record.knots[:-1]
    coefficients[:, 1] -= about
    return Channel(record.knots, coefficients)


@kept
def specified_angle(motion: Motion) -> Recorded:
    """The same angle as it is specified."""
    record, about = spline(motion.signal), motion.about
    if motion.speed is not None:
        return Recorded(motion.signal, is_rate=True, slope=-(mean(record) if about is None else about))
    first, last = record.at(record.knots[[0, -1]])
    about = float(last - first) / float(record.knots[-1]) if about is None else about
    return Recorded(motion.signal, offset=-float(first), slope=-about)


def moved(model: Model, time: Array, derivative: int = 0) -> Array:
    """(t, P) angles of the inertias with a motion, or their derivatives, in file order of the motions."""
    columns = [angle_of(motion).at(time, derivative) for motion in model.motions]
    return np.column_stack(columns) if columns else np.zeros((len(time), 0))


def places(model: Model) -> IntArray:
    """(P,) indices of the inertias with a motion, in file order of the motions."""
    names = [inertia.name for inertia in model.inertias]
    return np.array([names.index(motion.on) for motion in model.motions], dtype=np.int64)


def whole(model: Model, free: Array, prescribed: Array) -> Array:
    """(..., n) values of all inertias from those of the free ones and of those with a motion."""
    out = np.empty((*free.shape[:-1], len(model.inertias)))
    out[..., free_of(model)], out[..., places(model)] = free, prescribed
    return out


def whole_trajectory(model: Model, trajectory: Trajectory) -> Trajectory:
    """A trajectory of the free inertias with those of prescribed motion in their places; itself if there are none."""
    if not model.motions:
        return trajectory
    angle, velocity, acceleration = (
        whole(model, free, moved(model, trajectory.time, order))
        for order, free in enumerate((trajectory.angle, trajectory.velocity, trajectory.acceleration))
    )
    return replace(trajectory, angle=angle, velocity=velocity, acceleration=acceleration)
