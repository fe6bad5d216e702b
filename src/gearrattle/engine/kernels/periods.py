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

If asked, one touch (``approaches``) or all turning points (``turning_points``) are found too.

Arrays: ``located`` (workspace), ``packed`` (regions, march, samples, log), ``variants``.

N. J. Higham, Functions of Matrices, SIAM 2008, section 3.2 and theorem 3.6.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, strict, strict_entry
from gearrattle.engine.kernels.approaches import (
    TERMS,
    Course,
    Crossings,
    Rates,
    Steps,
    dot,
    write_approach,
)
from gearrattle.engine.kernels.arrays import IntMatrix, IntVector, Matrix, Vector
from gearrattle.engine.kernels.laid_out import lay_out
from gearrattle.engine.kernels.levels import norm_of_square
from gearrattle.engine.kernels.located import common_at, laws_at, region_at
from gearrattle.engine.kernels.many import AT, SLOTS, numbers_of
from gearrattle.engine.kernels.packed import EVENTS
from gearrattle.engine.kernels.region import accelerate
from gearrattle.engine.kernels.turning_points import Direction, write_direction, write_outside, write_turns
from gearrattle.engine.kernels.workspace import PERIOD

NEIGHBOURS = 2
"""Variants before the one that is marched: the same with a smaller, and with a larger parameter."""
NO_TURNS, ALONG_ROW, ALONG_CHANGE = -1, 0, 1
"""Turning points that are asked for: none, of a motion that repeats, of a part of one.

Slopes of the second are along the change that keeps the gap, and of which the product with a row over the state at the
start [SI] and the parameter is 1. Slopes of the third are along the change of both that is told.
"""
_WIDEST = 1.0 / 64.0  # norm of the rates times the finest step: the first term left out is below 1e-16
_LEVELS = 60


class Map(NamedTuple):
    """A motion over n periods; N states."""

    end: Vector  # (N,) state at the end [SI]
    turned: Vector  # (R,) how far the reference inertia of every free train has turned [rad]
    gradient: Matrix  # (N, N) of the end with respect to the start [SI]
    slope: Vector  # (N,) of the end with respect to the parameter [SI], times half the distance of both neighbours
    corner: IntVector  # (2,) clearance whose approach to a corner is asked for (-1: none), and 1 for the upper corner
    approach: Vector  # (8 + 2 N,) an instant nearby [periods]; what ``approaches`` writes; depth NaN: there is none
    row: Vector  # (N + 1,) the direction of slopes: see ALONG_ROW and ALONG_CHANGE
    turns: Matrix  # (MOST_TURNS, TURN_COLUMNS) all turning points
    turning: IntVector  # (1,) NO_TURNS, ALONG_ROW or ALONG_CHANGE; then how many there are, NO_TURNS: not known
    delay: Vector  # (MOST_TURNS,) by how much crossings come later along the direction of the turning points [periods]
    outside: IntMatrix  # (2, K) of ``Crossings``; read along a change, written along a row
    reach: Vector  # (K,) to a corner of every clearance: turning points farther away are left out


class Carried(NamedTuple):
    """What is carried along a motion, and room for products."""

    columns: Matrix  # (N, N + 1) perturbations of the start, balanced; the last column is s
    z: Vector  # (P,)
    columns_term: Matrix
    z_term: Vector
    columns_product: Matrix
    z_product: Vector


@strict
def _double(half, half_moved, states, increment, moved):
    """Write the tables of a step from those of half of it, or add their products to what stands there."""
    size = half.shape[1]
    pairs = (size - states - 1) // 2
    for i in range(states):
        row, moved_row = increment[i], moved[i]
        for j in range(states):
            weight, moved_weight = half[i, j], half_moved[i, j]
            other, other_moved = half[j], half_moved[j]
            for p in range(size):
                row[p] += weight * other[p]
                moved_row[p] += weight * other_moved[p] + moved_weight * other[p]
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
    size, states = generator.shape[0], shift.shape[0]
    pairs, finest = (size - states - 1) // 2, steps.levels[slot] - 1
    h = 0.5**finest
    term, moved_term = np.zeros((2, size, size)), np.zeros((2, states, size))
    for level in range(steps.first[slot], finest + 1):
        increment, moved = steps.increment[slot, level], steps.moved[slot, level]
        for i in range(size):
            for j in range(size):
                increment[i, j] = 0.0
        for i in range(states):
            for j in range(size):
                moved[i, j] = 0.0
        for c in range(states + 1, states + 1 + pairs):
            angle = generator[c + pairs, c] * 0.5**level
            turned, half = np.sin(angle), np.sin(0.5 * angle)
            increment[c, c] = increment[c + pairs, c + pairs] = -2.0 * half * half
            increment[c + pairs, c], increment[c, c + pairs] = turned, -turned
    increment, moved = steps.increment[slot, finest], steps.moved[slot, finest]
    for i in range(size):
        for j in range(size):
            term[0, i, j] = h * generator[i, j]
            if i < states:
                increment[i, j] = term[0, i, j]
                moved[i, j] = moved_term[0, i, j] = h * shift[i, j]
    for m in range(2, TERMS + 1):
        now, then = m % 2, 1 - m % 2
        _multiply_term(generator, shift, h / m, (term[now], moved_term[now]), (term[then], moved_term[then]))
        for i in range(states):
            for j in range(size):
                increment[i, j] += term[then, i, j]
                moved[i, j] += moved_term[then, i, j]
    for level in range(finest - 1, steps.first[slot] - 1, -1):
        half, half_moved = steps.increment[slot, level + 1], steps.moved[slot, level + 1]
        increment, moved = steps.increment[slot, level], steps.moved[slot, level]
        for i in range(states):
            for j in range(size):
                increment[i, j] = 2.0 * half[i, j]
                moved[i, j] = 2.0 * half_moved[i, j]
        _double(half, half_moved, states, increment, moved)


