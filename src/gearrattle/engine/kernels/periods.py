"""The end of a motion over whole periods, and its derivatives: to the state at the start, and to a parameter.

Time is counted in periods. Inside a region the states x and the inputs u, which are oscillators, obey

    z' = Z(p) z,    z = (x, u),    Z = [[A, G], [0, W]]

and W does not depend on the parameter p. Perturbations of the start are carried by A alone. The derivative s = dx/dp
for a fixed start obeys s' = A s + B z with B = d[A, G]/dp, so that over an interval h

    s(h) = exp(A h) s(0) + D(h) z(0),    exp([[A, B], [0, Z]] h) = [[exp(A h), D(h)], [0, exp(Z h)]]

D is the derivative of the exponential in the direction of B. It is made by the same doublings as the exponential:
D(2 h) = exp(A h) D(h) + D(h) exp(Z h). Where a crossing changes the damping, every perturbation kicks the velocities in
proportion to how it moves the deflection (``system.perturbation_growth``); so does p, which moves the corner as well.

A, G and corners are closed forms of p. Their derivatives are central differences of these, not of motions: two
variants beside the one that is marched are laid out in its scales.

If asked, one touch or all turning points are found too (``course``).

Arrays: ``located`` (workspace), ``packed`` (regions, march, samples, log), ``variants``.

N. J. Higham, Functions of Matrices, SIAM 2008, section 3.2 and theorem 3.6.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, loose, strict, strict_entry
from gearrattle.engine.kernels.arrays import Array3, Array4, IntMatrix, IntVector, Matrix, Vector
from gearrattle.engine.kernels.course import (
    Direction,
    Driven,
    Path,
    Touched,
    Trace,
    write_course,
    write_direction,
    write_outside,
    write_touch,
)
from gearrattle.engine.kernels.memory_addresses import common_at, laws_at, region_at
from gearrattle.engine.kernels.motion_levels import norm_of_square
from gearrattle.engine.kernels.packed import EVENTS
from gearrattle.engine.kernels.region_rates import accelerate
from gearrattle.engine.kernels.variant_common import lay_out
from gearrattle.engine.kernels.variants_march import AT, SLOTS, numbers_of
from gearrattle.engine.kernels.workspace import PERIOD

NEIGHBOURS = 2
"""Variants before the one that is marched: the same with a smaller, and with a larger parameter."""
NO_TURNS = -1
ALONG_ROW = 0
ALONG_CHANGE = 1
"""Turning points that are asked for: none, of a motion that repeats, of a part of one.

