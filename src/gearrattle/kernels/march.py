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
from gearrattle.kernels.packed import BAND, CYCLE, EVENTS, LEVEL, PENDING, SAMPLE, SLOT, STALLED, STEPS, TRIALS
from gearrattle.kernels.polynomial import NEVER, stays_inside
from gearrattle.kernels.window import advance, evaluate, first_crossing, inputs_at, multiply, region_at, state_between

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


@inlined
def _judge(region, seen, third, side, h, unsafe):
    """Mark every corner (k, lower or upper) that a step h might reach; whether there is none."""
    count = third.size
    safe = True
    for k in range(count):
        delta, rate, curvature = seen[k], seen[count + k], seen[2 * count + k]
        lower, upper = region.lower[k], region.upper[k]
        if (side[k] == -1 and delta - lower > 4.0 * BAND) or (side[k] == 1 and upper - delta > 4.0 * BAND):
            side[k] = 0
        unsafe[k, 0] = lower > -1e300 and not _open(delta - lower, rate, curvature, third[k], side[k] == -1, h)
        unsafe[k, 1] = upper < 1e300 and not _open(upper - delta, -rate, -curvature, third[k], side[k] == 1, h)
        safe = safe and not (unsafe[k, 0] or unsafe[k, 1])
    return safe


@inlined
def _bound(seen, region, third):
    """Bound every third derivative from the moduli of the bound rows."""
    count = third.size
    first = (3 * count + 3) // 4 * 4
    for k in range(count):
        third[k] = region.constant[k]
    for j in range(region.bound_rows):
        real, imaginary = seen[first + 2 * j], seen[first + 2 * j + 1]
        size = np.sqrt(real * real + imaginary * imaginary)
        for k in range(count):
            third[k] += region.weights[k, j] * size


@inlined
def _ahead(march, samples):
    """Time from now to the next sample, in periods."""
    i = march.counts[SAMPLE]
    whole = i // samples.per_cycle
    part = (i - whole * samples.per_cycle) / samples.per_cycle
    return (whole - march.counts[CYCLE]) + (part - (march.clock[0] + march.clock[1]))


@kernel
def _emit(region, inputs, march, samples, h, work):
    """Store every sample in [now, now + h)."""
    now = march.clock[0] + march.clock[1]
    while march.counts[SAMPLE] < samples.slots.size:
        i = march.counts[SAMPLE]
        ahead = _ahead(march, samples)
        if ahead >= h and ahead > 0.0:
            break
        if ahead <= 0.0:
            samples.states[i] = march.y
        else:
            state_between(region, inputs, march, now, ahead, work)
            samples.states[i] = work.y
        samples.slots[i] = march.counts[SLOT]
        march.counts[SAMPLE] += 1


@inlined
def _pass_time(march, h, dyadic):
    """Advance the clock; the offset stays an exact dyadic fraction until a crossing sets a new anchor."""
    if dyadic:
        march.clock[1] += h
    else:
        march.clock[0] += march.clock[1] + h
        march.clock[1] = 0.0
    while march.clock[0] + march.clock[1] >= 1.0:
        march.counts[CYCLE] += 1
        march.clock[1] -= 1.0


@inlined
def _turn(inputs, level, y, states):
    """Rotate the inputs over one step of a level."""
    for j in range(inputs.cycles_high.size):
        cosine, sine = inputs.turn_cosine[level, j], inputs.turn_sine[level, j]
        at = states + 1 + 2 * j
        c, s = y[at], y[at + 1]
        y[at] = c * cosine - s * sine
        y[at + 1] = s * cosine + c * sine


