"""How far two estimated power spectral densities are apart, against what their estimation alone explains.

Each is the mean of K Hann-tapered segments that do not overlap (P. D. Welch 1967, IEEE Trans. Audio Electroacoust.
AU-15, 70-73), for Gaussian noise S(f) chi^2_nu / nu with nu = 2 K. The ratio of two independent estimates of one
density is then F-distributed, which gives each bin a 95 % band. Two figures say how far they are apart:

    share of the bins outside their bands (0.05 expected);
    L = sqrt(mean (10 lg ratio)^2) [dB], the log-spectral distance; (10/ln 10) sqrt(psi'(K_1) + psi'(K_2)) expected.

Rattle is no Gaussian noise: bursts of impacts lift all bins of a segment together. How large both figures become by
chance is therefore asked of the segments themselves (``exchange``).

Takes plain arrays; gives a DensityDistance to comparisons.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.signals.exchange import Exchange, exchange
from gearrattle.signals.spectra import CYCLES_PER_SEGMENT, psd
from gearrattle.trajectory import Array

FLOOR = 1e-10  # bins below this share of the largest density hold leakage and rounding
LEVEL = 0.95
WANTED_SEGMENTS = 8


@dataclass(frozen=True)
class DensityDistance:
    """Two densities against each other.

    Attributes:
        bins: number of bins compared.
        low, high: 95 % band of given / reference in one bin, for Gaussian noise.
        outside: share of the bins outside it, 0 to 1, against exchanged segments.
        distance: log-spectral distance [dB], against exchanged segments.
        expected: log-spectral distance of two estimates of one Gaussian noise [dB].
    """

    bins: int
    low: float
    high: float
    outside: Exchange
    distance: Exchange
    expected: float


def segment_densities(signal: Array, period: float, samples_per_cycle: int) -> Array:
    """Return (K, f) the density of every segment: of eight cycles, or as few as leave eight segments.

    Args:
        signal: (N,) samples over whole cycles, each phase once.
        period: length of a cycle [s].
        samples_per_cycle: samples in a cycle.

    Raises:
        ModelError: if a segment would hold fewer than four samples.
    """
    cycles = signal.size // samples_per_cycle
    length = max(1, min(CYCLES_PER_SEGMENT, cycles // WANTED_SEGMENTS)) * samples_per_cycle
    count = max(1, signal.size // length)
    parts = signal[-count * length :].reshape(count, length)
    return np.stack([psd(part, period, samples_per_cycle).density for part in parts])


def density_distance(given: Array, reference: Array) -> DensityDistance:
    """Return how far two densities are apart, from their segments' (K, f); NaN where no bin holds power.

    Bins count whose mean over all segments lies above the floor; not the two lowest (mean removed), nor the last.

    Args:
        given, reference: densities of segments on the same bins.
    """
    from scipy.special import polygamma
    from scipy.stats import f

    pooled = np.concatenate([given, reference]).mean(axis=0)
    chosen = pooled > FLOOR * pooled.max()
    chosen[:2] = chosen[-1] = False
    numbers = [len(given), len(reference)]
    low, high = (float(f.ppf(q, 2 * numbers[0], 2 * numbers[1])) for q in (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL))
    decibel = 10.0 / np.log(10.0)
    expected = decibel * float(np.sqrt(sum(polygamma(1, each) for each in numbers)))
    if not chosen.any():
        nothing = Exchange(float("nan"), float("nan"), float("nan"))
        return DensityDistance(0, low, high, nothing, nothing, expected)
    tiny = np.finfo(np.float64).tiny

    def ratio(mine: Array, theirs: Array) -> Array:
        return np.maximum(mine, tiny) / np.maximum(theirs, tiny) * (numbers[1] / numbers[0])

    def outside(mine: Array, theirs: Array) -> Array:
        across = ratio(mine, theirs)
        return np.asarray(np.mean((across < low) | (across > high), axis=1), dtype=np.float64)

    def distance(mine: Array, theirs: Array) -> Array:
        return np.asarray(decibel * np.sqrt(np.mean(np.log(ratio(mine, theirs)) ** 2, axis=1)), dtype=np.float64)

    a, b = given[:, chosen], reference[:, chosen]
    return DensityDistance(
        bins=int(np.count_nonzero(chosen)),
        low=low,
        high=high,
        outside=exchange(a, b, outside),
        distance=exchange(a, b, distance),
        expected=expected,
    )
