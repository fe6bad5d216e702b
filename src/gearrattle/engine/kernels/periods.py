"""The end of a motion over whole periods, and its derivatives: to the state at the start, and to a parameter.

Time is counted in periods. Inside a region the states x and the inputs u, which are oscillators, obey

    z' = Z(p) z,    z = (x, u),    Z = [[A, G], [0, W]]

and W does not depend on the parameter p. Perturbations of the start are carried by A alone. The derivative s = dx/dp
for a fixed start obeys s' = A s + B z with B = d[A, G]/dp, so that over an interval h

    s(h) = exp(A h) s(0) + D(h) z(0),    exp([[A, B], [0, Z]] h) = [[exp(A h), D(h)], [0, exp(Z h)]]

D is the derivative of the exponential in the direction of B. It is made by the same doublings as the exponential:
D(2 h) = exp(A h) D(h) + D(h) exp(Z h). Where a crossing changes the damping, every perturbation kicks the velocities in
proportion to how it moves the deflection (``system.variation``); so does p, which moves the corner as well.

A, G and corners are closed forms of p. Their derivatives are central differences of these, not of motions: two
variants beside the one that is marched are laid out in its scales.

If asked, the extremum of a clearance's deflection near an instant is found too, and how far it lies beyond a corner.

Arrays: ``located`` (workspace), ``packed`` (regions, march, samples, log), ``variants``.

N. J. Higham, Functions of Matrices, SIAM 2008, section 3.2 and theorem 3.6.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, strict, strict_entry
from gearrattle.engine.kernels.arrays import Array3, IntVector, Matrix, Vector
from gearrattle.engine.kernels.laid_out import lay_out
from gearrattle.engine.kernels.levels import norm_of_rows
from gearrattle.engine.kernels.located import common_at, laws_at, region_at
from gearrattle.engine.kernels.many import AT, SLOTS, numbers_of
from gearrattle.engine.kernels.packed import EVENTS
from gearrattle.engine.kernels.region import accelerate
from gearrattle.engine.kernels.workspace import PERIOD

NEIGHBOURS = 2
"""Variants before the one that is marched: the same with a smaller, and with a larger parameter."""
TERMS = 7
"""Of the Taylor series over the finest step."""
_WIDEST = 1.0 / 64.0  # norm of the rates times the finest step: the first term left out is below 1e-16
_LEVELS = 60
NEAR = 1.0 / 64.0
"""Periods that an extremum may move in one step of Newton's method."""
FARTHEST = 1.0 / 16.0
"""Periods from an instant within which its extremum lies."""
_ITERATIONS, _SETTLED = 30, 1e-11  # of Newton's method in time; a step after which the depth is exact, in periods


class Map(NamedTuple):
    """A motion over n periods; N states."""

    end: Vector  # (N,) state at the end [SI]
    turned: Vector  # (R,) how far the reference inertia of every free train has turned [rad]
    gradient: Matrix  # (N, N) of the end with respect to the start [SI]
    slope: Vector  # (N,) of the end with respect to the parameter [SI], times half the distance of both neighbours
    corner: IntVector  # (2,) clearance whose approach to a corner is asked for (-1: none), and 1 for the upper corner
    approach: Vector  # (3,) instant nearby [periods]; then of the extremum: instant, how far beyond it lies (NaN: there
    # is none), and second derivative over periods


class Rates(NamedTuple):
    """What drives the states and their derivatives, for the S slots that a motion visits; P entries of z, K clearances.

    A *shift* is a derivative with respect to the parameter, times half the distance of both neighbours.
    """

    generator: Array3  # (S, P, P) Z
    shift: Array3  # (S, N, P) B
    deflection: Matrix  # (K, P) of the clearances
    deflection_shift: Matrix  # (K, P)


class Tables(NamedTuple):
    """Increments over the steps h = 1, 1/2, 1/4 ... of a region."""

    increment: Array3  # (levels, P, P) exp(Z h) - 1
    moved: Array3  # (levels, N, P) D(h)