Slopes of the second are along the change that keeps the gap, and of which the product with a row over the state at the
start [SI] and the parameter is 1. Slopes of the third are along the change of both that is told.
"""
_TERMS = 7  # of the Taylor series over the finest step
_WIDEST = 1.0 / 64.0  # norm of the rates times the finest step: the first term left out is below 1e-16
_LEVELS = 60


class Map(NamedTuple):
    """A motion over n periods; N states."""

    end: Vector  # (N,) state at the end [SI]
    turned: Vector  # (R,) how far the reference inertia of every free train has turned [rad]
    gradient: Matrix  # (N, N) of the end with respect to the start [SI]
    slope: Vector  # (N,) of the end with respect to the parameter [SI], times half the distance of both neighbours
    corner: IntVector  # (2,) clearance whose approach to a corner is asked for (-1: none), and 1 for the upper corner
    touched: Touched  # that approach
    row: Vector  # (N + 1,) the direction of slopes: see ALONG_ROW and ALONG_CHANGE
    turns: Matrix  # (MOST_TURNS, COLUMNS) all turning points
    turning: IntVector  # (1,) NO_TURNS, ALONG_ROW or ALONG_CHANGE; then how many there are, NO_TURNS: not known
    delay: Vector  # (MOST_TURNS,) by how much crossings come later along the direction of the turning points [periods]
    outside: IntMatrix  # (2, K) of ``Path``; read along a change, written along a row
    reach: Vector  # (K,) to a corner of every clearance: turning points farther away are left out


class Rates(NamedTuple):
    """Rates of the states and of their derivatives, for the S slots that a motion visits; P entries of z, K clearances.

    A *shift* is a derivative with respect to the parameter, times half the distance of both neighbours.
    """

    generator: Array3  # (S, P, P) Z
    shift: Array3  # (S, N, P) B
    deflection: Matrix  # (K, P) of the clearances
    deflection_shift: Matrix  # (K, P)
    lower_shift: Vector  # of every piece
    upper_shift: Vector


class Steps(NamedTuple):
    """Tables of all slots: increments over the steps h = 1, 1/2, 1/4 ..., of which a slot has a range."""

    increment: Array4  # (S, levels, P, P) exp(Z h) - 1
    moved: Array4  # (S, levels, N, P) D(h)
    levels: IntVector  # (S,) the finest step of a slot is that of its last level
    first: IntVector  # (S,) its longest step


class Laid(NamedTuple):
    """A driveline as it is laid out."""

    common: Any  # see ``located``
    laws: Any
    regions: Any  # see ``packed``


class Marched(NamedTuple):
    """A motion that was marched."""

    log: Any  # see ``packed``
    events: int  # crossings
    initial: IntVector  # (K,) pieces of the clearances at its start
    end: float  # in periods


class Carried(NamedTuple):
    """Perturbations and state carried along a motion, and scratch for products."""

    columns: Matrix  # (N, N + 1) perturbations of the start, balanced; the last column is s
    z: Vector  # (P,)
    columns_term: Matrix
    z_term: Vector
    columns_product: Matrix
    z_product: Vector


@loose
def dot(matrix, i, z):
    """Product of a row and a vector."""
    total = 0.0
    for j in range(z.size):
        total += matrix[i, j] * z[j]
    return total


@strict
def _double(half, half_moved, states, increment, moved):
    """Write the tables of a step from those of half of it, or add their products to what stands there."""
    size = half.shape[1]
    pairs = (size - states - 1) // 2
    for i in range(states):
        # products of the states' rows with those of the states: E E, and E D + D E
        row = increment[i]
        moved_row = moved[i]
        for j in range(states):
            weight = half[i, j]
            moved_weight = half_moved[i, j]
            other = half[j]
            other_moved = half_moved[j]
            for p in range(size):
                row[p] += weight * other[p]
                moved_row[p] += weight * other_moved[p] + moved_weight * other[p]
        # products with the oscillators' own blocks
        for c in range(states + 1, states + 1 + pairs):
            s = c + pairs
            row[c] += half[i, c] * half[c, c] + half[i, s] * half[s, c]
            row[s] += half[i, c] * half[c, s] + half[i, s] * half[s, s]
            moved_row[c] += half_moved[i, c] * half[c, c] + half_moved[i, s] * half[s, c]
            moved_row[s] += half_moved[i, c] * half[c, s] + half_moved[i, s] * half[s, s]


@strict
def _write_tables(generator, shift, steps, slot):
    """Write the tables of a slot: Taylor series over the finest step, then doublings.

    The inputs are oscillators: their own rows are turned exactly.
    """
    # room for the terms of the series
    size = generator.shape[0]
    states = shift.shape[0]
    pairs = (size - states - 1) // 2
    finest = steps.levels[slot] - 1
    h = 0.5**finest
    term = np.zeros((2, size, size))
    moved_term = np.zeros((2, states, size))
    # the inputs' rows: turned exactly
    for level in range(steps.first[slot], finest + 1):
        increment = steps.increment[slot, level]
        moved = steps.moved[slot, level]
        for i in range(size):
            for j in range(size):
                increment[i, j] = 0.0
        for i in range(states):
            for j in range(size):
                moved[i, j] = 0.0
        for c in range(states + 1, states + 1 + pairs):
            angle = generator[c + pairs, c] * 0.5**level
            turned = np.sin(angle)
            half = np.sin(0.5 * angle)
            increment[c, c] = -2.0 * half * half
            increment[c + pairs, c + pairs] = increment[c, c]
            increment[c + pairs, c] = turned
            increment[c, c + pairs] = -turned
    # Taylor series over the finest step, of the exponential and of its derivative D
    increment = steps.increment[slot, finest]
    moved = steps.moved[slot, finest]
    for i in range(size):
        for j in range(size):
            term[0, i, j] = h * generator[i, j]
            if i < states:
                increment[i, j] = term[0, i, j]
                moved[i, j] = h * shift[i, j]
                moved_term[0, i, j] = moved[i, j]
    for m in range(2, _TERMS + 1):
        now = m % 2
        then = 1 - m % 2
        _multiply_term(generator, shift, h / m, (term[now], moved_term[now]), (term[then], moved_term[then]))
        for i in range(states):
            for j in range(size):
                increment[i, j] += term[then, i, j]
                moved[i, j] += moved_term[then, i, j]
    # double: E(2 h) = 2 E(h) + E(h) E(h), D(2 h) = exp(A h) D(h) + D(h) exp(Z h)
    for level in range(finest - 1, steps.first[slot] - 1, -1):
        half = steps.increment[slot, level + 1]
        half_moved = steps.moved[slot, level + 1]
        increment = steps.increment[slot, level]
        moved = steps.moved[slot, level]
        for i in range(states):
            for j in range(size):
                increment[i, j] = 2.0 * half[i, j]
                moved[i, j] = 2.0 * half_moved[i, j]
        _double(half, half_moved, states, increment, moved)


@strict
def _multiply_term(generator, shift, factor, terms, products):
    """Write the next term of both series, of the states' rows alone: factor [A, B] times the last one."""
    (term, moved_term) = terms
    (product, moved_product) = products
    states, size = shift.shape
    # rows of the states
    for i in range(states):
        row = product[i]
        moved_row = moved_product[i]
        for p in range(size):
            row[p] = 0.0
            moved_row[p] = 0.0
        for j in range(states):
            weight = factor * generator[i, j]
            moved_weight = factor * shift[i, j]
            other = term[j]
            other_moved = moved_term[j]
            for p in range(size):
                row[p] += weight * other[p]
                moved_row[p] += weight * other_moved[p] + moved_weight * other[p]
        for j in range(states, size):
            weight = factor * generator[i, j]
            moved_weight = factor * shift[i, j]
            for p in range(states, size):
                row[p] += weight * term[j, p]
                moved_row[p] += moved_weight * term[j, p]
    # rows of the inputs
    for i in range(states, size):
        for p in range(states, size):
            total = 0.0
            for j in range(states, size):
                total += generator[i, j] * term[j, p]
            product[i, p] = factor * total


