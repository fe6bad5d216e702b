"""The inputs u = (1, cos 2 pi p_j s, sin 2 pi p_j s), all cosines first, scaled: at a time, and rotated from there.

Signals are chains of derivatives, which are computed when they are needed.
"""

from __future__ import annotations

from math import cos, factorial, floor, pi, sin

import numpy as np

from gearrattle.engine.kernels._jit import inlined, kernel
from gearrattle.engine.kernels._llvm import strip_product

_SINE = tuple((-1) ** i / factorial(2 * i + 1) for i in range(8))
_COSINE = tuple(-((-1) ** i) / factorial(2 * i + 2) for i in range(8))  # of (cos x - 1) / x^2

_INVERSE = np.array([0.0] + [1.0 / k for k in range(1, 64)])


@kernel
def inputs_at(inputs, cycle, fraction, u):
    """Write the inputs at time cycle + fraction (periods), with phases reduced to one turn."""
    count = inputs.cycles_high.size
    u[0] = inputs.scale[0]
    for j in range(count):
        high = inputs.cycles_high[j]
        low = inputs.cycles_low[j]
        turn = high * cycle
        turn = (turn - floor(turn)) + low * cycle + (high + low) * fraction
        angle = 2.0 * pi * (turn - floor(turn))
        u[1 + j] = inputs.scale[1 + j] * cos(angle)
        u[1 + count + j] = inputs.scale[1 + j] * sin(angle)


@kernel
def chains_at(inputs, interval, since, y, first, scratch):
    """Write the chains of the signals into y at s = ``since`` in an interval: q_j = sum_k q_(j+k) (w s)^k / k!."""
    moved = inputs.pace * since
    links = inputs.links
    padded = inputs.chains.shape[2]
    part = 1.0
    strips = (links + 3) // 4
    for k in range(links):
        scratch[k] = part
        part *= moved * _INVERSE[k + 1]
    for c in range(inputs.chains.shape[1]):
        begin = (interval * inputs.chains.shape[1] + c) * padded
        # a matrix whose columns lie one entry apart: entry i is a sum over the entries from begin + i on
        strip_product(inputs.chains, (begin, 4, 1, strips, links), scratch, scratch, links)
        for j in range(links):
            y[first + c * links + j] = scratch[links + j]


@kernel
def shift_chains(y, first, count, links, moved):
    """Advance the chains in y by w s = ``moved``: q_j becomes sum_k q_(j+k) (w s)^k / k!."""
    for begin in range(first, first + count, links):
        for j in range(begin, begin + links):
            total = 0.0
            part = 1.0
            for k in range(begin + links - j):
                total += y[j + k] * part
                part *= moved * _INVERSE[k + 1]
            y[j] = total


@inlined
def turn_step(cosines, sines, level, u):
    """Rotate the inputs by one step of a level."""
    count = cosines.shape[1]
    for j in range(count):
        c = u[1 + j]
        s = u[1 + count + j]
        u[1 + j] = c * cosines[level, j] - s * sines[level, j]
        u[1 + count + j] = s * cosines[level, j] + c * sines[level, j]


@kernel
def turn_little(frequency, h, u):
    """Rotate the inputs by less than a finest step: for angles below 0.55 rad the series have errors of 1e-19."""
    count = frequency.size
    for j in range(count):
        a = frequency[j] * h
        q = a * a
        sine = _SINE[7]
        lack = _COSINE[7]
        for i in range(6, -1, -1):
            sine = sine * q + _SINE[i]
            lack = lack * q + _COSINE[i]
        sine = sine * a
        lack = lack * q
        c = u[1 + j]
        s = u[1 + count + j]
        u[1 + j] = c + (c * lack - s * sine)
        u[1 + count + j] = s + (s * lack + c * sine)