class Course(NamedTuple):
    """Where a motion stands at its start and after each of its E crossings."""

    time: Vector  # (E + 2,) in periods; the last one is its end
    slot: IntVector  # (E + 1,) of the region from there on
    z: Matrix  # (E + 1, P)


class Carried(NamedTuple):
    """What is carried along a motion, and room for products."""

    columns: Matrix  # (N, N + 1) perturbations of the start, balanced; the last column is s
    z: Vector  # (P,)
    columns_term: Matrix
    z_term: Vector
    columns_product: Matrix
    z_product: Vector


@kernel
def clear(matrix):
    """Write zeros; a slice assignment would take seconds to compile."""
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            matrix[i, j] = 0.0


@kernel
def copy_matrix(source, out):
    """Write a matrix of the same shape."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = source[i, j]


@kernel
def add_product(a, b, rows, inner, out):
    """Add to so many rows of out the product of a and b, over so many columns of a."""
    for i in range(rows):
        for j in range(inner):
            weight = a[i, j]
            if weight != 0.0:
                for p in range(out.shape[1]):
                    out[i, p] += weight * b[j, p]


@kernel
def write_tables(generator, shift, tables, term, moved_term):
    """Write the increments of a region: Taylor series over the finest step, then doublings; terms are room."""
    size, states = generator.shape[0], shift.shape[0]
    levels = tables.increment.shape[0]
    h = 0.5 ** (levels - 1)
    increment, moved = tables.increment[levels - 1], tables.moved[levels - 1]
    product, moved_product = np.empty((size, size)), np.empty((states, size))
    for i in range(size):
        for j in range(size):
            term[i, j] = increment[i, j] = h * generator[i, j]
            if i < states:
                moved_term[i, j] = moved[i, j] = h * shift[i, j]
    for m in range(2, TERMS + 1):
        clear(moved_product)
        add_product(generator, moved_term, states, states, moved_product)
        add_product(shift, term, states, size, moved_product)
        clear(product)
        add_product(generator, term, size, size, product)
        for i in range(size):
            for j in range(size):
                term[i, j] = h / m * product[i, j]
                increment[i, j] += term[i, j]
                if i < states:
                    moved_term[i, j] = h / m * moved_product[i, j]
                    moved[i, j] += moved_term[i, j]
    for level in range(levels - 2, -1, -1):
        half, half_moved = tables.increment[level + 1], tables.moved[level + 1]
        increment, moved = tables.increment[level], tables.moved[level]
        for i in range(size):
            for j in range(size):
                increment[i, j] = 2.0 * half[i, j]
                if i < states:
                    moved[i, j] = 2.0 * half_moved[i, j]
        add_product(half, half_moved, states, states, moved)
        add_product(half_moved, half, states, size, moved)
        add_product(half, half, size, size, increment)


@kernel
def dot(matrix, i, z):
    """Product of a row and a vector."""
    total = 0.0
    for j in range(z.size):
        total += matrix[i, j] * z[j]
    return total


@kernel
def multiply(rates, shift, columns, z, carried):
    """Write the products of both kinds of rates with columns and z; those of the inputs are not zero in two places."""
    states, size = shift.shape
    product, z_product = carried.columns_product, carried.z_product
    clear(product)
    add_product(rates, columns, states, states, product)
    for i in range(states):
        product[i, states] += dot(shift, i, z)
        z_product[i] = dot(rates, i, z)
    pairs = (size - states - 1) // 2
    z_product[states] = 0.0
    for cosine in range(states + 1, states + 1 + pairs):
        sine = cosine + pairs
        z_product[cosine] = rates[cosine, cosine] * z[cosine] + rates[cosine, sine] * z[sine]
        z_product[sine] = rates[sine, cosine] * z[cosine] + rates[sine, sine] * z[sine]


@kernel
def step(increment, moved, carried):
    """Carry over one step of a table."""
    columns, z = carried.columns, carried.z
    multiply(increment, moved, columns, z, carried)
    for i in range(columns.shape[0]):
        for p in range(columns.shape[1]):
            columns[i, p] += carried.columns_product[i, p]
    for i in range(z.size):
        z[i] += carried.z_product[i]


@kernel
def add_series(generator, shift, h, carried):
    """Carry over h shorter than the finest step, by Taylor series."""
    columns, z, term, z_term = carried.columns, carried.z, carried.columns_term, carried.z_term
    copy_matrix(columns, term)
    for i in range(z.size):
        z_term[i] = z[i]
    for m in range(1, TERMS + 1):
        multiply(generator, shift, term, z_term, carried)
        factor = h / m
        for i in range(columns.shape[0]):
            for p in range(columns.shape[1]):
                term[i, p] = factor * carried.columns_product[i, p]
                columns[i, p] += term[i, p]
        for i in range(z.size):
            z_term[i] = factor * carried.z_product[i]
            z[i] += z_term[i]


@kernel
def carry(tables, generator, shift, h, carried):
    """Carry over an interval: steps of the tables, the longest first, then a Taylor series."""
    left = h
    while left >= 1.0:
        step(tables.increment[0], tables.moved[0], carried)
        left -= 1.0
    length = 1.0
    for level in range(1, tables.increment.shape[0]):
        length *= 0.5
        if left >= length:
            step(tables.increment[level], tables.moved[level], carried)
            left -= length
    if left > 0.0:
        add_series(generator, shift, left, carried)


@kernel
def cross(common, k, jump, corner_shift, deflection, deflection_shift, carried):
    """Kick the velocities where the damping of element k jumps at a corner that moves with the parameter."""
    columns, z = carried.columns, carried.z
    states, inertias = columns.shape[0], common.inertia.size
    moving = states - inertias
    for p in range(states + 1):
        moved = 0.0
        for j in range(states):
            moved += deflection[j] * columns[j, p]
        if p == states:
            moved -= corner_shift
            for j in range(z.size):
                moved += deflection_shift[j] * z[j]
        for j in range(inertias):
            kick = common.pace[j] / common.limits[PERIOD] * common.rows[k, j] / common.inertia[j]
            columns[moving + j, p] -= kick * jump * moved


@strict
def _write_rows(workspace, regions, generator, deflection):
    """Write A and G of every slot's region, and the deflections of the clearances."""
    common, region = common_at(workspace), region_at(workspace)
    clearances, states, size = common.clearances, region.matrix.shape[0], region.matrix.shape[1]
    for slot in range(generator.shape[0]):
        for i in range(clearances.size):
            region.pieces[clearances[i]] = regions.piece[slot, i]
        accelerate(workspace)
        for i in range(states):
            for j in range(size):
                generator[slot, i, j] = region.matrix[i, j]
    for i in range(clearances.size):
        for j in range(size):
            deflection[i, j] = common.deflection[clearances[i], j]


