"""The rigid response of free trains to the harmonics, see ``system.rigid_motion``."""

from __future__ import annotations

from math import pi

import numpy as np

from gearrattle.engine.kernels._jit import strict, strict_entry
from gearrattle.engine.kernels.equilibrium_kernel import piece_at

UNBALANCED = 1e-3
"""A train accelerates if the sum of its mean torques exceeds this share of the sum of their moduli, on one shaft."""


@strict
def _share_a_body(motion, p, q):
    """Whether two rigid motions move the same body."""
    for i in range(motion.shape[0]):
        if motion[i, p] != 0.0 and motion[i, q] != 0.0:
            return True
    return False


@strict_entry
def mark_accelerated(mean, motion, is_accelerated):
    """Write (R,) whether a rigid motion, or another one of the same train, accelerates under the mean torques (n,)."""
    n, trains = motion.shape
    for p in range(trains):
        total = 0.0
        size = 0.0
        for i in range(n):
            total += motion[i, p] * mean[i]
            size += abs(motion[i, p]) * abs(mean[i])
        is_accelerated[p] = abs(total) > UNBALANCED * size
    is_spreading = True
    while is_spreading:
        is_spreading = False
        for p in range(trains):
            for q in range(trains):
                if is_accelerated[q] and not is_accelerated[p] and _share_a_body(motion, p, q):
                    is_accelerated[p] = True
                    is_spreading = True


@strict
def _dashpots(system, rows, elastic, angle, dashpot):
    """Write the damping (m,) in the equilibrium of the elements without stiffness; 0 for the others."""
    laws = system.laws
    for k in range(dashpot.size):
        deflection = 0.0
        for i in range(angle.size):
            deflection += rows[k, i] * angle[i]
        piece = piece_at(laws.upper, laws.first[k], laws.first[k + 1] - 1, deflection)
        dashpot[k] = laws.damping[laws.first[k] + piece]
    for k in elastic:
        dashpot[k] = 0.0


@strict
def _rigid_matrices(system, motion, travel, dashpot, inertia, drag):
    """Write inertia and drag (R, R) of the rigid motions."""
    for p in range(motion.shape[1]):
        for q in range(motion.shape[1]):
            inertia[p, q] = 0.0
            drag[p, q] = 0.0
            for i in range(motion.shape[0]):
                inertia[p, q] += motion[i, p] * (system.inertia[i] * motion[i, q])
                drag[p, q] += motion[i, p] * (system.drag[i] * motion[i, q])
            for k in range(dashpot.size):
                drag[p, q] += travel[k, p] * (dashpot[k] * travel[k, q])


@strict
def _solve(matrix, right):
    """Solve in place of ``right`` by elimination without pivoting: the real part of the matrix is definite."""
    size = right.size
    for p in range(size):
        for q in range(p + 1, size):
            weight = matrix[q, p] / matrix[p, p]
            for j in range(p, size):
                matrix[q, j] -= weight * matrix[p, j]
            right[q] -= weight * right[p]
    for p in range(size - 1, -1, -1):
        for j in range(p + 1, size):
            right[p] -= matrix[p, j] * right[j]
        right[p] /= matrix[p, p]


@strict_entry
def respond_rigidly(system, frame, statics, rest, angle, velocity):
    """Write angles and velocities (n,) of the periodic rigid response at t = 0, zero for trains that accelerate.

    system: ``variant_arrays.Coefficients`` of one driveline.
    rest: (n,) angles of the equilibrium.
    angle, velocity: (n,) written.
    """
    motion = statics.motion
    n, trains = motion.shape
    dashpot = np.zeros(frame.rows.shape[0])
    travel = np.zeros((frame.rows.shape[0], trains))
    inertia = np.empty((trains, trains))
    drag = np.empty((trains, trains))
    matrix = np.empty((trains, trains), np.complex128)
    response = np.empty(trains, np.complex128)
    is_accelerated = np.empty(trains, np.bool_)
    for i in range(n):
        angle[i] = 0.0
        velocity[i] = 0.0
    # inertia and drag of the rigid motions, including elements that have damping and no stiffness
    mark_accelerated(system.mean, motion, is_accelerated)
    _dashpots(system, frame.rows, statics.elastic, rest, dashpot)
    for k in range(travel.shape[0]):
        for p in range(trains):
            for i in range(n):
                travel[k, p] += frame.rows[k, i] * motion[i, p]
    _rigid_matrices(system, motion, travel, dashpot, inertia, drag)
    for h in range(frame.cycles.size):
        omega = 2.0 * pi * frame.cycles[h] / system.period[0]
        # generalised torques of this order; a sin + b cos is written a + i b
        for p in range(trains):
            response[p] = 0.0
            for i in range(n):
                response[p] += motion[i, p] * complex(system.torque_sine[i, h], system.torque_cosine[i, h])
            for k in range(dashpot.size):
                rate = omega * complex(-system.error_cosine[k, h], system.error_sine[k, h])
                response[p] += travel[k, p] * (dashpot[k] * rate)
            for q in range(trains):
                matrix[p, q] = complex(-omega * omega * inertia[p, q], omega * drag[p, q])
        _solve(matrix, response)
        # at t = 0 the value of a sin + b cos is b, its rate omega a
        for p in range(trains):
            for i in range(n):
                if not is_accelerated[p]:
                    angle[i] += motion[i, p] * response[p].imag
                    velocity[i] += motion[i, p] * (omega * response[p].real)