@strict
def _multiply_term(generator, shift, factor, terms, products):
    """Write the next term of both series, of the states' rows alone: factor [A, B] times the last one."""
    (term, moved_term), (product, moved_product) = terms, products
    states, size = shift.shape
    for i in range(states):
        row, moved_row = product[i], moved_product[i]
        for p in range(size):
            row[p] = moved_row[p] = 0.0
        for j in range(states):
            weight, moved_weight = factor * generator[i, j], factor * shift[i, j]
            other, other_moved = term[j], moved_term[j]
            for p in range(size):
                row[p] += weight * other[p]
                moved_row[p] += weight * other_moved[p] + moved_weight * other[p]
        for j in range(states, size):
            weight, moved_weight = factor * generator[i, j], factor * shift[i, j]
            for p in range(states, size):
                row[p] += weight * term[j, p]
                moved_row[p] += moved_weight * term[j, p]
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
    product, z_product = carried.columns_product, carried.z_product
    for i in range(states):
        row = product[i]
        for p in range(states + 1):
            row[p] = 0.0
        for j in range(states):
            weight, other = rates[i, j], columns[j]
            for p in range(states + 1):
                row[p] += weight * other[p]
        row[states] += dot(shift, i, z)
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
    for i in range(columns.shape[0]):
        for p in range(columns.shape[1]):
            term[i, p] = columns[i, p]
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
def carry(steps, slot, generator, shift, h, carried):
    """Carry over an interval: steps of the tables, the longest first, then a Taylor series."""
    left, length = h, 0.5 ** steps.first[slot]
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
        for i in range(size):
            for j in range(size):
                rates.generator[slot, i, j] = 0.0
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
    below, above = numbers_of(cases.numbers, v - NEIGHBOURS).laws, numbers_of(cases.numbers, v - 1).laws
    for p in range(rates.lower_shift.size):
        rates.lower_shift[p] = 0.5 * (above.lower[p] - below.lower[p])
        rates.upper_shift[p] = 0.5 * (above.upper[p] - below.upper[p])


@strict
def _write_levels(common, rates, course, steps):
    """Write the range of steps of every slot: from its longest interval to a step of which a Taylor series is exact."""
    slots, states, _ = rates.shift.shape
    widest = 0.0
    for h in range(common.frequency.size):
        widest = max(widest, common.frequency[h])
    for slot in range(slots):
        norm, longest = max(widest, norm_of_square(rates.generator[slot], states)), 0.0
        for i in range(course.slot.size):
            if course.slot[i] == slot:
                longest = max(longest, course.time[i + 1] - course.time[i])
        levels, first = 1, 0
        while norm * 0.5 ** (levels - 1) > _WIDEST and levels < _LEVELS:
            levels += 1
        while first < levels - 1 and 0.5**first > longest:
            first += 1
        steps.levels[slot], steps.first[slot] = levels, first


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
def _write_course(common, laws, regions, rates, log, initial, end, course, crossings):
    """Write when a motion is in which slot, and what it crosses."""
    pieces, events, slots = initial.copy(), crossings.clearance.size, rates.shift.shape[0]
    course.time[0] = 0.0
    for i in range(events + 1):
        course.slot[i] = slot_of(regions, slots, pieces)
        course.time[i + 1] = log.cycle[i] + log.fraction[i] if i < events else end
        if i < events:
            crossed = log.clearance[i]
            piece = laws.first[common.clearances[crossed]] + pieces[crossed]
            beyond = piece + 1 if log.upward[i] else piece - 1
            pieces[crossed] += beyond - piece
            crossings.clearance[i], crossings.upward[i] = crossed, log.upward[i]
            crossings.jump[i] = laws.damping[beyond] - laws.damping[piece]
            crossings.shift[i] = rates.upper_shift[piece] if log.upward[i] else rates.lower_shift[piece]


