"""A curve by as few of its points as a screen needs.

Points are left out as long as the chords stay within a distance of what they replace (U. Ramer 1972, Comput. Graph.
Image Process. 1, 244-256; D. H. Douglas, T. K. Peucker 1973, Cartographica 10, 112-122), all chords of a depth at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.trajectory import Array

SCREEN = (1200.0, 600.0)
"""Width and height [px] of the largest frame that a curve is drawn in."""
WITHIN = 0.35
"""Largest distance [px] of a chord from the points that it replaces."""
MOST_POINTS = 4000
_PASSES = 6
_SLACK = 0.05


def thinned(points: Array, within: float, most: int = MOST_POINTS) -> NDArray[np.int64]:
    """Return the indices of points (N, 2) of a curve whose chords stay within a distance of all others.

    Where more than ``most`` are needed, those that are farthest are kept.
    """
    straight = _without_straights(points, _SLACK * within)
    chosen, distance = _ends_of_chords(points[straight], (1.0 - _PASSES * _SLACK) * within, most)
    return straight[chosen[distance > _beyond_most(distance, most)]]


def _beyond_most(distance: Array, most: int) -> float:
    """Return the largest distance for which there is no room; 0 where there is room for all."""
    return float(np.partition(distance, -most - 1)[-most - 1]) if len(distance) > most else 0.0


def _without_straights(points: Array, within: float) -> NDArray[np.int64]:
    """Leave out every other point that its neighbours' chord passes, again and again: what is left is searched soon."""
    kept = np.arange(len(points))
    for _ in range(_PASSES):
        inner = np.arange(1, len(kept) - 1, 2)
        away = distances(points[kept[inner]], points[kept[inner - 1]], points[kept[inner + 1]])
        kept = np.delete(kept, inner[away <= within])
    return kept


def _ends_of_chords(points: Array, within: float, most: int) -> tuple[NDArray[np.int64], Array]:
    """Return the points (n,) at which chords are divided, and how far each was from the chord that it divided.

    No distance is larger than those of the chords divided before: for a larger ``within``, those at larger distances
    are the answer. Chords that come too late to be among the ``most`` are not divided.
    """
    chosen = np.array([0, len(points) - 1])
    distance = np.full(2, np.inf)
    beyond = np.arange(len(points))  # points of chords that are too far from some of them
    while beyond.size:
        chord = np.clip(np.searchsorted(chosen, beyond, "right") - 1, 0, len(chosen) - 2)
        away = distances(points[beyond], points[chosen[chord]], points[chosen[chord + 1]])
        begins = np.flatnonzero(np.diff(chord, prepend=-1))
        farthest = np.maximum.reduceat(away, begins)
        is_wrong = farthest > within
        of_chord = np.repeat(np.arange(len(begins)), np.diff(begins, append=len(beyond)))
        ends = np.flatnonzero((away == farthest[of_chord]) & is_wrong[of_chord])
        ends = ends[np.diff(of_chord[ends], prepend=-1) > 0]
        divided = chord[ends]
        smallest = np.minimum(away[ends], np.minimum(distance[divided], distance[divided + 1]))
        chosen = np.insert(chosen, divided + 1, beyond[ends])
        distance = np.insert(distance, divided + 1, smallest)
        beyond = beyond[is_wrong[of_chord]]
        within = max(within, _beyond_most(distance, most))
    return chosen, distance


def distances(points: Array, begin: Array, end: Array) -> Array:
    """Return distances of points from chords, (N,): from the nearer end where a point is beyond it."""
    along = end - begin
    off = points - begin
    square = np.einsum("ij,ij->i", along, along)
    share = np.clip(np.einsum("ij,ij->i", off, along) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return np.asarray(np.hypot(*(off - share[:, None] * along).T))
