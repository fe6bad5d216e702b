"""Lowest, highest and mean deflections along a motion, exact between its crossings.

Takes a Flow, the state at the start and the log of crossings; gives levels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.levels import levels
from gearrattle.engine.system.flow import Flow, Pieces
from gearrattle.engine.system.passages import Passages

Array = NDArray[np.float64]


def deflection_levels(flow: Flow, initial: Pieces, states: Array, path: Passages, end: float) -> Array:
    """Return (3, K) lowest, highest and mean deflection of every clearance [SI].

    Parameters
    ----------
    flow
        of the driveline.
    initial
        pieces at the start.
    states
        (N,) at the start, balanced.
    path
        all crossings.
    end
        of the motion [s].
    """
    system = flow.system
    index: dict[Pieces, int] = {}
    region = np.empty(len(path.time) + 1, np.int64)
    known = np.full((len(region), flow.width), np.nan)
    first, pieces = flow.states - flow.memory.size, initial
    for i in range(len(region)):
        region[i] = index.setdefault(pieces, len(index))
        if i > 0:
            known[i, first : flow.states] = flow.known(pieces)
        if i < len(path.time):
            pieces = system.beyond(pieces, int(path.watch[i]), int(path.upward[i]))
    period = system.inputs.period
    duration = np.maximum(np.diff(np.concatenate([[0.0], path.time, [end]])) / period, 0.0)
    z = np.concatenate([states, flow.inputs_at(np.zeros(1), np.zeros(1))[0]])
    rows = np.ascontiguousarray(flow.deflection[list(system.clearances)])
    out = np.empty((len(rows), 3))
    generators = np.array([flow.generator(one) for one in index])
    vectorised(levels)(generators, region, duration, known, z, rows, out)
    out[:, 2] /= end / period
    return np.ascontiguousarray(out.T)
