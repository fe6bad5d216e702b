"""A motion in the phase plane of a clearance, with as few points as a smooth curve on a screen needs.

The exact flow is sampled as finely as its most curved stay needs, and the crossings, which are known as times, stand
between the samples: there the curve has its corners. Points that a screen does not show are left out
(``plots/chords``).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import deflection_rate
from gearrattle.orbits import Orbit
from gearrattle.orbits.orbit import SAMPLES_PER_CYCLE, sampled
from gearrattle.report.plots.chords import distances
from gearrattle.results import Run
from gearrattle.trajectory import Array

_BETWEEN = 0.1  # px: largest distance of the flow from chords between samples
_FINEST = 16_384  # samples of a motion


def fine_curves(orbit: Orbit, count: int, scales: Array) -> list[tuple[Array, Array]]:
    """Return times and points of a motion, fine enough for any screen.

    Parameters
    ----------
    count
        how many clearances, the first of the model.
    scales
        (K, 2) pixels by unit of deflection and of rate.

    Returns
    -------
    list[tuple[Array, Array]]
        Of every clearance (N,) times [s] and (N, 2) deflection and rate, its crossings among them.
    """
    curves = [_with_crossings(orbit.run, orbit, k) for k in range(count)]
    bend = max(_bend(points * scale, own) for (_, points, own), scale in zip(curves, scales, strict=True))
    if bend > _BETWEEN:  # corners of other clearances' impacts: a step of half the size misses half as much
        most = max(SAMPLES_PER_CYCLE, _FINEST // orbit.cycles)
        samples = min(most, SAMPLES_PER_CYCLE * 2 ** math.ceil(math.log2(bend / _BETWEEN)))
        run = sampled(orbit, samples)
        curves = [_with_crossings(run, orbit, k) for k in range(count)]
    return [(time, points) for time, points, _ in curves]


def _with_crossings(run: Run, orbit: Orbit, k: int) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Times and points of a motion with its crossings of a clearance's corners, in order, and which are crossings."""
    trajectory = run.trajectory
    layout = trajectory.layout
    events = trajectory.events
    own = events.clearance == k
    rate = deflection_rate(orbit.model, trajectory, int(layout.clearance[k]))
    corners = layout.corners[k]
    reached = np.interp(events.time[own], trajectory.time, trajectory.deflection[:, k])
    corner = corners[np.argmin(np.abs(reached[:, None] - corners), axis=1)] if own.any() else reached
    time = np.concatenate([trajectory.time, events.time[own]])
    points = np.concatenate(
        [
            np.column_stack([trajectory.deflection[:, k], rate]),
            np.column_stack([corner, events.velocity[own]]),
        ]
    )
    order = np.argsort(time, kind="stable")
    return time[order], points[order], order >= len(trajectory.time)


def _bend(points: Array, at_corner: NDArray[np.bool_]) -> float:
    """How far a curve may be from its chords: a quarter of what those of every other point miss between its corners."""
    away = distances(points[1:-1], points[:-2], points[2:])
    return 0.25 * float(away[~at_corner[1:-1]].max(initial=0.0))
