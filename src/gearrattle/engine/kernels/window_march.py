"""The march of a large driveline: window by window, with all motions as polynomials, without regions and tables.

All windows have one length. It is so short that a Taylor series represents every motion to rounding, for all pieces of
the elements. In a window every clearance's gap is a polynomial: either its coefficients prove that it stays positive,
or its first root is isolated (``first_exit.exit_from``). The earliest root of all clearances is the next crossing. It
changes the piece of one element, and the polynomials near that element (``crossing_correction``). After a number of
crossings, and at the end of the window, all polynomials are computed again from the states. No crossing is skipped:
every instant lies in a window that is searched from its beginning.

The kernel works in slices, as ``march`` does; the end of a slice changes no bit of the motion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gearrattle.engine.kernels._jit import kernel
from gearrattle.engine.kernels.arrays import IntVector, Matrix, Vector
from gearrattle.engine.kernels.corner_log import MOST_STALLED, band_of, has_left, lifted, log_crossing
from gearrattle.engine.kernels.crossing_correction import correct, jump_series
from gearrattle.engine.kernels.first_exit import NEVER, evaluate, exit_from, slope
from gearrattle.engine.kernels.march_arrays import COUNTS, CYCLE, EVENTS, EXPANSIONS, SAMPLE, STALLED, STEPS
from gearrattle.engine.kernels.network_series import error_series, expand, move, tie_up, wave_series
from gearrattle.engine.kernels.oscillators import inputs_at
from gearrattle.engine.kernels.outcomes import CHATTER, DONE, LOG_FULL, NO_PROGRESS, NON_FINITE, SLICE_SPENT
from gearrattle.engine.kernels.strip_products import copy

WINDOW, CORRECTED, EXPANDED, SIZE = range(COUNTS, COUNTS + 4)
"""More indices into ``counts``: number of the window in its period; crossings since all polynomials were computed; 1
once they have been computed."""


class Sweep(NamedTuple):
    """State of a march by windows: all arrays that change; a later slice continues from them with the same bits."""

    most: int  # most crossings in a window before all polynomials are computed again
    counts: IntVector  # (SIZE,) integers, see the names above and in ``march_arrays``
    clock: Vector  # (2,) in window lengths: the polynomials' origin in the window; the present time from the origin
    table: Matrix  # (ORDER + 1, columns) coefficients of all motions, see ``network_series.Network``
    errors: Matrix  # (ORDER + 2, E) coefficients of transmission errors
    reach: Vector  # (m,) sum of |c_j| of each deflection's orders from 1 on
    piece: IntVector  # (K,)
    stiffness: Vector  # (m,) of the present pieces
    damping: Vector  # (m,)
    offset: Vector  # (m,)
    side: IntVector  # (K,) -1: sits on the lower corner (to the band), +1: on the upper corner, 0: on no corner
    exit: Vector  # (K,) next crossing of every clearance in this window, from the origin; NEVER: none
    upward: IntVector  # (K,) direction of that crossing
    rate: Vector  # (K,) d delta / ds at that crossing, per window


class SweepBuffers(NamedTuple):
    """Scratch."""

    y: Vector  # (columns,)
    u: Vector  # (1 + 2 H,)
    waves: Matrix  # (ORDER + 2, 2 H)
    force: Vector  # (m,)
    pull: Vector  # (m + n,)
    load: Vector  # (T,)
    jump: Vector  # (ORDER,)
    matrix: Matrix  # (ORDER + 1, ORDER + 1), zero below the diagonal
    laws: Matrix  # (2, largest number of elements near a clearance)
    moved: Matrix  # (ORDER + 1, twice that number)
    turned: Matrix  # (ORDER + 1, largest number of inertias near a clearance, and one)
    row: Vector  # as long as the longer row of ``moved`` and ``turned``
    whole: Vector  # (ORDER + 1,) series of a deflection
    gap: Vector  # (ORDER + 1,)


@kernel
def next_exit(table, errors, row, k, c, reach, lower, upper, fixed, side, low, end, whole, gap):
    """The first crossing of clearance c, element k, in [low, end] of a window: (s, upward, rate), s ``NEVER`` if none.

    table, errors: coefficients.
    row: of the element's transmission error in ``errors``; -1: it has none.
    reach: sum of |c_j| of its deflection's orders from 1 on.
    lower, upper: corners of its piece.
    fixed: its rounding band; 0: relative to its motion.
    side: (K,) set to 0 if the clearance has left the corner on which it sat.
    """
    # the coefficients alone prove that the gap stays open: |g(0)| > sum of |c_j|
    start = table[0, k]
    if row >= 0:
        start -= errors[0, row]
        for j in range(1, gap.size):
            reach += abs(errors[j, row])
    if start - lower > reach and upper - start > reach:
        return NEVER, 0, 0.0
    # the deflection as a polynomial over the window, and its value where the search begins
    for j in range(gap.size):
        whole[j] = table[j, k]
    if row >= 0:
        for j in range(gap.size):
            whole[j] -= errors[j, row]
    here, rate, curvature = evaluate(whole, low)
    # an element that sits on a corner leaves it once it is farther away than the band
    band = band_of(fixed, abs(rate) + 0.5 * abs(curvature))
    if has_left(side[c], here - lower, upper - here, band):
        side[c] = 0
    # the first root of either gap from there on; the earlier one is the crossing
    best = NEVER
    upward = 0
    speed = 0.0
    for up in range(2):
        sign = 2 * up - 1
        corner = upper if up else lower
        if abs(corner) > 1e300:
            continue
        distance = sign * (corner - here)
        for j in range(gap.size):
            gap[j] = -sign * whole[j]
        # at a corner on which the element sits the gap counts as the band at least
        gap[0] += sign * corner
        if side[c] == sign:
            if low == 0.0:
                gap[0] = lifted(gap[0], band)
            else:
                gap[0] += lifted(distance, band) - distance
            distance = lifted(distance, band)
        s = exit_from(gap, low, distance, -sign * rate, -sign * curvature)
        if s < best and s <= end:
            best = s
            upward = up
            speed = -sign * slope(gap, s)
    return best, upward, speed


@kernel
def _search_all(driveline, sweep, buffers, low):
    """Compute the next crossing of every clearance."""
    network = driveline.network
    laws = driveline.laws
    band = driveline.band
    table = sweep.table
    errors = sweep.errors
    side = sweep.side
    reach = sweep.reach
    piece = sweep.piece
    clearances = network.clearances
    first = laws.first
    error_of = network.error_of
    whole = buffers.whole
    gap = buffers.gap
    end = 1.0 - sweep.clock[0]
    # from the present time to the end of the window
    for c in range(side.size):
        k = clearances[c]
        p = first[k] + piece[c]
        sweep.exit[c], sweep.upward[c], sweep.rate[c] = next_exit(
            table,
            errors,
            error_of[k],
            k,
            c,
            reach[k],
            laws.lower[p],
            laws.upper[p],
            band[c],
            side,
            low,
            end,
            whole,
            gap,
        )


@kernel
def _search_near(driveline, sweep, buffers, c, low):
    """Compute the next crossings of the clearances near clearance c, which has crossed."""
    network = driveline.network
    laws = driveline.laws
    near = driveline.near
    band = driveline.band
    table = sweep.table
    errors = sweep.errors
    side = sweep.side
    reach = sweep.reach
    piece = sweep.piece
    first = laws.first
    error_of = network.error_of
    clearance = network.clearance
    elements = near.element
    whole = buffers.whole
    gap = buffers.gap
    end = 1.0 - sweep.clock[0]
    for i in range(near.element_start[c], near.element_start[c + 1]):
        k = np.int64(elements[i])
        other = clearance[k]
        if other < 0:
            continue
        # the sum of |c_j|, which the correction has changed
        total = 0.0
        for j in range(1, gap.size):
            total += abs(table[j, k])
        reach[k] = total
        # its next crossing, searched from the crossing on
        p = first[k] + piece[other]
        sweep.exit[other], sweep.upward[other], sweep.rate[other] = next_exit(
            table,
            errors,
            error_of[k],
            k,
            other,
            total,
            laws.lower[p],
            laws.upper[p],
            band[other],
            side,
            low,
            end,
            whole,
            gap,
        )


@kernel
def _refresh(driveline, sweep, buffers):
    """Compute all polynomials from the states in ``buffers.y`` at the origin, and the next crossings."""
    counts = sweep.counts
    clock = sweep.clock
    network = driveline.network
    # the states and the inputs where the window begins
    for i in range(buffers.y.size):
        sweep.table[0, i] = buffers.y[i]
    tie_up(network, sweep.table)
    inputs_at(driveline.inputs, counts[CYCLE], (counts[WINDOW] + clock[0]) / driveline.windows, buffers.u)
    wave_series(network.turn, buffers.u, buffers.waves)
    # Taylor series of all motions from the equation of motion, order by order
    error_series(network.error_at, network.error, buffers.waves, sweep.errors)
    expand(
        network,
        network.length,
        sweep.stiffness,
        sweep.damping,
        sweep.offset,
        buffers.waves,
        sweep.errors,
        sweep.table,
        buffers.force,
        buffers.pull,
        buffers.load,
        sweep.reach,
    )
    # every gap is searched from the beginning of the window
    counts[CORRECTED] = 0
    counts[EXPANSIONS] += 1
    clock[1] = 0.0
    _search_all(driveline, sweep, buffers, 0.0)


@kernel
def _emit(windows, sweep, samples, until, buffers):
    """Store every sample before ``until`` (from the origin, in windows); a period has ``windows`` of them."""
    counts = sweep.counts
    clock = sweep.clock
    per_cycle = samples.per_cycle
    begun = (counts[CYCLE] * windows + counts[WINDOW]) * per_cycle
    while counts[SAMPLE] < samples.pieces.shape[0]:
        i = counts[SAMPLE]
        s = (i * windows - begun) / per_cycle - clock[0]
        if s >= until and s > clock[1]:
            break
        move(sweep.table, max(s, clock[1]), buffers.y)
        for j in range(buffers.y.size):
            samples.states[i, j] = buffers.y[j]
        for c in range(sweep.piece.size):
            samples.pieces[i, c] = sweep.piece[c]
        counts[SAMPLE] += 1


@kernel
def _cross(driveline, sweep, log, buffers, c):
    """Move clearance c over its corner, and compute the motion after the crossing."""
    network = driveline.network
    laws = driveline.laws
    windows = driveline.windows
    counts = sweep.counts
    clock = sweep.clock
    k = network.clearances[c]
    s = sweep.exit[c]
    upward = sweep.upward[c]
    before = clock[0] + clock[1]
    # the force integral at the crossing
    column = network.mean.size + c
    integral = 0.0
    for j in range(sweep.table.shape[0] - 1, -1, -1):
        integral = integral * s + sweep.table[j, column]
    clock[1] = s
    # log the crossing
    time = (counts[WINDOW] + (clock[0] + s)) / windows
    rate = sweep.rate[c] * windows
    log_crossing(log, counts[EVENTS], counts[CYCLE], time, c, upward, sweep.piece[c], rate, integral)
    counts[EVENTS] += 1
    counts[STALLED] = counts[STALLED] + 1 if clock[0] + s == before else 0
    # one element changes its piece, and sits on the corner
    p = laws.first[k] + sweep.piece[c]
    corner = laws.upper[p] if upward else laws.lower[p]
    q = p + 2 * upward - 1
    sweep.piece[c] += 2 * upward - 1
    sweep.side[c] = -1 if upward else 1
    sweep.stiffness[k] = laws.stiffness[q]
    sweep.damping[k] = laws.damping[q]
    sweep.offset[k] = laws.offset[q]
    # the force changes by a known polynomial: add the resulting motion near the element
    if counts[CORRECTED] < sweep.most:
        change = laws.stiffness[q] - laws.stiffness[p], laws.damping[q] - laws.damping[p]
        jump_series(
            sweep.table,
            sweep.errors,
            k,
            network.error_of[k],
            s,
            corner,
            change,
            network.length,
            buffers.jump,
            buffers.matrix,
        )
        correct(
            network,
            driveline.near,
            c,
            sweep.stiffness,
            sweep.damping,
            s,
            buffers.jump,
            sweep.table,
            buffers.laws,
            buffers.moved,
            buffers.turned,
            buffers.pull,
            buffers.matrix,
            buffers.row,
        )
        counts[CORRECTED] += 1
        # only the gaps near the element are searched again, from the crossing on
        _search_near(driveline, sweep, buffers, c, s)
    # too many crossings in the window: all polynomials are computed again from the states here
    else:
        move(sweep.table, s, buffers.y)
        clock[0] += s
        _refresh(driveline, sweep, buffers)


@kernel
def sweep_on(driveline, sweep, samples, log, buffers, budget):
    """March until all samples are stored or the caller must act.

    sweep, buffers: see ``Sweep`` and ``SweepBuffers``; sweep changes.
    samples, log: see ``march_arrays``; both change. The states of a sample are the columns of the sweep's table.
    budget: most windows and crossings in this slice.
    Returns an ``Outcome`` code.
    """
    counts = sweep.counts
    clock = sweep.clock
    exits = sweep.exit
    windows = driveline.windows
    # the first window
    if not counts[EXPANDED]:
        copy(sweep.table[0], buffers.y.size, buffers.y)
        _refresh(driveline, sweep, buffers)
        counts[EXPANDED] = 1
    for _ in range(budget):
        # stop where the caller must act
        if counts[SAMPLE] >= samples.pieces.shape[0]:
            return DONE
        if counts[EVENTS] >= log.cycle.size:
            return LOG_FULL
        # the earliest crossing of all clearances in the window
        k = -1
        end = NEVER
        for c in range(exits.size):
            if exits[c] < end:
                k = c
                end = exits[c]
        if end < 0.0:  # undecided
            return NO_PROGRESS if np.isfinite(sweep.table.sum()) else NON_FINITE
        # move to that crossing, and over it
        if k >= 0:
            _emit(windows, sweep, samples, end, buffers)
            if counts[SAMPLE] >= samples.pieces.shape[0]:
                return DONE
            _cross(driveline, sweep, log, buffers, k)
            if counts[STALLED] > MOST_STALLED:
                return CHATTER
            continue
        # no crossing is left: the states at the end of the window begin the next one
        end = 1.0 - clock[0]
        _emit(windows, sweep, samples, end, buffers)
        move(sweep.table, end, buffers.y)
        clock[0] = 0.0
        counts[STEPS] += 1
        counts[WINDOW] += 1
        if counts[WINDOW] == windows:
            counts[WINDOW] = 0
            counts[CYCLE] += 1
        # all motions as Taylor series over the next window
        if not np.isfinite(buffers.y.sum()):
            return NON_FINITE
        _refresh(driveline, sweep, buffers)
    return SLICE_SPENT
