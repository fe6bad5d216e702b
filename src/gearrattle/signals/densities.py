"""How far two estimated power spectral densities are apart, against what their estimation alone explains.

A Welch estimate from K segments is S(f) chi^2_nu / nu; with Hann segments half overlapping neighbours share 1/36 of
their power, so nu = 2 K / (1 + (1/18)(K - 1)/K) (P. D. Welch 1967, IEEE Trans. Audio Electroacoust. AU-15, 70-73). The
ratio of two independent estimates of one density is then F-distributed, and each bin has a 95 % band for it. Two
figures say how far they are apart:

    share outside the bands (5 % expected);   L = sqrt(mean (10 lg ratio)^2) [dB], the log-spectral distance.

ln F has the cumulants kappa_2 = psi'(nu_1/2) + psi'(nu_2/2), kappa_4 likewise with psi''', so L^2 has the mean
(10/ln 10)^2 kappa_2 and a known variance. A Hann window correlates the powers of neighbouring bins by 4/9 and 1/36, so
B bins count as B / (1 + 2 (4/9 + 1/36)) independent ones. All this holds for Gaussian noise: at a line of constant
amplitude an estimate scatters less, so lines widen nothing.

Takes Spectrum objects of one signal each; gives a DensityDistance to comparisons.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearrattle.signals.spectra import Spectrum
from gearrattle.trajectory import Array

OVERLAP_CORRELATION = 1.0 / 36.0  # Hann, half overlapping
BIN_CORRELATION = (4.0 / 9.0, 1.0 / 36.0)  # Hann, one and two bins apart
FLOOR = 1e-10  # bins below this share of the largest density hold leakage, not signal
LEVEL = 0.95


@dataclass(frozen=True)
class DensityDistance:
    """Two densities against each other.

    Attributes:
        bins: number of bins compared.
        low, high: 95 % band of given / reference in one bin.
        outside: share of the bins outside it, 0 to 1.
        outside_high: sampling error alone stays below this share in 95 of 100 cases.
        outside_p: how often sampling error alone gives as large a share.
        distance: log-spectral distance [dB].
        distance_expected: that of sampling error alone [dB].
        distance_high: sampling error alone stays below it in 95 of 100 cases [dB].
        distance_p: how often sampling error alone gives as large a distance.
    """

    bins: int
    low: float
    high: float
    outside: float
    outside_high: float
    outside_p: float
    distance: float
    distance_expected: float
    distance_high: float
    distance_p: float


def degrees_of_freedom(segments: int) -> float:
    """Return nu of a Welch estimate from so many half-overlapping Hann segments."""
    return 2.0 * segments / (1.0 + 2.0 * OVERLAP_CORRELATION * (segments - 1) / segments)


def compared_bins(given: Array, reference: Array) -> NDArray[np.bool_]:
    """Return which bins are compared: power above the floor in either; not the two lowest (mean removed), nor the last.

    Args:
        given, reference: (f,) densities.
    """
    either = np.maximum(given, reference)
    chosen = either > FLOOR * either.max()
    chosen[:2] = chosen[-1] = False
    return np.asarray(chosen, dtype=np.bool_)


def density_distance(given: Spectrum, reference: Spectrum) -> DensityDistance:
    """Return how far two densities (f,) on the same bins are apart; all NaN where no bin holds power."""
    from scipy.special import polygamma
    from scipy.stats import binom, f, norm

    chosen = compared_bins(given.density, reference.density)
    bins = int(np.count_nonzero(chosen))
    half = [0.5 * degrees_of_freedom(each.segments) for each in (given, reference)]
    low, high = (float(f.ppf(q, 2 * half[0], 2 * half[1])) for q in (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL))
    if not bins:
        return DensityDistance(0, low, high, *[float("nan")] * 7)
    tiny = np.finfo(np.float64).tiny
    ratio = np.maximum(given.density[chosen], tiny) / np.maximum(reference.density[chosen], tiny)
    effective = max(1, round(bins / (1.0 + 2.0 * sum(BIN_CORRELATION))))
    outside = float(np.mean((ratio < low) | (ratio > high)))
    decibel = 10.0 / np.log(10.0)
    second = float(sum(polygamma(1, h) for h in half))
    spread = float(np.sqrt((sum(polygamma(3, h) for h in half) + 2.0 * second**2) / effective))
    square = float(np.mean(np.log(ratio) ** 2))
    return DensityDistance(
        bins=bins,
        low=low,
        high=high,
        outside=outside,
        outside_high=float(binom.ppf(LEVEL, effective, 1.0 - LEVEL) / effective),
        outside_p=float(binom.sf(np.floor(outside * effective + 1e-9) - 1, effective, 1.0 - LEVEL)),
        distance=decibel * float(np.sqrt(square)),
        distance_expected=decibel * float(np.sqrt(second)),
        distance_high=decibel * float(np.sqrt(second + norm.ppf(LEVEL) * spread)),
        distance_p=float(norm.sf((square - second) / spread)),
    )