@kernel
def multiply(rates, shift, columns, z, carried):
    """Write the products of both kinds of rates with columns and z; those of the inputs are not zero in two places."""
    states, size = shift.shape
    product = carried.columns_product
    z_product = carried.z_product
    # the states and their perturbations; the last column is pushed by the shift of the rates
    for i in range(states):
        row = product[i]
        for p in range(states + 1):
            row[p] = 0.0
        for j in range(states):
            weight = rates[i, j]
            other = columns[j]
            for p in range(states + 1):
                row[p] += weight * other[p]
        row[states] += dot(shift, i, z)
        z_product[i] = dot(rates, i, z)
    # the inputs, oscillators
    pairs = (size - states - 1) // 2
    z_product[states] = 0.0
    for cosine in range(states + 1, states + 1 + pairs):
        sine = cosine + pairs
        z_product[cosine] = rates[cosine, cosine] * z[cosine] + rates[cosine, sine] * z[sine]
        z_product[sine] = rates[sine, cosine] * z[cosine] + rates[sine, sine] * z[sine]


@kernel
def step(increment, moved, carried):
    """Carry over one step of a table."""
    columns = carried.columns
    z = carried.z
    multiply(increment, moved, columns, z, carried)
    for i in range(columns.shape[0]):
        for p in range(columns.shape[1]):
            columns[i, p] += carried.columns_product[i, p]
    for i in range(z.size):
        z[i] += carried.z_product[i]


