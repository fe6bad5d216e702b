"""Instants that are known beforehand: knots of signals, ticks of clocks. A step ends exactly at such an instant."""

from __future__ import annotations

from gearrattle.engine.kernels._jit import inlined, kernel
from gearrattle.engine.kernels.march_arrays import CYCLE, INSTANT, INTERVAL, SLOT
from gearrattle.engine.kernels.oscillators import chains_at


@inlined
def until_instant(instants, counts, clock):
    """Time from now to the next instant, in periods."""
    i = counts[INSTANT]
    return (instants.cycle[i] - counts[CYCLE]) + (instants.fraction[i] - (clock[0] + clock[1]))


@inlined
def stand_at_instant(instants, counts, clock):
    """Set the clock to the next instant exactly."""
    i = counts[INSTANT]
    counts[CYCLE] = int(instants.cycle[i])
    clock[0] = instants.fraction[i]
    clock[1] = 0.0


@kernel
def write_chains(regions, inputs, march, scratch):
    """Write the chains of the signals at the present time into y."""
    if regions.chain == 0:
        return
    i = march.counts[INTERVAL]
    slot = march.counts[SLOT]
    since = (march.counts[CYCLE] - inputs.knot_cycle[i]) + (march.clock[0] + march.clock[1] - inputs.knot_fraction[i])
    chains_at(inputs, i, since, march.y, regions.width[slot] - regions.chain, scratch)