@strict
def _write_rates(workspace, cases, scales, regions, v, rates):
    """Write the rates of a variant, and their shifts from both variants beside it; all in its scales."""
    slots, states, size = rates.shift.shape
    generators = np.empty((NEIGHBOURS, slots, states, size))
    deflections = np.empty((NEIGHBOURS, rates.deflection.shape[0], size))
    for side in range(NEIGHBOURS):
        lay_out(workspace, numbers_of(cases.numbers, v - NEIGHBOURS + side), cases.frame, scales)
        _write_rows(workspace, regions, generators[side], deflections[side])
    lay_out(workspace, numbers_of(cases.numbers, v), cases.frame, scales)
    for slot in range(slots):
        clear(rates.generator[slot])
    _write_rows(workspace, regions, rates.generator, rates.deflection)
    frequency = common_at(workspace).frequency
    for slot in range(slots):
        for h in range(frequency.size):
            cosine, sine = states + 1 + h, states + 1 + frequency.size + h
            rates.generator[slot, cosine, sine], rates.generator[slot, sine, cosine] = -frequency[h], frequency[h]
        for i in range(states):
            for j in range(size):
                rates.shift[slot, i, j] = 0.5 * (generators[1, slot, i, j] - generators[0, slot, i, j])
    for i in range(deflections.shape[1]):
        for j in range(size):
            rates.deflection_shift[i, j] = 0.5 * (deflections[1, i, j] - deflections[0, i, j])


