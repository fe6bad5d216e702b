"""The arrays that every march kernel works on.

Inside a region the states are x = w + P u (``system.forced_response``): w moves freely, P u is the particular solution
of the inputs that were split off; the others are *kept* as states behind w. The marcher's vector is y = (w, kept
inputs).

Sizes: N states, the last S of them memories of auxiliaries, U = 1 + 2 H inputs, C carried quantities, K clearances, W
watched (the clearances, then the auxiliaries), Q entries of the chains of signals (``system.piecewise_signals``), which
are kept behind the other inputs; M <= N + U + Q the longest y so far. A *slot* is a region that has been visited. Rows
lie in strips of four, (strips, columns, 4), the last strip of each group filled up with zeros; rows of rates and
increments hold the carried quantities' strips first, then those of y.
"""

from __future__ import annotations

from math import ceil, factorial, log2
from typing import NamedTuple

from gearrattle.engine.kernels.arrays import Array3, Array4, IntArray3, IntMatrix, IntVector, Matrix, Vector


class Inputs(NamedTuple):
    """The oscillators that drive the system."""

    cycles_high: Vector  # (H,) oscillations per period, leading 24 bits
    cycles_low: Vector  # (H,) the rest
    frequency: Vector  # (H,) radians per period
    scale: Vector  # (1 + H,) constant amplitudes
    steps: Vector  # (levels,) see ``step_of``
    knot_cycle: Vector  # (G,) starts of the signals' intervals, whole periods
    knot_fraction: Vector  # (G,) the rest
    chains: Array3  # (G, channels, D + 1, and zeros of as many strips) at the start of every interval
    fourth: Matrix  # (G, Q) bounds on their fourth derivatives, all through every interval
    pace: float  # of the chains
    links: int  # D + 1, entries a channel has
    turn_cosine: Matrix  # (levels, H) rotation over one step of each level
    turn_sine: Matrix  # (levels, H)


class Instants(NamedTuple):
    """Instants known beforehand, ascending; the last never comes."""

    cycle: Vector  # (instants,) whole periods
    fraction: Vector  # (instants,) the rest
    watch: IntVector  # (instants,) the auxiliary that enters the piece above; -1: the next interval of signals begins


class Regions(NamedTuple):
    """The region in every slot."""

    states: int  # N
    clearances: int  # K
    chain: int  # Q, the last entries of y
    width: IntVector  # (slots,) length of y
    kept: IntMatrix  # (slots, U) which inputs are kept, in the order they have in y
    first_table: IntVector  # (slots,) where its tables begin in `tables`
    fine: IntVector  # (slots,) its finest level
    tables: Array4  # (tables, strips, M, 4) increments over a step
    powers: Array4  # (4 slots, strips, M, 4) (h A)^1 ... (h A)^4, h the finest step
    particular: Array4  # (slots, strips, U, 4) P, carried rows first
    drift: Matrix  # (slots, C filled up to fours) what the constant input adds to the carried quantities in a period
    probe: Array4  # (slots, strips, M, 4) what is watched and three derivatives
    calm: Array4  # (slots, strips, M, 4) the same without the fast modes
    forced: Array4  # (slots, strips, U, 4) the same from the inputs split off
    series: Array4  # (W slots, strips, M, 4) Taylor coefficients of all that is watched over the finest step
    forced_series: Array4  # (W slots, strips, U, 4)
    forced_strips: IntVector  # (slots,) how many of them count: inputs turn little in a finest step
    modes: IntVector  # (slots,) how many modes bound the fourth derivatives
    bounds: Array4  # (slots, strips, M, 4) their rows, four real and four imaginary parts in turn
    weights: Array4  # (slots, strips, modes, 4) W bounds on fourth derivatives, W without fast modes, W on fast modes
    pushes: Array4  # (slots, strips, Q, 4) the same on the fourth derivatives of chains
    constant: Matrix  # (slots, 4 strips)
    lower: Matrix  # (slots, W) bounds of what is watched, corner scales
    upper: Matrix  # (slots, W)
    band: Matrix  # (slots, W) rounding bands, corner scales; 0: relative to its motion
    known: Matrix  # (slots, S) memories on entering, scaled; NaN where they go on
    piece: IntMatrix  # (slots, W)
    neighbour: IntArray3  # (slots, W, 2) slot beyond the lower, the upper corner; -1: not built yet


class Samples(NamedTuple):
    """Sampled states, written: sample i lies at i / per_cycle periods, in row i - first."""

    per_cycle: int
    first: int
    states: Matrix  # (samples, N + C) x, carried
    pieces: IntMatrix  # (samples, W)
    waves: Matrix  # (per_cycle, U) inputs at the samples of a period, not scaled; (0, U) where no two periods are alike


class Notes(NamedTuple):
    """Notes of the samples that the march passes in a step, see ``sample_notes``."""

    row: IntVector  # (room,) of the first of them
    samples: IntVector  # (room,) how many there are
    slot: IntVector  # (room,)
    ahead: Vector  # (room,) periods from the state noted to the first
    elapsed: Vector  # (room,) periods from the entry of the region to the first
    y: Matrix  # (room, N + U + Q filled up to fours)
    carried: Matrix  # (room, C filled up to fours)


class Log(NamedTuple):
    """Log of crossings, written."""

    cycle: IntVector  # (capacity,) whole periods
    fraction: Vector  # (capacity,) the rest of the time, in periods
    clearance: IntVector  # (capacity,) or what else is watched
    upward: IntVector  # (capacity,) 1: delta grows through the corner
    piece: IntVector  # (capacity,) the piece left
    rate: Vector  # (capacity,) d delta / ds in corner scales
    integral: Vector  # (capacity,) the clearance's force integral
    memory: Matrix  # (capacity, S) memories before the crossing


class March(NamedTuple):
    """State of a march: all arrays that change, from which a later run goes on with the same bits."""

    y: Vector  # (N + U + Q, filled up to fours) w and kept inputs, or x while no region is entered
    carried: Vector  # (C, filled up to fours) relative to their own particular solution, as w is
    u: Vector  # (U,) inputs
    clock: (
        Vector  # (4,) anchor, offset, entry, age: time = cycle + anchor + offset, offset dyadic; the region was entered
    )
    #   at entry cycle + entry; the bounds are as old as age
    counts: IntVector  # (COUNTS,) integers, see the names below
    tried: Vector  # (1,) sum of all steps tried, in periods
    bound: Vector  # (4 strips,) the present bounds, as in `weights`
    side: IntVector  # (W,) -1: sits on the lower corner (to the band), +1: on the upper one, 0: neither


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
