"""Lowest, highest and mean deflections along a motion, and its extreme forces, exact between its crossings."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearrattle.engine.kernels._jit import vectorised
from gearrattle.engine.kernels.motion_levels import levels
from gearrattle.engine.system.crossings_in_order import Passages
from gearrattle.engine.system.flow import Flow, Pieces

Array = NDArray[np.float64]


class _Intervals(NamedTuple):
    """A motion between its crossings, I intervals in R regions."""

    regions: tuple[Pieces, ...]  # pieces of every region
    region: NDArray[np.int64]  # (I,) of every interval
    duration: Array  # (I,) of every interval, in periods
    known: Array  # (I, Z) entries of z that are set where an interval starts; NaN for those that go on
    z: Array  # (Z,) at the start


def deflection_levels(flow: Flow, initial: Pieces, states: Array, path: Passages, end: float) -> Array:
    """Return (3, K) lowest, highest and mean deflection of every clearance [SI].

    initial: pieces at the start.
    states: (N,) at the start, balanced.
    end: of the motion [s].
    """
    intervals = _intervals(flow, initial, states, path, end)
    rows = np.ascontiguousarray(flow.deflection[list(flow.system.clearances)])
    out = np.empty((len(rows), 3))
    generators = np.array([flow.generator(one) for one in intervals.regions])
    vectorised(levels)(generators, intervals.region, intervals.duration, intervals.known, intervals.z, rows, out)
    out[:, 2] /= end / flow.system.inputs.period
    return np.ascontiguousarray(out.T)


def force_levels(flow: Flow, initial: Pieces, states: Array, path: Passages, end: float) -> Array:
    """Return (2, K) lowest and highest force of every clearance, elastic and damping [N m or N].

    At a crossing the force may jump; both its limits count. Arguments as of ``deflection_levels``.
    """
    regions, region, duration, known, z = _intervals(flow, initial, states, path, end)
    chosen = list(flow.system.clearances)
    first = np.zeros(1, np.int64)
    generators = [flow.generator(one)[None] for one in regions]
    rows = [np.ascontiguousarray(flow.force_rows(one)[chosen]) for one in regions]
    out = np.empty((len(region), len(chosen), 3))
    for i, one in enumerate(region):  # the rows of a force differ from region to region
        vectorised(levels)(generators[one], first, duration[i : i + 1], known[i : i + 1], z, rows[one], out[i])
    return np.stack([out[:, :, 0].min(axis=0), out[:, :, 1].max(axis=0)])


def _intervals(flow: Flow, initial: Pieces, states: Array, path: Passages, end: float) -> _Intervals:
    """A motion between its crossings; arguments as of ``deflection_levels``."""
    index: dict[Pieces, int] = {}
    region = np.empty(len(path.time) + 1, np.int64)
    known = np.full((len(region), flow.width), np.nan)
    first = flow.states - flow.memory.size
    pieces = initial
    for i in range(len(region)):
        region[i] = index.setdefault(pieces, len(index))
        if i > 0:
            known[i, first : flow.states] = flow.known(pieces)
        if i < len(path.time):
            pieces = flow.system.beyond(pieces, int(path.watch[i]), int(path.upward[i]))
    duration = np.maximum(np.diff(np.concatenate([[0.0], path.time, [end]])) / flow.system.inputs.period, 0.0)
    z = np.concatenate([states, flow.inputs_at(np.zeros(1), np.zeros(1))[0]])
    return _Intervals(tuple(index), region, duration, known, z)
