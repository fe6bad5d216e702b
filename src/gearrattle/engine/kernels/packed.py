"""The arrays every march kernel sees, and nothing else.

Inside a region the states are x = w + P u (``system.forced``): w moves freely, P u is the particular solution of the
inputs that were split off; the others are *kept* as states behind w. The marcher's vector is y = (w, kept inputs).

Sizes: N states, the last S of them memories of auxiliaries, U = 1 + 2 H inputs, C carried quantities, K clearances, W
watched (the clearances, then the auxiliaries), Q entries of the chains of signals (``system.signals``), which are kept
behind the other inputs; M <= N + U + Q the longest y so far. A *slot* is a region that has been visited. Rows lie in
strips of four, (strips, columns, 4), the last strip of each group filled up with zeros; rows of rates and
increments hold the carried quantities' strips first, then those of y.
"""

from __future__ import annotations

from math import ceil, factorial, log2
from typing import Any, NamedTuple


class Inputs(NamedTuple):
    """The oscillators that drive the system."""

    cycles_high: Any  # (H,) oscillations a period, leading 24 bits
    cycles_low: Any  # (H,) the rest
    frequency: Any  # (H,) radians a period
    scale: Any  # (1 + H,) constant amplitudes
    steps: Any  # (levels,) see ``step_of``
    knot_cycle: Any  # (G,) begins of the signals' intervals, whole periods
    knot_fraction: Any  # (G,) the rest
    chains: Any  # (G, channels, D + 1, and zeros of as many strips) at the begin of every interval
    fourth: Any  # (G, Q) bounds on their fourth derivatives, all through every interval
    pace: float  # of the chains
    links: int  # D + 1, entries a channel has
    turn_cosine: Any  # (levels, H) rotation over one step of each level
    turn_sine: Any  # (levels, H)


class Instants(NamedTuple):
    """What happens at times known beforehand, ascending; the last never comes."""

    cycle: Any  # (instants,) whole periods
    fraction: Any  # (instants,) the rest
    watch: Any  # (instants,) the auxiliary that enters the piece above its own; -1: the next interval of signals begins


class Regions(NamedTuple):
    """What is known of every slot."""

    states: int  # N
    clearances: int  # K
    chain: int  # Q, the last entries of y
    width: Any  # (slots,) length of y
    kept: Any  # (slots, U) which inputs are kept, in the order they have in y
    first_table: Any  # (slots,) where its tables begin in `tables`
    fine: Any  # (slots,) its finest level
    tables: Any  # (tables, strips, M, 4) increments over a step
    powers: Any  # (4 slots, strips, M, 4) (h A)^1 ... (h A)^4, h the finest step
    particular: Any  # (slots, strips, U, 4) P, carried rows first
    drift: Any  # (slots, C filled up to fours) what the constant input adds to the carried quantities in a period
    probe: Any  # (slots, strips, M, 4) what is watched and three derivatives
    calm: Any  # (slots, strips, M, 4) the same without the fast modes
    forced: Any  # (slots, strips, U, 4) the same from the inputs split off
    series: Any  # (W slots, strips, M, 4) Taylor coefficients of all that is watched over the finest step
    forced_series: Any  # (W slots, strips, U, 4)
    forced_strips: Any  # (slots,) how many of them count: inputs turn little in a finest step
    modes: Any  # (slots,) how many modes bound the fourth derivatives
    bounds: Any  # (slots, strips, M, 4) their rows, four real and four imaginary parts in turn
    weights: Any  # (slots, strips, modes, 4) W bounds on fourth derivatives, W without fast modes, W on fast modes
    pushes: Any  # (slots, strips, Q, 4) the same on the fourth derivatives of chains
    constant: Any  # (slots, 4 strips)
    lower: Any  # (slots, W) bounds of what is watched, corner scales
    upper: Any  # (slots, W)
    band: Any  # (slots, W) rounding bands, corner scales; 0: relative to its motion
    known: Any  # (slots, S) memories on entering, scaled; NaN where they go on
    piece: Any  # (slots, W)
    neighbour: Any  # (slots, W, 2) slot beyond the lower, the upper corner; -1: not built yet