@strict
def _write_turns(common, laws, regions, rates, steps, course, crossings, columns, scale, out):
    """Write the turning points along the direction that is asked for; none are known if there is no such direction."""
    states = scale.size
    direction = Direction(np.empty((states + 1, states + 1)), np.empty(states + 1, np.int64), np.empty(states + 1))
    change = direction.change
    if out.turning[0] == ALONG_ROW:
        write_outside(crossings.clearance, crossings.upward, np.zeros(2, np.int64), crossings.outside)
        if not write_direction(columns, scale, out.row, direction):
            out.turning[0] = NO_TURNS
            return
    else:
        for i in range(states):
            change[i] = scale[i] * out.row[i]
        change[states] = out.row[states]
    clearances, reach, turns = common.clearances, out.reach, out.turns
    write_turns(laws, clearances, regions, rates, steps, course, crossings, change, reach, turns, out.turning)


@strict
def _follow(common, laws, regions, rates, log, events, initial, end, carried, scale, out):
    """Carry perturbations and s along a motion of so many crossings that ends after ``end`` periods."""
    slots, states, size = rates.shift.shape
    course = Course(
        np.empty(events + 2),
        np.empty(events + 1, np.int64),
        np.empty((events + 2, size)),
        np.empty((events + 1, states, states + 1)),
    )
    integers, numbers = np.empty((2, events), np.int64), np.empty((2, events))
    delay = out.delay[:events] if events <= out.delay.size else np.empty(events)
    crossings = Crossings(integers[0], integers[1], numbers[0], numbers[1], delay, out.outside)
    _write_course(common, laws, regions, rates, log, initial, end, course, crossings)
    ranges = np.empty(slots, np.int64), np.empty(slots, np.int64)
    steps = Steps(np.empty((slots, 0, size, size)), np.empty((slots, 0, states, size)), ranges[0], ranges[1])
    _write_levels(common, rates, course, steps)
    levels, is_written = ranges[0].max(), np.zeros(slots, np.bool_)
    steps = Steps(np.empty((slots, levels, size, size)), np.empty((slots, levels, states, size)), ranges[0], ranges[1])
    for i in range(events + 1):
        slot = course.slot[i]
        for j in range(size):
            course.z[i, j] = carried.z[j]
        for j in range(states):
            for p in range(states + 1):
                course.columns[i, j, p] = carried.columns[j, p]
        generator, shift = rates.generator[slot], rates.shift[slot]
        if not is_written[slot]:
            _write_tables(generator, shift, steps, slot)
            is_written[slot] = True
        carry(steps, slot, generator, shift, course.time[i + 1] - course.time[i], carried)
        if i < events and crossings.jump[i] != 0.0:
            crossed = crossings.clearance[i]
            rows = rates.deflection[crossed], rates.deflection_shift[crossed]
            cross(common, common.clearances[crossed], crossings.jump[i], crossings.shift[i], rows[0], rows[1], carried)
    for j in range(size):
        course.z[events + 1, j] = carried.z[j]
    if out.corner[0] >= 0:
        write_approach(common, laws, regions, rates, steps, course, crossings, out.corner, scale, out.approach)
    if out.turning[0] != NO_TURNS:
        _write_turns(common, laws, regions, rates, steps, course, crossings, carried.columns, scale, out)


@strict_entry
def differentiate(workspace, cases, buffers, regions, march, samples, log, cursor, out):
    """Write the end of a motion that was marched there, and its derivatives.

    cases, buffers, cursor: of ``many``; the ``NEIGHBOURS`` variants before the present one are its neighbours.
    out: ``Map``.
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
        np.empty(cases.numbers.laws.lower.shape[1]),
        np.empty(cases.numbers.laws.lower.shape[1]),
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
    end, common, laws = float(samples.first) / samples.per_cycle, common_at(workspace), laws_at(workspace)
    _follow(common, laws, regions, rates, log, march.counts[EVENTS], buffers.initial, end, carried, scale, out)
    last = samples.states[samples.states.shape[0] - 1]
    for i in range(states):
        out.end[i], out.slope[i] = last[i] / scale[i], columns[i, states] / scale[i]
        for j in range(states):
            out.gradient[i, j] = columns[i, j] / scale[i] * scale[j]
    for i in range(frame.references.size):
        out.turned[i] = last[states + i] - cases.angle[v, frame.references[i]]
