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

from gearrattle.kernels._jit import kernel
from gearrattle.kernels.packed import (
    CYCLE,
    EVENTS,
    LEVEL,
    LONGEST,
    PENDING,
    SAMPLE,
    SLOT,
    STALLED,
    STEPS,
    TRIALS,
    Work,
)
from gearrattle.kernels.polynomial import NEVER, stays_inside
from gearrattle.kernels.window import accumulate, evaluate, first_crossing, inputs_at, state_between

DONE, SLICE_SPENT, NEEDS_REGION, LOG_FULL, CHATTER, NON_FINITE = range(6)  # outcome.Outcome
_ANCHOR_EVERY = 16  # steps between fresh sines; in between the inputs are rotated
_MOST_STALLED = 10_000  # crossings in a row that do not advance the clock


@kernel
def _safe(regions, slot, k, side, watch, third, h):
    """Whether clearance k provably stays in its region for a step h."""
    count = regions.lower.shape[1]
    delta, rate, curvature = watch[k], watch[count + k], watch[2 * count + k]
    upper, lower = regions.upper[slot, k], regions.lower[slot, k]
    if upper < 1e300:
        gap = 0.0 if side == 1 else upper - delta
        if gap <= 0.0 and side != 1 and rate < 0.0:
            gap = 0.0
        if not stays_inside(gap, -rate, -curvature, third, h):
            return False
    if lower > -1e300:
        gap = 0.0 if side == -1 else delta - lower
        if gap <= 0.0 and side != -1 and rate > 0.0:
            gap = 0.0
        if not stays_inside(gap, rate, curvature, third, h):
            return False
    return True


@kernel
def _watch(regions, march, u, watch, third):
    """Deflections, rates, curvatures and the bound of every clearance at the marcher's state."""
    slot = march.counts[SLOT]
    count = regions.lower.shape[1]
    rows = regions.bound_rows[slot]
    states = regions.generator.shape[1] - u.size
    seen = watch[: 3 * count + 2 * rows]
    seen[:] = 0.0
    accumulate(regions.probe[slot], states, march.state, u, seen)
    for k in range(count):
        third[k] = regions.constant[slot, k]
    for j in range(rows):
        real, imaginary = seen[3 * count + 2 * j], seen[3 * count + 2 * j + 1]
        size = np.sqrt(real * real + imaginary * imaginary)
        for k in range(count):
            third[k] += regions.weights[slot, k, j] * size


@kernel
def _choose(regions, march, watch, third, unsafe):
    """Longest safe level, at most one coarser than the last; fine + 1 if none is safe (then `unsafe` says who)."""
    slot = march.counts[SLOT]
    fine = regions.fine[slot]
    level = max(0, min(march.counts[LEVEL] - 1, fine))
    while level <= fine:
        h = LONGEST * 0.5**level
        march.tried[0] += h
        march.counts[TRIALS] += 1
        safe = True
        for k in range(unsafe.size):
            unsafe[k] = not _safe(regions, slot, k, march.side[k], watch, third[k], h)
            if unsafe[k]:
                safe = False
                if level < fine:
                    break
        if safe:
            break
        level += 1
    return level


@kernel
def _emit(regions, inputs, march, samples, u, h, work):
    """Store every sample in [now, now + h)."""
    now = march.clock[0] + march.clock[1]
    while march.counts[SAMPLE] < samples.slots.size:
        i = march.counts[SAMPLE]
        whole = i // samples.per_cycle
        ahead = (whole - march.counts[CYCLE]) + ((i - whole * samples.per_cycle) / samples.per_cycle - now)
        if ahead >= h and ahead > 0.0:
            break
        if ahead <= 0.0:
            samples.states[i] = march.state
        else:
            state_between(regions, inputs, march, u, now, ahead, work)
            samples.states[i] = work.state
        samples.slots[i] = march.counts[SLOT]
        march.counts[SAMPLE] += 1


@kernel
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


