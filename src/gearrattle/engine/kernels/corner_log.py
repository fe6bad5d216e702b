"""The rounding band around a corner, and the log of crossings, for all event-driven marches.

After a crossing a clearance *sits* on the corner until it has moved away from it. While it sits, its gap to that corner
counts as a rounding band at least: so the same crossing is not counted twice, and rounding makes no crossing.
"""

from __future__ import annotations

from gearrattle.engine.kernels._jit import inlined
from gearrattle.engine.kernels.march_arrays import BAND

MOST_STALLED = 10_000
"""Most successive crossings at one instant."""

_LEAST = 1e-300  # band of a clearance that does not move


@inlined
def band_of(fixed, travel):
    """The rounding band; for a clearance without a scale (fixed is 0) relative to its travel in a finest step."""
    return fixed if fixed > 0.0 else max(BAND * travel, _LEAST)


@inlined
def has_left(side, below, above, band):
    """Whether a clearance that sits on its lower (-1) or upper (+1) corner has moved away from it."""
    return (side == -1 and below > 4.0 * band) or (side == 1 and above > 4.0 * band)


@inlined
def lifted(gap, band):
    """The gap to the corner on which a clearance sits, raised by the band."""
    return max(gap, 0.0) + band


@inlined
def log_crossing(log, i, cycle, fraction, k, upward, piece, rate, integral):
    """Write crossing i into the log."""
    log.cycle[i] = cycle
    log.fraction[i] = fraction
    log.clearance[i] = k
    log.upward[i] = upward
    log.piece[i] = piece
    log.rate[i] = rate
    log.integral[i] = integral
