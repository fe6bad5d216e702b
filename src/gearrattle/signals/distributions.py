"""How far two samples of a quantity are apart in distribution: the Kolmogorov-Smirnov distance.

    D = max_x |F_1(x) - F_2(x)|,   F the empirical distribution functions (scipy.stats.ks_2samp).

Its tabled p-value takes the values as independent; those of consecutive impacts are not, so they are dealt anew by
blocks (``exchange``), on at most ``GRID`` quantiles of all values. Where a motion repeats itself its values do too, and
D = 1 for any shift; so D is also told for distributions that may be shifted by a tolerance either way (as in P. Levy's
metric).

Takes plain arrays; gives a DistributionDistance to comparisons.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.signals.exchange import Exchange, exchange
from gearrattle.trajectory import Array, IntArray

GRID = 200


@dataclass(frozen=True)
class DistributionDistance:
    """Two distributions against each other.

    Attributes:
        value: D, 0 to 1.
        independent_p: how often independent values of one distribution give so large a D.
        blocks: D on the grid against exchanged blocks.
        beyond_tolerance: D that remains if every value may move by the tolerance.
    """

    value: float
    independent_p: float
    blocks: Exchange
    beyond_tolerance: float


def distribution_distance(
    given: Array, reference: Array, blocks_given: IntArray, blocks_reference: IntArray, *, blocks: int, tolerance: float
) -> DistributionDistance:
    """Return how far two samples are apart in distribution; neither may be empty.

    Args:
        given, reference: (a,), (b,) values.
        blocks_given, blocks_reference: (a,), (b,) the block each belongs to, from 0.
        blocks: number of blocks in either.
        tolerance: shift that does not count, in the unit of the values.
    """
    from scipy.stats import ks_2samp

    whole = ks_2samp(given, reference)
    pooled = np.sort(np.concatenate([given, reference]))
    grid = pooled[np.unique(np.linspace(0, pooled.size - 1, GRID).round().astype(np.int64))]

    def counted(values: Array, block: IntArray) -> Array:
        """(blocks, grid) how many values of each block are at most each grid value."""
        counts = np.zeros((blocks, grid.size))
        np.add.at(counts, (block, np.searchsorted(grid, values)), 1.0)
        return np.cumsum(counts, axis=1)

    return DistributionDistance(
        value=float(whole.statistic),
        independent_p=float(whole.pvalue),
        blocks=exchange(counted(given, blocks_given), counted(reference, blocks_reference), _largest_gap),
        beyond_tolerance=max(_one_sided(given, reference, tolerance), _one_sided(reference, given, tolerance)),
    )


def _largest_gap(mine: Array, theirs: Array) -> Array:
    """(d,) largest difference of distribution functions from cumulated counts (d, grid)."""
    a, b = (each / np.maximum(each[:, -1:], 1.0) for each in (mine, theirs))
    return np.asarray(np.max(np.abs(a - b), axis=1), dtype=np.float64)


def _one_sided(low: Array, high: Array, tolerance: float) -> float:
    """Largest amount by which more of ``low`` than of ``high``, shifted down, lies at or below a value."""
    at = np.sort(low)
    shifted = np.searchsorted(np.sort(high - tolerance), at, side="right") / high.size
    return float(np.max(np.arange(1, low.size + 1) / low.size - shifted, initial=0.0))
