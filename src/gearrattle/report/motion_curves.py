"""A motion in the phase plane of a clearance, by as few points as a screen shows it smooth with.

The exact flow is sampled as finely as its most curved stay needs, and the crossings, which are known as times, stand
between the samples: there the curve has its corners. Then points are left out as long as the chords stay within
``WITHIN`` of what they replace (U. Ramer 1972, Comput. Graph. Image Process. 1, 244-256; D. H. Douglas, T. K. Peucker
1973, Cartographica 10, 112-122), all chords of a depth at once.

Takes an Orbit; gives points.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearrattle.assembly import deflection_rate
from gearrattle.orbits import Orbit
from gearrattle.orbits.orbit import SAMPLES_PER_CYCLE, sampled
from gearrattle.results import Run
from gearrattle.trajectory import Array

SCREEN = (1200.0, 600.0)
"""Width and height [px] of the largest frame that a curve is drawn in."""
WITHIN, _BETWEEN = 0.35, 0.1
"""Largest distance [px] of a chord from the points that it replaces, and of the flow from the samples before."""
MOST_POINTS = 4000
_FINEST = 16_384  # samples of a motion
_PASSES, _SLACK = 6, 0.02


def fine_curves(orbit: Orbit, count: int, scales: Array) -> list[tuple[Array, Array]]:
    """Return times and points of a motion, fine enough for any screen.

    Parameters
    ----------
    orbit
        the motion.
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
    layout, events = trajectory.layout, trajectory.events
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
    away = _distances(points[1:-1], points[:-2], points[2:])
    return 0.25 * float(away[~at_corner[1:-1]].max(initial=0.0))


def thinned(points: Array, within: float, most: int = MOST_POINTS) -> NDArray[np.int64]:
    """Return the indices of points whose chords stay within a distance of all others.

    Parameters
    ----------
    points
        (N, 2) of a curve.
    within
        largest distance, in the unit of the points.
    most
        points; where more are needed the distance grows.
    """
    straight = _without_straights(points, _SLACK * within)
    while True:
        chosen = _ends_of_chords(points[straight], (1.0 - _PASSES * _SLACK) * within)
        if len(chosen) <= most:
            return straight[chosen]
        within *= 1.5


def _without_straights(points: Array, within: float) -> NDArray[np.int64]:
    """Leave out every other point that its neighbours' chord passes, again and again: what is left is searched soon."""
    kept = np.arange(len(points))
    for _ in range(_PASSES):
        inner = np.arange(1, len(kept) - 1, 2)
        away = _distances(points[kept[inner]], points[kept[inner - 1]], points[kept[inner + 1]])
        kept = np.delete(kept, inner[away <= within])
    return kept


def _ends_of_chords(points: Array, within: float) -> NDArray[np.int64]:
    chosen = np.array([0, len(points) - 1])
    numbers = np.arange(len(points))
    while True:
        chord = np.clip(np.searchsorted(chosen, numbers, "right") - 1, 0, len(chosen) - 2)
        away = _distances(points, points[chosen[chord]], points[chosen[chord + 1]])
        farthest = np.maximum.reduceat(away, chosen[:-1])
        wrong = (away > within) & (away == farthest[chord])
        further = numbers[wrong]
        if not further.size:
            return chosen
        _, first = np.unique(chord[wrong], return_index=True)
        chosen = np.union1d(chosen, further[first])


def _distances(points: Array, begin: Array, end: Array) -> Array:
    """Distances of points from chords, one each; from the nearer end where a point is beyond it."""
    along, off = end - begin, points - begin
    square = np.einsum("ij,ij->i", along, along)
    share = np.clip(np.einsum("ij,ij->i", off, along) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return np.asarray(np.hypot(*(off - share[:, None] * along).T))
