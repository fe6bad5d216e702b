"""The certified march inside one region, and the crossing to the next.

Every step has the longest dyadic length h for which no clearance can leave its region. The gap g of a clearance and its
first three derivatives are known at the start, and |delta''''| <= b holds in the whole region (``system.majorant``): so
a minorant of g is known, which must stay positive over the step. If even the finest step is not safe, the deflections
over it are polynomials to rounding, and the first crossing is their first root (``first_exit.first_exit``). No crossing
is skipped: every instant lies in a step that is proven free of crossings, or in a window searched from its beginning.

The kernel works in slices and returns an ``Outcome`` code, so that its caller can show progress, enlarge the log, or
build a region that is entered for the first time. The end of a slice changes no bit of the motion. Nor does the end of
a run that is continued with new samples: the step that contains the last sample is taken by the continued run.
"""

from __future__ import annotations

import numpy as np

from gearrattle.engine.kernels._jit import inlined, kernel
from gearrattle.engine.kernels.corner_log import MOST_STALLED, band_of, has_left, lifted, log_crossing
from gearrattle.engine.kernels.first_exit import NEVER, SIXTH, stays_inside
from gearrattle.engine.kernels.known_instants import stand_at_instant, until_instant, write_chains
from gearrattle.engine.kernels.march_arrays import (
    CYCLE,
    ENTERED,
    ENTRY,
    EVENTS,
    EXPANSIONS,
    INSTANT,
    INTERVAL,
    LAST,
    LEVEL,
    LONGEST,
    NOTED,
    ORDER,
    PASSED,
    PENDING,
    SAMPLE,
    SLOT,
    STALLED,
    STEPS,
    TICKS,
    TRIALS,
    UNANCHORED,
    UNBOUNDED,
)
from gearrattle.engine.kernels.oscillators import inputs_at, turn_little, turn_step
from gearrattle.engine.kernels.outcomes import (
    CHATTER,
    DONE,
    LOG_FULL,
    NEEDS_REGION,
    NO_PROGRESS,
    NON_FINITE,
    NOTES_FULL,
    SLICE_SPENT,
)
from gearrattle.engine.kernels.sample_notes import note
from gearrattle.engine.kernels.strip_products import multiply, multiply_add
from gearrattle.engine.kernels.taylor_window import (
    advance,
    enter,
    first_crossing,
    leave,
    move_within,
    reach_of,
    recall,
    strips_of,
    window_scratch,
)

_REACH = 4  # levels by which a step may be longer than the last one
_LEAP = 6  # levels by which a step may be longer than a finest step before it
_ANCHOR_EVERY = 16  # steps after which the inputs are computed from their phase; in between they are rotated
_SMALL = 4.0  # least ratio of a gap to the bound on the fast modes for which they are judged by that bound
_BOUND_EVERY = 3  # steps for which a bound is used; it holds for twice the longest step
_NEAR = 1e-9  # periods: nearer to a sample, the time to it is computed anew and not as a running difference


@inlined
def _counted(gap, rate, band):
    """The gap that is tested: lifted by the band > 0 if the motion sits on the corner; zero if it opens from below."""
    if band > 0.0:
        return lifted(gap, band)
    return 0.0 if gap <= 0.0 and rate > 0.0 else gap


@inlined
def _third(jerk, fourth, h):
    """The third derivative of a cubic minorant over h: fourth s^4 / 24 <= (h fourth / 4) s^3 / 6 for 0 <= s <= h."""
    return max(0.25 * h * fourth - jerk, 0.0)


@inlined
def _ends_inside(low, high, rate, curvature, jerk, fourth, h):
    """Whether the minorants of both gaps are positive at the end of a step h, which is necessary for a safe step."""
    near = rate + h * (0.5 * curvature - h * SIXTH * _third(jerk, fourth, h))
    far = rate + h * (0.5 * curvature + h * SIXTH * _third(-jerk, fourth, h))
    return low + h * near > 0.0 and high - h * far > 0.0


