"""One touch of a motion: the turning point of a deflection near an instant, how far beyond a corner, how that moves.

The *depth* of a turning point is how far it lies beyond a corner, in the direction in which the deflection moves before
it: negative where the corner is not reached. With d = w z the deflection of a clearance and c the corner, the depth is
stationary over time, so its derivative with respect to the state at the start and to the parameter p is that of w z - c
at a fixed instant. The instant itself moves by that of the rate w Z z, over the second derivative of w z, with the
opposite sign.

Both derivatives are wanted by the whole state. A row over (s, z), s = dx/dp, is carried backwards over the interval
from the crossing before:

    [r_s, r_z] -> [r_s exp(A h), r_s D(h) + r_z exp(Z h)]            (``periods``)

and meets the perturbations that were carried to that crossing. All turning points, along one direction, are found by
``turning_points``.

At a grazing the corner would be passed for a short time tau, in which the rates gain, the saltations on the way in and
out included,

    B = -(k u + c A u) w,      u = J^-1 w in the velocities,

k and c what stiffness and damping gain there. So the trace of the gradient over the whole motion gains
-w C (k u + c A u) tau, C the gradient over one motion from the touch on.

Arrays: ``packed`` (regions, log), ``periods`` (rates, course).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, loose, strict
from gearrattle.engine.kernels.arrays import Array3, Array4, IntMatrix, IntVector, Matrix, Vector
from gearrattle.engine.kernels.workspace import PERIOD

TERMS = 7
"""Of the Taylor series over the finest step."""
NEAR = 1.0 / 64.0
"""Periods that an extremum may move in one step of Newton's method."""
FARTHEST = 1.0 / 16.0
"""Periods from an instant within which its extremum lies."""
_ITERATIONS, _SETTLED = 30, 1e-11  # of Newton's method in time; a step after which the depth is exact, in periods
TIME, DEPTH, BEND, GAIN, STIFFNESS, DAMPING, SLOPE = range(7)
"""Entries of ``Map.approach``; from SLOPE on the derivatives of the depth: (N,) by the state at the start, and by p;
then as many of the instant."""


