"""Thinning of curves to the number of samples that a screen can show.

A curve of a rattling run has about 1e5 samples, and a screen about 1e3 columns. Every n-th sample would miss the
impacts. So two selections are combined: MinMaxLTTB (J. Van Der Donckt et al., "MinMaxLTTB: Leveraging
MinMax-Preselection to Scale LTTB", IEEE VIS 2023) for the shape, and the lowest and highest sample of every bucket for
the envelope. Therefore every spike remains visible.

The selection is an array of indices, so that one selection can serve several curves.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gearrattle.trajectory import Array, IntArray

_COUNTS_PER_BUCKET = 2
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
        The first and the last sample and, of each of ``at_most // 4`` equal buckets, the lowest and highest are kept.
    """
    if at_most < _SMALLEST_BUDGET:
        raise ValueError(f"at_most is {at_most}; at least {_SMALLEST_BUDGET} points are needed to draw a curve")
    count = values.size
    if count <= at_most:
        return np.arange(count, dtype=np.int64)
    buckets = (at_most - 2) // 4
    return np.union1d(_extremes(values, buckets), _shape(values, at_most - 2 - _COUNTS_PER_BUCKET * buckets))


def _extremes(values: Array, buckets: int) -> IntArray:
    """Return the first, the last and, of each equal bucket, the lowest and the highest sample."""
    edges = np.linspace(0, values.size, buckets + 1).astype(np.int64)
    kept = [0, values.size - 1]
    for low, high in pairwise(edges.tolist()):
        part = values[low:high]
        kept += [low + int(np.argmin(part)), low + int(np.argmax(part))]
    return np.unique(np.asarray(kept, dtype=np.int64))


def _shape(values: Array, at_most: int) -> IntArray:
    """Return what MinMaxLTTB keeps."""
    from tsdownsample import MinMaxLTTBDownsampler

    chosen: NDArray[np.uint64] = MinMaxLTTBDownsampler().downsample(np.ascontiguousarray(values), n_out=at_most)
    return chosen.astype(np.int64)
