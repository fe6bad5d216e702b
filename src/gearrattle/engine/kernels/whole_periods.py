"""The end of a motion over whole periods, and its derivatives by the state at the start and by a parameter.

Time is counted in periods. Inside a region the states x and the inputs u, which are oscillators, obey

    z' = Z(p) z,    z = (x, u),    Z = [[A, G], [0, W]]

and W does not depend on the parameter p. Perturbations of the start obey v' = A v. The derivative s = dx/dp for a fixed
start obeys s' = A s + B z with B = d[A, G]/dp. Both are carried by tables (``exponentials``).

A, G and corners are closed forms of p. Their derivatives are central differences of these forms, not of motions: the
two neighbours of a variant, with a smaller and a larger p, are laid out in its scales.

On request one approach to a corner (``corner_approach``) or all turning points (``branch_direction``,
``turning_point_depths``) are written too.

Arrays: ``memory_addresses`` (workspace), ``march_arrays`` (regions, march, samples, log), ``variant_arrays``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel, strict, strict_entry
from gearrattle.engine.kernels.arrays import Array3, IntMatrix, IntVector, Matrix, Vector
from gearrattle.engine.kernels.branch_direction import write_course_along
from gearrattle.engine.kernels.corner_approach import Touched, write_touch
from gearrattle.engine.kernels.exponentials import Carried, Steps, carry, cross, write_levels, write_tables
from gearrattle.engine.kernels.march_arrays import EVENTS
from gearrattle.engine.kernels.memory_addresses import common_at, laws_at, region_at
from gearrattle.engine.kernels.perturbed_motion import Driven, Path, Trace, write_course
from gearrattle.engine.kernels.region_rates import accelerate
from gearrattle.engine.kernels.variant_common import lay_out
from gearrattle.engine.kernels.variants_march import AT, SLOTS, numbers_of

NEIGHBOURS = 2
"""Number of variants before the marched one: its neighbours, with a smaller and with a larger parameter."""
NO_TURNS = -1
ALONG_ROW = 0
ALONG_CHANGE = 1
"""Requested turning points: none; of a periodic motion; of a part of one.

