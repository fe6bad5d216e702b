"""One motion among others: its distance from the rest, and the probability of a distance so large.

If m motions are draws of one process, none of them is special: each is as likely as any other to lie farthest from the
rest. So with the distance of every motion from all others, d_1 ... d_m, the share of those that lie at least as far out
as the first,

    p = #{i : d_i >= d_1} / m,

is at most alpha in at most alpha of the cases, whatever the process and however slowly it wanders within a motion
(exchangeability: E. J. G. Pitman 1937, Suppl. J. R. Stat. Soc. 4, 119-130; the first counts, as in B. Phipson,
G. K. Smyth 2010, Stat. Appl. Genet. Mol. Biol. 9, art. 39). Distances here: of numbers, of spectral densities
(log-spectral distance), of densities bin by bin, and of distributions (Kolmogorov-Smirnov).

The motion in question comes first in every array.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearrattle.trajectory import Array

FLOOR = 1e-10  # bins below this share of the largest density hold leakage and rounding
_EQUAL = 1e-9  # distances this near, relatively, are a rounding apart


def rank(distances: Array) -> float:
    """Return p: the share of the motions that lie at least as far out as the first, itself included.

    Parameters
    ----------
    distances
        (m,) of every motion from all others.
    """
    return float(np.mean(distances >= distances[0] * (1.0 - _EQUAL)))


def mean_of_others(values: Array) -> Array:
    """Return (m, ...) the mean of all others for each of (m, ...) values, m at least 2."""
    m = len(values)
    others = 1.0 - np.eye(m)
    return np.asarray((others @ values.reshape(m, -1) / (m - 1)).reshape(values.shape))


def number_distances(values: Array) -> Array:
    """Return (m,) distance of each number from the mean of the others, in their unit."""
    return np.asarray(np.abs(values - mean_of_others(values)))


def density_distances(densities: Array, error: Array | None = None) -> tuple[Array, Array]:
    """Return (m,) the log-spectral distance sqrt(mean (10 lg S_i/S_others)^2) [dB], and (m,) the share of extreme bins.

    A bin of a motion is extreme if its density alone is the largest or the least of all. Bins count whose mean lies
    above the floor, to which lower densities are raised; not the two lowest (the mean is removed), nor the last. NaN
    where no bin holds power.

    Parameters
    ----------
    densities
        (m, f) one-sided spectral densities.
    error
        (f,) density of a known error, to which lower densities are raised too; None: of none.
    """
    chosen, floor = _compared(densities, error)
    if not chosen.any():
        nothing = np.full(len(densities), np.nan)
        return nothing, nothing
    raised = np.maximum(densities[:, chosen], floor)
    decibel = 10.0 * np.log10(raised / np.maximum(mean_of_others(densities)[:, chosen], floor))
    ordered = np.sort(raised, axis=0)
    alone = (raised < ordered[1]) | (raised > ordered[-2])
    return np.sqrt(np.mean(decibel**2, axis=1)), np.mean(alone, axis=1)


def explained_distance(densities: Array, reference: Array, error: Array) -> tuple[float, float]:
    """Return the log-spectral distance of the first motion from a reference, and the most that an error explains [dB].

    An error of density S_e moves the root of every density by sqrt(S_e) at most, so with densities S and S_ref raised
    to S_e the distance is at most that of 20 lg(1 + sqrt(S_e / min(S, S_ref))). NaN where no bin holds power.

    Parameters
    ----------
    densities
        (m, f) as for ``density_distances``, whose bins are taken.
    reference
        (f,) density of the motion that the error is compared with.
    error
        (f,) density of the error.
    """
    chosen, floor = _compared(densities, error)
    if not chosen.any():
        return float("nan"), float("nan")
    mine, theirs = (np.maximum(density[chosen], floor) for density in (densities[0], reference))
    bound = 20.0 * np.log10(1.0 + np.sqrt(error[chosen] / np.minimum(mine, theirs)))
    distances = (10.0 * np.log10(mine / theirs), bound)
    distance, most = (float(np.sqrt(np.mean(decibel**2))) for decibel in distances)
    return distance, most


def _compared(densities: Array, error: Array | None) -> tuple[NDArray[np.bool_], Array]:
    """(f,) which bins are compared, and for these the density below which nothing differs."""
    pooled = densities.mean(axis=0)
    least = FLOOR * pooled.max()
    chosen = pooled > least
    chosen[:2] = False
    chosen[-1] = False
    floor = np.full(int(chosen.sum()), least)
    return chosen, floor if error is None else np.maximum(floor, error[chosen])


def distribution_distances(samples: Sequence[Array], tolerance: float) -> Array:
    """Return (m,) the Kolmogorov-Smirnov distance of each sample from all others pooled, beyond a shift.

    D = max_x |F_i(x) - F_others(x)|, 0 to 1, F the empirical distribution functions, if every value may move by the
    tolerance (as in P. Levy's metric): where motions repeat themselves their values do too, and D = 1 for any shift.

    Parameters
    ----------
    samples
        m arrays (n_i,) of values, none empty.
    tolerance
        shift that does not count, in the unit of the values.
    """
    ordered = [np.sort(sample) for sample in samples]
    pool = np.sort(np.concatenate(ordered))
    return np.array([_beyond(sample, pool, tolerance) for sample in ordered])


def _beyond(mine: Array, pool: Array, tolerance: float) -> float:
    """D of one sorted sample from the rest of the sorted pool."""
    rest = pool.size - mine.size

    def of_rest(at: Array) -> Array:
        """F of the others, at ``at``."""
        below = np.searchsorted(pool, at, side="right") - np.searchsorted(mine, at, side="right")
        return np.asarray(below / rest)

    n = mine.size
    above = np.arange(1, n + 1) / n - of_rest(mine + tolerance)  # mine lies lower
    at = mine - tolerance
    strictly = np.nextafter(at, -np.inf)
    below = of_rest(strictly) - np.searchsorted(mine, mine, side="left") / n  # mine lies higher
    return float(max(0.0, np.max(above), np.max(below)))
