"""The change of the motion in a window by a crossing: a small motion near the element that crosses."""

from __future__ import annotations

from math import comb

import numpy as np

from gearrattle.engine.kernels._jit import kernel
from gearrattle.engine.kernels.march_arrays import ORDER

_BINOMIAL = np.array([[float(comb(j, i)) for j in range(ORDER + 1)] for i in range(ORDER + 1)])


@kernel
def shifts(by, matrix):
    """Write a matrix (ORDER + 1, ORDER + 1): row i times (c_j) is coefficient i of sum c_j (s + by)^j."""
    for i in range(ORDER + 1):
        power = 1.0
        for j in range(i, ORDER + 1):
            matrix[i, j] = _BINOMIAL[i, j] * power
            power *= by


@kernel
def jump_series(table, errors, k, error_row, now, corner, change, length, jump, matrix):
    """Write the coefficients (ORDER,) about ``now`` of the change of element k's force.

    change: changes of its stiffness and of its damping.
    """
    shifts(now, matrix)
    stiffness, damping = change
    before = 0.0
    for i in range(ORDER, -1, -1):
        total = 0.0
        for j in range(ORDER, i - 1, -1):
            total += matrix[i, j] * (table[j, k] - (errors[j, error_row] if error_row >= 0 else 0.0))
        if i < ORDER:
            at = total - corner if i == 0 else total
            jump[i] = stiffness * at + damping * (i + 1) * before / length
        before = total


@kernel
def _respond(near, c, e0, i0, length, stiffness, damping, jump, moved, turned, pull):
    """Write the coefficients, about the crossing, of the motion near element 0 by a change of its force."""
    first = near.first
    second = near.second
    first_arm = near.first_arm
    second_arm = near.second_arm
    drag = near.drag
    mobility = near.mobility
    active = near.active
    for j in range(ORDER):
        by = length / (j + 1)
        n = active[c, j + 1, 0]
        m = active[c, j + 1, 1]
        # torques on the bodies: drag, then the changes of the elements' forces
        for i in range(n):
            pull[i] = -drag[i0 + i] * turned[j, i]
        for k in range(m):
            a = first[e0 + k]
            b = second[e0 + k]
            rate = first_arm[e0 + k] * turned[j, a] + second_arm[e0 + k] * turned[j, b]
            moved[j + 1, 2 * k] = by * rate
            f = stiffness[k] * moved[j, 2 * k] + damping[k] * rate
            if k == 0:
                f += jump[j]
            moved[j + 1, 2 * k + 1] = by * f
            pull[a] -= first_arm[e0 + k] * f
            pull[b] -= second_arm[e0 + k] * f
        # the next coefficient of the velocities
        for i in range(n):
            turned[j + 1, i] = by * mobility[i0 + i] * pull[i]


@kernel
def _shifted_row(matrix, i, c, begin, counts, which, times, row):
    """row = sum_j matrix[i, j] c[j], j from begin on, four at a time; c[j] has counts[j, which] * times columns."""
    for column in range(times * counts[ORDER, which]):
        row[column] = 0.0
    for j in range(ORDER - 3, begin - 4, -4):
        low = max(j, 0)
        a0 = matrix[i, low]
        a1 = matrix[i, low + 1]
        a2 = matrix[i, low + 2]
        a3 = matrix[i, low + 3]
        for q in range(times * counts[low + 3, which]):
            row[q] += (a0 * c[low, q] + a1 * c[low + 1, q]) + (a2 * c[low + 2, q] + a3 * c[low + 3, q])


@kernel
def correct(network, near, c, stiffness, damping, now, jump, table, room, moved, turned, pull, matrix, row):
    """Add to a table the motion after ``now`` that the change of the force of clearance c makes.

    network, near: see ``network_series``.
    stiffness, damping: (m,) of every element after the crossing.
    now: time of the crossing from the origin of the window, in windows.
    table: changed; it holds for times after ``now``.
    room: (2, .) scratch for the neighbourhood's stiffness and damping.
    moved: (ORDER + 1, .) scratch; columns of deflections and of force integrals alternate.
    turned: (ORDER + 1, .) scratch for velocities.
    """
    # the neighbourhood: elements and inertias that the change reaches within the window
    elements = near.element
    inertias = near.inertia
    active = near.active[c]
    clearance = network.clearance
    places = near.reference
    length = network.length
    e0 = near.element_start[c]
    m = near.element_start[c + 1] - near.element_start[c]
    i0 = near.inertia_start[c]
    n = near.inertia_start[c + 1] - near.inertia_start[c]
    # the laws of these elements; scratch is set to zero
    k_near = room[0]
    c_near = room[1]
    for k in range(m):
        k_near[k] = stiffness[elements[e0 + k]]
        c_near[k] = damping[elements[e0 + k]]
    for j in range(ORDER + 1):
        for k in range(2 * m):
            moved[j, k] = 0.0
        for i in range(n + 1):
            turned[j, i] = 0.0
    # the motion that the change of the force makes, from zero at the crossing, order by order
    _respond(near, c, e0, i0, length, k_near, c_near, jump, moved, turned, pull)
    # its polynomials, shifted from the crossing to the origin of the window
    integrals = network.mean.size
    angles = integrals + network.clearances.size
    shifts(-now, matrix)
    for i in range(ORDER + 1):
        # add deflections and force integrals
        _shifted_row(matrix, i, moved, i, active, 1, 2, row)
        for k in range(m):
            e = elements[e0 + k]
            table[i, e] += row[2 * k]
            if clearance[e] >= 0:
                table[i, integrals + clearance[e]] += row[2 * k + 1]
        # add velocities
        _shifted_row(matrix, i, turned, i, active, 0, 1, row)
        for k in range(n):
            table[i, inertias[i0 + k]] += row[k]
        # add the angles of reference inertias: integrals of velocities
        for r in range(places.shape[1]):
            if places[c, r] >= 0:
                for j in range(ORDER, max(i, 1) - 1, -1):
                    table[i, angles + r] += matrix[i, j] * (length / j) * turned[j - 1, places[c, r]]