@kernel
def _cross(regions, march, log, passed, k, upward, rate):
    """Log the crossing the marcher has been moved to, and step into the region beyond.

    PENDING is set if that region is not built yet.
    """
    before = march.clock[0] + march.clock[1]
    _pass_time(march, passed, False)
    i, slot = march.counts[EVENTS], march.counts[SLOT]
    log.cycle[i] = march.counts[CYCLE]
    log.fraction[i] = march.clock[0] + march.clock[1]
    log.clearance[i] = k
    log.upward[i] = upward
    log.slot[i] = slot
    log.rate[i] = rate
    log.integral[i] = march.y[march.y.size - march.side.size + k]
    march.counts[EVENTS] += 1
    march.counts[STALLED] = march.counts[STALLED] + 1 if march.clock[0] + march.clock[1] == before else 0
    march.side[k] = -1 if upward else 1
    beyond = regions.neighbour[slot, k, upward]
    if beyond < 0:
        march.counts[PENDING] = 2 * k + upward
    else:
        march.counts[SLOT] = beyond


@kernel
def _stay(region, inputs, march, samples, unsafe, work, budget):
    """Take certified steps in one region until none is safe, or the budget or the samples are spent.

    Returns:
        steps taken; ``unsafe`` tells which corners stopped the march (none: it stopped for another reason).
    """
    states = region.probe.shape[1] - 1 - 2 * inputs.cycles_high.size
    level, fine = march.counts[LEVEL], region.fine
    for taken in range(budget):
        if march.counts[SAMPLE] >= samples.slots.size:
            return taken
        if taken % _ANCHOR_EVERY == 0:
            inputs_at(inputs, march.counts[CYCLE], march.clock[0] + march.clock[1], march.y, states)
        multiply(region.probe, march.y, work.seen)
        _bound(work.seen, region, work.third)
        level = max(0, min(level, fine) - _REACH)
        safe = False
        while not safe and level <= fine:
            h = inputs.steps[level]
            march.tried[0] += h
            march.counts[TRIALS] += 1
            safe = _judge(region, work.seen, work.third, march.side, h, unsafe)
            level += 0 if safe else 1
        if not safe:
            march.counts[LEVEL] = fine
            return taken
        h = inputs.steps[level]
        if _ahead(march, samples) < h:
            _emit(region, inputs, march, samples, h, work)
        advance(region.tables[level], states, march.y, work.out)
        _pass_time(march, h, True)
        _turn(inputs, level, march.y, states)
        march.counts[LEVEL] = level
    return budget


@kernel
def march_on(regions, inputs, march, samples, log, work, budget):
    """March until all samples are stored, or until something above is needed.

    Args:
        regions, inputs, march, samples, log, work: see ``packed``; march, samples, log and work change.
        budget: most steps in this slice.

    Returns:
        an ``Outcome`` code.
    """
    unsafe = np.zeros((march.side.size, 2), dtype=np.bool_)
    while budget > 0:
        if march.counts[PENDING] >= 0:
            return NEEDS_REGION
        if march.counts[EVENTS] >= log.cycle.size:
            return LOG_FULL
        if march.counts[STALLED] > _MOST_STALLED:
            return CHATTER
        region = region_at(regions, march.counts[SLOT])
        unsafe[:] = False
        taken = _stay(region, inputs, march, samples, unsafe, work, budget)
        march.counts[STEPS] += taken
        budget -= max(taken, 1)
        if march.counts[SAMPLE] >= samples.slots.size:
            return DONE
        if not np.isfinite(march.y[0]):
            return NON_FINITE
        if not unsafe.any():
            continue
        march.counts[STEPS] += 1
        h = inputs.steps[region.fine]
        x, k, upward, rate = first_crossing(region, inputs, march, unsafe, work)
        passed = x * h if x < NEVER else h
        if _ahead(march, samples) < passed:
            _emit(region, inputs, march, samples, passed, work)
        if march.counts[SAMPLE] >= samples.slots.size:
            return DONE
        if x < NEVER:
            evaluate(march.expansion, x, march.y)
            _cross(regions, march, log, passed, k, upward, rate)
        else:
            evaluate(march.expansion, 1.0, march.y)
            _pass_time(march, h, True)
    return SLICE_SPENT
