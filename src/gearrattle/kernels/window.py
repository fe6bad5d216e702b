"""The Taylor window: inside one finest step the motion is a polynomial to rounding; the first crossing is a root."""

from __future__ import annotations

from math import cos, floor, pi, sin

from gearrattle.kernels._jit import kernel
from gearrattle.kernels.packed import BAND, CYCLE, EXPANSIONS, RegionView
from gearrattle.kernels.polynomial import NEVER, first_exit, slope


@kernel
def inputs_at(inputs, cycle, fraction, y, first):
    """Write the inputs u at time cycle + fraction (periods) to y[first:], phases reduced turn by turn."""
    y[first] = inputs.scale[0]
    for j in range(inputs.cycles_high.size):
        high, low = inputs.cycles_high[j], inputs.cycles_low[j]
        turn = high * cycle
        turn = (turn - floor(turn)) + low * cycle + (high + low) * fraction
        angle = 2.0 * pi * (turn - floor(turn))
        y[first + 1 + 2 * j] = inputs.scale[1 + j] * cos(angle)
        y[first + 2 + 2 * j] = inputs.scale[1 + j] * sin(angle)


@kernel
def multiply(strips, y, out):
    """out = rows @ z, rows in strips of four, z the leading entries of y."""
    for c in range(strips.shape[0]):
        a0, a1, a2, a3 = 0.0, 0.0, 0.0, 0.0
        for j in range(strips.shape[1]):
            weight = y[j]
            a0 += strips[c, j, 0] * weight
            a1 += strips[c, j, 1] * weight
            a2 += strips[c, j, 2] * weight
            a3 += strips[c, j, 3] * weight
        out[4 * c], out[4 * c + 1], out[4 * c + 2], out[4 * c + 3] = a0, a1, a2, a3


@kernel
def advance(strips, states, y, out):
    """Add a step's increments to the states and to what is carried behind z; the inputs are left to the caller."""
    multiply(strips, y, out)
    width = strips.shape[1]
    for i in range(states):
        y[i] += out[i]
    for i in range(y.size - width):
        y[width + i] += out[states + i]


@kernel
def expand(strips, inputs, states, y, h, expansion, out):
    """Taylor coefficients in x of y(t + h x), one row an order."""
    width = strips.shape[1]
    expansion[0] = y
    for m in range(1, expansion.shape[0]):
        factor = h / m
        before, after = expansion[m - 1], expansion[m]
        multiply(strips, before, out)
        for i in range(states):
            after[i] = factor * out[i]
        after[states] = 0.0
        for j in range(inputs.cycles_high.size):
            turn = factor * 2.0 * pi * (inputs.cycles_high[j] + inputs.cycles_low[j])
            cosine = states + 1 + 2 * j
            after[cosine] = -turn * before[cosine + 1]
            after[cosine + 1] = turn * before[cosine]
        for i in range(y.size - width):
            after[width + i] = factor * out[states + i]


@kernel
def evaluate(expansion, x, out):
    """Value of the expansion at x, Horner."""
    order = expansion.shape[0] - 1
    out[:] = expansion[order]
    for m in range(order - 1, -1, -1):
        for i in range(out.size):
            out[i] = out[i] * x + expansion[m, i]


@kernel
def region_at(regions, slot):
    """One slot as views; the strips of unused bound rows are left out."""
    count = regions.lower.shape[1]
    rows, fine, first = regions.bound_rows[slot], regions.fine[slot], regions.first_table[slot]
    strips = (3 * count + 3) // 4 + (2 * rows + 3) // 4
    return RegionView(
        slot, fine, regions.tables[first : first + fine + 1], regions.generator[slot], regions.probe[slot, :strips],
        rows, regions.weights[slot], regions.constant[slot], regions.lower[slot], regions.upper[slot],
    )  # fmt: skip


@kernel
def _gap_series(probe, k, expansion, sign, gap):
    """Taylor coefficients of -sign delta_k over the window; a deflection's row is mostly zeros."""
    gap[:] = 0.0
    strip, row = k // 4, k % 4
    for j in range(probe.shape[1]):
        weight = -sign * probe[strip, j, row]
        if weight != 0.0:
            for m in range(gap.size):
                gap[m] += weight * expansion[m, j]


@kernel
def first_crossing(region, inputs, march, unsafe, work):
    """Expand over the finest step and find the first crossing of the corners (k, lower or upper) marked unsafe.

    Returns:
        (x, k, upward, rate): x as a fraction of the step, ``NEVER`` if none; d delta / ds there. Simultaneous
        crossings go to the first element.
    """
    h = inputs.steps[region.fine]
    states = region.generator.shape[1] - 1 - 2 * inputs.cycles_high.size
    expand(region.generator, inputs, states, march.y, h, march.expansion, work.out)
    march.counts[EXPANSIONS] += 1
    gap = work.gap
    best, element, upward, rate = NEVER, -1, 0, 0.0
    for k in range(unsafe.shape[0]):
        for upper in range(2):
            if not unsafe[k, upper]:
                continue
            sign = 2 * upper - 1
            _gap_series(region.probe, k, march.expansion, sign, gap)
            gap[0] += sign * (region.upper[k] if upper else region.lower[k])
            if march.side[k] == sign:
                gap[0] = max(gap[0], 0.0) + BAND
            x = first_exit(gap)
            if x < best:
                best, element, upward = x, k, upper
                rate = -sign * slope(gap, x) / h
    return best, element, upward, rate


@kernel
def state_between(region, inputs, march, start, h, work):
    """y a time h (at most one longest step) after the marcher's, into work.y: tables, then a Taylor rest."""
    states = region.generator.shape[1] - 1 - 2 * inputs.cycles_high.size
    work.y[:] = march.y
    done = 0.0
    for level in range(region.fine + 1):
        length = inputs.steps[level]
        while h - done >= length:
            advance(region.tables[level], states, work.y, work.out)
            done += length
            inputs_at(inputs, march.counts[CYCLE], start + done, work.y, states)
    rest = h - done
    if rest > 0.0:
        expand(region.generator, inputs, states, work.y, rest, work.expansion, work.out)
        evaluate(work.expansion, 1.0, work.y)
