"""The Taylor window: inside one finest step the motion is a polynomial to rounding; the first crossing is a root."""

from __future__ import annotations

from math import cos, floor, pi, sin

from gearrattle.kernels._jit import kernel
from gearrattle.kernels.packed import CYCLE, EXPANSIONS, LONGEST, SLOT
from gearrattle.kernels.polynomial import NEVER, first_exit


@kernel
def inputs_at(inputs, cycle, fraction, out):
    """Inputs u at time cycle + fraction (periods), phases reduced turn by turn."""
    out[0] = inputs.scale[0]
    for j in range(inputs.cycles_high.size):
        high, low = inputs.cycles_high[j], inputs.cycles_low[j]
        turn = high * cycle
        turn = (turn - floor(turn)) + low * cycle + (high + low) * fraction
        angle = 2.0 * pi * (turn - floor(turn))
        out[1 + 2 * j] = inputs.scale[1 + j] * cos(angle)
        out[2 + 2 * j] = inputs.scale[1 + j] * sin(angle)


@kernel
def accumulate(columns, states, state, u, out):
    """Add columns @ (state, u) to out; columns are (Z, n) by column of z, the first `states` belong to the state."""
    for j in range(states):
        weight = state[j]
        for i in range(out.size):
            out[i] += columns[j, i] * weight
    for j in range(u.size):
        weight = u[j]
        for i in range(out.size):
            out[i] += columns[states + j, i] * weight


@kernel
def expand(columns, inputs, state, u, h, order, expansion, waves):
    """Taylor coefficients in x of state(t + h x) and u(t + h x), orders 0 ... order."""
    states = columns.shape[0] - u.size
    for i in range(state.size):
        expansion[0, i] = state[i]
    for i in range(u.size):
        waves[0, i] = u[i]
    for m in range(1, order + 1):
        factor = h / m
        coefficient = expansion[m]
        coefficient[:] = 0.0
        accumulate(columns, states, expansion[m - 1], waves[m - 1], coefficient)
        for i in range(coefficient.size):
            coefficient[i] *= factor
        waves[m, 0] = 0.0
        for j in range(inputs.cycles_high.size):
            turn = factor * 2.0 * pi * (inputs.cycles_high[j] + inputs.cycles_low[j])
            waves[m, 1 + 2 * j] = -turn * waves[m - 1, 2 + 2 * j]
            waves[m, 2 + 2 * j] = turn * waves[m - 1, 1 + 2 * j]


@kernel
def evaluate(expansion, order, x, out):
    """Value of the expansion at x, Horner."""
    for i in range(out.size):
        out[i] = expansion[order, i]
    for m in range(order - 1, -1, -1):
        for i in range(out.size):
            out[i] = out[i] * x + expansion[m, i]


@kernel
def _gap_series(probe, k, states, march, limit, sign, gap):
    """Taylor coefficients of sign (limit - delta_k) over the window."""
    for m in range(gap.size):
        total = 0.0
        for j in range(states):
            total += probe[j, k] * march.expansion[m, j]
        for j in range(march.waves.shape[1]):
            total += probe[states + j, k] * march.waves[m, j]
        gap[m] = -sign * total
    gap[0] += sign * limit


@kernel
def first_crossing(regions, inputs, march, u, h, unsafe, gap):
    """Expand over h and find the first crossing of the clearances marked unsafe.

    Returns:
        (x, k, upward): x as a fraction of h, ``NEVER`` if none; simultaneous crossings go to the first element.
    """
    slot = march.counts[SLOT]
    order = gap.size - 1
    states = regions.generator.shape[1] - u.size
    expand(regions.generator[slot], inputs, march.state, u, h, order, march.expansion, march.waves)
    march.counts[EXPANSIONS] += 1
    best, element, upward = NEVER, -1, 0
    for k in range(unsafe.size):
        for side in (-1, 1):
            if not unsafe[k]:
                continue
            limit = regions.upper[slot, k] if side > 0 else regions.lower[slot, k]
            if abs(limit) > 1e300:
                continue
            _gap_series(regions.probe[slot], k, states, march, limit, side, gap)
            if march.side[k] == side:
                gap[0] = 0.0
            x = first_exit(gap)
            if x < best:
                best, element, upward = x, k, 1 if side > 0 else 0
    return best, element, upward


@kernel
def state_between(regions, inputs, march, u, start, h, work):
    """State a time h (at most one longest step) after the marcher's, into work.state: tables, then a Taylor rest."""
    slot = march.counts[SLOT]
    order = work.expansion.shape[0] - 1
    states = regions.generator.shape[1] - u.size
    work.state[:] = march.state
    work.u[:] = u
    length, done = LONGEST, 0.0
    increment = work.expansion[order]
    for level in range(regions.fine[slot] + 1):
        while h - done >= length:
            increment[:] = 0.0
            accumulate(regions.tables[regions.first_table[slot] + level], states, work.state, work.u, increment)
            for i in range(increment.size):
                work.state[i] += increment[i]
            done += length
            inputs_at(inputs, march.counts[CYCLE], start + done, work.u)
        length *= 0.5
    rest = h - done
    if rest > 0.0:
        expand(regions.generator[slot], inputs, work.state, work.u, rest, order, work.expansion, work.waves)
        evaluate(work.expansion, order, 1.0, work.state)
