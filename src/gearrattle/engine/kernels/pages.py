"""The pages that all regions of a driveline share (``bench``), written for one variant of many.

The same rows as ``system.flow`` writes: scales are powers of two, so that all but a few products are exact, and those
few are made in the same order. ``tests/engine/system/test_variants.py`` holds both to the same bits.
"""

from __future__ import annotations

from math import pi

from gearrattle.engine.kernels._jit import strict, strict_entry
from gearrattle.engine.kernels.bench import (
    AMPLITUDE,
    BALANCE,
    CORNER_SCALE,
    CORNERED,
    CURVATURE,
    DAMPING,
    DEFLECTION,
    ELEMENTS,
    FREQUENCY,
    INERTIA,
    INPUT_SIZE,
    LIMITS,
    LOWER,
    MOTION,
    OFFSET,
    PACE,
    PERIOD,
    RATE,
    REFERENCES,
    SEEN,
    STIFFNESS,
    UPPER,
    VECTORS,
)
from gearrattle.engine.kernels.scaling import most_of, power_below


@strict
def _write_laws(law, constant, laws):
    """Slopes, damping and corners of all pieces; offsets over the scale of the constant input."""
    for p in range(law.stiffness.size):
        laws[STIFFNESS, p], laws[DAMPING, p] = law.stiffness[p], law.damping[p]
        laws[OFFSET, p] = law.offset[p] / constant
        laws[LOWER, p], laws[UPPER, p] = law.lower[p], law.upper[p]


@strict
def _write_elements(system, frame, scales, work):
    """Deflections and rates of all elements."""
    r, n, count = frame.elements.size, system.inertia.size, frame.cycles.size
    states = r + n
    for k in range(frame.label.size):
        for j in range(states + 1 + 2 * count):
            work[DEFLECTION, k, j] = work[RATE, k, j] = 0.0
        for j in range(r):
            work[DEFLECTION, k, j] = frame.combination[k, j] / scales.deflection[j]
        for i in range(n):
            work[ELEMENTS, k, i] = frame.rows[k, i]
            work[RATE, k, r + i] = frame.rows[k, i] * (1.0 / scales.velocity[i])
        for h in range(count):
            c, s, size = states + 1 + h, states + 1 + count + h, scales.inputs[1 + h]
            omega = 2.0 * pi * frame.cycles[h] / system.period[0]
            sine, cosine = system.error_sine[k, h], system.error_cosine[k, h]
            work[DEFLECTION, k, c], work[DEFLECTION, k, s] = 0.0 - cosine / size, 0.0 - sine / size
            work[RATE, k, c], work[RATE, k, s] = 0.0 - sine * omega / size, cosine * omega / size


@strict
def _write_balance(system, frame, scales, work):
    """Rates of the deflections, torques less drag, rates of the reference angles."""
    r, n, count, period = frame.elements.size, system.inertia.size, frame.cycles.size, system.period[0]
    states = r + n
    width = states + 1 + 2 * count
    for i in range(r):
        for j in range(width):
            work[MOTION, i, j] = 0.0
        for j in range(n):
            work[MOTION, i, r + j] = period * scales.deflection[i] * (frame.basis[i, j] * (1.0 / scales.velocity[j]))
    for i in range(n):
        for j in range(width):
            work[BALANCE, i, j] = 0.0
        work[BALANCE, i, r + i] = 0.0 - system.drag[i] * (1.0 / scales.velocity[i])
        work[BALANCE, i, states] = system.mean[i] / scales.inputs[0]
        for h in range(count):
            size = scales.inputs[1 + h]
            work[BALANCE, i, states + 1 + h] = system.torque_cosine[i, h] / size
            work[BALANCE, i, states + 1 + count + h] = system.torque_sine[i, h] / size
    for i in range(frame.references.size):
        for j in range(width):
            work[REFERENCES, i, j] = 0.0
        work[REFERENCES, i, r + frame.references[i]] = period * (1.0 / scales.velocity[frame.references[i]])


@strict
def _write_clearances(system, frame, scales, work, marks):
    """Corner scales, and what is seen of the clearances in them."""
    r, n, count, clearances = frame.elements.size, system.inertia.size, frame.cycles.size, frame.clearances.size
    laws, period, states = system.laws, system.period[0], r + n
    width = states + 1 + 2 * count
    for i in range(clearances):
        k = frame.clearances[i]
        corner = most_of(laws.upper, laws.first[k], laws.first[k + 1] - 1)
        marks[CORNERED, i] = corner > 0.0
        if not corner > 0.0:  # a corner at zero only: any scale serves
            for j in range(width):
                corner = max(corner, abs(work[DEFLECTION, k, j]))
        scales.corner[i] = power_below(corner)
        work[VECTORS, CORNER_SCALE, i] = scales.corner[i]
        unit = 1.0 / scales.corner[i]
        for j in range(width):
            work[SEEN, i, j] = work[DEFLECTION, k, j] * unit
            work[SEEN, clearances + i, j] = work[RATE, k, j] * unit * period
            work[CURVATURE, i, j] = 0.0
        for h in range(count):
            omega, size = 2.0 * pi * frame.cycles[h] / period, scales.inputs[1 + h]
            square = omega * omega
            work[CURVATURE, i, states + 1 + h] = -system.error_cosine[k, h] * square / size
            work[CURVATURE, i, states + 1 + count + h] = -system.error_sine[k, h] * square / size


@strict_entry
def lay_out(system, frame, scales, work, laws, marks):
    """Write all pages that regions share, but the limits that depend on what is typical.

    Args:
        system: ``variants.Coefficients`` of one variant.
        frame: ``variants.Frame``.
        scales: ``variants.Scales``; the corners' are written, the others read.
        work, laws, marks: see ``bench``; the sizes and where pieces begin stand in ``marks`` already.
    """
    n, count, period = system.inertia.size, frame.cycles.size, system.period[0]
    _write_laws(system.laws, scales.inputs[0], laws)
    _write_elements(system, frame, scales, work)
    _write_balance(system, frame, scales, work)
    _write_clearances(system, frame, scales, work, marks)
    for i in range(n):
        work[VECTORS, INERTIA, i] = system.inertia[i]
        work[VECTORS, PACE, i] = period * scales.velocity[i]
    for h in range(count):
        work[VECTORS, FREQUENCY, h] = 2.0 * pi * frame.cycles[h]
    for h in range(1 + count):
        work[VECTORS, AMPLITUDE, h] = work[VECTORS, INPUT_SIZE, h] = scales.inputs[h]
        if h > 0:
            work[VECTORS, INPUT_SIZE, count + h] = scales.inputs[h]
    work[VECTORS, LIMITS, PERIOD] = period
