"""The Taylor window: inside one finest step the motion is a polynomial to rounding; the first crossing is a root."""

from __future__ import annotations

from math import cos, floor, pi, sin

from gearrattle.kernels._jit import kernel
from gearrattle.kernels.packed import BAND, CYCLE, EXPANSIONS, RegionView
from gearrattle.kernels.polynomial import NEVER, first_exit, slope


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
def multiply(strips, states, state, u, out):
    """out = rows @ (state, u); rows stand in strips of four, the first `states` columns belong to the state."""
    for c in range(strips.shape[0]):
        a0, a1, a2, a3 = 0.0, 0.0, 0.0, 0.0
        for j in range(states):
            weight = state[j]
            a0 += strips[c, j, 0] * weight
            a1 += strips[c, j, 1] * weight
            a2 += strips[c, j, 2] * weight
            a3 += strips[c, j, 3] * weight
        for j in range(u.size):
            weight = u[j]
            a0 += strips[c, states + j, 0] * weight
            a1 += strips[c, states + j, 1] * weight
            a2 += strips[c, states + j, 2] * weight
            a3 += strips[c, states + j, 3] * weight
        out[4 * c], out[4 * c + 1], out[4 * c + 2], out[4 * c + 3] = a0, a1, a2, a3


@kernel
def expand(strips, inputs, state, u, h, order, expansion, waves):
    """Taylor coefficients in x of state(t + h x) and u(t + h x), orders 0 ... order."""
    states = strips.shape[1] - u.size
    for i in range(state.size):
        expansion[0, i] = state[i]
    for i in range(u.size):
        waves[0, i] = u[i]
    for m in range(1, order + 1):
        factor = h / m
        coefficient = expansion[m]
        multiply(strips, states, expansion[m - 1], waves[m - 1], coefficient)
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
def _gap_series(probe, k, states, march, sign, gap):
    """Taylor coefficients of -sign delta_k over the window; a deflection's row is mostly zeros."""
    gap[:] = 0.0
    strip, row = k // 4, k % 4
    for j in range(probe.shape[1]):
        weight = -sign * probe[strip, j, row]
        if weight == 0.0:
            continue
        if j < states:
            for m in range(gap.size):
                gap[m] += weight * march.expansion[m, j]
        else:
            for m in range(gap.size):
                gap[m] += weight * march.waves[m, j - states]


@kernel
def region_at(regions, slot):
    """One slot as views; the columns of unused bound rows are left out."""
    count = regions.lower.shape[1]
    rows, fine, first = regions.bound_rows[slot], regions.fine[slot], regions.first_table[slot]
    strips = (3 * count + 3) // 4 + (2 * rows + 3) // 4
    return RegionView(
        slot, fine, regions.tables[first : first + fine + 1], regions.generator[slot],
        regions.probe[slot, :strips], rows, regions.weights[slot], regions.constant[slot],
        regions.lower[slot], regions.upper[slot],
    )  # fmt: skip


@kernel
def first_crossing(region, inputs, march, u, h, unsafe, gap):
    """Expand over h and find the first crossing of the corners (k, lower or upper) marked unsafe.

    Returns:
        (x, k, upward, rate): x as a fraction of h, ``NEVER`` if none; d delta / ds there. Simultaneous crossings go
        to the first element.
    """
    order = gap.size - 1
    states = region.generator.shape[1] - u.size
    expand(region.generator, inputs, march.state, u, h, order, march.expansion, march.waves)
    march.counts[EXPANSIONS] += 1
    best, element, upward, rate = NEVER, -1, 0, 0.0
    for k in range(unsafe.shape[0]):
        for upper in range(2):
            if not unsafe[k, upper]:
                continue
            sign = 2 * upper - 1
            _gap_series(region.probe, k, states, march, sign, gap)
            gap[0] += sign * (region.upper[k] if upper else region.lower[k])
            if march.side[k] == sign:
                gap[0] = max(gap[0], 0.0) + BAND
            x = first_exit(gap)
            if x < best:
                best, element, upward = x, k, upper
                rate = -sign * slope(gap, x) / h
    return best, element, upward, rate


@kernel
def state_between(region, inputs, march, u, start, h, work):
    """State a time h (at most one longest step) after the marcher's, into work.state: tables, then a Taylor rest."""
    order = work.expansion.shape[0] - 1
    states = region.generator.shape[1] - u.size
    work.state[:] = march.state
    work.u[:] = u
    done = 0.0
    increment = work.expansion[order]
    for level in range(region.fine + 1):
        length = inputs.steps[level]
        while h - done >= length:
            multiply(region.tables[level], states, work.state, work.u, increment)
            for i in range(increment.size):
                work.state[i] += increment[i]
            done += length
            inputs_at(inputs, march.counts[CYCLE], start + done, work.u)
    rest = h - done
    if rest > 0.0:
        expand(region.generator, inputs, work.state, work.u, rest, order, work.expansion, work.waves)
        evaluate(work.expansion, order, 1.0, work.state)
