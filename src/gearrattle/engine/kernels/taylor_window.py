"""The Taylor window: over one finest step the motion is a polynomial to rounding, and a crossing is a root of it."""

from __future__ import annotations

from math import factorial

import numpy as np

from gearrattle.engine.kernels._jit import inlined, kernel
from gearrattle.engine.kernels._llvm import strip_product, strip_product_added
from gearrattle.engine.kernels.corner_log import lifted
from gearrattle.engine.kernels.first_exit import NEVER, first_exit, slope
from gearrattle.engine.kernels.march_arrays import ORDER, window_norm
from gearrattle.engine.kernels.strip_products import add, multiply, multiply_add, subtract

_STRIPS = (ORDER + 1) // 4
_INVERSE = np.array([1.0 / factorial(j) for j in range(ORDER + 1)])
_FALLING = np.array([[factorial(4 * q) / factorial(4 * q + r) for r in range(4)] for q in range(_STRIPS)])
_REACH = np.array([0.0] + [window_norm(4 * n) / window_norm(ORDER + 1) for n in range(1, _STRIPS)] + [1.0])
"""Share of the window in which n groups of four terms are exact to rounding, n = 0 ... _STRIPS."""
_BEYOND = 0.25  # share of the searched part: if the next instant lies before it, half the part is searched


@inlined
def window_scratch(behind, longest):
    """Scratch for ``move_within``."""
    rows = behind + longest
    return np.zeros(rows), np.zeros(4 * rows), np.zeros(longest), np.zeros(4)


@inlined
def strips_of(count):
    """The number of strips of four for ``count`` rows."""
    return (count + 3) // 4


@inlined
def advance(tables, index, width, chain, y, carried, out):
    """Add a table's increments to the carried quantities and to y without its chains."""
    behind = strips_of(carried.size)
    strips = strips_of(width - chain)
    multiply(tables, index, behind + strips, width, y, out, 0)
    add(behind, out, 0, carried)
    add(strips, out, 4 * behind, y)


@inlined
def _combine_chains(c0, c1, c2, c3, y, begin, chained, total):
    """total = (g N)^4 total + c0 q + c1 g N q + c2 (g N)^2 q + c3 (g N)^3 q for chains q, (N q)_j = q_(j+1)."""
    count, links, g = chained
    c1 = c1 * g
    c2 = c2 * (g * g)
    c3 = c3 * (g * g * g)
    c4 = (g * g) * (g * g)
    for c in range(begin, begin + count, links):
        last = c + links - 1
        for j in range(c, last - 3):
            here = (c0 * y[j] + c1 * y[j + 1]) + (c2 * y[j + 2] + c3 * y[j + 3])
            total[j] = c4 * total[j + 4] + here
        for j in range(max(c, last - 3), last + 1):
            total[j] = c0 * y[j]
            if j < last:
                total[j] += c1 * y[j + 1]
            if j < last - 1:
                total[j] += c2 * y[j + 2]
            if j < last - 2:
                total[j] += c3 * y[j + 3]


@kernel
def move_within(powers, slot, width, chained, x, y, carried, scratch):
    """Move y and the carried quantities by x finest steps, 0 <= x <= 1; the chains at the end of y stay as they are.

    The Taylor polynomial sum_j x^j / j! B^j y, B = h A, after Paterson and Stockmeyer: the powers up to B^3 y once,
    then Horner in B^4, with as many groups of four terms as x needs. A small x needs few groups only if the entries of
    y are of comparable size. Higher derivatives of a signal are not, so with chains all groups are used.

    powers: see ``march_arrays.Regions``.
    chained: number of entries of y that are chains, number of links of a chain, factor of B on the next link.
    x: share of the finest step.
    """
    # sizes: strips of the carried quantities and of y without its chains
    out, terms, total, weight = scratch
    behind = strips_of(carried.size)
    moved = width - chained[0]
    first = 4 * behind
    strips = behind + strips_of(moved)
    rows = 4 * strips
    # y, B y, B^2 y, B^3 y
    for i in range(4 * strips_of(moved)):
        terms[first + i] = y[i]
    for r in range(3):
        multiply(powers, 4 * slot + r, strips, width, y, terms, (r + 1) * rows)
    for i in range(rows):
        out[i] = 0.0
    for i in range(moved, width):
        total[i] = 0.0
    # as many groups of four terms as x needs
    rounds = _STRIPS if chained[0] > 0 else 1
    while rounds < _STRIPS and x > _REACH[rounds]:
        rounds += 1
    # Horner in B^4
    x2 = x * x
    x3 = x2 * x
    x4 = x2 * x2
    for q in range(rounds - 1, 0, -1):
        p = _INVERSE[4 * q]
        for _ in range(q):
            p *= x4
        c1 = p * x * _FALLING[q, 1]
        c2 = p * x2 * _FALLING[q, 2]
        c3 = p * x3 * _FALLING[q, 3]
        weight[0] = p
        weight[1] = c1
        weight[2] = c2
        weight[3] = c3
        strip_product(terms, (first, 4, rows, strips - behind, 4), weight, total, 0)
        add(strips - behind, out, first, total)
        _combine_chains(p, c1, c2, c3, y, moved, chained, total)
        multiply(powers, 4 * slot + 3, strips, width, total, out, 0)
    # the first three orders of the carried quantities; then add all increments
    weight[0] = x
    weight[1] = x2 / 2.0
    weight[2] = x3 / 6.0
    strip_product_added(terms, (rows, 4, rows, strips, 3), weight, out, 0)
    add(behind, out, 0, carried)
    add(strips - behind, out, first, y)


