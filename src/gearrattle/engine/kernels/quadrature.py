"""Second moments of the state along a known motion: the integral of z z' over the time in every region.

A power is a sum of products of two linear forms of z, so its integral follows from these moments. For steps of every
length, and for whole intervals between two samples, only z z' at their beginnings is summed here; the integrals follow
from these sums at the end (``system.state_moments``). The remainder of an interval, shorter than every step, is
integrated here by Gauss-Legendre quadrature of z z' with the Taylor series of z.
"""

from __future__ import annotations

from typing import NamedTuple

from gearrattle.engine.kernels._jit import inlined, kernel
from gearrattle.engine.kernels._llvm import strip_product, strip_product_added
from gearrattle.engine.kernels.arrays import Array4, Matrix, Vector
from gearrattle.engine.kernels.march_arrays import ORDER
from gearrattle.engine.kernels.strip_products import add, copy, multiply

FEW_TERMS = 8
ALL_TERMS = ORDER + 1
"""Terms of the Taylor series over a remainder: for z without chains of signals, and with them."""


class Moves(NamedTuple):
    """Motion of the state in every region; strips as in ``march_arrays``.

    Every step is twice as long as the one before. The shift of a region is subtracted from the state, so that forces of
    clearances are small at zero and products of moments cancel little.
    """

    step: Matrix  # (regions, L) lengths of the steps, in periods
    advance: Array4  # (L regions, strips, Z, 4) increments over the steps
    generator: Array4  # (regions, strips, Z, 4) rates
    shift: Matrix  # (regions, Z) subtracted from z
    known: Matrix  # (regions, S) memories at the entry, scaled; NaN: a memory keeps its value
    first_memory: int  # index of the first memory in z
    chains: Matrix  # (G, Q) chains of signals at the start of every interval of the signals, the last entries of z
    followed: Matrix  # (r, Q) part of the deflections, the first entries of z, that the chains make directly
    powers: Matrix  # (nodes + 1, terms filled up to fours) powers of the nodes in 0 ... 1, and of the end, 1
    weights: Vector  # (nodes,)


class Room(NamedTuple):
    """Scratch of the quadrature; M is Z rounded up to a multiple of four."""

    z: Vector  # (M,)
    made: Vector  # (M,)
    term: Vector  # (M,)
    series: Vector  # (terms M,)
    weight: Vector  # (terms filled up to fours,)


@inlined
def _weigh(moments, index, weight, z, width, room):
    """Add weight times z z', in every row from the strip of the diagonal on."""
    strips = z.size // 4
    for i in range(width):
        room.weight[0] = weight * z[i]
        first = i - i % 4
        at = (index * width + i) * z.size + first
        strip_product_added(z, (first, 4, 4, strips - first // 4, 1), room.weight, moments, at)


@inlined
def _remainder(moves, region, h, width, room, moments):
    """Add the moments over less than the shortest step and move z to its end.

    With signals all terms of the series are used: in a short interval of a signal high derivatives may be large.
    """
    strips = moves.generator.shape[1]
    rows = room.z.size
    terms = moves.powers.shape[1]
    index = moves.advance.shape[0] + region
    copy(room.z, rows, room.term)
    copy(room.z, rows, room.series)
    for p in range(1, terms):
        multiply(moves.generator, region, strips, width, room.term, room.made, 0)
        for j in range(rows):
            room.term[j] = h / p * room.made[j]
            room.series[p * rows + j] = room.term[j]
    for q in range(moves.weights.size + 1):
        for p in range(terms):
            room.weight[p] = moves.powers[q, p]
        strip_product(room.series, (0, 4, rows, strips, terms), room.weight, room.made, 0)
        if q < moves.weights.size:
            _weigh(moments, index, h * moves.weights[q], room.made, width, room)
    copy(room.made, rows, room.z)


@kernel
def integrate_moments(moves, path, durations, samples, room, moments):
    """Add the moments of some intervals.

    path: (I, 4) for every interval: region; index of the sample with its first state, -1: the end of the interval
    before;
        interval of the signals that begins with it, -1: none; 1 if it is the whole interval between two samples.
    durations: (I,) lengths in periods.
    samples: (t, Z) sampled states z.
    room: see ``Room``; entries of z beyond Z are zero.
    moments: flat array ((L + 2) regions, Z, M), added to: sums of z z' at the beginnings of steps, L per region; then
        integrals over remainders, one per region; then sums at the beginnings of whole intervals, one per region.
    """
    width = samples.shape[1]
    levels = moves.step.shape[1]
    strips = moves.generator.shape[1]
    z = room.z
    for i in range(durations.size):
        # the state at the beginning: a sample, or the end of the interval before
        region = path[i, 0]
        sample = path[i, 1]
        left = durations[i]
        if sample >= 0:
            for j in range(width):
                z[j] = samples[sample, j]
        # a knot of the signals: new chains, and the deflections that follow them directly
        if path[i, 2] >= 0:
            for j in range(moves.chains.shape[1]):
                at = width - moves.chains.shape[1] + j
                for k in range(moves.followed.shape[0]):
                    z[k] += moves.followed[k, j] * (moves.chains[path[i, 2], j] - z[at])
                z[at] = moves.chains[path[i, 2], j]
        # memories with a known value in this region
        for j in range(moves.known.shape[1]):
            if moves.known[region, j] == moves.known[region, j]:  # not NaN
                z[moves.first_memory + j] = moves.known[region, j]
        # subtract the shift of the region
        for j in range(width):
            z[j] -= moves.shift[region, j]
        # a whole interval: z z' at its beginning
        if path[i, 3]:
            _weigh(moments, moves.advance.shape[0] + moves.step.shape[0] + region, 1.0, z, width, room)
            continue
        # dyadic steps, the longest first: z z' at the beginning of each
        for level in range(levels - 1, -1, -1):
            while left >= moves.step[region, level]:
                index = region * levels + level
                _weigh(moments, index, 1.0, z, width, room)
                multiply(moves.advance, index, strips, width, z, room.made, 0)
                add(strips, room.made, 0, z)
                left -= moves.step[region, level]
        # the remainder, by Gauss-Legendre quadrature
        if left > 0.0:
            _remainder(moves, region, left, width, room, moments)
        for j in range(width):
            z[j] += moves.shift[region, j]
