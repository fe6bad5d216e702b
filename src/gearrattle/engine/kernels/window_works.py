"""Works and losses of a large driveline along a known motion (``quadrature`` does the same with dense regions).

The motion is computed again from every sampled state, and all polynomials after every crossing, unlike in
``window_march``. The powers are integrated by Gauss-Legendre quadrature.
"""

from __future__ import annotations

from typing import NamedTuple

from gearrattle.engine.kernels._jit import kernel
from gearrattle.engine.kernels.arrays import IntVector, Matrix, Vector
from gearrattle.engine.kernels.network_series import error_series, expand, move, tie_up, wave_series
from gearrattle.engine.kernels.oscillators import inputs_at


class Intervals(NamedTuple):
    """The intervals between neighbouring samples and crossings, I in all."""

    duration: Vector  # (I,) in windows
    sample: IntVector  # (I,) index of the sample with the first state; -1: the end of the interval before
    clearance: IntVector  # (I,) the clearance that crosses at the end; -1: none
    piece: IntVector  # (I,) the piece that it enters


class Works(NamedTuple):
    """Sums of works [J]."""

    torque: Vector  # (n,) work of the torques
    drag: Vector  # (n,) loss by drag
    element: Vector  # (m,) loss in the elements' damping
    error: Vector  # (m,) work of the transmission errors


class WorkBuffers(NamedTuple):
    """Laws of the present pieces, Taylor series over a window, and scratch.

    m elements, n inertias, H harmonics, E elements with a transmission error, T inertias with a torque. The state has
    the columns of ``table``: deflections (m,), rates of inertias (n,), and what ``network`` has beside them.
    """

    now: Vector  # (2,) the time: whole periods, fraction of a period
    table: Matrix  # (ORDER + 1, columns) coefficients of the state in the share of the window
    waves: Matrix  # (ORDER + 2, 2 H) coefficients of the sines and cosines of the inputs
    errors: Matrix  # (ORDER + 2, E) coefficients of the transmission errors
    stiffness: Vector  # (m,) slope of the present piece of every element
    damping: Vector  # (m,) its damping
    offset: Vector  # (m,) its force at no deflection
    u: Vector  # (1 + 2 H,) inputs at the begin: one, sines and cosines
    y: Vector  # (columns,) state at a node
    wave: Vector  # (2 H,) sines and cosines at a node
    slip: Matrix  # (2, E) errors and their rates at a node
    torque: Vector  # (m + n,) torques at a node, at the columns of the velocities
    load: Vector  # (T,) scratch of ``expand``: one coefficient of every torque
    force: Vector  # (m,) scratch: one coefficient of every force
    pull: Vector  # (m + n,) scratch: one coefficient of what acts on every inertia
    reach: Vector  # (m,) sum of the moduli of a deflection's coefficients from order 1 on
    turn: Vector  # (H,) angle by which every harmonic turns in the share of the window


@kernel
def _add_powers(network, buffers, works, length, s, weight):
    """Add weight times every power at the time s of the window in the table."""
    # the motion and the inputs at s
    y = buffers.y
    wave = buffers.wave
    slip = buffers.slip
    torque = buffers.torque
    m = buffers.force.size
    n = network.mean.size - m
    stiffness = buffers.stiffness
    damping = buffers.damping
    offset = buffers.offset
    move(buffers.table, s, y)
    move(buffers.waves, s, wave)
    # transmission errors and their rates
    for i in range(slip.shape[1]):
        value = 0.0
        rate = 0.0
        for j in range(buffers.errors.shape[0] - 1, -1, -1):
            rate = rate * s + value
            value = value * s + buffers.errors[j, i]
        slip[0, i] = value
        slip[1, i] = rate / length
    # torques, and the powers of torques and drags
    for i in range(torque.size):
        torque[i] = network.mean[i]
    for i in range(network.driven.size):
        for h in range(wave.size):
            torque[network.driven[i]] += network.torque[h, i] * wave[h]
    for i in range(n):
        works.torque[i] += weight * torque[m + i] * y[m + i]
        works.drag[i] += weight * network.drag[m + i] * y[m + i] * y[m + i]
    for k in range(m):
        # forces: the powers of transmission errors and of losses
        rate = network.first_arm[k] * y[network.first[k]] + network.second_arm[k] * y[network.second[k]]
        row = network.error_of[k]
        if row >= 0:
            rate -= slip[1, row]
            force = stiffness[k] * (y[k] - slip[0, row]) + damping[k] * rate + offset[k]
            works.error[k] -= weight * force * slip[1, row]
        works.element[k] += weight * damping[k] * rate * rate


@kernel
def _over(driveline, buffers, works, share, abscissas, weights):
    """Add the works over a share of a window from the state in the table, and replace that state by the last one."""
    network = driveline.network
    # the inputs and the Taylor series over that share of the window
    length = share * network.length
    for j in range(buffers.turn.size):
        buffers.turn[j] = share * network.turn[j]
    inputs_at(driveline.inputs, buffers.now[0], buffers.now[1], buffers.u)
    tie_up(network, buffers.table)
    wave_series(buffers.turn, buffers.u, buffers.waves)
    error_series(network.error_at, network.error, buffers.waves, buffers.errors)
    expand(
        network,
        length,
        buffers.stiffness,
        buffers.damping,
        buffers.offset,
        buffers.waves,
        buffers.errors,
        buffers.table,
        buffers.force,
        buffers.pull,
        buffers.load,
        buffers.reach,
    )
    # powers at the Gauss-Legendre nodes
    for q in range(weights.size):
        _add_powers(network, buffers, works, length, abscissas[q], length * weights[q])
    # the state at the end, and the clock
    move(buffers.table, 1.0, buffers.y)
    buffers.table[0] = buffers.y
    buffers.now[1] += share / driveline.windows
    if buffers.now[1] >= 1.0:
        buffers.now[0] += 1.0
        buffers.now[1] -= 1.0


@kernel
def integrate_works(driveline, path, first, last, samples, buffers, works, nodes):
    """Integrate every power over the intervals first ... last - 1.

    driveline, path, buffers, works: see their types; buffers and works change.
    samples: see ``march_arrays.Samples``; states have the columns of ``Sweep.table``.
    nodes: (2, Q) abscissas in 0 ... 1 and weights.
    """
    network = driveline.network
    laws = driveline.laws
    per_cycle = samples.per_cycle
    for i in range(first, last):
        if path.sample[i] >= 0:
            buffers.table[0] = samples.states[path.sample[i]]
            buffers.now[0] = path.sample[i] // per_cycle
            buffers.now[1] = (path.sample[i] % per_cycle) / per_cycle
        left = path.duration[i]
        while left > 0.0:
            share = min(left, 1.0)
            _over(driveline, buffers, works, share, nodes[0], nodes[1])
            left -= share
        c = path.clearance[i]
        if c >= 0:
            k = network.clearances[c]
            p = laws.first[k] + path.piece[i]
            buffers.stiffness[k] = laws.stiffness[p]
            buffers.damping[k] = laws.damping[p]
            buffers.offset[k] = laws.offset[p]
