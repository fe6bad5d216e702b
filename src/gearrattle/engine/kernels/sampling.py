"""Quantities at sampled states: accelerations, and deflections, rates, pieces and forces of the elements."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, strict
from gearrattle.engine.kernels.arrays import Array4, IntVector, Matrix, Vector
from gearrattle.engine.kernels.equation_of_motion import derivative, element_states
from gearrattle.engine.kernels.strip_products import multiply, multiply_row


@kernel
def element_samples(field, time, states):
    """Accelerations (t, n), deflections, pieces and forces (t, m) at states (t, S)."""
    samples, size = states.shape
    elements, inertias = field.rows.shape
    r = field.basis.shape[0]
    wave = np.empty(2 * field.cycles.size)
    rate = np.empty(elements)
    pieces = np.empty(elements)
    out = np.empty(size)
    acceleration = np.empty((samples, inertias))
    deflection = np.empty((samples, elements))
    force = np.empty((samples, elements))
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
    """out[i] = stack[table[i]] @ states[i]; the bits of a sample do not depend on the other samples."""
    for i in range(table.size):
        multiply_row(stack, table[i], states, i, out[i])


class Lines(NamedTuple):
    """Rows, laws and structure from which the samples of a piecewise system are computed."""

    rows: (
        Array4  # (1, strips, Z, 4) over z: angles without references, velocities, torques (n,), deflections, rates (m,)
    )
    turned: Matrix  # (n, R) angles per angle of the references
    stiffness: Vector  # (P,) of all pieces; those of element k begin at first[k]
    damping: Vector  # (P,)
    offset: Vector  # (P,)
    first: IntVector  # (m,)
    watch: IntVector  # (m,) column of an element in the sampled pieces; -1: its piece is not sampled
    elements: Matrix  # (m, n) W
    drag: Vector  # (n,)
    inertia: Vector  # (n,)
    clearances: IntVector  # (K,) their elements


class Quantities(NamedTuple):
    """Sampled quantities, written [SI]."""

    angle: Matrix  # (t, n)
    velocity: Matrix  # (t, n)
    acceleration: Matrix  # (t, n)
    force: Matrix  # (t, m); before the call: forces of the auxiliaries, to which those of the laws are added
    deflection: Matrix  # (K, t)


@strict
def _force(stiffness, deflection, damping, rate, offset):
    """Force of a law, rounded like that of its auxiliary: the sum of opposite and equal forces is zero."""
    return stiffness * deflection + damping * rate + offset


@kernel
def quantities_at(lines, states, pieces, inputs, phase, out, begin):
    """Write the quantities of some samples; the bits of a sample do not depend on the other samples.

    states: (t, N + C) states, then carried quantities, the reference angles first.
    pieces: (t, W).
    inputs: (P, U) inputs; sample i has the inputs of row (phase + i) mod P.
    out: see ``Quantities``; forces are added to.
    begin: the row of ``out`` for the first sample.
    """
    elements, inertias = lines.elements.shape
    width = lines.rows.shape[2]
    references = lines.turned.shape[1]
    held = width - inputs.shape[1]
    z = np.empty(width)
    values = np.empty(4 * lines.rows.shape[1])
    rest = 3 * inertias
    for i in range(states.shape[0]):
        # states and inputs of the sample, and the products of all rows with them
        row = (phase + i) % inputs.shape[0]
        at = begin + i
        for j in range(held):
            z[j] = states[i, j]
        for j in range(inputs.shape[1]):
            z[held + j] = inputs[row, j]
        multiply(lines.rows, 0, lines.rows.shape[1], width, z, values, 0)
        # angles, velocities, and the torques of inputs and drag
        for j in range(inertias):
            angle = values[j]
            for r in range(references):
                angle += lines.turned[j, r] * states[i, held + r]
            out.angle[at, j] = angle
            out.velocity[at, j] = values[inertias + j]
            out.acceleration[at, j] = values[2 * inertias + j] - lines.drag[j] * values[inertias + j]
        # forces, and the accelerations that they make
        for k in range(elements):
            piece = lines.first[k] + (pieces[i, lines.watch[k]] if lines.watch[k] >= 0 else 0)
            deflection = values[rest + k]
            rate = values[rest + elements + k]
            auxiliary = out.force[at, k]
            force = auxiliary + _force(
                lines.stiffness[piece], deflection, lines.damping[piece], rate, lines.offset[piece]
            )
            out.force[at, k] = force
            for j in range(inertias):
                out.acceleration[at, j] -= lines.elements[k, j] * force
        for j in range(inertias):
            out.acceleration[at, j] /= lines.inertia[j]
        for c in range(lines.clearances.size):
            out.deflection[c, at] = values[rest + lines.clearances[c]]


@kernel
def elements_at(field, time, y):
    """Deflections, rates and pieces (m,) of all elements at one state y (S,)."""
    elements = field.rows.shape[0]
    wave = np.empty(2 * field.cycles.size)
    deflection = np.empty(elements)
    rate = np.empty(elements)
    pieces = np.empty(elements)
    force = np.empty(elements)
    element_states(field, time, y, wave, deflection, rate, pieces, force)
    return deflection, rate, pieces.astype(np.int64)
