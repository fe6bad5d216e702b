"""The certified march inside one region, and the crossing to the next.

Each step tries the longest dyadic h for which no clearance can leave its region: with gap g, closing speed and its rate
exact at the start and |delta'''| <= b for as long as the region lasts (``system.majorant``), the cubic minorant of
every gap must stay positive over the whole step. If even the finest step is not safe, the motion over it is expanded
in a Taylor series and the first crossing is the first root (``polynomial.first_exit``). Nothing can be skipped:
every instant lies in a step proven free of crossings or in a window searched from its beginning.

The kernel works in slices and hands back an ``Outcome`` code, so that the floor above can show progress, grow the log,
or build a region met for the first time.
"""

from __future__ import annotations

import numpy as np

from gearrattle.kernels._jit import inlined, kernel
from gearrattle.kernels.packed import (
    BAND,
    CYCLE,
    EVENTS,
    EXPANSIONS,
    LEVEL,
    PENDING,
    SAMPLE,
    SLOT,
    STALLED,
    STEPS,
    TRIALS,
)
from gearrattle.kernels.polynomial import NEVER, stays_inside
from gearrattle.kernels.window import advance, evaluate, expand, first_crossing, inputs_at, multiply, state_between

DONE, SLICE_SPENT, NEEDS_REGION, LOG_FULL, CHATTER, NON_FINITE = range(6)  # outcome.Outcome
_REACH = 2  # how many times a step may double
_ANCHOR_EVERY = 16  # steps between fresh sines; in between the inputs are rotated
_MOST_STALLED = 10_000  # crossings in a row that do not advance the clock


@inlined
def _open(gap, rate, curvature, third, sits, h):
    """Whether a gap provably stays open for a step h; where the motion sits on the corner, down to the band."""
    if sits:
        gap = max(gap, 0.0) + BAND
    elif gap <= 0.0 and rate > 0.0:
        gap = 0.0
    return stays_inside(gap, rate, curvature, third, h)


@kernel
def _judge(lower, upper, slot, seen, third, side, h, unsafe):
    """Mark every corner (k, lower or upper) that a step h might reach; whether there is none."""
    count = third.size
    safe = True
    for k in range(count):
        delta, rate, curvature = seen[k], seen[count + k], seen[2 * count + k]
        low, high = lower[slot, k], upper[slot, k]
        if (side[k] == -1 and delta - low > 4.0 * BAND) or (side[k] == 1 and high - delta > 4.0 * BAND):
            side[k] = 0
        unsafe[k, 0] = low > -1e300 and not _open(delta - low, rate, curvature, third[k], side[k] == -1, h)
        unsafe[k, 1] = high < 1e300 and not _open(high - delta, -rate, -curvature, third[k], side[k] == 1, h)
        safe = safe and not (unsafe[k, 0] or unsafe[k, 1])
    return safe


@kernel
def _bound(weights, constant, slot, rows, seen, third):
    """Bound every third derivative from the moduli of the bound rows."""
    count = third.size
    first = (3 * count + 3) // 4 * 4
    for k in range(count):
        third[k] = constant[slot, k]
    for j in range(rows):
        real, imaginary = seen[first + 2 * j], seen[first + 2 * j + 1]
        size = np.sqrt(real * real + imaginary * imaginary)
        for k in range(count):
            third[k] += weights[slot, k, j] * size


@inlined
def _ahead(counts, clock, per_cycle):
    """Time from now to the next sample, in periods."""
    i = counts[SAMPLE]
    whole = i // per_cycle
    part = (i - whole * per_cycle) / per_cycle
    return (whole - counts[CYCLE]) + (part - (clock[0] + clock[1]))


@kernel
def _emit(regions, inputs, march, samples, h, work):
    """Store every sample in [now, now + h)."""
    counts, now = march.counts, march.clock[0] + march.clock[1]
    while counts[SAMPLE] < samples.slots.size:
        i = counts[SAMPLE]
        ahead = _ahead(counts, march.clock, samples.per_cycle)
        if ahead >= h and ahead > 0.0:
            break
        if ahead <= 0.0:
            samples.states[i] = march.y
        else:
            state_between(regions, inputs, counts[SLOT], march.y, counts[CYCLE], now, ahead, work)
            samples.states[i] = work.y
        samples.slots[i] = counts[SLOT]
        counts[SAMPLE] += 1


@inlined
def _pass_time(counts, clock, h, dyadic):
    """Advance the clock; the offset stays an exact dyadic fraction until a crossing sets a new anchor."""
    if dyadic:
        clock[1] += h
    else:
        clock[0] += clock[1] + h
        clock[1] = 0.0
    while clock[0] + clock[1] >= 1.0:
        counts[CYCLE] += 1
        clock[1] -= 1.0