ALONG_ROW: slopes are along the change (du, dp) that keeps the difference of end and start, and whose product with
``Map.row``, over the state at the start [SI] and the parameter, is 1. ALONG_CHANGE: ``Map.row`` is the change itself.
"""


class Map(NamedTuple):
    """A motion over n periods; N states."""

    end: Vector  # (N,) state at the end [SI]
    turned: Vector  # (R,) angle through which the reference inertia of every free train has turned [rad]
    gradient: Matrix  # (N, N) of the end with respect to the start [SI]
    slope: Vector  # (N,) of the end with respect to the parameter [SI], times half the difference of the neighbours' p
    corner: IntVector  # (2,) clearance of the requested approach, -1: none; 1: to its upper corner, 0: to the lower
    touched: Touched  # that approach
    row: Vector  # (N + 1,) defines the direction of slopes, see ALONG_ROW and ALONG_CHANGE
    turns: Matrix  # (MOST_TURNS, COLUMNS) all turning points
    turning: IntVector  # (1,) NO_TURNS, ALONG_ROW or ALONG_CHANGE; afterwards their number, NO_TURNS: not known
    delay: Vector  # (MOST_TURNS,) slope of the instants of crossings along that direction [periods]
    outside: IntMatrix  # (2, K) of ``Path``; read for ALONG_CHANGE, written for ALONG_ROW
    reach: Vector  # (K,) distance from a corner up to which turning points are written


class Rates(NamedTuple):
    """Rates of the states and their shifts, for the S slots that a motion visits; P entries of z, K clearances.

    A *shift* is a derivative with respect to the parameter, times half the difference of the neighbours' parameters.
    """

    generator: Array3  # (S, P, P) Z
    shift: Array3  # (S, N, P) B
    deflection: Matrix  # (K, P) of the clearances
    deflection_shift: Matrix  # (K, P)
    lower_shift: Vector  # of the lower corner of every piece
    upper_shift: Vector  # of the upper corner


class Marched(NamedTuple):
    """The arrays of a driveline, and a motion that was marched."""

    common: Any  # see ``memory_addresses``
    laws: Any
    regions: Any  # see ``march_arrays``
    log: Any
    events: int  # number of crossings
    initial: IntVector  # (K,) pieces of the clearances at the start of the motion
    end: float  # in periods


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
    """Write the rates of a variant, and their shifts from its two neighbours, in the scales of the variant."""
    # rates of both neighbours, then of the variant
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
    # rows of the inputs, and the shift B by central differences
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
def _write_path(marched, rates, path):
    """Write the intervals of a motion with their slots, and its crossings, which are corners of laws."""
    common = marched.common
    laws = marched.laws
    log = marched.log
    events = marched.events
    pieces = marched.initial.copy()
    slots = rates.shift.shape[0]
    path.time[0] = 0.0
    for i in range(events + 1):
        # each interval: its region, its end, and the corners of the pieces
        path.slot[i] = slot_of(marched.regions, slots, pieces)
        path.time[i + 1] = log.cycle[i] + log.fraction[i] if i < events else marched.end
        for k in range(pieces.size):
            piece = laws.first[common.clearances[k]] + pieces[k]
            path.lower[i, k] = laws.lower[piece]
            path.upper[i, k] = laws.upper[piece]
            path.lower_shift[i, k] = rates.lower_shift[piece]
            path.upper_shift[i, k] = rates.upper_shift[piece]
        # the crossing at its end: the watched row, the shift of the corner, and the next pieces
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
    """Write the turning points along the requested direction; NO_TURNS if that direction does not exist."""
    if out.turning[0] == ALONG_CHANGE:
        change = out.row.copy()
        for i in range(scale.size):
            change[i] *= scale[i]
        write_course(driven, path, z, change, trace)
    elif not write_course_along(driven, path, z, columns, scale, out.row, 0, trace):
        out.turning[0] = NO_TURNS
        return
    out.turning[0] = trace.number[0]
    for i in range(min(trace.delay.size, out.delay.size)):
        out.delay[i] = trace.delay[i]


@strict
def _follow(marched, rates, carried, scale, out):
    """Carry perturbations and s along a motion, and write the requested turning points."""
    # the path of the motion, and the tables of its slots
    common = marched.common
    laws = marched.laws
    regions = marched.regions
    events = marched.events
    slots, states, size = rates.shift.shape
    path = _room_path(events, common.clearances.size, size, out.outside)
    _write_path(marched, rates, path)
    levels = np.empty(slots, np.int64)
    first = np.empty(slots, np.int64)
    write_levels(common, rates, path, levels, first)
    most = levels.max()
    steps = Steps(np.empty((slots, most, size, size)), np.empty((slots, most, states, size)), levels, first)
    is_written = np.zeros(slots, np.bool_)
    begin = carried.z.copy()
    for i in range(events + 1):  # perturbations of all states, and s, by tables
        slot = path.slot[i]
        generator = rates.generator[slot]
        shift = rates.shift[slot]
        if not is_written[slot]:
            write_tables(generator, shift, steps, slot)
            is_written[slot] = True
        carry(steps, slot, generator, shift, path.time[i + 1] - path.time[i], carried)
        if i < events:
            crossed = path.clearance[i]
            element = common.clearances[crossed]
            before = laws.first[element] + regions.piece[slot, crossed]
            beyond = laws.first[element] + regions.piece[path.slot[i + 1], crossed]
            # a jump of damping makes a jump of the perturbed velocities
            jump = laws.damping[beyond] - laws.damping[before]
            if jump != 0.0:
                row = rates.deflection[crossed]
                cross(common, element, jump, path.bound_shift[i], row, rates.deflection_shift[crossed], carried)
    if out.corner[0] >= 0 or out.turning[0] != NO_TURNS:  # one perturbation, with the series of the deflections
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


@strict_entry
def differentiate(workspace, cases, buffers, regions, march, samples, log, cursor, out):
    """Write the end of a marched motion, and its derivatives.

    cases, buffers, cursor: see ``variants_march``; the ``NEIGHBOURS`` variants before the present one are its
    neighbours. out: ``Map``.
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
    marched = Marched(
        common_at(workspace),
        laws_at(workspace),
        regions,
        log,
        march.counts[EVENTS],
        buffers.initial,
        float(samples.first) / samples.per_cycle,
    )
    _follow(marched, rates, carried, scale, out)
    # the end and its derivatives in SI units
    last = samples.states[samples.states.shape[0] - 1]
    for i in range(states):
        out.end[i] = last[i] / scale[i]
        out.slope[i] = columns[i, states] / scale[i]
        for j in range(states):
            out.gradient[i, j] = columns[i, j] / scale[i] * scale[j]
    for i in range(frame.references.size):
        out.turned[i] = last[states + i] - cases.angle[v, frame.references[i]]
