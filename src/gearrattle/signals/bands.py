"""Power of a signal in a band around each harmonic of a fundamental.

The samples of whole periods are split by the discrete Fourier transform into bands: band k holds the bins from
(k - 1/2) to (k + 1/2) fundamentals, the lower bound included. By Parseval's theorem the squares of all bands' rms
values, that of the band around zero included, add up to the signal's mean square. A periodic motion has one line a
band; in a chaotic one a band gathers the continuum about the harmonic as well.
"""

from __future__ import annotations

import numpy as np

from gearrattle.trajectory import Array


def band_rms(signal: Array, periods: int, harmonics: int) -> Array:
    """Return (h, ...) the rms value in the band around each of the first harmonics, in the unit of the signal.

    Parameters
    ----------
    signal
        (N, ...) samples over whole periods of the fundamental, each phase once.
    harmonics
        how many bands; NaN for those not wholly below half the sampling rate.
    """
    power = np.abs(np.fft.rfft(signal, axis=0) / signal.shape[0]) ** 2
    power[1:] *= 2.0
    if signal.shape[0] % 2 == 0:
        power[-1] *= 0.5  # half the sampling rate has one bin, not two
    out = np.full((harmonics, *signal.shape[1:]), np.nan)
    for k in range(1, harmonics + 1):
        first, end = ((2 * k + side) * periods + 1 for side in (-1, 1))  # twice the bounds, rounded up when halved
        if end // 2 <= power.shape[0]:
            out[k - 1] = np.sqrt(power[first // 2 : end // 2].sum(axis=0))
    return out