class Samples(NamedTuple):
    """Where sampled states go: sample i lies at i / per_cycle periods, in row i - first."""

    per_cycle: int
    first: int
    states: Any  # (samples, N + C) x, carried
    pieces: Any  # (samples, W)
    waves: Any  # (per_cycle, U) inputs at the samples of a period, not scaled; (0, U) where no two periods are alike


class Notes(NamedTuple):
    """What the march notes of the samples it passes in a step, see ``notes``."""

    row: Any  # (room,) of the first of them
    count: Any  # (room,) how many there are
    slot: Any  # (room,)
    ahead: Any  # (room,) periods from the state noted to the first
    elapsed: Any  # (room,) periods from the entry of the region to the first
    y: Any  # (room, N + U + Q filled up to fours)
    carried: Any  # (room, C filled up to fours)


class Log(NamedTuple):
    """Where crossings go."""

    cycle: Any  # (capacity,) whole periods
    fraction: Any  # (capacity,) the rest of the time, in periods
    clearance: Any  # (capacity,) or what else is watched
    upward: Any  # (capacity,) 1: delta grows through the corner
    piece: Any  # (capacity,) the piece left
    rate: Any  # (capacity,) d delta / ds in corner scales
    integral: Any  # (capacity,) the clearance's force integral
    memory: Any  # (capacity, S) memories before the crossing


class March(NamedTuple):
    """The marcher itself: everything that changes, and all a later run needs to go on with the same bits."""

    y: Any  # (N + U + Q, filled up to fours) w and kept inputs, or x while no region is entered
    carried: Any  # (C, filled up to fours) relative to their own particular solution, as w is
    u: Any  # (U,) inputs
    clock: Any  # (4,) anchor, offset, entry, age: time = cycle + anchor + offset, offset dyadic; the region was entered
    #   at entry cycle + entry; the bounds are as old as age
    counts: Any  # (COUNTS,) integers, see the names below
    tried: Any  # (1,) sum of all steps tried, in periods
    bound: Any  # (4 strips,) the present bounds, as in `weights`
    side: Any  # (W,) -1: sits on the lower corner (to the band), +1: on the upper one, 0: neither


LONGEST = 0.125
"""Step of level 0, in periods."""

DEEPEST = 120
"""The last level of all: 2^-60 of it."""

ORDER = 19
"""Order of the Taylor window; ORDER + 1 is a multiple of four."""

NEGLIGIBLE = 1e-17
"""Largest remainder of a Taylor series, relative to what it starts from."""

BAND = 1e-14
"""The rounding band: a clearance that sits on a corner leaves it once it is this far beyond, in corner scales.

A clearance whose only corner is at zero has no such scale; its band is relative to how far it moves in a finest step.
"""

ON_CORNER = 8 * 2.220446049250313e-16
"""A deflection this near to a corner, of the terms that make it, sits on it at the start."""

CYCLE, SLOT, LEVEL, SAMPLE, EVENTS, STEPS, TRIALS, EXPANSIONS, PENDING, STALLED, ENTERED, ENTRY = range(12)
UNANCHORED, UNBOUNDED, NOTED, INTERVAL, TICKS, INSTANT, PASSED, COUNTS = range(12, 20)
"""Indices into ``March.counts``. PENDING is 2 k + upward of a crossing into a region not built yet, else -1; ENTERED is
1 while y is relative to the slot's particular solution; ENTRY is the whole cycles at its entry; UNANCHORED counts steps
since the inputs were last computed afresh, UNBOUNDED those since the bounds were; NOTED are the notes taken; INTERVAL
is that of the signals, TICKS counts what clocks have done, INSTANT is the next one; PASSED is 1 while the last sample
noted lies in the step that is taken next."""


def step_of(level: int) -> float:
    """Step of a level, in periods: LONGEST, three quarters of it, a half, three eighths, a quarter ..., all dyadic."""
    return LONGEST * (1.0 - 0.25 * (level % 2)) / 2.0 ** (level // 2)


def level_within(longest: float) -> int:
    """The first level whose step is no longer than this."""
    octaves = max(0, ceil(log2(LONGEST / longest)))
    return 2 * octaves - 1 if octaves > 0 and 1.5 * LONGEST / 2.0**octaves <= longest else 2 * octaves


def window_norm(terms: int) -> float:
    """Norm |h A| up to which so many terms of exp(h A) leave a negligible remainder."""
    return float((NEGLIGIBLE * factorial(terms)) ** (1.0 / terms))
