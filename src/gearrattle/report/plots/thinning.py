"""Thinning of curves to the number of samples that a screen can show.

A curve of a rattling run has about 1e5 samples, and a screen about 1e3 columns. Every n-th sample would miss the
impacts. So the curve is cut into equal buckets, and the lowest and the highest sample of every bucket are kept: MinMax
of U. Jugel et al., "M4: A Visualization-Oriented Time Series Data Aggregation", Proc. VLDB Endowment 7 (2014) 797-808.
Therefore every spike remains visible, and the envelope is exact.

The selection is an array of indices, so that one selection can serve several curves.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gearrattle.trajectory import Array, IntArray

_SMALLEST_BUDGET = 16


def thin(values: Array, at_most: int) -> IntArray:
    """Choose the samples of one curve that draw the same picture.

    Parameters
    ----------
    values
        (N,) equally spaced samples, any unit.
    at_most
        largest number of indices wanted (>= 16).

    Returns
    -------
    IntArray
        Ascending indices into ``values``, at most ``at_most`` of them; all of them if there are no more than that.
        The first and the last sample and, of each of ``(at_most - 2) // 2`` equal buckets, the lowest and
        the highest are kept.
    """
    if at_most < _SMALLEST_BUDGET:
        raise ValueError(f"at_most is {at_most}; at least {_SMALLEST_BUDGET} points are needed to draw a curve")
    count = values.size
    if count <= at_most:
        return np.arange(count, dtype=np.int64)
    edges = np.linspace(0, count, (at_most - 2) // 2 + 1).astype(np.int64)
    kept = [0, count - 1]
    for low, high in pairwise(edges.tolist()):
        bucket = values[low:high]
        kept += [low + int(np.argmin(bucket)), low + int(np.argmax(bucket))]
    return np.unique(np.asarray(kept, dtype=np.int64))