@inlined
def reach_of(until, h):
    """The share of a finest step h, a power of two, in which a crossing before the next instant is searched.

    The polynomial of a signal holds up to the next instant. Far beyond it high powers are large, and the search for a
    root would take many trials. If the instant lies in the last three quarters of the step, the whole step is searched.
    """
    reach = 1.0
    while until < _BEYOND * reach * h:
        reach *= 0.5
    return reach


@kernel
def shrink(gap, reach):
    """Scale the argument of a polynomial: gap(reach x)."""
    power = 1.0
    for j in range(gap.size):
        gap[j] *= power
        power *= reach


@kernel
def first_crossing(
    series, forced_series, forced_strips, lower, upper, slot, width, y, u, side, band, unsafe, gap, h, reach
):
    """The first crossing of the corners (k, lower or upper) marked unsafe, within a part of one finest step h.

    series, forced_series, forced_strips, lower, upper: see ``march_arrays.Regions``.
    y, u, side: see ``march_arrays.March``.
    band, unsafe: rounding bands (W,) and corners (W, 2).
    gap: scratch (ORDER + 1,).
    reach: the share of the step that is searched, a power of two.
    Returns (x, k, upward, rate): x as a fraction of the step, ``NEVER`` if there is no crossing, or ``UNDECIDED``; rate
    is
        d delta / ds at x. Of simultaneous crossings the one of the first element is returned.
    """
    best = NEVER
    element = -1
    upward = 0
    rate = 0.0
    for k in range(side.size):
        for up in range(2):
            if not unsafe[k, up]:
                continue
            sign = 2 * up - 1
            index = slot * side.size + k
            # the deflection's Taylor polynomial, of the state and of the inputs split off
            multiply(series, index, _STRIPS, width, y, gap, 0)
            multiply_add(forced_series, index, forced_strips[slot], u.size, u, gap)
            # its gap to the corner, lifted by the band if it sits on the corner
            for j in range(gap.size):
                gap[j] *= -sign
            if reach < 1.0:
                shrink(gap, reach)
            gap[0] += sign * (upper[slot, k] if up else lower[slot, k])
            if side[k] == sign:
                gap[0] = lifted(gap[0], band[k])
            # the earliest root of all gaps
            x = first_exit(gap)
            if x < best:
                best = x
                element = k
                upward = up
                rate = -sign * slope(gap, x) / h
    if reach < 1.0 and best < NEVER:
        best = reach * best
        rate = rate / reach
    return best, element, upward, rate


@kernel
def leave(particular, drift, states, slot, u, elapsed, y, carried, out):
    """Add the particular solution: y becomes the states, and the carried quantities count from the start of the run."""
    behind = strips_of(carried.size)
    multiply(particular, slot, behind + strips_of(states), u.size, u, out, 0)
    add(strips_of(states), out, 4 * behind, y)
    for i in range(carried.size):
        carried[i] += out[i] + drift[slot, i] * elapsed


@kernel
def recall(regions, slot, states):
    """Set the memories whose values are known in a region."""
    count = regions.known.shape[1]
    for i in range(count):
        if regions.known[slot, i] == regions.known[slot, i]:  # not NaN
            states[regions.states - count + i] = regions.known[slot, i]


@kernel
def enter(particular, kept, states, width, slot, u, y, carried, out):
    """Subtract the particular solution, and append the kept inputs to the states."""
    behind = strips_of(carried.size)
    multiply(particular, slot, behind + strips_of(states), u.size, u, out, 0)
    subtract(strips_of(states), out, 4 * behind, y)
    subtract(behind, out, 0, carried)
    for i in range(states, width):
        y[i] = u[kept[slot, i - states]]
