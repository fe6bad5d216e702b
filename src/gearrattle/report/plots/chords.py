"""A curve with as few of its points as a screen needs.

Points are removed as long as they are within a distance of the chords that replace them (U. Ramer 1972, Comput. Graph.
Image Process. 1, 244-256; D. H. Douglas, T. K. Peucker 1973, Cartographica 10, 112-122). All chords of one depth of the
recursion are divided at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearrattle.trajectory import Array

SCREEN = (1200.0, 600.0)
"""Width and height of the largest frame of a curve [px]."""
WITHIN = 0.35
"""Largest distance [px] of a chord from the points that it replaces."""
MOST_POINTS = 4000
_PASSES = 6
_SLACK = 0.05


def thinned(points: Array, within: float, most: int = MOST_POINTS) -> NDArray[np.int64]:
    """Return the indices of points (N, 2) of a curve whose chords stay within a distance of all others.

    If more than ``most`` are needed, the points farthest from their chords are kept.
    """
    straight = _without_straights(points, _SLACK * within)
    chosen, distance = _ends_of_chords(points[straight], (1.0 - _PASSES * _SLACK) * within, most)
    return straight[chosen[distance > _beyond_most(distance, most)]]


def _beyond_most(distance: Array, most: int) -> float:
    """Return the largest distance among the points beyond the ``most`` largest; 0 if there are not more points."""
    return float(np.partition(distance, -most - 1)[-most - 1]) if len(distance) > most else 0.0


def _without_straights(points: Array, within: float) -> NDArray[np.int64]:
    """Remove, repeatedly, every other point near the chord of its neighbours, so that the search has fewer points."""
    kept = np.arange(len(points))
    for _ in range(_PASSES):
        inner = np.arange(1, len(kept) - 1, 2)
        away = distances(points[kept[inner]], points[kept[inner - 1]], points[kept[inner + 1]])
        kept = np.delete(kept, inner[away <= within])
    return kept


def _ends_of_chords(points: Array, within: float, most: int) -> tuple[NDArray[np.int64], Array]:
    """Return the points (n,) at which chords are divided, and their distances from the chords that they divided.

    A distance is never larger than the distances of the chords divided before. So for a larger ``within``, the answer
    is the points with larger distances. Chords that cannot be among the ``most`` are not divided.
    """
    chosen = np.array([0, len(points) - 1])
    distance = np.full(2, np.inf)
    beyond = np.arange(len(points))  # points of the chords that are too far from some of their points
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
    """Return distances (N,) of points from chords; for a point beyond an end of its chord, from this end."""
    along = end - begin
    off = points - begin
    square = np.einsum("ij,ij->i", along, along)
    share = np.clip(np.einsum("ij,ij->i", off, along) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return np.asarray(np.hypot(*(off - share[:, None] * along).T))
