"""Taylor coefficients of all motions of a large driveline over one window, from the equation of motion.

With s the time from the window's origin in window lengths, every deflection d_k + e_k, velocity v_i, force integral and
reference angle is sum_j c_j s^j, and the equation of motion gives the coefficients one order at a time,

    (j + 1) d_{j+1} = h w v_j,   F_j = k (d_j - e_j) + c (w v_j - e'_j),
    (j + 1) v_{j+1} = h J^-1 (T_j - D v_j - w F_j),

with a row w of two entries for every element: a few operations per element and order, without matrices.

A crossing changes the law of one element. The change of the motion (``crossing_correction.correct``) obeys the same
recurrence from zero, driven by the change of that element's force. Within one window it reaches only a neighbourhood of
the element, which is listed beforehand (``Near``). So the cost of a crossing does not depend on the length of the
train.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel
from gearrattle.engine.kernels.arrays import IntArray3, IntMatrix, IntVector, Matrix, UInt64Vector, Vector
from gearrattle.engine.kernels.laws import Laws
from gearrattle.engine.kernels.march_arrays import ORDER, Inputs


class Network(NamedTuple):
    """The system as sparse arrays [SI]: n inertias, m elements, K clearances, R references, H harmonics.

    A table of coefficients has m columns of deflections w . q (without transmission errors), n of velocities, K of
    force integrals and R of reference angles.
    """

    length: float  # h, of a window [s]
    first: UInt64Vector  # (m,) column of the velocity at one end of an element; ground: any column, with arm zero
    second: UInt64Vector  # (m,) the same at the other end
    first_arm: Vector  # (m,) entry of w for the first end
    second_arm: Vector  # (m,) entry of w for the second end
    mobility: Vector  # (m + n,) 1 / J at the columns of the velocities
    drag: Vector  # (m + n,) at the columns of the velocities
    clearances: IntVector  # (K,) their elements
    clearance: IntVector  # (m,) index among the clearances; -1: the element is none
    references: UInt64Vector  # (R,) columns of their velocities
    mean: Vector  # (m + n,) mean torque at the columns of the velocities
    driven: UInt64Vector  # (T,) columns of the velocities with a torque
    torque: Matrix  # (2 H, T) cosine amplitudes of the torques, then sine amplitudes
    error_of: IntVector  # (m,) row of the element's transmission error; -1: it has none
    erring: IntVector  # (E,) elements with a transmission error
    error_at: IntMatrix  # (L, 2) row and harmonic of each error
    error: Matrix  # (L, 2) amplitudes of cosine and sine
    turn: Vector  # (H,) radians per window
    tied: IntVector  # (D,) elements whose deflection is a weighted sum of other deflections
    tie_start: IntVector  # (D + 1,) where the terms of every sum begin in ``tie`` and ``tie_weight``
    tie: IntVector  # elements of the terms
    tie_weight: Vector  # weights of the terms


class Near(NamedTuple):
    """For every clearance the neighbourhood that a change of its force reaches within a window.

    The inertias and the elements of all neighbourhoods lie one after the other, in the order in which the change
    reaches them; ``active`` is the number of those that it has reached at an order.
    """

    inertia_start: IntVector  # (K + 1,)
    inertia: UInt64Vector  # columns of their velocities
    drag: Vector
    mobility: Vector
    element_start: IntVector  # (K + 1,)
    element: UInt64Vector
    first: UInt64Vector  # index in the neighbourhood of the inertia at one end; outside: one beyond the last
    second: UInt64Vector
    first_arm: Vector
    second_arm: Vector
    reference: IntMatrix  # (K, R) index of every reference in the neighbourhood; -1: outside
    active: IntArray3  # (K, ORDER + 1, 2) numbers of inertias and of elements reached


class Driveline(NamedTuple):
    """The data of a driveline for the march by windows; they do not change."""

    network: Network
    laws: Laws
    near: Near
    band: Vector  # (K,) rounding band of every clearance [SI]; 0: relative to its motion
    inputs: Inputs  # with all amplitudes one
    windows: int  # per period


@kernel
def wave_series(turn, u, waves):
    """(ORDER + 2, 2 H) coefficients of cosines and sines from their values u = (1, cosines, sines)."""
    count = turn.size
    for i in range(2 * count):
        waves[0, i] = u[1 + i]
    for j in range(waves.shape[0] - 1):
        for i in range(count):
            by = turn[i] / (j + 1)
            waves[j + 1, i] = -by * waves[j, count + i]
            waves[j + 1, count + i] = by * waves[j, i]


@kernel
def error_series(error_at, error, waves, errors):
    """(ORDER + 2, E) coefficients of the transmission errors."""
    errors[:] = 0.0
    count = waves.shape[1] // 2
    for j in range(errors.shape[0]):
        for i in range(error_at.shape[0]):
            row = error_at[i, 0]
            wave = error_at[i, 1]
            errors[j, row] += error[i, 0] * waves[j, wave] + error[i, 1] * waves[j, count + wave]


@kernel
def expand(network, length, stiffness, damping, offset, waves, errors, table, force, pull, load, reach):
    """Fill a table from its order 0.

    length: of the window [s].
    stiffness, damping, offset: (m,) of the present piece of every element.
    waves, errors: see ``wave_series``, ``error_series``.
    table: (ORDER + 1, columns).
    force, pull, load: (m,), (m + n,) and (T,) scratch.
    reach: (m,) written: sum of |c_j| of every deflection over the orders from 1 on.
    """
    # short names of the arrays
    first = network.first
    second = network.second
    first_arm = network.first_arm
    second_arm = network.second_arm
    drag = network.drag
    mobility = network.mobility
    clearances = network.clearances
    references = network.references
    mean = network.mean
    erring = network.erring
    driven = network.driven
    torque = network.torque
    m = force.size
    sources = waves.shape[1]
    # with unsigned indices the compiler vectorises the loops
    begin = np.uint64(m)
    end = np.uint64(mean.size)
    for k in range(m):
        reach[k] = 0.0
    # the equation of motion, order by order
    for j in range(ORDER):
        by = length / (j + 1)
        # torques on the inertias: drag, inputs, mean
        for i in range(mean.size):
            pull[i] = -drag[i] * table[j, i]
        for i in range(driven.size):
            load[i] = 0.0
        for h in range(sources):
            wave = waves[j, h]
            for i in range(driven.size):
                load[i] += torque[h, i] * wave
        for i in range(driven.size):
            pull[driven[i]] += load[i]
        if j == 0:
            for i in range(mean.size):
                pull[i] += mean[i]
        # forces of the elements, from deflections and rates minus transmission errors
        for k in range(m):
            force[k] = first_arm[k] * table[j, first[k]] + second_arm[k] * table[j, second[k]]
        for k in range(m):
            moved = by * force[k]
            table[j + 1, k] = moved
            reach[k] += abs(moved)
            force[k] = stiffness[k] * table[j, k] + damping[k] * force[k]
        for i in range(erring.size):
            k = erring[i]
            force[k] -= stiffness[k] * errors[j, i] + damping[k] * errors[j + 1, i] * ((j + 1) / length)
        if j == 0:
            for k in range(m):
                force[k] += offset[k]
        # the balance of torques gives the next order of the velocities
        for k in range(m):
            pull[first[k]] -= first_arm[k] * force[k]
            pull[second[k]] -= second_arm[k] * force[k]
        for i in range(begin, end):
            table[j + 1, i] = by * mobility[i] * pull[i]
        # integrals of forces, and angles of the reference inertias
        for i in range(clearances.size):
            table[j + 1, mean.size + i] = by * force[clearances[i]]
        for i in range(references.size):
            table[j + 1, mean.size + clearances.size + i] = by * table[j, references[i]]


@kernel
def move(table, s, y):
    """Write the values at s of all columns to y (columns,)."""
    top = table.shape[0] - 1
    for i in range(y.size):
        y[i] = table[top, i]
    for j in range(top - 1, -1, -1):
        for i in range(y.size):
            y[i] = y[i] * s + table[j, i]


@kernel
def tie_up(network, table):
    """Compute the tied deflections in order 0."""
    for i in range(network.tied.size):
        total = 0.0
        for other in range(network.tie_start[i], network.tie_start[i + 1]):
            total += network.tie_weight[other] * table[0, network.tie[other]]
        table[0, network.tied[i]] = total