@inlined
def _choose_level(lower, upper, bands, slot, near, steps, level, fine, unsafe):
    """The longest dyadic step, from ``level`` on, over which every clearance stays in its region.

    If the bound on the fast modes is small against the gaps of a clearance, the gaps without fast modes (``calm``) are
    tested, reduced by that bound.

    Returns (level, safe): not safe if even the finest step might reach a corner; ``unsafe`` (k, lower or upper) marks
        these corners. A step that is safe for one clearance stays safe if another clearance shortens it.
    """
    seen, calm, bound, side, band = near
    count = side.size
    safe = True
    for k in range(count):
        value = seen[4 * k]
        rate = seen[4 * k + 1]
        curvature = seen[4 * k + 2]
        jerk = seen[4 * k + 3]
        below = value - lower[slot, k]
        above = upper[slot, k] - value
        fourth = bound[k]
        margin = bound[k + 2 * count]
        unsafe[k, 0] = False
        unsafe[k, 1] = False
        # a bound for both gaps: the motion cannot reach the nearer corner
        h = steps[level]
        room = min(below, above)
        if room > h * (abs(rate) + h * (0.5 * abs(curvature) + h * SIXTH * (abs(jerk) + 0.25 * h * fourth))):
            continue
        # an element that sits on a corner leaves it once it is farther away than the band
        travel = steps[fine] * (abs(rate) + steps[fine] * 0.5 * abs(curvature))
        band[k] = band_of(bands[slot, k], travel)
        if has_left(side[k], below, above, band[k]):
            side[k] = 0
        # small fast modes: minorants (M') of the motion without them, gaps reduced by their bound m
        if room > _SMALL * margin:
            below = calm[4 * k] - lower[slot, k] - margin
            above = upper[slot, k] - calm[4 * k] - margin
            rate = calm[4 * k + 1]
            curvature = calm[4 * k + 2]
            jerk = calm[4 * k + 3]
            fourth = bound[k + count]
        # the longest step for which both minorants (M) or (M') stay positive
        low = _counted(below, rate, band[k] if side[k] == -1 else 0.0)
        high = _counted(above, -rate, band[k] if side[k] == 1 else 0.0)
        while level < fine and not _ends_inside(low, high, rate, curvature, jerk, fourth, steps[level]):
            level += 1
        while True:
            h = steps[level]
            nears = low < 1e300 and not stays_inside(low, rate, curvature, _third(jerk, fourth, h), h)
            fars = high < 1e300 and not stays_inside(high, -rate, -curvature, _third(-jerk, fourth, h), h)
            if not (nears or fars):
                break
            # not even the finest step is safe: its Taylor polynomials must be searched
            if level == fine:
                unsafe[k, 0] = nears
                unsafe[k, 1] = fars
                safe = False
                break
            level += 1
    return level, safe


