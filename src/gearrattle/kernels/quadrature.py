"""Works and losses along a known motion, by Gauss-Legendre quadrature of the power on its dense output."""

from __future__ import annotations

from typing import Any, NamedTuple

from gearrattle.kernels._jit import kernel
from gearrattle.kernels.products import copy, multiply, multiply_row


class Powers(NamedTuple):
    """What the quadrature needs of every region; strips as in ``packed``, Q nodes, n inertias, m elements."""

    step: Any  # (regions,) length of a full quadrature step, in periods
    advance: Any  # (regions, strips, Z, 4) increments of z over a full step
    nodes: Any  # (regions Q, strips, Z, 4) increments of z to every node of a full step
    generator: Any  # (regions, strips, Z, 4) rates of z
    forms: Any  # (regions, strips, Z, 4) velocities, torques (n each), rates, forces, error rates, forces that are
    #   not elastic, and of these the friction's (m each)
    known: Any  # (regions, S) memories on entering, scaled; NaN where they go on
    first_memory: int  # where they stand in z
    chains: Any  # (G, Q) chains of signals at the begin of every interval; they stand last in z
    drag: Any  # (n,)
    abscissas: Any  # (Q,) in 0 ... 1
    weights: Any  # (Q,)


@kernel
def _add_powers(powers, region, z, weight, values, torque, drag, loss, error):
    """Add weight times every power at the state z."""
    multiply(powers.forms, region, powers.forms.shape[1], powers.forms.shape[2], z, values, 0)
    n, m = drag.size, error.size
    for i in range(n):
        torque[i] += weight * values[n + i] * values[i]
        drag[i] += weight * powers.drag[i] * values[i] * values[i]
    for k in range(m):
        loss[k] += weight * values[2 * n + 3 * m + k] * values[2 * n + k]
        loss[m + k] += weight * values[2 * n + 4 * m + k] * values[2 * n + k]
        error[k] -= weight * values[2 * n + m + k] * values[2 * n + 2 * m + k]


@kernel
def _full_step(powers, region, scratch, width, values, torque, drag, loss, error):
    """Add the powers over one full step and move z, scratch[0], to its end."""
    z, at, made = scratch[0], scratch[1], scratch[2]
    h, nodes = powers.step[region], powers.weights.size
    for q in range(nodes):
        multiply(powers.nodes, region * nodes + q, powers.nodes.shape[1], width, z, made, 0)
        for j in range(width):
            at[j] = z[j] + made[j]
        _add_powers(powers, region, at, h * powers.weights[q], values, torque, drag, loss, error)
    multiply(powers.advance, region, powers.advance.shape[1], width, z, made, 0)
    for j in range(width):
        z[j] += made[j]


@kernel
def _partial_step(powers, region, h, scratch, width, values, torque, drag, loss, error):
    """The same over a shorter step, by its Taylor series."""
    z, at, made, series = scratch[0], scratch[1], scratch[2], scratch[4:]
    order = series.shape[0] - 1
    for j in range(width):
        series[0, j] = z[j]
    for p in range(1, order + 1):
        multiply_row(powers.generator, region, series, p - 1, made)
        for j in range(width):
            series[p, j] = h / p * made[j]
    for q in range(powers.weights.size + 1):
        x = powers.abscissas[q] if q < powers.weights.size else 1.0
        for j in range(width):
            total = series[order, j]
            for p in range(order - 1, -1, -1):
                total = total * x + series[p, j]
            at[j] = total
        if q < powers.weights.size:
            _add_powers(powers, region, at, h * powers.weights[q], values, torque, drag, loss, error)
    copy(at, width, z)


@kernel
def integrate_powers(powers, path, durations, samples, scratch, torque, drag, loss, error):
    """Integrate every power over intervals, in periods.

    Args:
        powers: see ``Powers``.
        path: (I, 3) region of each interval, the sample its first state is taken from (-1: goes on), and the signals'
            interval that begins with it (-1: none).
        durations: (I,) lengths in periods.
        samples: (t, Z) sampled states z.
        scratch: (order of the Taylor series + 5, room for the longest product).
        torque, drag: (n,) work of the torques and loss to drag; loss, error: (2 m,) and (m,) of elements, the second
            half of the losses what friction took; all are added to.
    """
    width = samples.shape[1]
    values = scratch[3]
    for i in range(durations.size):
        region, sample = path[i, 0], path[i, 1]
        if sample >= 0:
            for j in range(width):
                scratch[0, j] = samples[sample, j]
        if path[i, 2] >= 0:
            for j in range(powers.chains.shape[1]):
                scratch[0, width - powers.chains.shape[1] + j] = powers.chains[path[i, 2], j]
        for j in range(powers.known.shape[1]):
            if powers.known[region, j] == powers.known[region, j]:  # not NaN
                scratch[0, powers.first_memory + j] = powers.known[region, j]
        left = durations[i]
        while left >= powers.step[region]:
            _full_step(powers, region, scratch, width, values, torque, drag, loss, error)
            left -= powers.step[region]
        if left > 0.0:
            _partial_step(powers, region, left, scratch, width, values, torque, drag, loss, error)
