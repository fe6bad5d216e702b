"""What is asked of sampled states: accelerations and element states of the vector field, rows over states."""

from __future__ import annotations

import numpy as np

from gearrattle.engine.kernels._jit import kernel
from gearrattle.engine.kernels.products import multiply_row
from gearrattle.engine.kernels.vector_field import derivative, element_states


@kernel
def element_samples(field, time, states):
    """Accelerations (t, n), deflections, pieces and forces (t, m) at states (t, S)."""
    samples, size = states.shape
    elements, inertias = field.rows.shape
    r = field.basis.shape[0]
    wave = np.empty(2 * field.cycles.size)
    rate, pieces, out = np.empty(elements), np.empty(elements), np.empty(size)
    acceleration = np.empty((samples, inertias))
    deflection, force = np.empty((samples, elements)), np.empty((samples, elements))
    piece = np.empty((samples, elements), dtype=np.int64)
    for i in range(samples):
        derivative(field, time[i], states[i], wave, deflection[i], rate, pieces, force[i], out)
        for j in range(inertias):
            acceleration[i, j] = out[r + j]
        for k in range(elements):
            piece[i, k] = int(pieces[k])
    return acceleration, deflection, piece, force


@kernel
def rows_at(stack, table, states, out):
    """out[i] = all rows of stack[table[i]] @ states[i], each sample by itself: how many there are changes no bit."""
    for i in range(table.size):
        multiply_row(stack, table[i], states, i, out[i])


@kernel
def elements_at(field, time, y):
    """Deflections, rates and pieces (m,) of all elements at one state y (S,)."""
    elements = field.rows.shape[0]
    wave = np.empty(2 * field.cycles.size)
    deflection, rate, pieces, force = np.empty(elements), np.empty(elements), np.empty(elements), np.empty(elements)
    element_states(field, time, y, wave, deflection, rate, pieces, force)
    return deflection, rate, pieces.astype(np.int64)
