"""The arrays that every march kernel works on.

Inside a region the states are x = w + P u (``system.forced_response``): w is the free motion, P u the particular
solution of the inputs that are split off. The other inputs are *kept* as states. The vector of the march is
y = (w, kept inputs, chains).

Sizes: N states, the last S of them memories of auxiliaries; U = 1 + 2 H inputs; C carried quantities; K clearances; W
watched quantities (the clearances, then the auxiliaries); Q entries of the chains of signals
(``system.piecewise_signals``); M <= N + U + Q the longest y so far. A *slot* holds one region that has been visited.
Rows lie in strips of four, (strips, columns, 4); the last strip of every group is filled up with zeros. Rows of rates
and increments hold the strips of the carried quantities first, then those of y.
"""

from __future__ import annotations

from math import ceil, factorial, log2
from typing import NamedTuple

from gearrattle.engine.kernels.arrays import Array3, Array4, IntArray3, IntMatrix, IntVector, Matrix, Vector


class Inputs(NamedTuple):
    """The oscillators that drive the system."""

    cycles_high: Vector  # (H,) oscillations per period, leading 24 bits
    cycles_low: Vector  # (H,) oscillations per period, the remaining bits
    frequency: Vector  # (H,) radians per period
    scale: Vector  # (1 + H,) constant amplitudes
    steps: Vector  # (levels,) see ``step_of``
    knot_cycle: Vector  # (G,) starts of the signals' intervals: whole periods
    knot_fraction: Vector  # (G,) fraction of a period
    chains: Array3  # (G, channels, D + 1 filled up to fours) chains at the start of every interval
    fourth: Matrix  # (G, Q) bounds on their fourth derivatives over every interval
    pace: float  # of the chains
    links: int  # D + 1, entries of one channel
    turn_cosine: Matrix  # (levels, H) rotation over one step of each level
    turn_sine: Matrix  # (levels, H)


class Instants(NamedTuple):
    """Instants that are known beforehand, ascending; the last one is never reached."""

    cycle: Vector  # (instants,) whole periods
    fraction: Vector  # (instants,) fraction of a period
    # (instants,) the auxiliary that enters its next piece; -1: the next interval of signals begins; LAST: the march
    # ends
    watch: IntVector


class Regions(NamedTuple):
    """The region in every slot."""

    states: int  # N
    clearances: int  # K
    chain: int  # Q, the last entries of y
    width: IntVector  # (slots,) length of y
    kept: IntMatrix  # (slots, U) indices of the kept inputs, in their order in y
    first_table: IntVector  # (slots,) index of the first table of a region in `tables`
    fine: IntVector  # (slots,) level of the finest step
    tables: Array4  # (tables, strips, M, 4) increments over a step
    powers: Array4  # (4 slots, strips, M, 4) (h A)^1 ... (h A)^4, h the finest step
    particular: Array4  # (slots, strips, U, 4) P, carried rows first
    drift: Matrix  # (slots, C filled up to fours) change of the carried quantities by the constant input in a period
    probe: Array4  # (slots, strips, M, 4) watched quantities of y, with three derivatives
    calm: Array4  # (slots, strips, M, 4) the same without the fast modes
    forced: Array4  # (slots, strips, U, 4) watched quantities of the inputs split off, with three derivatives
    series: Array4  # (W slots, strips, M, 4) Taylor coefficients of the watched quantities over the finest step, of y
    forced_series: Array4  # (W slots, strips, U, 4) the same of the inputs split off
    forced_strips: IntVector  # (slots,) number of strips of ``forced_series`` that are not negligible
    modes: IntVector  # (slots,) number of modes that bound the fourth derivatives
    bounds: Array4  # (slots, strips, M, 4) rows of these modes; strips of real and of imaginary parts alternate
    weights: Array4  # (slots, strips, modes, 4) bounds per mode, in the 3 W rows of ``workspace.Bounds``
    pushes: Array4  # (slots, strips, Q, 4) bounds per fourth derivative of a chain
    constant: Matrix  # (slots, 4 strips) constant part of the bounds
    lower: Matrix  # (slots, W) lower corners of the watched quantities, corner scales
    upper: Matrix  # (slots, W) upper corners
    band: Matrix  # (slots, W) rounding bands, corner scales; 0: relative to the motion
    known: Matrix  # (slots, S) memories at the entry, scaled; NaN: a memory keeps its value
    piece: IntMatrix  # (slots, W)
    neighbour: IntArray3  # (slots, W, 2) slot beyond the lower and beyond the upper corner; -1: not built yet