@kernel
def levels_for(common, rates):
    """How often a period is halved until it is a step of which the Taylor series are exact."""
    slots, states, _ = rates.shift.shape
    widest = 0.0
    for h in range(common.frequency.size):
        widest = max(widest, common.frequency[h])
    for slot in range(slots):
        widest = max(widest, norm_of_rows(rates.generator[slot], states))
    levels = 1
    while widest * 0.5 ** (levels - 1) > _WIDEST and levels < _LEVELS:
        levels += 1
    return levels


@kernel
def slot_of(regions, slots, pieces):
    """The slot of a region."""
    for slot in range(slots):
        is_same = True
        for k in range(pieces.size):
            is_same = is_same and regions.piece[slot, k] == pieces[k]
        if is_same:
            return slot
    return 0


@kernel
def write_products(matrix, z, out):
    """Write the product of a square matrix and a vector."""
    for i in range(z.size):
        out[i] = dot(matrix, i, z)


@kernel
def carry_state(increment, generator, h, z, term, product):
    """Carry z alone over an interval, as ``carry`` does; the others are room."""
    left = h
    length = 1.0
    for level in range(increment.shape[0]):
        while left >= length:
            write_products(increment[level], z, product)
            for i in range(z.size):
                z[i] += product[i]
            left -= length
        length *= 0.5
    for i in range(z.size):
        term[i] = z[i]
    for m in range(1, TERMS + 1):
        write_products(generator, term, product)
        for i in range(z.size):
            term[i] = left / m * product[i]
            z[i] += term[i]


@strict
def _write_approach(laws, clearances, regions, rates, increment, course, corner, approach):
    """Write when the deflection of a clearance has an extremum near an instant, and how far beyond a corner that is."""
    k, asked, end = corner[0], approach[0], course.time[course.time.size - 1]
    z, term, product = np.empty(course.z.shape[1]), np.empty(course.z.shape[1]), np.empty(course.z.shape[1])
    time, i = asked, 0
    approach[1] = np.nan
    for _ in range(_ITERATIONS):
        now = time - end * np.floor(time / end)
        i = 0
        while i < course.slot.size - 1 and course.time[i + 1] <= now:
            i += 1
        slot = course.slot[i]
        for j in range(z.size):
            z[j] = course.z[i, j]
        carry_state(increment[slot], rates.generator[slot], now - course.time[i], z, term, product)
        value = dot(rates.deflection, k, z)
        write_products(rates.generator[slot], z, product)
        rate = dot(rates.deflection, k, product)
        write_products(rates.generator[slot], product, term)
        bend = dot(rates.deflection, k, term)
        if (bend >= 0.0) == (corner[1] == 1):
            return
        change = min(max(-rate / bend, -NEAR), NEAR)
        time += change
        if abs(time - asked) > FARTHEST:
            return
        if abs(change) < _SETTLED:
            piece = laws.first[clearances[k]] + regions.piece[slot, k]
            approach[0], approach[2] = time, bend
            approach[1] = value - laws.upper[piece] if corner[1] == 1 else laws.lower[piece] - value
            return


