"""The start of a motion: its states from angles and velocities, and the pieces of its elements."""

from __future__ import annotations

from gearrattle.engine.kernels._jit import strict, strict_entry
from gearrattle.engine.kernels.march_arrays import ON_CORNER, PENDING, UNANCHORED
from gearrattle.engine.kernels.memory_addresses import common_at, laws_at, region_at


@strict_entry
def deflect(basis, angle, deflection):
    """(r,) deflections of angles (n,)."""
    for i in range(deflection.size):
        deflection[i] = 0.0
        for j in range(angle.size):
            deflection[i] += basis[i, j] * angle[j]


@strict
def put_at_start(frame, scales, angle, velocity, deflection, march):
    """Put a march at t = 0: scaled states, carried angles, inputs, and all counts zero."""
    r = deflection.size
    n = angle.size
    count = frame.cycles.size
    deflect(frame.basis, angle, deflection)
    march.y[:] = 0.0
    march.carried[:] = 0.0
    march.clock[:] = 0.0
    march.bound[:] = 0.0
    march.counts[:] = 0
    march.side[:] = 0
    march.tried[0] = 0.0
    for i in range(r):
        march.y[i] = deflection[i] * scales.deflection[i]
    for i in range(n):
        march.y[r + i] = velocity[i] * scales.velocity[i]
    for i in range(frame.references.size):
        march.carried[i] = angle[frame.references[i]]
    march.u[0] = scales.inputs[0]
    for h in range(count):
        march.u[1 + h] = scales.inputs[1 + h]
        march.u[1 + count + h] = 0.0
    march.counts[PENDING] = -1
    march.counts[UNANCHORED] = 1 << 20


@strict
def choose_pieces(workspace, frame, angle, march):
    """Write the pieces at t = 0; return False if a deflection is at a corner to rounding, so that its rate decides."""
    common = common_at(workspace)
    laws = laws_at(workspace)
    region = region_at(workspace)
    r = frame.elements.size
    n = angle.size
    states = r + n
    for k in range(common.rows.shape[0]):
        region.pieces[k] = 0
    for i in range(frame.clearances.size):
        # the deflection, and the sum of its terms' moduli, on which its rounding depends
        k = common.clearances[i]
        delta = 0.0
        size = 0.0
        for j in range(n):
            size += abs(frame.rows[k, j]) * abs(angle[j])
        for j in range(states + march.u.size):
            term = common.deflection[k, j] * (march.y[j] if j < states else march.u[j - states])
            delta += term
            size += abs(term)
        for p in range(laws.first[k] + 1, laws.first[k + 1]):
            # the piece in which the deflection lies
            corner = laws.lower[p]
            if abs(delta - corner) <= 2.0 * ON_CORNER * max(abs(corner), size):
                return False
            if corner <= delta:
                region.pieces[k] += 1
    return True
