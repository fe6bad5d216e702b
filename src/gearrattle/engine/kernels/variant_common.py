"""The arrays that all regions of a driveline share (``workspace.Common``), written for one variant of many.

``system.flow`` writes the same rows with the same bits: scales are powers of two, so that most products are exact, and
the others are computed in the same order (``tests/engine/system/test_laid_out.py``).
"""

from __future__ import annotations

from math import pi

from gearrattle.engine.kernels._jit import strict, strict_entry
from gearrattle.engine.kernels.memory_addresses import common_at, laws_at
from gearrattle.engine.kernels.state_scaling import largest_modulus, power_below
from gearrattle.engine.kernels.workspace import PERIOD


@strict
def _write_laws(law, constant, laws):
    """Write stiffness, damping and corners of all pieces, and their offsets over the scale of the constant input."""
    for k in range(law.first.size):
        laws.first[k] = law.first[k]
    for p in range(law.stiffness.size):
        laws.stiffness[p] = law.stiffness[p]
        laws.damping[p] = law.damping[p]
        laws.offset[p] = law.offset[p] / constant
        laws.lower[p] = law.lower[p]
        laws.upper[p] = law.upper[p]


@strict
def _write_elements(system, frame, scales, common):
    """Write the deflections and rates of all elements."""
    r = frame.elements.size
    n = system.inertia.size
    count = frame.cycles.size
    states = r + n
    for k in range(frame.label.size):
        for j in range(states + 1 + 2 * count):
            common.deflection[k, j] = 0.0
            common.rate[k, j] = 0.0
        for j in range(r):
            common.deflection[k, j] = frame.combination[k, j] / scales.deflection[j]
        for i in range(n):
            common.rows[k, i] = frame.rows[k, i]
            common.rate[k, r + i] = frame.rows[k, i] * (1.0 / scales.velocity[i])
        for h in range(count):
            c = states + 1 + h
            s = states + 1 + count + h
            size = scales.inputs[1 + h]
            omega = 2.0 * pi * frame.cycles[h] / system.period[0]
            sine = system.error_sine[k, h]
            cosine = system.error_cosine[k, h]
            common.deflection[k, c] = 0.0 - cosine / size
            common.deflection[k, s] = 0.0 - sine / size
            common.rate[k, c] = 0.0 - sine * omega / size
            common.rate[k, s] = cosine * omega / size


@strict
def _write_balance(system, frame, scales, common):
    """Write the rates of the deflections, the torques minus the drag torques, and the rates of the reference angles."""
    r = frame.elements.size
    n = system.inertia.size
    count = frame.cycles.size
    period = system.period[0]
    states = r + n
    width = states + 1 + 2 * count
    # rates of the deflections from the velocities
    for i in range(r):
        for j in range(width):
            common.motion[i, j] = 0.0
        for j in range(n):
            common.motion[i, r + j] = period * scales.deflection[i] * (frame.basis[i, j] * (1.0 / scales.velocity[j]))
    # torques: drag, mean, harmonics
    for i in range(n):
        for j in range(width):
            common.balance[i, j] = 0.0
        common.balance[i, r + i] = 0.0 - system.drag[i] * (1.0 / scales.velocity[i])
        common.balance[i, states] = system.mean[i] / scales.inputs[0]
        for h in range(count):
            size = scales.inputs[1 + h]
            common.balance[i, states + 1 + h] = system.torque_cosine[i, h] / size
            common.balance[i, states + 1 + count + h] = system.torque_sine[i, h] / size
    # angles of the reference inertias
    for i in range(frame.references.size):
        for j in range(width):
            common.references[i, j] = 0.0
        common.references[i, r + frame.references[i]] = period * (1.0 / scales.velocity[frame.references[i]])


@strict
def _write_clearances(system, frame, scales, common):
    """Write the corner scales, and deflections and rates of the clearances in these scales."""
    r = frame.elements.size
    n = system.inertia.size
    count = frame.cycles.size
    clearances = frame.clearances.size
    laws = system.laws
    period = system.period[0]
    states = r + n
    width = states + 1 + 2 * count
    for i in range(clearances):
        # scale: the power of two below the largest corner
        k = frame.clearances[i]
        corner = largest_modulus(laws.upper, laws.first[k], laws.first[k + 1] - 1)
        common.cornered[i] = corner > 0.0
        if not corner > 0.0:  # the only corner is zero: any scale will do
            for j in range(width):
                corner = max(corner, abs(common.deflection[k, j]))
        scales.corner[i] = power_below(corner)
        common.corner_scale[i] = scales.corner[i]
        # deflection and rate in that scale, and the second derivative of the transmission error
        unit = 1.0 / scales.corner[i]
        for j in range(width):
            common.seen[i, j] = common.deflection[k, j] * unit
            common.seen[clearances + i, j] = common.rate[k, j] * unit * period
            common.curvature[i, j] = 0.0
        for h in range(count):
            omega = 2.0 * pi * frame.cycles[h] / period
            size = scales.inputs[1 + h]
            square = omega * omega
            common.curvature[i, states + 1 + h] = -system.error_cosine[k, h] * square / size
            common.curvature[i, states + 1 + count + h] = -system.error_sine[k, h] * square / size


@strict_entry
def lay_out(workspace, system, frame, scales):
    """Write the arrays that regions share, without the indices of the clearances and the limits of an ordinary motion.

    workspace: see ``memory_addresses``.
    system: ``variant_arrays.Coefficients`` of one variant.
    scales: ``variant_arrays.Scales``; those of the corners are written, the others are read.
    """
    common = common_at(workspace)
    laws = laws_at(workspace)
    n = system.inertia.size
    count = frame.cycles.size
    period = system.period[0]
    _write_laws(system.laws, scales.inputs[0], laws)
    _write_elements(system, frame, scales, common)
    _write_balance(system, frame, scales, common)
    _write_clearances(system, frame, scales, common)
    for i in range(n):
        common.inertia[i] = system.inertia[i]
        common.pace[i] = period * scales.velocity[i]
    for h in range(count):
        common.frequency[h] = 2.0 * pi * frame.cycles[h]
    for h in range(1 + count):
        common.amplitude[h] = scales.inputs[h]
        common.input_size[h] = common.amplitude[h]
        if h > 0:
            common.input_size[count + h] = scales.inputs[h]
    common.limits[PERIOD] = period
