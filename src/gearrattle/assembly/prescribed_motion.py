"""Prescribed motions: inertias that are no degrees of freedom, but are in all results.

The angle theta_a(t) of such an inertia is a sum of harmonics, the curve through a record, or the integral of a curve.
Its column is removed from W; for an element at this inertia the angle is a transmission error, e_k = -w_ka theta_a(t).
After a run its angle, speed and acceleration, exact from the sines or the curve, are inserted into the trajectory, so
that criteria and reports have all inertias.

Angles of a record are zero at the start of the run, and relative to the uniform rotation ``about``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly.elements import rows_of
from gearrattle.assembly.period import period_of
from gearrattle.assembly.records import Recorded, channel_of, mean
from gearrattle.assembly.sideways import directions_of
from gearrattle.assembly.sines import sines
from gearrattle.derived_values import kept
from gearrattle.engine.system.piecewise_channels import Channel
from gearrattle.model import Harmonic, Model, Motion, Signal
from gearrattle.trajectory import Trajectory

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
_T = TypeVar("_T", np.float64, np.complex128)
ALL = slice(None)
"""All samples."""


def free_of(model: Model) -> IntArray:
    """Indices of the inertias whose angles are degrees of freedom, ascending."""
    prescribed = {motion.on for motion in model.motions}
    return np.array([i for i, inertia in enumerate(model.inertias) if inertia.name not in prescribed], dtype=np.int64)


def free_names(model: Model) -> tuple[str, ...]:
    """Names of the inertias whose angles are degrees of freedom, in file order."""
    return tuple(model.inertias[i].name for i in free_of(model))


def coordinate_names(model: Model) -> tuple[str, ...]:
    """Names of the coordinates of the system: free inertias, then directions."""
    return (*free_names(model), *(direction.name for direction in directions_of(model)))


def columns_of(model: Model) -> IntArray:
    """Indices of the coordinates of the system among all inertias, followed by all directions."""
    count = len(model.inertias)
    return np.append(free_of(model), np.arange(count, count + len(directions_of(model))))


def coordinates_of(model: Model, trajectory: Trajectory, derivative: int = 0, rows: slice | IntArray = ALL) -> Array:
    """(t, N) coordinates of the system along a motion, or their derivatives, of all samples or of some."""
    kinds = ("angle", "velocity", "acceleration")
    angle: Array = getattr(trajectory, kinds[derivative])[rows]
    angle = angle[..., free_of(model)] if model.motions else angle
    if trajectory.sideways is None:
        return angle
    displacement = getattr(trajectory.sideways, ("displacement", *kinds[1:])[derivative])[rows]
    return np.concatenate([angle, displacement], axis=-1)


class MotionError(NamedTuple):
    """One harmonic of a prescribed motion as the error of an element at its inertia: factor times the harmonic.

    Attributes
    ----------
    factor
        -w_ka, from the element's row of W [m or 1].
    harmonic
        of the angle theta_a [rad].
    """

    element: int
    factor: float
    harmonic: Harmonic
    path: str


def motion_errors(model: Model) -> Iterator[MotionError]:
    """Yield the harmonics of all motions as errors of the elements that they move, element by element."""
    rows = rows_of(model)
    columns = prescribed_indices(model)
    for k in range(len(rows)):
        for i, (motion, column) in enumerate(zip(model.motions, columns.tolist(), strict=True)):
            if rows[k, column] != 0.0:
                for j, harmonic in enumerate(motion.harmonics):
                    yield MotionError(k, -float(rows[k, column]), harmonic, f"motion.{i}.harmonics.{j}")


def _record(motion: Motion) -> Signal:
    """The signal of a recorded motion."""
    assert motion.signal is not None
    return motion.signal


@kept
def angle_of(motion: Motion) -> Channel:
    """The angle of a recorded motion over the time of the run, zero at the start [rad]."""
    signal = _record(motion)
    record = channel_of(signal)
    if motion.speed is not None:
        about = mean(signal) if motion.about is None else motion.about
        return record.plus(-about).integral()
    first, last = record.at(record.knots[[0, -1]])
    about = float(last - first) / float(record.knots[-1]) if motion.about is None else motion.about
    coefficients = record.coefficients.copy()
    coefficients[:, 0] -= first + about * record.knots[:-1]
    coefficients[:, 1] -= about
    return Channel(record.knots, coefficients)


@kept
def specified_angle(motion: Motion) -> Recorded:
    """The angle of a recorded motion as it is specified, before it becomes a channel."""
    signal = _record(motion)
    record = channel_of(signal)
    about = motion.about
    if motion.speed is not None:
        return Recorded(signal, is_rate=True, slope=-(mean(signal) if about is None else about))
    first, last = record.at(record.knots[[0, -1]])
    about = float(last - first) / float(record.knots[-1]) if about is None else about
    return Recorded(signal, offset=-float(first), slope=-about)


def prescribed_angles(model: Model, time: Array, derivative: int = 0) -> Array:
    """(t, P) angles of the inertias with a motion, or their derivatives, in file order of the motions."""
    columns = [
        sines(model, motion.harmonics, time, derivative)
        if motion.signal is None
        else angle_of(motion).at(time, derivative)
        for motion in model.motions
    ]
    return np.column_stack(columns) if columns else np.zeros((len(time), 0))


def motion_amplitudes(model: Model) -> NDArray[np.complex128]:
    """(P, H) complex amplitudes a of the prescribed angles at all orders; an angle is Re(sum a exp(i w t))."""
    orders = period_of(model).orders.tolist()
    amplitudes = np.zeros((len(model.motions), len(orders)), dtype=np.complex128)
    for row, motion in zip(amplitudes, model.motions, strict=True):
        for harmonic in motion.harmonics:
            row[orders.index(harmonic.order)] += -1j * harmonic.amplitude * np.exp(1j * harmonic.phase)
    return amplitudes


def carried_along(model: Model, prescribed: Array) -> Array:
    """(N,) angles or velocities of the free inertias, and displacements, that go along with the others (P,), no element
    deflecting.

    If elements must deflect, such as those to ground, the sum of squares of their relative deflections is smallest.
    """
    rows = rows_of(model)
    size = np.linalg.norm(rows, axis=1)[:, None]
    forced = rows[:, prescribed_indices(model)] @ prescribed
    return np.asarray(np.linalg.lstsq(rows[:, columns_of(model)] / size, -forced / size[:, 0], rcond=None)[0])


def prescribed_indices(model: Model) -> IntArray:
    """(P,) indices of the inertias with a motion, in file order of the motions."""
    names = [inertia.name for inertia in model.inertias]
    return np.array([names.index(motion.on) for motion in model.motions], dtype=np.int64)


def with_prescribed(model: Model, free: NDArray[_T], prescribed: NDArray[_T]) -> NDArray[_T]:
    """(..., n) values of all inertias from those of the coordinates of the system, or of the free inertias alone, and
    of those with a prescribed motion.
    """
    out = np.empty((*free.shape[:-1], len(model.inertias)), dtype=free.dtype)
    out[..., free_of(model)] = free[..., : free_of(model).size]
    out[..., prescribed_indices(model)] = prescribed
    return out


def whole_trajectory(model: Model, trajectory: Trajectory) -> Trajectory:
    """Trajectory of all inertias from the trajectory of the free ones; unchanged if no motion is prescribed."""
    if not model.motions:
        return trajectory
    angle, velocity, acceleration = (
        with_prescribed(model, free, prescribed_angles(model, trajectory.time, order))
        for order, free in enumerate((trajectory.angle, trajectory.velocity, trajectory.acceleration))
    )
    return replace(trajectory, angle=angle, velocity=velocity, acceleration=acceleration)
