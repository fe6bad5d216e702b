"""The Taylor window: inside one finest step the motion is a polynomial to rounding; the first crossing is a root.

Products index stacks of matrices directly: taking a view of an array costs a compiled loop more than the product.
"""

from __future__ import annotations

from math import cos, floor, pi, sin

from gearrattle.kernels._jit import kernel
from gearrattle.kernels.packed import BAND
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
def multiply(stack, index, strips, y, out):
    """out = rows @ z: the first strips of stack[index], rows in strips of four, z the leading entries of y."""
    for c in range(strips):
        a0, a1, a2, a3 = 0.0, 0.0, 0.0, 0.0
        for j in range(stack.shape[2]):
            weight = y[j]
            a0 += stack[index, c, j, 0] * weight
            a1 += stack[index, c, j, 1] * weight
            a2 += stack[index, c, j, 2] * weight
            a3 += stack[index, c, j, 3] * weight
        out[4 * c], out[4 * c + 1], out[4 * c + 2], out[4 * c + 3] = a0, a1, a2, a3


@kernel
def multiply_row(stack, index, rows, r, out):
    """The same for z in row r of an array; all strips."""
    for c in range(stack.shape[1]):
        a0, a1, a2, a3 = 0.0, 0.0, 0.0, 0.0
        for j in range(stack.shape[2]):
            weight = rows[r, j]
            a0 += stack[index, c, j, 0] * weight
            a1 += stack[index, c, j, 1] * weight
            a2 += stack[index, c, j, 2] * weight
            a3 += stack[index, c, j, 3] * weight
        out[4 * c], out[4 * c + 1], out[4 * c + 2], out[4 * c + 3] = a0, a1, a2, a3


@kernel
def advance(tables, index, states, y, out):
    """Add a step's increments to the states and to what is carried behind z; the inputs are left to the caller."""
    multiply(tables, index, tables.shape[1], y, out)
    width = tables.shape[2]
    for i in range(states):
        y[i] += out[i]
    for i in range(y.size - width):
        y[width + i] += out[states + i]


@kernel
def expand(generator, slot, high, low, states, y, h, expansion, out):
    """Taylor coefficients in x of y(t + h x), one row an order; the inputs oscillate high + low times a period."""
    width = generator.shape[2]
    for i in range(y.size):
        expansion[0, i] = y[i]
    for m in range(1, expansion.shape[0]):
        factor = h / m
        multiply_row(generator, slot, expansion, m - 1, out)
        for i in range(states):
            expansion[m, i] = factor * out[i]
        expansion[m, states] = 0.0
        for j in range(high.size):
            turn = factor * 2.0 * pi * (high[j] + low[j])
            cosine = states + 1 + 2 * j
            expansion[m, cosine] = -turn * expansion[m - 1, cosine + 1]
            expansion[m, cosine + 1] = turn * expansion[m - 1, cosine]
        for i in range(y.size - width):
            expansion[m, width + i] = factor * out[states + i]


@kernel
def evaluate(expansion, x, out):
    """Value of the expansion at x, Horner."""
    order = expansion.shape[0] - 1
    for i in range(out.size):
        out[i] = expansion[order, i]
    for m in range(order - 1, -1, -1):
        for i in range(out.size):
            out[i] = out[i] * x + expansion[m, i]


@kernel
def _gap_series(probe, slot, k, expansion, sign, gap):
    """Taylor coefficients of -sign delta_k over the window; a deflection's row is mostly zeros."""
    for m in range(gap.size):
        gap[m] = 0.0
    strip, row = k // 4, k % 4
    for j in range(probe.shape[2]):
        weight = -sign * probe[slot, strip, j, row]
        if weight != 0.0:
            for m in range(gap.size):
                gap[m] += weight * expansion[m, j]


@kernel
def first_crossing(probe, lower, upper, slot, expansion, side, unsafe, gap, h):
    """The first crossing of the corners (k, lower or upper) marked unsafe, in the window expanded over h.

    Returns:
        (x, k, upward, rate): x as a fraction of the window, ``NEVER`` if none; d delta / ds there. Simultaneous
        crossings go to the first element.
    """
    best, element, upward, rate = NEVER, -1, 0, 0.0
    for k in range(side.size):
        for up in range(2):
            if not unsafe[k, up]:
                continue
            sign = 2 * up - 1
            _gap_series(probe, slot, k, expansion, sign, gap)
            gap[0] += sign * (upper[slot, k] if up else lower[slot, k])
            if side[k] == sign:
                gap[0] = max(gap[0], 0.0) + BAND
            x = first_exit(gap)
            if x < best:
                best, element, upward = x, k, up
                rate = -sign * slope(gap, x) / h
    return best, element, upward, rate


@kernel
def state_between(regions, inputs, slot, y, cycle, start, h, work):
    """y a time h (at most one longest step) later, into work.y: tables, then a Taylor rest."""
    states = regions.generator.shape[2] - 1 - 2 * inputs.cycles_high.size
    work.y[:] = y
    done = 0.0
    for level in range(regions.fine[slot] + 1):
        length = inputs.steps[level]
        while h - done >= length:
            advance(regions.tables, regions.first_table[slot] + level, states, work.y, work.out)
            done += length
            inputs_at(inputs, cycle, start + done, work.y, states)
    rest = h - done
    if rest > 0.0:
        high, low = inputs.cycles_high, inputs.cycles_low
        expand(regions.generator, slot, high, low, states, work.y, rest, work.expansion, work.out)
        evaluate(work.expansion, 1.0, work.y)