class Samples(NamedTuple):
    """Sampled states, written: sample i is taken at i / per_cycle periods, and stored in row i - first."""

    per_cycle: int
    first: int
    states: Matrix  # (samples, N + C) states x, then carried quantities
    pieces: IntMatrix  # (samples, W)
    waves: Matrix  # (per_cycle, U) inputs at the samples of a period, not scaled; (0, U) if periods are not equal


class Notes(NamedTuple):
    """Notes of the samples in steps of the march, see ``sample_notes``."""

    row: IntVector  # (room,) row of the first sample
    samples: IntVector  # (room,) number of samples
    slot: IntVector  # (room,)
    ahead: Vector  # (room,) periods from the noted state to the first sample
    elapsed: Vector  # (room,) periods from the entry into the region to the first sample
    y: Matrix  # (room, N + U + Q filled up to fours)
    carried: Matrix  # (room, C filled up to fours)


class Log(NamedTuple):
    """Log of crossings, written."""

    cycle: IntVector  # (capacity,) whole periods
    fraction: Vector  # (capacity,) fraction of a period
    clearance: IntVector  # (capacity,) index of the watched quantity
    upward: IntVector  # (capacity,) 1: delta grows through the corner
    piece: IntVector  # (capacity,) the piece that is left
    rate: Vector  # (capacity,) d delta / ds in corner scales
    integral: Vector  # (capacity,) the clearance's force integral
    memory: Matrix  # (capacity, S) memories before the crossing


class March(NamedTuple):
    """State of a march: all arrays that change; a later run continues from them with the same bits."""

    y: Vector  # (N + U + Q, filled up to fours) w, kept inputs and chains; x while no region is entered
    carried: Vector  # (C, filled up to fours) carried quantities without their particular solution
    u: Vector  # (U,) inputs
    # anchor, offset, entry, age [periods]: the time is cycle + anchor + offset, with a dyadic offset; the region was
    # entered at cycle ENTRY + entry; age is the time since the bounds were computed
    clock: Vector  # (4,)
    counts: IntVector  # (COUNTS,) integers, see the names below
    tried: Vector  # (1,) sum of all steps tried, in periods
    bound: Vector  # (4 strips,) the present bounds, as in `weights`
    side: IntVector  # (W,) -1: sits on the lower corner (to the band), +1: on the upper corner, 0: on no corner


LONGEST = 0.125
"""Step of level 0, in periods."""

LAST = -2
"""``Instants.watch`` of the end of a march that ends between samples."""

DEEPEST = 120
"""The last level; its step is 2^-60 LONGEST."""

ORDER = 19
"""Order of the Taylor window; ORDER + 1 is a multiple of four."""

NEGLIGIBLE = 1e-17
"""Largest remainder of a Taylor series, relative to its first term."""

BAND = 1e-14
"""The rounding band: half-width around a corner in which a deflection counts as on it, in corner scales.

A clearance whose only corner is at zero has no such scale; its band is relative to its travel in a finest step.
"""

ON_CORNER = 8 * 2.220446049250313e-16
"""At the start a deflection sits on a corner if its distance is below this share of the sum of its terms' moduli."""

CYCLE, SLOT, LEVEL, SAMPLE, EVENTS, STEPS, TRIALS, EXPANSIONS, PENDING, STALLED, ENTERED, ENTRY = range(12)
UNANCHORED, UNBOUNDED, NOTED, INTERVAL, TICKS, INSTANT, PASSED, COUNTS = range(12, 20)
"""Indices into ``March.counts``. PENDING: 2 k + upward of a crossing into a region that is not built yet, else -1;
ENTERED: 1 while y is relative to the slot's particular solution; ENTRY: whole cycles at the entry into the region;
UNANCHORED: steps since the inputs were computed from their phases; UNBOUNDED: steps since the bounds were computed;
NOTED: number of notes; INTERVAL: index of the signals' interval; TICKS: number of changes by the clock; INSTANT: index
of the next known instant; PASSED: 1 while the last noted sample lies in the step that is taken next."""


def step_of(level: int) -> float:
    """Step of a level, in periods: LONGEST, three quarters of it, a half, three eighths, a quarter ..., all dyadic."""
    return LONGEST * (1.0 - 0.25 * (level % 2)) / 2.0 ** (level // 2)


def level_within(longest: float) -> int:
    """The first level whose step is not longer than ``longest``."""
    octaves = max(0, ceil(log2(LONGEST / longest)))
    return 2 * octaves - 1 if octaves > 0 and 1.5 * LONGEST / 2.0**octaves <= longest else 2 * octaves


def window_norm(terms: int) -> float:
    """Largest norm |h A| for which ``terms`` terms of exp(h A) leave a negligible remainder."""
    return float((NEGLIGIBLE * factorial(terms)) ** (1.0 / terms))
