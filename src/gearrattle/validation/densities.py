"""Power spectral densities in bands of a third of an octave, their ratio and its limits by the F distribution.

Welch's method over segments of whole cycles, half overlapping, Hann. For Gaussian signals the power of a band is
distributed as chi-square with 2 n degrees of freedom, n being the equivalent number of averages,

    n = n_s (sum G_i)^2 / sum_ij G_i G_j r_|i-j|^2,      n_s = K / (1 + (K - 1) / (18 K)),

with r = 1, 2/3, 1/6 between bins of a Hann window, and K segments of which neighbours are correlated by 1/6
(P. D. Welch 1967, IEEE Trans. Audio Electroacoust. AU-15, 70-73; J. S. Bendat, A. G. Piersol, Random Data, ch. 8). The
ratio of two such powers then has the limits ratio / F(0.975; 2n, 2m) and ratio / F(0.025; 2n, 2m). Lines that repeat
themselves do not scatter: where they dominate a band, its limits are wider than they need be, and orders tell more.

Takes cycles; gives densities and Bands.
"""

from __future__ import annotations

import numpy as np

from gearrattle.signals import Spectrum, psd
from gearrattle.trajectory import Array
from gearrattle.validation.cycles import Cycles
from gearrattle.validation.record import Band

_LONGEST, _SEGMENTS = 8, 4
_ROUNDING = 1e-12  # of the power: a band with less on both sides is left out
_HANN = (1.0, 4.0 / 9.0, 1.0 / 36.0)  # squared correlations of bins 0, 1, 2 apart


def densities(measured: Cycles, simulated: Cycles) -> tuple[Spectrum, Spectrum]:
    """Return the densities (f, C) of both, from segments of as many cycles."""
    length = max(1, min(_LONGEST, min(measured.count, simulated.count) // _SEGMENTS))
    first, second = (
        psd(each.values.reshape(-1, each.values.shape[2]), each.period, each.values.shape[1], length)
        for each in (measured, simulated)
    )
    return first, second


def averages(density: Array, segments: int) -> float:
    """Return the equivalent number of averages behind the power of a band.

    Args:
        density: (b,) of its bins.
        segments: K.
    """
    single = segments / (1.0 + (segments - 1) / (18.0 * segments))
    total = 0.0
    for lag, related in enumerate(_HANN):
        product = float(np.sum(density[lag:] * density[: density.size - lag]))
        total += (1.0 if lag == 0 else 2.0) * related * product / (1.0 + related / single)  # an estimate is too large
    return single * float(np.sum(density)) ** 2 / total if total > 0.0 else float("nan")


def limits(ratio: float, first: float, second: float) -> tuple[float, float]:
    """Return between what the true ratio of two powers lies, in 95 of 100 cases.

    Args:
        ratio: of the estimates.
        first, second: equivalent numbers of averages of its numerator and its denominator.
    """
    from scipy.stats import f

    high, low = (float(f.ppf(p, 2.0 * first, 2.0 * second)) for p in (0.975, 0.025))
    return ratio / high, ratio / low


def compare_bands(spectra: tuple[Spectrum, Spectrum], band: tuple[float, float]) -> list[tuple[Band, ...]]:
    """Return the bands of every channel: thirds of an octave that hold a bin, within ``band`` [Hz]."""
    measured, simulated = spectra
    frequency = simulated.frequency
    first = max(band[0], 0.75 * float(frequency[1]))
    edges = first * 2.0 ** (np.arange(int(np.ceil(3.0 * np.log2(band[1] / first))) + 1) / 3.0)
    edges[-1] = band[1] * (1.0 + 1e-9)
    whole = [each.density[frequency <= band[1]].sum(axis=0) for each in spectra]
    found: list[list[Band]] = [[] for _ in range(measured.density.shape[1])]
    for low, high in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        inside = (frequency >= low) & (frequency < high)
        if not inside.any():
            continue
        for c, rows in enumerate(found):
            one, other = measured.density[inside, c], simulated.density[inside, c]
            power = float(one.sum()), float(other.sum())
            share = max(
                part / float(all_of[c]) if all_of[c] > 0.0 else 0.0 for part, all_of in zip(power, whole, strict=True)
            )
            if min(power) <= 0.0 or share < _ROUNDING:
                continue
            n = averages(one, measured.segments), averages(other, simulated.segments)
            ratio = power[0] / power[1]
            middle, least, most = (float(10.0 * np.log10(each)) for each in (ratio, *limits(ratio, *n)))
            rows.append(Band(low, min(high, band[1]), middle, least, most, *n, share))
    return [tuple(rows) for rows in found]
