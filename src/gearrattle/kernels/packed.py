"""The arrays every march kernel sees, and nothing else.

Sizes: N states, C carried quantities, Z = N + 1 + 2 H entries of z, K clearances, J bound rows. The marcher's vector is
y = (z, carried). A *slot* is a region that has been visited. Rows that multiply z are stored in strips of four,
(strips, Z, 4), so that a product keeps four sums in registers; strips of rates and increments hold the states' rows,
then the carried ones, the last strip filled up with zeros.
"""

from __future__ import annotations

from typing import Any, NamedTuple


class Inputs(NamedTuple):
    """The oscillators that drive the system."""

    cycles_high: Any  # (H,) oscillations a period, leading 24 bits
    cycles_low: Any  # (H,) the rest
    scale: Any  # (1 + H,) constant amplitudes in z
    steps: Any  # (levels,) LONGEST / 2^level
    turn_cosine: Any  # (levels, H) rotation over one step of each level
    turn_sine: Any  # (levels, H)


class Regions(NamedTuple):
    """What is known of every slot."""

    first_table: Any  # (slots,) where its tables begin in `tables`
    fine: Any  # (slots,) its finest level
    tables: Any  # (tables, strips, Z, 4) increments over a step
    generator: Any  # (slots, strips, Z, 4) rates
    probe: Any  # (slots, strips, Z, 4) deflections, rates, curvatures; in strips of their own, bound rows (re, im)
    bound_rows: Any  # (slots,) how many bound rows
    weights: Any  # (slots, K, J)
    constant: Any  # (slots, K)
    lower: Any  # (slots, K) corners, corner scales
    upper: Any  # (slots, K)
    neighbour: Any  # (slots, K, 2) slot beyond the lower, the upper corner; -1: not built yet


class Samples(NamedTuple):
    """Where sampled states go: sample i lies at i / per_cycle periods."""

    per_cycle: int
    states: Any  # (samples, Z + C)
    slots: Any  # (samples,)


class Log(NamedTuple):
    """Where crossings go."""

    cycle: Any  # (capacity,) whole periods
    fraction: Any  # (capacity,) the rest of the time, in periods
    clearance: Any  # (capacity,)
    upward: Any  # (capacity,) 1: delta grows through the corner
    slot: Any  # (capacity,) the region left
    rate: Any  # (capacity,) d delta / ds in corner scales
    integral: Any  # (capacity,) the clearance's force integral


class March(NamedTuple):
    """The marcher itself: everything that changes."""

    y: Any  # (Z + C,)
    clock: Any  # (2,) anchor and offset: time = cycle + anchor + offset; offset is a dyadic fraction
    counts: Any  # (10,) integers, see the names below
    tried: Any  # (1,) sum of all steps tried, in periods
    side: Any  # (K,) -1: sits on the lower corner (to the band), +1: on the upper one, 0: neither
    expansion: Any  # (ORDER + 1, Z + C) Taylor coefficients over the finest step


class Work(NamedTuple):
    """Scratch."""

    y: Any  # (Z + C,) a sample's vector, so that a sample never disturbs the march
    expansion: Any  # (ORDER + 1, Z + C)
    out: Any  # (4 strips,) a product with rates or increments
    seen: Any  # (4 strips,) a product with the probe
    third: Any  # (K,) bounds on third derivatives
    gap: Any  # (ORDER + 1,) one gap's Taylor coefficients


LONGEST = 0.125
"""Step of level 0, in periods; level l steps LONGEST / 2^l."""

BAND = 1e-14
"""The rounding band, in corner scales: a clearance that sits on a corner leaves it once it is this far beyond."""

CYCLE, SLOT, LEVEL, SAMPLE, EVENTS, STEPS, TRIALS, EXPANSIONS, PENDING, STALLED = range(10)
"""Indices into ``March.counts``; PENDING is 2 k + upward of a crossing into a region not built yet, else -1."""
