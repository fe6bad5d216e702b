"""Works and losses along a known motion, by Gauss-Legendre quadrature of the power on its dense output."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import inlined, kernel
from gearrattle.engine.kernels.arrays import Array4, IntMatrix, IntVector, Matrix, Vector
from gearrattle.engine.kernels.packed import ORDER, window_norm
from gearrattle.engine.kernels.products import copy, multiply, multiply_row

_REACH = np.array([window_norm(4 * n) / window_norm(ORDER + 1) for n in range(1, (ORDER + 1) // 4)] + [np.inf])
"""How much of a short step 4, 8, 12 ... terms of a Taylor series reach over."""


class Powers(NamedTuple):
    """What the quadrature needs of every region; strips as in ``packed``.

    A full step is a short or a long one, which come in this order. Of P and Q nodes they have, P + Q = R. A region
    whose modes are fast against the intervals has *leaps* as well: steps of twice, four times ... the short one, over
    which the integral of every power is a quadratic form of the state at the beginning.
    """

    step: Matrix  # (2, regions) their lengths, in periods
    advance: Array4  # (2 regions, strips, Z, 4) increments of z over a short, over a long step
    seen: Array4  # (R regions, strips, Z, 4) the forms at every node of a full step, of z at its start
    generator: Array4  # (regions, strips, Z, 4) rates of z
    forms: Array4  # (regions, strips, Z, 4) rows over z whose products are powers
    pairs: IntMatrix  # (P, 3) two forms, and the sum that their product goes to
    known: Matrix  # (regions, S) memories on entering, scaled; NaN where they go on
    first_memory: int  # where they stand in z
    chains: Matrix  # (G, Q) chains of signals at the start of every interval; they stand last in z
    nodes: IntVector  # (3,) where those of a short, of a long step begin, and how many there are
    abscissas: Vector  # (R,) in 0 ... 1
    weights: Vector  # (R,)
    leaps: IntMatrix  # (regions, 2) where a region's leaps begin, shortest first, and where they end
    leap_step: Vector  # (leaps,) their lengths, in periods
    leap_advance: Array4  # (leaps, strips, Z, 4) increments of z
    leap_work: Array4  # (sums leaps, strips, Z, 4) the quadratic forms, a leap's sums together
    leap_sums: IntVector  # (sums,) where they go


@inlined
def _add_powers(powers, weight, values, sums):
    """Add weight times every power, of the values of the forms."""
    pairs = powers.pairs
    for p in range(pairs.shape[0]):
        sums[pairs[p, 2]] += weight * values[pairs[p, 0]] * values[pairs[p, 1]]


@inlined
def _full_step(powers, region, is_long, scratch, width, sums):
    """Add the powers over one full step and move z, scratch[0], to its end."""
    z, made, values = scratch[0], scratch[2], scratch[3]
    first, h = region * powers.weights.size, powers.step[is_long, region]
    for q in range(powers.nodes[is_long], powers.nodes[is_long + 1]):
        multiply(powers.seen, first + q, powers.seen.shape[1], width, z, values, 0)
        _add_powers(powers, h * powers.weights[q], values, sums)
    multiply(powers.advance, 2 * region + is_long, powers.advance.shape[1], width, z, made, 0)
    for j in range(width):
        z[j] += made[j]


@inlined
def _leap(powers, leap, scratch, width, sums):
    """Add the powers over one leap and move z, scratch[0], to its end."""
    z, made, count = scratch[0], scratch[2], powers.leap_sums.size
    for s in range(count):
        multiply(powers.leap_work, leap * count + s, powers.leap_work.shape[1], width, z, made, 0)
        total = 0.0
        for j in range(width):
            total += z[j] * made[j]
        sums[powers.leap_sums[s]] += total
    multiply(powers.leap_advance, leap, powers.leap_advance.shape[1], width, z, made, 0)
    for j in range(width):
        z[j] += made[j]


@kernel
def _part_of_step(powers, region, h, scratch, width, sums):
    """The same over less than a short step, by the Taylor series of z.

    With signals by all of its terms: in an interval much shorter than others high derivatives of a signal may be large.
    """
    z, at, made, values, series = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4:]
    order = 3 if powers.chains.shape[1] == 0 else ORDER
    while h > powers.step[0, region] * _REACH[order // 4]:
        order += 4
    for j in range(width):
        series[0, j] = z[j]
    for p in range(1, order + 1):
        multiply_row(powers.generator, region, series, p - 1, made)
        for j in range(width):
            series[p, j] = h / p * made[j]
    end = powers.nodes[1]
    for q in range(powers.nodes[0], end + 1):
        x = powers.abscissas[q] if q < end else 1.0
        for j in range(width):
            at[j] = series[order, j]
        for p in range(order - 1, -1, -1):
            for j in range(width):
                at[j] = at[j] * x + series[p, j]
        if q < end:
            multiply(powers.forms, region, powers.forms.shape[1], width, at, values, 0)
            _add_powers(powers, h * powers.weights[q], values, sums)
    copy(at, width, z)


@kernel
def integrate_powers(powers, path, durations, samples, scratch, sums):
    """Integrate every power over intervals, in periods.

    Parameters
    ----------
    powers
        see ``Powers``.
    path
        (I, 3) region of each interval, the sample its first state is taken from (-1: goes on), and the signals'
        interval that begins with it (-1: none).
    durations
        (I,) lengths in periods.
    samples
        (t, Z) sampled states z.
    scratch
        (order of the Taylor series + 5, room for the longest product).
    sums
        added to.
    """
    width = samples.shape[1]
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
        for leap in range(powers.leaps[region, 1] - 1, powers.leaps[region, 0] - 1, -1):
            while left >= powers.leap_step[leap]:
                _leap(powers, leap, scratch, width, sums)
                left -= powers.leap_step[leap]
        for is_long in range(1, -1, -1):
            while left >= powers.step[is_long, region]:
                _full_step(powers, region, is_long, scratch, width, sums)
                left -= powers.step[is_long, region]
        if left > 0.0:
            _part_of_step(powers, region, left, scratch, width, sums)