class Rates(NamedTuple):
    """What drives the states and their derivatives, for the S slots that a motion visits; P entries of z, K clearances.

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


class Course(NamedTuple):
    """Where a motion stands at its start, after each of its E crossings, and at its end."""

    time: Vector  # (E + 2,) in periods
    slot: IntVector  # (E + 1,) of the region from there on
    z: Matrix  # (E + 2, P)
    columns: Array3  # (E + 1, N, N + 1) perturbations of the start, and s


class Crossings(NamedTuple):
    """The E crossings of a motion."""

    clearance: IntVector
    upward: IntVector
    jump: Vector  # of the damping
    shift: Vector  # of the corner
    delay: Vector  # by how much each comes later along the direction of turning points [periods]
    outside: IntMatrix  # (2, K) 1 upwards, 0 downwards: before the start of the motion, after its end; -1: no crossing


class Room(NamedTuple):
    """Room for one turning point."""

    z: Vector  # (P,)
    term: Vector
    product: Vector
    row: Vector  # (P,)
    state_row: Vector  # (N,)
    row_term: Vector
    row_product: Vector
    state_term: Vector
    state_product: Vector


@loose
def dot(matrix, i, z):
    """Product of a row and a vector."""
    total = 0.0
    for j in range(z.size):
        total += matrix[i, j] * z[j]
    return total


@kernel
def write_products(matrix, states, z, out):
    """Write the product of rates, or of increments, and z; inputs turn in pairs."""
    for i in range(states):
        out[i] = dot(matrix, i, z)
    if z.size > states:
        out[states] = 0.0
    pairs = (z.size - states - 1) // 2
    for cosine in range(states + 1, states + 1 + pairs):
        sine = cosine + pairs
        out[cosine] = matrix[cosine, cosine] * z[cosine] + matrix[cosine, sine] * z[sine]
        out[sine] = matrix[sine, cosine] * z[cosine] + matrix[sine, sine] * z[sine]


@strict
def carry_state(steps, slot, generator, h, z, term, product):
    """Carry the first entries of z alone over an interval; the others are room of the same size."""
    left, size, states = h, z.size, steps.moved.shape[2]
    length = 0.5 ** steps.first[slot]
    for level in range(steps.first[slot], steps.levels[slot]):
        while left >= length:
            write_products(steps.increment[slot, level], states, z, product)
            for i in range(size):
                z[i] += product[i]
            left -= length
        length *= 0.5
    for i in range(size):
        term[i] = z[i]
    for m in range(1, TERMS + 1):
        write_products(generator, states, term, product)
        for i in range(size):
            term[i] = left / m * product[i]
            z[i] += term[i]


@kernel
def add_turned(row, states, matrix, out):
    """Add what the inputs, which turn in pairs, give to the product of a row and a matrix."""
    pairs = (row.size - states - 1) // 2
    for cosine in range(states + 1, states + 1 + pairs):
        sine = cosine + pairs
        out[cosine] += row[cosine] * matrix[cosine, cosine] + row[sine] * matrix[sine, cosine]
        out[sine] += row[cosine] * matrix[cosine, sine] + row[sine] * matrix[sine, sine]


@kernel
def _multiply_rows(state_row, row, matrix, moved, state_product, product):
    """Write the products of a row over (s, z) with [[A, B], [0, Z]], or with the increments of both."""
    states, size = state_row.size, row.size
    for j in range(states):
        state_product[j] = 0.0
    for j in range(size):
        product[j] = 0.0
    for i in range(states):
        weight, own = state_row[i], row[i]
        for j in range(states):
            state_product[j] += weight * matrix[i, j]
        for j in range(size):
            product[j] += weight * moved[i, j] + own * matrix[i, j]
    add_turned(row, states, matrix, product)


@strict
def _carry_row(steps, slot, rates, h, room):
    """Carry a row over (s, z) backwards over an interval."""
    left, length = h, 0.5 ** steps.first[slot]
    state_row, row = room.state_row, room.row
    for level in range(steps.first[slot], steps.levels[slot]):
        while left >= length:
            increment, moved = steps.increment[slot, level], steps.moved[slot, level]
            _multiply_rows(state_row, row, increment, moved, room.state_product, room.row_product)
            for j in range(state_row.size):
                state_row[j] += room.state_product[j]
            for j in range(row.size):
                row[j] += room.row_product[j]
            left -= length
        length *= 0.5
    for j in range(state_row.size):
        room.state_term[j] = state_row[j]
    for j in range(row.size):
        room.row_term[j] = row[j]
    generator, shift = rates.generator[slot], rates.shift[slot]
    for m in range(1, TERMS + 1):
        _multiply_rows(room.state_term, room.row_term, generator, shift, room.state_product, room.row_product)
        for j in range(state_row.size):
            room.state_term[j] = left / m * room.state_product[j]
            state_row[j] += room.state_term[j]
        for j in range(row.size):
            room.row_term[j] = left / m * room.row_product[j]
            row[j] += room.row_term[j]


@strict
def _write_slope(steps, rates, course, i, since, room, scale, factor, out, first):
    """Write a factor times the derivative of a value so long after crossing i, by the state at the start and by p.

    The value is ``room.state_row`` times the states; ``room.row`` times z is what the shift of p adds.
    """
    states = room.state_row.size
    _carry_row(steps, course.slot[i], rates, since, room)
    for p in range(states + 1):
        total = 0.0
        for j in range(states):
            total += room.state_row[j] * course.columns[i, j, p]
        out[first + p] = factor * (total * scale[p] if p < states else total)
    total = 0.0
    for j in range(room.row.size):
        total += room.row[j] * course.z[i, j]
    out[first + states] += factor * total


@strict
def _write_depth_slope(steps, rates, course, i, k, since, sign, corner_shift, scale, room, out, first):
    """Write the derivative of a depth so long after crossing i, by the state at the start and by p."""
    states = room.state_row.size
    for j in range(states):
        room.state_row[j] = rates.deflection[k, j]
    for j in range(room.row.size):
        room.row[j] = rates.deflection_shift[k, j]
    _write_slope(steps, rates, course, i, since, room, scale, sign, out, first)
    out[first + states] -= sign * corner_shift


@strict
def _write_time_slope(steps, rates, course, i, k, since, bend, scale, room, out, first):
    """Write the derivative of the instant of a turning point, by the state at the start and by p."""
    states, size = room.state_row.size, room.row.size
    generator, shift = rates.generator[course.slot[i]], rates.shift[course.slot[i]]
    for j in range(size):
        room.row[j] = 0.0
        for q in range(size):
            room.row[j] += rates.deflection_shift[k, q] * generator[q, j]
        for q in range(states):
            room.row[j] += rates.deflection[k, q] * shift[q, j]
    for j in range(states):
        room.state_row[j] = 0.0
        for q in range(states):
            room.state_row[j] += rates.deflection[k, q] * generator[q, j]
    _write_slope(steps, rates, course, i, since, room, scale, -1.0 / bend, out, first)


@strict
def _stand(rates, slot, k, room):
    """Value, first and second derivative of a deflection at ``room.z``, over periods."""
    value, states = dot(rates.deflection, k, room.z), rates.shift.shape[1]
    write_products(rates.generator[slot], states, room.z, room.product)
    rate = dot(rates.deflection, k, room.product)
    write_products(rates.generator[slot], states, room.product, room.term)
    return value, rate, dot(rates.deflection, k, room.term)


@kernel
def room_for(states, size):
    """Room for one turning point."""
    z, short = np.empty((5, size)), np.empty((3, states))
    return Room(z[0], z[1], z[2], z[3], short[0], z[4], np.empty(size), short[1], short[2])


@strict
def write_approach(common, laws, regions, rates, steps, course, crossings, corner, scale, approach):
    """Write when the deflection of a clearance has an extremum near an instant, and what is known of it."""
    k, upward, asked, end = corner[0], corner[1], approach[TIME], course.time[course.time.size - 1]
    room = room_for(rates.shift.shape[1], course.z.shape[1])
    time, i = asked, 0
    approach[DEPTH] = np.nan
    for _ in range(_ITERATIONS):
        now = time - end * np.floor(time / end)
        i = 0
        while i < course.slot.size - 1 and course.time[i + 1] <= now:
            i += 1
        slot, since = course.slot[i], now - course.time[i]
        for j in range(room.z.size):
            room.z[j] = course.z[i, j]
        carry_state(steps, slot, rates.generator[slot], since, room.z, room.term, room.product)
        value, rate, bend = _stand(rates, slot, k, room)
        if (bend >= 0.0) == (upward == 1):
            return
        change = min(max(-rate / bend, -NEAR), NEAR)
        time += change
        if abs(time - asked) > FARTHEST:
            return
        if abs(change) < _SETTLED:
            piece = laws.first[common.clearances[k]] + regions.piece[slot, k]
            approach[TIME], approach[BEND] = time, bend
            approach[DEPTH] = value - laws.upper[piece] if upward == 1 else laws.lower[piece] - value
            if np.isfinite(approach[DEPTH]):
                sign = 1.0 if upward == 1 else -1.0
                shift = rates.upper_shift[piece] if upward == 1 else rates.lower_shift[piece]
                _write_depth_slope(steps, rates, course, i, k, since, sign, shift, scale, room, approach, SLOPE)
                first = SLOPE + rates.shift.shape[1] + 1
                _write_time_slope(steps, rates, course, i, k, since, bend, scale, room, approach, first)
                beyond = piece + 1 if upward == 1 else piece - 1
                _write_gain(common, laws, rates, steps, course, crossings, (i, k, since, piece, beyond), room, approach)
            return


@strict
def _write_gain(common, laws, rates, steps, course, crossings, touch, room, approach):
    """Write what the trace of the gradient gains for a period beyond a corner, and what is entered there."""
    i, k, since, piece, beyond = touch
    element, slot, states = common.clearances[k], course.slot[i], room.state_row.size
    stiffness, damping = laws.stiffness[beyond] - laws.stiffness[piece], laws.damping[beyond] - laws.damping[piece]
    lightness, first = 0.0, states - common.inertia.size
    kick, column = room.state_term, room.state_row
    for j in range(states):
        kick[j] = 0.0
    for j in range(common.inertia.size):
        arm = common.rows[element, j] / common.inertia[j]
        lightness += common.rows[element, j] * arm
        kick[first + j] = common.pace[j] / common.limits[PERIOD] * arm
    approach[STIFFNESS], approach[DAMPING] = stiffness * lightness, damping * lightness
    for j in range(states):
        column[j] = common.limits[PERIOD] * stiffness * kick[j]
        for q in range(states):
            column[j] += damping * rates.generator[slot, j, q] * kick[q]
    now = course.time[i] + since
    for n in range(i, course.slot.size):
        region = course.slot[n]
        h = course.time[n + 1] - now
        carry_state(steps, region, rates.generator[region], h, column, room.state_product, kick)
        now = course.time[n + 1]
        if n < course.slot.size - 1:
            _kick(common, rates, crossings, n, column)
    for j in range(states):
        total = 0.0
        for q in range(states):
            total += course.columns[i, j, q] * column[q]
        room.state_product[j] = total
    carry_state(steps, slot, rates.generator[slot], since, room.state_product, column, kick)
    gain = 0.0
    for j in range(states):
        gain -= rates.deflection[k, j] * room.state_product[j]
    approach[GAIN] = gain


@kernel
def _kick(common, rates, crossings, n, column):
    """Kick the velocities of a perturbation where the damping jumps at crossing n."""
    crossed, jump = crossings.clearance[n], crossings.jump[n]
    moving, moved = column.size - common.inertia.size, 0.0
    for j in range(column.size):
        moved += rates.deflection[crossed, j] * column[j]
    for j in range(common.inertia.size):
        arm = common.rows[common.clearances[crossed], j] / common.inertia[j]
        column[moving + j] -= common.pace[j] / common.limits[PERIOD] * arm * jump * moved
