"""A motion in the phase plane of a clearance, with as few points as a smooth curve on a screen needs.

The exact flow is sampled so finely that its most curved section is smooth. The crossings, whose times are exact, are
inserted between the samples, because the curve has corners there. Who draws it removes points that a screen cannot show
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

_BETWEEN = 0.1  # px, largest distance of the flow from chords between samples
_FINEST = 16_384  # largest number of samples of a motion


def fine_curves(orbit: Orbit, count: int, scales: Array) -> list[tuple[Array, Array]]:
    """Return times and points of a motion, fine enough for any screen.

    Parameters
    ----------
    count
        number of clearances, counted from the first of the model.
    scales
        (K, 2) pixels per unit of deflection and of rate.

    Returns
    -------
    list[tuple[Array, Array]]
        For every clearance, (N,) times [s] and (N, 2) deflection and rate, its crossings included.
    """
    curves = [_with_crossings(orbit.run, orbit, k) for k in range(count)]
    bend = max(_bend(points * scale, own) for (_, points, own), scale in zip(curves, scales, strict=True))
    if bend > _BETWEEN:  # at corners from impacts of other clearances, half the step gives half the error
        most = max(SAMPLES_PER_CYCLE, _FINEST // orbit.cycles)
        samples = min(most, SAMPLES_PER_CYCLE * 2 ** math.ceil(math.log2(bend / _BETWEEN)))
        run = sampled(orbit, samples)
        curves = [_with_crossings(run, orbit, k) for k in range(count)]
    return [(time, points) for time, points, _ in curves]


def _with_crossings(run: Run, orbit: Orbit, k: int) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Times and points of a motion with its crossings of a clearance's corners, and whether a point is a crossing."""
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
    """Estimated distance of a curve from its chords: a quarter of its distance from chords of every other point."""
    away = distances(points[1:-1], points[:-2], points[2:])
    return 0.25 * float(away[~at_corner[1:-1]].max(initial=0.0))
