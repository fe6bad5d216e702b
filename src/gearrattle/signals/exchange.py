"""Whether two motions differ by more than their blocks do: a test that assumes no distribution.

If two motions have the same statistics, blocks of cycles long enough to be nearly independent may be exchanged between
them. A distance between the two is therefore compared with what it becomes when all blocks are dealt anew at random, as
many to each as before (E. J. G. Pitman 1937, Suppl. J. R. Stat. Soc. 4, 119-130). With m deals of which b give at least
the distance found, p = (b + 1) / (m + 1) (B. Phipson, G. K. Smyth 2010, Stat. Appl. Genet. Mol. Biol. 9, art. 39).
Formulas for Gaussian noise or independent values say too little here: impacts come in bursts, so all bins of a spectrum
rise together, and one impact's impulse goes with the next one's.

Takes what every block contributes to a sum; gives an Exchange to comparisons.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gearrattle.trajectory import Array

DEALS = 999
FEWEST_BLOCKS = 4  # of four and four the smallest p is 1/35
LEVEL = 0.95
_SEED = 1995


@dataclass(frozen=True)
class Exchange:
    """A distance and what exchanging blocks makes of it.

    Attributes:
        value: the distance found.
        high: exchanged blocks stay below or at it in 95 of 100 deals; NaN for too few blocks.
        p_value: how often they give at least the value; NaN for too few blocks.
    """

    value: float
    high: float
    p_value: float


def exchange(given: Array, reference: Array, distance: Callable[[Array, Array], Array]) -> Exchange:
    """Return a distance of two motions against that of exchanged blocks; the deals are the same in every call.

    Args:
        given, reference: (a, f), (b, f) what each block contributes.
        distance: takes the two sums over blocks, (d, f) each, the first of a blocks, the second of b; gives (d,).
    """
    blocks = np.concatenate([given, reference])
    mine = np.arange(len(blocks)) < len(given)
    enough = min(len(given), len(reference)) >= FEWEST_BLOCKS
    dealt = np.random.default_rng(_SEED).permuted(np.tile(mine, (DEALS if enough else 0, 1)), axis=1)
    chosen = np.concatenate([mine[None], dealt]).astype(np.float64)
    found = distance(chosen @ blocks, (1.0 - chosen) @ blocks)
    if not enough:
        return Exchange(float(found[0]), float("nan"), float("nan"))
    reached = int(np.count_nonzero(found[1:] >= found[0] - 1e-12 * abs(found[0])))
    return Exchange(float(found[0]), float(np.quantile(found[1:], LEVEL)), (reached + 1) / (DEALS + 1))