@inlined
def _turn(cosines, sines, level, y, states):
    """Rotate the inputs over one step of a level."""
    for j in range(cosines.shape[1]):
        at = states + 1 + 2 * j
        c, s = y[at], y[at + 1]
        y[at] = c * cosines[level, j] - s * sines[level, j]
        y[at + 1] = s * cosines[level, j] + c * sines[level, j]


@kernel
def _cross(neighbour, log, counts, clock, side, integral, passed, k, upward, rate):
    """Log the crossing the marcher has been moved to, and step into the region beyond.

    PENDING is set if that region is not built yet.
    """
    before = clock[0] + clock[1]
    _pass_time(counts, clock, passed, False)
    i, slot = counts[EVENTS], counts[SLOT]
    log.cycle[i] = counts[CYCLE]
    log.fraction[i] = clock[0] + clock[1]
    log.clearance[i] = k
    log.upward[i] = upward
    log.slot[i] = slot
    log.rate[i] = rate
    log.integral[i] = integral
    counts[EVENTS] += 1
    counts[STALLED] = counts[STALLED] + 1 if clock[0] + clock[1] == before else 0
    side[k] = -1 if upward else 1
    beyond = neighbour[slot, k, upward]
    if beyond < 0:
        counts[PENDING] = 2 * k + upward
    else:
        counts[SLOT] = beyond


@kernel
def march_on(regions, inputs, march, samples, log, work, budget):
    """March until all samples are stored, or until something above is needed.

    Args:
        regions, inputs, march, samples, log, work: see ``packed``; march, samples, log and work change.
        budget: most steps in this slice.

    Returns:
        an ``Outcome`` code.
    """
    probe, tables, generator, steps = regions.probe, regions.tables, regions.generator, inputs.steps
    lower, upper, weights, constant = regions.lower, regions.upper, regions.weights, regions.constant
    high, low, cosines, sines = inputs.cycles_high, inputs.cycles_low, inputs.turn_cosine, inputs.turn_sine
    y, clock, counts, side, expansion = march.y, march.clock, march.counts, march.side, march.expansion
    out, seen, third, gap, per_cycle = work.out, work.seen, work.third, work.gap, samples.per_cycle
    finest, bound_rows, first_table = regions.fine, regions.bound_rows, regions.first_table
    tried, total, room = march.tried, samples.slots.size, log.cycle.size
    states = probe.shape[2] - 1 - 2 * high.size
    watched = (3 * side.size + 3) // 4
    unsafe = np.zeros((side.size, 2), dtype=np.bool_)
    since_anchor = _ANCHOR_EVERY
    for _ in range(budget):
        if counts[SAMPLE] >= total:
            return DONE
        if counts[PENDING] >= 0:
            return NEEDS_REGION
        if counts[EVENTS] >= room:
            return LOG_FULL
        slot = counts[SLOT]
        fine, rows = finest[slot], bound_rows[slot]
        if since_anchor >= _ANCHOR_EVERY:
            inputs_at(inputs, counts[CYCLE], clock[0] + clock[1], y, states)
            since_anchor = 0
        multiply(probe, slot, watched + (2 * rows + 3) // 4, y, seen)
        _bound(weights, constant, slot, rows, seen, third)
        level = max(0, min(counts[LEVEL], fine) - _REACH)
        safe = False
        while not safe and level <= fine:
            tried[0] += steps[level]
            counts[TRIALS] += 1
            safe = _judge(lower, upper, slot, seen, third, side, steps[level], unsafe)
            level += 0 if safe else 1
        counts[STEPS] += 1
        counts[LEVEL] = min(level, fine)
        h = steps[counts[LEVEL]]
        passed, k, upward, rate, x = h, -1, 0, 0.0, NEVER
        if not safe:
            expand(generator, slot, high, low, states, y, h, expansion, out)
            counts[EXPANSIONS] += 1
            x, k, upward, rate = first_crossing(probe, lower, upper, slot, expansion, side, unsafe, gap, h)
            passed = x * h if x < NEVER else h
        if _ahead(counts, clock, per_cycle) < passed:
            _emit(regions, inputs, march, samples, passed, work)
            if counts[SAMPLE] >= total:
                return DONE
        if x < NEVER:
            evaluate(expansion, x, y)
            _cross(regions.neighbour, log, counts, clock, side, y[y.size - side.size + k], passed, k, upward, rate)
            since_anchor = _ANCHOR_EVERY
            if counts[STALLED] > _MOST_STALLED:
                return CHATTER
            continue
        advance(tables, first_table[slot] + counts[LEVEL], states, y, out)
        _pass_time(counts, clock, h, True)
        _turn(cosines, sines, counts[LEVEL], y, states)
        since_anchor += 1
        if not np.isfinite(y[0]):
            return NON_FINITE
    return SLICE_SPENT
