"""Power spectral densities in bands of a third of an octave, their ratio and its limits by the F distribution.

Welch's method over segments of whole cycles, half overlapping, Hann. For Gaussian signals the power of a band is
distributed as chi-square with 2 n degrees of freedom, n being the equivalent number of averages,

    n = n_s (sum G_i)^2 / sum_ij G_i G_j r_|i-j|^2,      n_s = K / (1 + (K - 1) / (18 K)),

with r = 1, 2/3, 1/6 between bins of a Hann window, and K segments of which neighbours are correlated by 1/6
(P. D. Welch 1967, IEEE Trans. Audio Electroacoust. AU-15, 70-73; J. S. Bendat, A. G. Piersol, Random Data, ch. 8). The
ratio of two such powers then has the limits ratio / F(0.975; 2n, 2m) and ratio / F(0.025; 2n, 2m).

Rattle is not Gaussian: impacts come in bursts that raise all bins of a band at once and last for cycles. So n is at
most mean^2 / variance of the mean of the band's power over the segments, with the correlation of neighbours in it.
Lines that repeat themselves scatter less than these limits allow: for them orders are the better comparison.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearrattle.measured.validation.cycles import Cycles
from gearrattle.measured.validation.validation_records import Band
from gearrattle.signals import cross_spectra
from gearrattle.trajectory import Array

_LONGEST = 4
_SEGMENTS = 4
_HANN = (1.0, 4.0 / 9.0, 1.0 / 36.0)  # squared correlations of bins 0, 1, 2 apart
_LAGS = 8  # segments
_ROUNDING = 1e-12  # of the power: a band with less on both sides is left out


@dataclass(frozen=True)
class Segments:
    """Periodograms of half-overlapping segments.

    Attributes
    ----------
    frequency
        (f,) [Hz].
    periodograms
        (f, C, K) one-sided densities of every segment [unit^2/Hz].
    """

    frequency: Array
    periodograms: Array

    @property
    def density(self) -> Array:
        """(f, C) their mean: Welch's estimate."""
        return np.asarray(self.periodograms.mean(axis=2))


def densities(measured: Cycles, simulated: Cycles) -> tuple[Segments, Segments]:
    """Return the densities of both, from segments of as many cycles."""
    cycles = max(1, min(_LONGEST, min(measured.count, simulated.count) // _SEGMENTS))
    return _segments(measured, cycles), _segments(simulated, cycles)


def _segments(record: Cycles, cycles: int) -> Segments:
    samples = record.values.shape[1]
    length = cycles * samples
    signal = record.values.reshape(-1, record.values.shape[2])
    step = length - length // 2
    segments = cross_spectra.Segments(cross_spectra.taper("hann", length), step, 1 + (len(signal) - length) // step)
    periodograms = np.concatenate(list(cross_spectra.periodograms(signal, record.rate, segments)))
    return Segments(cross_spectra.frequencies(segments, record.rate), periodograms.T)


def averages(powers: Array) -> float:
    """Return the equivalent number of averages behind a band, by the powers (b, K) of its bins in every segment."""
    return min(gaussian_averages(powers.mean(axis=1), powers.shape[1]), observed_averages(powers.sum(axis=0)))


def gaussian_averages(density: Array, segments: int) -> float:
    """Return the equivalent number of averages for a Gaussian signal, by the densities (b,) of the band's bins."""
    single = segments / (1.0 + (segments - 1) / (18.0 * segments))
    total = 0.0
    for lag, related in enumerate(_HANN):
        product = float(np.sum(density[lag:] * density[: density.size - lag]))
        total += (1.0 if lag == 0 else 2.0) * related * product / (1.0 + related / single)  # an estimate is too large
    return single * float(np.sum(density)) ** 2 / total if total > 0.0 else float("nan")


def observed_averages(powers: Array) -> float:
    """Return the equivalent number of averages by the scatter of successive powers (K,), with correlation; K >= 3."""
    count = powers.size
    away = powers - powers.mean()
    spread = float(away @ away) / max(count - 1, 1)
    lags = min(_LAGS, count // 4)
    for lag in range(1, lags + 1):  # Bartlett's weights: never negative
        spread += 2.0 * (1.0 - lag / (_LAGS + 1.0)) * float(away[lag:] @ away[:-lag]) / max(count - 1, 1)
    spread /= 1.0 - (lags + 1.0) / count  # correction: subtracting the mean has reduced the correlations
    return count * float(powers.mean()) ** 2 / spread if spread > 0.0 else float("inf")


def limits(ratio: float, first: float, second: float) -> tuple[float, float]:
    """Return the limits of the true ratio of two powers in 95 of 100 cases."""
    from scipy.stats import f

    high, low = (float(f.ppf(p, 2.0 * first, 2.0 * second)) for p in (0.975, 0.025))
    return ratio / high, ratio / low


def compare_bands(spectra: tuple[Segments, Segments], band: tuple[float, float]) -> list[tuple[Band, ...]]:
    """Return the bands of every channel: thirds of an octave that hold a bin, within ``band`` [Hz]."""
    measured, simulated = spectra
    frequency = simulated.frequency
    # edges of the bands: thirds of an octave
    first = max(band[0], 0.75 * float(frequency[1]))
    edges = first * 2.0 ** (np.arange(int(np.ceil(3.0 * np.log2(band[1] / first))) + 1) / 3.0)
    edges[-1] = band[1] * (1.0 + 1e-9)
    # power of every channel in the whole band compared
    whole = [spectrum.density[frequency <= band[1]].sum(axis=0) for spectrum in spectra]
    bands: list[list[Band]] = [[] for _ in range(measured.density.shape[1])]
    for low, high in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        inside = (frequency >= low) & (frequency < high)
        if not inside.any():
            continue
        # power in the band; a band of rounding alone is left out
        for c, rows in enumerate(bands):
            one = measured.density[inside, c]
            other = simulated.density[inside, c]
            power = float(one.sum()), float(other.sum())
            share = max(
                part / float(all_of[c]) if all_of[c] > 0.0 else 0.0 for part, all_of in zip(power, whole, strict=True)
            )
            if min(power) <= 0.0 or share < _ROUNDING:
                continue
            # limits of the ratio by the F distribution
            n = averages(measured.periodograms[inside, c]), averages(simulated.periodograms[inside, c])
            ratio = power[0] / power[1]
            middle, least, most = (float(10.0 * np.log10(value)) for value in (ratio, *limits(ratio, *n)))
            rows.append(Band(low, min(high, band[1]), middle, least, most, *n, share))
    return [tuple(rows) for rows in bands]