@kernel
def add_series(generator, shift, h, carried):
    """Carry over h shorter than the finest step, by Taylor series."""
    columns = carried.columns
    z = carried.z
    term = carried.columns_term
    z_term = carried.z_term
    for i in range(columns.shape[0]):
        for p in range(columns.shape[1]):
            term[i, p] = columns[i, p]
    for i in range(z.size):
        z_term[i] = z[i]
    for m in range(1, _TERMS + 1):
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
def carry(steps, slot, generator, shift, h, carried):
    """Carry over an interval: steps of the tables, the longest first, then a Taylor series."""
    left = h
    length = 0.5 ** steps.first[slot]
    for level in range(steps.first[slot], steps.levels[slot]):
        while left >= length:
            step(steps.increment[slot, level], steps.moved[slot, level], carried)
            left -= length
        length *= 0.5
    if left > 0.0:
        add_series(generator, shift, left, carried)


@kernel
def cross(common, k, jump, corner_shift, deflection, deflection_shift, carried):
    """Kick the velocities where the damping of element k jumps at a corner that moves with the parameter."""
    columns = carried.columns
    z = carried.z
    states = columns.shape[0]
    inertias = common.inertia.size
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
    common = common_at(workspace)
    region = region_at(workspace)
    clearances = common.clearances
    states = region.matrix.shape[0]
    size = region.matrix.shape[1]
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
    # rates of both variants beside it, then of this one
    slots, states, size = rates.shift.shape
    generators = np.empty((NEIGHBOURS, slots, states, size))
    deflections = np.empty((NEIGHBOURS, rates.deflection.shape[0], size))
    for side in range(NEIGHBOURS):
        lay_out(workspace, numbers_of(cases.numbers, v - NEIGHBOURS + side), cases.frame, scales)
        _write_rows(workspace, regions, generators[side], deflections[side])
    lay_out(workspace, numbers_of(cases.numbers, v), cases.frame, scales)
    for slot in range(slots):
        for i in range(size):
            for j in range(size):
                rates.generator[slot, i, j] = 0.0
    _write_rows(workspace, regions, rates.generator, rates.deflection)
    # the inputs' rows, and the shift B by central differences
    frequency = common_at(workspace).frequency
    for slot in range(slots):
        for h in range(frequency.size):
            cosine = states + 1 + h
            sine = states + 1 + frequency.size + h
            rates.generator[slot, cosine, sine] = -frequency[h]
            rates.generator[slot, sine, cosine] = frequency[h]
        for i in range(states):
            for j in range(size):
                rates.shift[slot, i, j] = 0.5 * (generators[1, slot, i, j] - generators[0, slot, i, j])
    # shifts of the deflections and of the corners
    for i in range(deflections.shape[1]):
        for j in range(size):
            rates.deflection_shift[i, j] = 0.5 * (deflections[1, i, j] - deflections[0, i, j])
    below = numbers_of(cases.numbers, v - NEIGHBOURS).laws
    above = numbers_of(cases.numbers, v - 1).laws
    for p in range(rates.lower_shift.size):
        rates.lower_shift[p] = 0.5 * (above.lower[p] - below.lower[p])
        rates.upper_shift[p] = 0.5 * (above.upper[p] - below.upper[p])


@strict
def _write_levels(common, rates, path, steps):
    """Write the range of steps of every slot: from its longest interval to a step of which a Taylor series is exact."""
    slots, states, _ = rates.shift.shape
    widest = 0.0
    # the fastest input
    for h in range(common.frequency.size):
        widest = max(widest, common.frequency[h])
    for slot in range(slots):
        # each slot: the norm of its rates, and its longest interval
        norm = max(widest, norm_of_square(rates.generator[slot], states))
        longest = 0.0
        for i in range(path.slot.size):
            if path.slot[i] == slot:
                longest = max(longest, path.time[i + 1] - path.time[i])
        # from the longest step within that interval down to one over which a Taylor series is exact
        levels = 1
        first = 0
        while norm * 0.5 ** (levels - 1) > _WIDEST and levels < _LEVELS:
            levels += 1
        while first < levels - 1 and 0.5**first > longest:
            first += 1
        steps.levels[slot] = levels
        steps.first[slot] = first


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