@strict
def _follow(workspace, neighbours, regions, rates, log, events, initial, end, carried, asked):
    """Carry perturbations and s along a motion of so many crossings that ends after ``end`` periods.

    ``asked``: ``corner`` and ``approach`` of a ``Map``.
    """
    common, laws = common_at(workspace), laws_at(workspace)
    slots, states, size = rates.shift.shape
    levels = levels_for(common, rates)
    increment, moved = np.empty((slots, levels, size, size)), np.empty((slots, levels, states, size))
    is_written, term, moved_term = np.zeros(slots, np.bool_), np.empty((size, size)), np.empty((states, size))
    pieces, before = initial.copy(), 0.0
    below, above = neighbours
    course = Course(np.zeros(events + 2), np.zeros(events + 1, np.int64), np.empty((events + 1, size)))
    for i in range(events + 1):
        slot = slot_of(regions, slots, pieces)
        course.time[i], course.slot[i], course.time[i + 1] = before, slot, end
        for j in range(size):
            course.z[i, j] = carried.z[j]
        tables = Tables(increment[slot], moved[slot])
        if not is_written[slot]:
            write_tables(rates.generator[slot], rates.shift[slot], tables, term, moved_term)
            is_written[slot] = True
        now = log.cycle[i] + log.fraction[i] if i < events else end
        carry(tables, rates.generator[slot], rates.shift[slot], now - before, carried)
        before = now
        if i == events:
            break
        crossed = log.clearance[i]
        k = common.clearances[crossed]
        piece = laws.first[k] + pieces[crossed]
        pieces[crossed] += 1 if log.upward[i] else -1
        jump = laws.damping[laws.first[k] + pieces[crossed]] - laws.damping[piece]
        if jump != 0.0:
            if log.upward[i]:
                corner_shift = 0.5 * (above.upper[piece] - below.upper[piece])
            else:
                corner_shift = 0.5 * (above.lower[piece] - below.lower[piece])
            rows = rates.deflection[crossed], rates.deflection_shift[crossed]
            cross(common, k, jump, corner_shift, rows[0], rows[1], carried)
    if asked[0][0] >= 0:
        _write_approach(laws, common.clearances, regions, rates, increment, course, asked[0], asked[1])


@strict_entry
def differentiate(workspace, cases, buffers, regions, march, samples, log, cursor, out):
    """Write the end of a motion that was marched there, and its derivatives.

    Parameters
    ----------
    workspace
        see ``located``.
    cases, buffers, cursor
        of ``many``; the ``NEIGHBOURS`` variants before the present one are its neighbours.
    regions, march, samples, log
        see ``packed``.
    out
        ``Map``.
    """
    v, frame, scales, slots = cursor[AT], cases.frame, buffers.scales, cursor[SLOTS]
    r, n = frame.elements.size, cases.angle.shape[1]
    states, inputs = r + n, scales.inputs.size
    size, clearances = states + 2 * inputs - 1, frame.clearances.size
    rates = Rates(
        np.empty((slots, size, size)),
        np.empty((slots, states, size)),
        np.empty((clearances, size)),
        np.empty((clearances, size)),
    )
    _write_rates(workspace, cases, scales, regions, v, rates)
    columns, z = np.eye(states, states + 1), np.zeros(size)
    room, z_room = np.empty((2, states, states + 1)), np.empty((2, size))
    carried = Carried(columns, z, room[0], z_room[0], room[1], z_room[1])
    scale = np.empty(states)
    for i in range(states):
        scale[i] = scales.deflection[i] if i < r else scales.velocity[i - r]
        z[i] = scale[i] * (buffers.deflection[i] if i < r else cases.velocity[v, i - r])
    for h in range(inputs):
        z[states + h] = scales.inputs[h]
    neighbours = numbers_of(cases.numbers, v - NEIGHBOURS).laws, numbers_of(cases.numbers, v - 1).laws
    end = float(samples.first) / samples.per_cycle
    asked = out.corner, out.approach
    _follow(workspace, neighbours, regions, rates, log, march.counts[EVENTS], buffers.initial, end, carried, asked)
    last = samples.states[samples.states.shape[0] - 1]
    for i in range(states):
        out.end[i], out.slope[i] = last[i] / scale[i], columns[i, states] / scale[i]
        for j in range(states):
            out.gradient[i, j] = columns[i, j] / scale[i] * scale[j]
    for i in range(frame.references.size):
        out.turned[i] = last[states + i] - cases.angle[v, frame.references[i]]
