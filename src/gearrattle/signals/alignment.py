"""Alignment of two lists of events when some are missing from either.

Both lists ascend. An *alignment* pairs events without changing their order; it costs |t_c - t_r| a pair and
half the *reach* an event left alone, and the cheapest one is taken (global alignment by dynamic programming:
S. B. Needleman, C. D. Wunsch 1970, J. Mol. Biol. 48, 443-453). So no pair is further apart than the reach, and an event
that one list lacks is left alone instead of shifting all pairs after it.

Events further apart than the reach cannot meet, so the lists fall into clusters that are aligned one by one; where a
cluster is too large for its table, the reach is halved inside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearrattle.trajectory import Array

Index = NDArray[np.intp]
_LARGEST_TABLE = 4_000_000


@dataclass(frozen=True)
class Alignment:
    """Pairs and what is left over, as positions in the two lists.

    Attributes
    ----------
    candidate, reference
        (p,) the events of pair i, ascending.
    """

    candidate: Index
    reference: Index
    missed: Index
    invented: Index


def align(candidate: Array, reference: Array, reach: float) -> Alignment:
    """Return the cheapest alignment of two ascending lists of times.

    Parameters
    ----------
    candidate, reference
        (a,), (b,) times [s], ascending.
    reach
        largest distance of a pair [s], above zero.
    """
    pairs = _pairs(candidate, reference, reach)
    mine = pairs[:, 0]
    theirs = pairs[:, 1]
    missed = np.setdiff1d(np.arange(reference.size), theirs)
    return Alignment(mine, theirs, missed, np.setdiff1d(np.arange(candidate.size), mine))


def _pairs(candidate: Array, reference: Array, reach: float) -> Index:
    """(p, 2) positions."""
    if not candidate.size or not reference.size:
        return np.empty((0, 2), dtype=np.intp)
    merged = np.sort(np.concatenate([candidate, reference]))
    breaks = merged[1:][np.diff(merged) > reach]
    first = np.stack([np.searchsorted(candidate, breaks), np.searchsorted(reference, breaks)], axis=1)
    bounds = np.concatenate([[[0, 0]], first, [[candidate.size, reference.size]]])
    pairs = []
    for (a, b), (a_end, b_end) in pairwise(bounds):
        mine = candidate[a:a_end]
        theirs = reference[b:b_end]
        if mine.size == theirs.size == 1:
            inside = np.zeros((1, 2), dtype=np.intp)
        elif mine.size * theirs.size > _LARGEST_TABLE:
            inside = _pairs(mine, theirs, 0.5 * reach)
        else:
            inside = _cheapest(mine, theirs, 0.5 * reach)
        pairs.append(inside + np.array([a, b]))
    return np.concatenate(pairs)


def _cheapest(candidate: Array, reference: Array, alone: float) -> Index:
    """(p, 2) the cheapest pairs of a small cluster; ``alone`` is the cost of an event without a partner."""
    distance = np.abs(candidate[:, None] - reference) / alone
    rows, columns = distance.shape
    steps = np.arange(columns + 1.0)
    cost = np.empty((rows + 1, columns + 1))
    cost[0] = steps
    for i in range(rows):
        best = cost[i] + 1.0
        best[1:] = np.minimum(best[1:], cost[i, :-1] + distance[i])
        cost[i + 1] = np.minimum.accumulate(best - steps) + steps  # any number of reference events left alone
    pairs = []
    i = rows
    j = columns
    while i and j:
        options = (cost[i - 1, j - 1] + distance[i - 1, j - 1], cost[i - 1, j] + 1.0, cost[i, j - 1] + 1.0)
        choice = int(np.argmin(options))
        if choice == 0:
            pairs.append((i - 1, j - 1))
        i = i - (choice != 2)
        j = j - (choice != 1)
    return np.array(pairs[::-1], dtype=np.intp).reshape(-1, 2)