@strict
def _write_path(laid, rates, marched, path):
    """Write the intervals of a motion with their slots, and its crossings: corners of laws alone."""
    common, laws, regions = laid
    log = marched.log
    events = marched.events
    pieces = marched.initial.copy()
    slots = rates.shift.shape[0]
    path.time[0] = 0.0
    for i in range(events + 1):
        # each interval: its region, its end, and the corners around the pieces
        path.slot[i] = slot_of(regions, slots, pieces)
        path.time[i + 1] = log.cycle[i] + log.fraction[i] if i < events else marched.end
        for k in range(pieces.size):
            piece = laws.first[common.clearances[k]] + pieces[k]
            path.lower[i, k] = laws.lower[piece]
            path.upper[i, k] = laws.upper[piece]
            path.lower_shift[i, k] = rates.lower_shift[piece]
            path.upper_shift[i, k] = rates.upper_shift[piece]
        # the crossing at its end: what is watched, how the corner moves, and the next pieces
        if i < events:
            crossed = log.clearance[i]
            path.clearance[i] = crossed
            path.upward[i] = log.upward[i]
            path.is_law[i] = 1
            path.tick[i] = np.nan
            path.bound_shift[i] = path.upper_shift[i, crossed] if log.upward[i] else path.lower_shift[i, crossed]
            for j in range(path.row.shape[1]):
                path.row[i, j] = rates.deflection[crossed, j]
                path.row_shift[i, j] = rates.deflection_shift[crossed, j]
            pieces[crossed] += 1 if log.upward[i] else -1


@kernel
def _room_path(events, clearances, size, outside):
    integers = np.empty((4, events + 1), np.int64)
    numbers = np.empty((2, events))
    corners = np.empty((4, events + 1, clearances))
    rows = np.empty((2, events, size))
    return Path(
        np.empty(events + 2),
        integers[0],
        corners[0],
        corners[1],
        corners[2],
        corners[3],
        np.empty((events + 1, 0)),
        np.empty((events + 1, 0)),
        integers[1, :events],
        integers[2, :events],
        rows[0],
        rows[1],
        numbers[0],
        numbers[1],
        integers[3, :events],
        outside,
    )


@strict
def _write_turns(driven, path, z, columns, scale, trace, out):
    """Write the turning points along the direction that is asked for; none are known if there is no such direction."""
    states = scale.size
    direction = Direction(np.empty((states + 1, states + 1)), np.empty(states + 1, np.int64), np.empty(states + 1))
    if out.turning[0] == ALONG_ROW:
        write_outside(path.clearance, path.upward, np.zeros(2, np.int64), path.outside)
        if not write_direction(columns, scale, out.row, 0, direction):
            out.turning[0] = NO_TURNS
            return
    else:
        for i in range(states):
            direction.change[i] = scale[i] * out.row[i]
        direction.change[states] = out.row[states]
    write_course(driven, path, z, direction.change, trace)
    for i in range(min(trace.delay.size, out.delay.size)):
        out.delay[i] = trace.delay[i]


