"""The state of a march at the time that it has reached: at a communication point of a co-simulation."""

from __future__ import annotations

import numpy as np

from gearrattle.engine.kernels._jit import kernel
from gearrattle.engine.kernels.march_arrays import CYCLE, ENTERED, ENTRY, SLOT
from gearrattle.engine.kernels.oscillators import chains_at, inputs_at
from gearrattle.engine.kernels.strip_products import copy
from gearrattle.engine.kernels.taylor_window import leave


@kernel
def state_at_point(particular, drift, states, inputs, march, state, driving):
    """Write the states and inputs at the present time; the march does not change.

    Inputs are computed from their phases and from the polynomials of the first interval of the signals: at its end
    these are left limits.

    particular, drift, states, inputs, march: see ``march_arrays``.
    state: (N + C,) states x, then carried quantities.
    driving: (U + Q,) inputs, then chains.
    """
    counts = march.counts
    clock = march.clock
    fraction = clock[0] + clock[1]
    # inputs, from their phases
    inputs_at(inputs, counts[CYCLE], fraction, driving)
    count = 1 + 2 * inputs.frequency.size
    # chains, from the start of their interval
    if driving.size > count:
        since = (counts[CYCLE] - inputs.knot_cycle[0]) + (fraction - inputs.knot_fraction[0])
        chains_at(inputs, 0, since, driving, count, np.zeros(4 * inputs.links + 8))
    # x = w + P u, and the carried quantities
    x = np.zeros(march.y.size)
    totals = np.zeros(march.carried.size)
    copy(march.y, march.y.size, x)
    copy(march.carried, march.carried.size, totals)
    if counts[ENTERED]:
        elapsed = (counts[CYCLE] - counts[ENTRY]) + (fraction - clock[2])
        out = np.zeros(march.y.size + march.carried.size)
        leave(particular, drift, states, counts[SLOT], driving[:count], elapsed, x, totals, out)
    for j in range(state.size):
        state[j] = x[j] if j < states else totals[j - states]