@kernel
def _cross(regions, march, log, x, h, order, k, upward, rate):
    """Move to the crossing at x h, log it, and step into the region beyond (PENDING if it is not built yet)."""
    evaluate(march.expansion, order, x, march.state)
    before = march.clock[0] + march.clock[1]
    _pass_time(march, x * h, False)
    i, slot = march.counts[EVENTS], march.counts[SLOT]
    carried = log.carried.shape[1]
    log.cycle[i] = march.counts[CYCLE]
    log.fraction[i] = march.clock[0] + march.clock[1]
    log.clearance[i] = k
    log.upward[i] = upward
    log.slot[i] = slot
    log.rate[i] = rate
    log.carried[i] = march.state[march.state.size - carried :]
    march.counts[EVENTS] += 1
    if march.clock[0] + march.clock[1] == before:
        march.counts[STALLED] += 1
    else:
        march.counts[STALLED] = 0
        march.side[:] = 0
    march.side[k] = -1 if upward else 1
    beyond = regions.neighbour[slot, k, upward]
    if beyond < 0:
        march.counts[PENDING] = 2 * k + upward
    else:
        march.counts[SLOT] = beyond


@kernel
def _rate_at(regions, march, k, x, h, states):
    """d delta_k / ds at x h inside the window."""
    probe = regions.probe[march.counts[SLOT]]
    total = 0.0
    for m in range(march.expansion.shape[0] - 1, 0, -1):
        coefficient = 0.0
        for j in range(states):
            coefficient += probe[j, k] * march.expansion[m, j]
        for j in range(march.waves.shape[1]):
            coefficient += probe[states + j, k] * march.waves[m, j]
        total = total * x + m * coefficient
    return total / h


@kernel
def march_on(regions, inputs, march, samples, log, budget):
    """March until all samples are stored, or until something above is needed.

    Args:
        regions, inputs, march, samples, log: see ``packed``; march, samples and log change.
        budget: most steps in this slice.

    Returns:
        an ``Outcome`` code.
    """
    width = regions.generator.shape[1]
    count = regions.lower.shape[1]
    order = march.expansion.shape[0] - 1
    u = np.empty(1 + 2 * inputs.cycles_high.size)
    states = width - u.size
    work = Work(np.empty(march.state.size), np.empty(u.size), march.expansion.copy(), march.waves.copy())
    increment = np.empty(march.state.size)
    watch, third = np.empty(regions.probe.shape[2]), np.empty(count)
    unsafe, gap = np.zeros(count, dtype=np.bool_), np.empty(order + 1)
    since_anchor = _ANCHOR_EVERY
    for _ in range(budget):
        if march.counts[PENDING] >= 0:
            return NEEDS_REGION
        if march.counts[SAMPLE] >= samples.slots.size:
            return DONE
        if march.counts[EVENTS] >= log.cycle.size:
            return LOG_FULL
        if march.counts[STALLED] > _MOST_STALLED:
            return CHATTER
        now = march.clock[0] + march.clock[1]
        if since_anchor >= _ANCHOR_EVERY:
            inputs_at(inputs, march.counts[CYCLE], now, u)
            since_anchor = 0
        _watch(regions, march, u, watch, third)
        level = _choose(regions, march, watch, third, unsafe)
        slot = march.counts[SLOT]
        fine = regions.fine[slot]
        march.counts[STEPS] += 1
        h = LONGEST * 0.5 ** min(level, fine)
        if level > fine:
            x, k, upward = first_crossing(regions, inputs, march, u, h, unsafe, gap)
            level = fine
            if x < NEVER:
                rate = _rate_at(regions, march, k, x, h, states)
                _emit(regions, inputs, march, samples, u, x * h, work)
                if march.counts[SAMPLE] >= samples.slots.size:
                    return DONE
                _cross(regions, march, log, x, h, order, k, upward, rate)
                march.counts[LEVEL] = level
                since_anchor = _ANCHOR_EVERY
                continue
        _emit(regions, inputs, march, samples, u, h, work)
        increment[:] = 0.0
        accumulate(regions.tables[regions.first_table[slot] + level], states, march.state, u, increment)
        for i in range(increment.size):
            march.state[i] += increment[i]
        if not np.isfinite(march.state[0]):
            return NON_FINITE
        march.side[:] = 0
        march.counts[LEVEL] = level
        _pass_time(march, h, True)
        since_anchor += 1
        for j in range(inputs.cycles_high.size):
            cosine, sine = inputs.turn_cosine[level, j], inputs.turn_sine[level, j]
            c, s = u[1 + 2 * j], u[2 + 2 * j]
            u[1 + 2 * j] = c * cosine - s * sine
            u[2 + 2 * j] = s * cosine + c * sine
    return SLICE_SPENT