@strict
def _follow(laid, rates, marched, carried, scale, out):
    """Carry perturbations and s along a motion, and write the turning points that are asked for."""
    # the path of the motion, and the tables of its slots
    common, laws, regions = laid
    events = marched.events
    slots, states, size = rates.shift.shape
    path = _room_path(events, common.clearances.size, size, out.outside)
    _write_path(laid, rates, marched, path)
    ranges = np.empty(slots, np.int64), np.empty(slots, np.int64)
    steps = Steps(np.empty((slots, 0, size, size)), np.empty((slots, 0, states, size)), ranges[0], ranges[1])
    _write_levels(common, rates, path, steps)
    levels = ranges[0].max()
    is_written = np.zeros(slots, np.bool_)
    steps = Steps(np.empty((slots, levels, size, size)), np.empty((slots, levels, states, size)), ranges[0], ranges[1])
    begin = carried.z.copy()
    for i in range(events + 1):  # perturbations of the whole state, and s: by tables
        slot = path.slot[i]
        generator = rates.generator[slot]
        shift = rates.shift[slot]
        if not is_written[slot]:
            _write_tables(generator, shift, steps, slot)
            is_written[slot] = True
        carry(steps, slot, generator, shift, path.time[i + 1] - path.time[i], carried)
        if i < events:
            crossed = path.clearance[i]
            element = common.clearances[crossed]
            before = laws.first[element] + regions.piece[slot, crossed]
            beyond = laws.first[element] + regions.piece[path.slot[i + 1], crossed]
            # a crossing kicks the velocities where the damping jumps
            jump = laws.damping[beyond] - laws.damping[before]
            if jump != 0.0:
                rows = rates.deflection[crossed], rates.deflection_shift[crossed]
                cross(common, element, jump, path.bound_shift[i], rows[0], rows[1], carried)
    if out.corner[0] >= 0 or out.turning[0] != NO_TURNS:  # one perturbation, with series of deflections
        driven = Driven(rates.generator, rates.shift, rates.deflection, rates.deflection_shift)
        trace = Trace(
            np.empty((events + 2, size)),
            np.empty((events + 2, states)),
            np.empty(events),
            np.empty((events, states)),
            out.reach,
            out.turns,
            np.zeros(1, np.int64),
        )
        if out.corner[0] >= 0:
            none = Trace(trace.z, trace.v, trace.delay, trace.jump, out.reach, out.turns[:0], trace.number)
            write_touch(driven, path, begin, out.corner, scale, none, out.touched)
        if out.turning[0] != NO_TURNS:
            _write_turns(driven, path, begin, carried.columns, scale, trace, out)
            if out.turning[0] != NO_TURNS:
                out.turning[0] = trace.number[0]


@strict_entry
def differentiate(workspace, cases, buffers, regions, march, samples, log, cursor, out):
    """Write the end of a motion that was marched there, and its derivatives.

    cases, buffers, cursor: of ``many``; the ``NEIGHBOURS`` variants before the present one are its neighbours.
    out: ``Map``.
    """
    # sizes
    v = cursor[AT]
    frame = cases.frame
    scales = buffers.scales
    slots = cursor[SLOTS]
    r = frame.elements.size
    n = cases.angle.shape[1]
    states = r + n
    inputs = scales.inputs.size
    size = states + 2 * inputs - 1
    clearances = frame.clearances.size
    # rates of the variant and their shifts
    rates = Rates(
        np.empty((slots, size, size)),
        np.empty((slots, states, size)),
        np.empty((clearances, size)),
        np.empty((clearances, size)),
        np.empty(cases.numbers.laws.lower.shape[1]),
        np.empty(cases.numbers.laws.lower.shape[1]),
    )
    _write_rates(workspace, cases, scales, regions, v, rates)
    # the start: perturbations of every state, none of the parameter, and the state itself
    columns = np.eye(states, states + 1)
    z = np.zeros(size)
    room = np.empty((2, states, states + 1))
    z_room = np.empty((2, size))
    carried = Carried(columns, z, room[0], z_room[0], room[1], z_room[1])
    scale = np.empty(states)
    for i in range(states):
        scale[i] = scales.deflection[i] if i < r else scales.velocity[i - r]
        z[i] = scale[i] * (buffers.deflection[i] if i < r else cases.velocity[v, i - r])
    for h in range(inputs):
        z[states + h] = scales.inputs[h]
    # carry them along the motion
    marched = Marched(log, march.counts[EVENTS], buffers.initial, float(samples.first) / samples.per_cycle)
    laid = Laid(common_at(workspace), laws_at(workspace), regions)
    _follow(laid, rates, marched, carried, scale, out)
    # the end and its derivatives in SI units
    last = samples.states[samples.states.shape[0] - 1]
    for i in range(states):
        out.end[i] = last[i] / scale[i]
        out.slope[i] = columns[i, states] / scale[i]
        for j in range(states):
            out.gradient[i, j] = columns[i, j] / scale[i] * scale[j]
    for i in range(frame.references.size):
        out.turned[i] = last[states + i] - cases.angle[v, frame.references[i]]