@inlined
def _bound_pushes(pushes, fourth, slot, interval, size, bound):
    """Add to the bounds the part due to the fourth derivatives of the chains."""
    for j in range(fourth.shape[1]):
        size[j] = fourth[interval, j]
    multiply_add(pushes, slot, bound.size // 4, fourth.shape[1], size, bound)


@inlined
def _bound(bounds, weights, constant, slot, width, modes, y, parts, size, bound):
    """Bound the fourth derivatives and the fast modes in the whole region, from the moduli of the modes."""
    groups = strips_of(modes)
    multiply(bounds, slot, 2 * groups, width, y, parts, 0)
    for g in range(groups):
        r = 8 * g
        i = 8 * g + 4
        for j in range(4):
            size[4 * g + j] = np.sqrt(parts[r + j] * parts[r + j] + parts[i + j] * parts[i + j])
    for i in range(0, bound.size, 4):
        b0 = constant[slot, i]
        b1 = constant[slot, i + 1]
        b2 = constant[slot, i + 2]
        b3 = constant[slot, i + 3]
        bound[i] = b0
        bound[i + 1] = b1
        bound[i + 2] = b2
        bound[i + 3] = b3
    multiply_add(weights, slot, bound.size // 4, modes, size, bound)


@inlined
def _pass_time(counts, clock, h, dyadic):
    """Advance the clock by h; a dyadic h is added to the exact offset, any other sets a new anchor."""
    if dyadic:
        clock[1] += h
    else:
        clock[0] += clock[1] + h
        clock[1] = 0.0
    while clock[0] + clock[1] >= 1.0:
        counts[CYCLE] += 1
        clock[1] -= 1.0


@inlined
def _count(counts, clock, first, level, safe, passed):
    """Count a step of the level ``level``, for which the levels from ``first`` on were tested."""
    counts[TRIALS] += level - first + 1
    counts[STEPS] += 1
    counts[LEVEL] = level
    counts[EXPANSIONS] += not safe
    clock[3] += passed
    counts[UNANCHORED] += 1
    counts[UNBOUNDED] += 1
    counts[PASSED] = 0


@inlined
def _elapsed(counts, clock):
    """Time in the region, in periods."""
    return (counts[CYCLE] - counts[ENTRY]) + (clock[0] + clock[1] - clock[2])


@inlined
def _ahead(counts, clock, i, per_cycle):
    """Time from now to sample i, in periods."""
    whole = i // per_cycle
    part = (i - whole * per_cycle) / per_cycle
    return (whole - counts[CYCLE]) + (part - (clock[0] + clock[1]))


@inlined
def _pass_samples(march, samples, notes, h):
    """Note every sample in [now, now + h) while there is room for notes."""
    counts = march.counts
    per_cycle = samples.per_cycle
    elapsed = _elapsed(counts, march.clock)
    last = samples.first + samples.pieces.shape[0]
    # If a period's first sample was passed in this step before the run went on, the next ones follow from it.
    i = counts[SAMPLE] - (1 if counts[PASSED] and (counts[SAMPLE] - 1) % per_cycle == 0 else 0)
    while counts[SAMPLE] < last and counts[NOTED] < notes.row.size:
        # the samples of one period that lie in the step follow from the first of them
        first = i
        ahead = max(_ahead(counts, march.clock, i, per_cycle), 0.0)
        while i < last and (i == first or i % per_cycle != 0):
            reached = ahead + (i - first) / per_cycle
            if reached >= h and reached > 0.0:
                break
            i += 1
        if i <= counts[SAMPLE]:
            break
        # one note for all: the states at these samples are computed later from the present state
        rows = first - samples.first, i - first
        note(notes, counts, rows, counts[SLOT], march.y, march.carried, ahead, elapsed + ahead)
        counts[SAMPLE] = i
        counts[PASSED] = 1


@inlined
def _cross(regions, march, log, k, upward, rate, behind):
    """Log that k leaves its piece, and enter the region beyond; set PENDING if that region is not built yet.

    The force integrals of the clearances are the last entries of the ``behind`` carried quantities.
    """
    counts = march.counts
    clock = march.clock
    slot = march.counts[SLOT]
    memories = regions.known.shape[1]
    # log the crossing: its instant, direction, rate, force integral and the memories
    integral = march.carried[behind - regions.clearances + k] if k < regions.clearances else 0.0
    i = counts[EVENTS]
    piece = regions.piece[slot, k]
    log_crossing(log, i, counts[CYCLE], clock[0] + clock[1], k, upward, piece, rate, integral)
    for s in range(memories):
        log.memory[i, s] = march.y[regions.states - memories + s]
    counts[EVENTS] = i + 1
    # the new region follows from the direction of the crossing; the element sits on the corner
    counts[ENTERED] = 0
    march.side[k] = -1 if upward else 1
    beyond = regions.neighbour[slot, k, upward]
    if beyond < 0:
        counts[PENDING] = 2 * k + upward
    else:
        counts[SLOT] = beyond


@inlined
def _pass_instant(regions, instants, march, log, out, behind):
    """Begin the next interval of the signals, or change the piece of an auxiliary by the clock."""
    counts = march.counts
    clock = march.clock
    slot = march.counts[SLOT]
    k = instants.watch[counts[INSTANT]]
    counts[INSTANT] += 1
    counts[UNBOUNDED] = _BOUND_EVERY
    if k < 0:
        counts[INTERVAL] += 1
        return
    counts[TICKS] += 1
    if counts[ENTERED]:
        past = _elapsed(counts, clock)
        leave(regions.particular, regions.drift, regions.states, slot, march.u, past, march.y, march.carried, out)
    _cross(regions, march, log, k, 1, 0.0, behind)


@inlined
def _anchor(inputs, regions, march, end):
    """Compute the inputs from their phases, and with them the kept inputs in y up to the entry ``end``."""
    counts = march.counts
    clock = march.clock
    slot = march.counts[SLOT]
    inputs_at(inputs, counts[CYCLE], clock[0] + clock[1], march.u)
    counts[UNANCHORED] = 0
    states = regions.states
    if counts[ENTERED]:
        for i in range(states, end):
            march.y[i] = march.u[regions.kept[slot, i - states]]


@inlined
def _look(forced, probe, calm_rows, slot, width, watched, y, u, seen, calm):
    """Write the watched quantities with three derivatives, one strip for each: all of it, and without fast modes."""
    multiply(forced, slot, watched, u.size, u, seen, 0)
    for i in range(0, 4 * watched, 4):
        calm[i] = seen[i]
        calm[i + 1] = seen[i + 1]
        calm[i + 2] = seen[i + 2]
        calm[i + 3] = seen[i + 3]
    multiply_add(probe, slot, watched, width, y, seen)
    multiply_add(calm_rows, slot, watched, width, y, calm)


@kernel
def march_on(regions, inputs, instants, march, samples, notes, log, budget):
    """March until all samples are noted, ``budget`` steps are taken or the caller must act; return an ``Outcome`` code.

    The arguments are described in ``march_arrays``; march, notes and log change. ``instants``: None if no instants are
    known beforehand; the march ends at one that is the ``LAST``. A step ends at the next instant at the latest, and a
    crossing after that instant does not count yet. Samples in a step are noted before the step is taken. Scratch arrays
    are allocated here, so that the compiler knows that they do not overlap with others.
    """
    steps = inputs.steps
    tables = regions.tables
    first_table = regions.first_table
    powers = regions.powers
    cosines = inputs.turn_cosine
    sines = inputs.turn_sine
    frequency = inputs.frequency
    lower = regions.lower
    upper = regions.upper
    states = regions.states
    widths = regions.width
    finest = regions.fine
    probe = regions.probe
    calm = regions.calm
    forced = regions.forced
    bounds = regions.bounds
    modes = regions.modes
    weights = regions.weights
    constant = regions.constant
    kept = regions.kept
    particular = regions.particular
    series = regions.series
    forced_series = regions.forced_series
    forced_strips = regions.forced_strips
    y = march.y
    carried = march.carried
    u = march.u
    clock = march.clock
    counts = march.counts
    side = march.side
    bound = march.bound
    tried = march.tried
    bands = regions.band
    watched = side.size
    per_cycle = samples.per_cycle
    last = samples.first + samples.pieces.shape[0]
    room = log.cycle.size
    behind = samples.states.shape[1] - states
    rows = carried.size + y.size
    longest = y.size
    until = np.inf
    chain = 0 if instants is None else regions.chain
    scratch = window_scratch(carried.size, longest)
    gap = np.zeros(ORDER + 1)
    band = np.zeros(side.size)
    out = scratch[0]
    terms = scratch[1]
    unsafe = np.zeros((side.size, 2), dtype=np.bool_)
    seen = np.zeros(4 * watched)
    still = np.zeros(4 * watched)
    parts = np.zeros(2 * longest)
    size = np.zeros(rows)
    near = (seen, still, bound, side, band)
    ahead = _ahead(counts, clock, counts[SAMPLE], per_cycle)
    for _ in range(budget):
        # stop where the caller must act: all samples noted, a region to build, a log that is full
        if counts[SAMPLE] >= last:
            return DONE
        if counts[PENDING] >= 0:
            return NEEDS_REGION
        if counts[EVENTS] >= room:
            return LOG_FULL
        # every few steps the inputs are computed from their phases
        slot = counts[SLOT]
        fine = finest[slot]
        width = widths[slot]
        if counts[UNANCHORED] >= _ANCHOR_EVERY:
            _anchor(inputs, regions, march, width - chain)
            ahead = _ahead(counts, clock, counts[SAMPLE], per_cycle)
        # a known instant: a knot of a signal, or an auxiliary element that changes by the clock
        if instants is not None:
            until = until_instant(instants, counts, clock)
            if until <= 0.0:
                if instants.watch[counts[INSTANT]] == LAST:
                    return DONE
                _pass_instant(regions, instants, march, log, out, behind)
                continue
        # enter a region: split off the inputs' particular solution, x = w + P u
        if not counts[ENTERED]:
            recall(regions, slot, y)
            enter(particular, kept, states, width - chain, slot, u, y, carried, out)
            counts[ENTERED] = 1
            counts[UNBOUNDED] = _BOUND_EVERY
            counts[ENTRY] = counts[CYCLE]
            clock[2] = clock[0] + clock[1]
        # the chains of the signals are written from their table
        if instants is not None:
            write_chains(regions, inputs, march, terms)
        # bound the fourth derivatives (B) and the fast modes in the whole region
        if counts[UNBOUNDED] >= _BOUND_EVERY or clock[3] > LONGEST:
            counts[UNBOUNDED] = 0
            clock[3] = 0.0
            _bound(bounds, weights, constant, slot, width, modes[slot], y, parts, size, bound)
            if instants is not None:
                _bound_pushes(regions.pushes, inputs.fourth, slot, counts[INTERVAL], size, bound)
        # the longest dyadic step over which the minorants (M) of all gaps stay positive
        _look(forced, probe, calm, slot, width, watched, y, u, seen, still)
        first = max(0, counts[LEVEL] - _REACH if counts[LEVEL] < fine else fine - _LEAP)
        level, safe = _choose_level(lower, upper, bands, slot, near, steps, first, fine, unsafe)
        while steps[level] > until and level < fine:
            level += 1
        h = steps[level]
        passed = h
        k = -1
        upward = 0
        rate = 0.0
        x = NEVER
        chained = (chain, inputs.links, inputs.pace * steps[fine])
        # no safe step: first root of the gaps' Taylor polynomials over the finest step
        if not safe:
            reach = 1.0 if instants is None else reach_of(until, h)
            x, k, upward, rate = first_crossing(
                series, forced_series, forced_strips, lower, upper, slot, width, y, u, side, band, unsafe, gap, h, reach
            )
            if x < 0.0:
                return NO_PROGRESS if np.isfinite(y.sum()) else NON_FINITE
            passed = x * h if x < NEVER else h
        if passed > until:
            passed = until
            x = NEVER
        if ahead < passed + _NEAR:
            _pass_samples(march, samples, notes, passed)
            ahead = _ahead(counts, clock, counts[SAMPLE], per_cycle)
            if counts[SAMPLE] >= last:
                return DONE  # the step is not taken yet: a continued run takes and counts it
            if counts[NOTED] >= notes.row.size:
                return NOTES_FULL  # the step is not taken yet
        tried[0] += 2.0 * steps[first] - h
        _count(counts, clock, first, level, safe, passed)
        ahead -= passed
        # a crossing: move to the root by the Taylor polynomial, leave the region, log the crossing, change the piece
        if x < NEVER:
            move_within(powers, slot, width, chained, x, y, carried, scratch)
            turn_little(frequency, passed, u)
            before = clock[0] + clock[1]
            _pass_time(counts, clock, passed, False)
            leave(particular, regions.drift, states, slot, u, _elapsed(counts, clock), y, carried, out)
            _cross(regions, march, log, k, upward, rate, behind)
            counts[STALLED] = counts[STALLED] + 1 if clock[0] + clock[1] == before else 0
            if counts[STALLED] > MOST_STALLED:
                return CHATTER
            continue
        # a known instant within the window: the Taylor polynomial up to it
        if instants is not None and passed < h:
            move_within(powers, slot, width, chained, passed / h, y, carried, scratch)
            turn_little(frequency, passed, u)
            stand_at_instant(instants, counts, clock)
            continue
        # a step without crossing: one product with the table E_l, and a rotation of the inputs
        advance(tables, first_table[slot] + level, width, chain, y, carried, out)
        turn_step(cosines, sines, level, u)
        _pass_time(counts, clock, h, True)
        if not np.isfinite(y[0]):
            return NON_FINITE
    return SLICE_SPENT
