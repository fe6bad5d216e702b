"""Taylor coefficients of all motions of a large driveline over one window, straight from the equation of motion.

With s the time from the window's origin in window lengths, every deflection d_k + e_k, velocity v_i, force integral and
reference angle is sum_j c_j s^j, and the equation of motion gives the coefficients one order at a time,

    (j + 1) d_{j+1} = h w v_j,   F_j = k (d_j - e_j) + c (w v_j - e'_j),
    (j + 1) v_{j+1} = h J^-1 (T_j - D v_j - w F_j),

with a row w of two entries for each element: a few operations per element and order, no matrix anywhere.

A crossing changes one element. What it changes of the motion, ``correct``, obeys the same recurrence from zero, driven
by the change of that element's force; inside one window it reaches only a neighbourhood, listed once and for all. So a
crossing costs the same in a long train as in a short one.
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

    A table of coefficients has m columns of deflections w . q (transmission errors not taken off), n of velocities, K
    of force integrals and R of reference angles.
    """

    length: float  # h, of a window [s]
    first: UInt64Vector  # (m,) columns of the two velocities an element joins, no sign; the ground: any, with no arm
    second: UInt64Vector  # (m,)
    first_arm: Vector  # (m,) entries of w
    second_arm: Vector  # (m,)
    mobility: Vector  # (m + n,) 1 / J, by columns of velocities
    drag: Vector  # (m + n,) the same
    clearances: IntVector  # (K,) their elements
    clearance: IntVector  # (m,) which clearance an element is, or -1
    references: UInt64Vector  # (R,) columns of their velocities
    mean: Vector  # (m + n,) torque, the same
    driven: UInt64Vector  # (T,) columns of the velocities with a torque
    torque: Matrix  # (2 H, T) its cosines, then its sines
    error_of: IntVector  # (m,) row of its transmission error, or -1
    erring: IntVector  # (E,) elements with a transmission error
    error_at: IntMatrix  # (L, 2) row and harmonic of each error
    error: Matrix  # (L, 2) cosine, sine
    turn: Vector  # (H,) radians per window
    tied: IntVector  # (D,) elements whose deflection is a sum of others'
    tie_start: IntVector  # (D + 1,)
    tie: IntVector  # the others, one after the other
    tie_weight: Vector


class Near(NamedTuple):
    """For each clearance the neighbourhood it reaches within a window; inertias and elements one after the other.

    Those felt first come first; ``active`` says how many are felt at an order.
    """

    inertia_start: IntVector  # (K + 1,)
    inertia: UInt64Vector  # columns of their velocities
    drag: Vector
    mobility: Vector
    element_start: IntVector  # (K + 1,)
    element: UInt64Vector
    first: UInt64Vector  # the element's inertias by their place in the neighbourhood; outside: one beyond the last
    second: UInt64Vector
    first_arm: Vector
    second_arm: Vector
    reference: IntMatrix  # (K, R) place of each reference in the neighbourhood, or -1
    active: IntArray3  # (K, ORDER + 1, 2) inertias and elements


class Driveline(NamedTuple):
    """What the march window by window knows of a driveline; nothing of it changes."""

    network: Network
    laws: Laws
    near: Near
    band: Vector  # (K,) rounding band of each clearance [SI]; 0: relative to its motion
    inputs: Inputs  # all amplitudes one
    windows: int  # a period


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
    """Fill a table whose order 0 is given; ``reach`` (m,) is the sum of |c_j| of each deflection's orders from 1 on.

    length: of the window [s].
    stiffness, damping, offset: (m,) of every element's present piece.
    waves, errors: see ``wave_series``, ``error_series``.
    table: (ORDER + 1, columns).
    force, pull, load: (m,), (m + n,) and (T,) scratch.
    reach: (m,).
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
    # loops over unsigned indices ask nothing and run in vectors
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
        # forces of the elements: deflections and rates, less the transmission errors
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
    """Values at s of all columns, (columns,)."""
    top = table.shape[0] - 1
    for i in range(y.size):
        y[i] = table[top, i]
    for j in range(top - 1, -1, -1):
        for i in range(y.size):
            y[i] = y[i] * s + table[j, i]


@kernel
def tie_up(network, table):
    """Make the deflections that are sums of others' afresh, in order 0."""
    for i in range(network.tied.size):
        total = 0.0
        for other in range(network.tie_start[i], network.tie_start[i + 1]):
            total += network.tie_weight[other] * table[0, network.tie[other]]
        table[0, network.tied[i]] = total
