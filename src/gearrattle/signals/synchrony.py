"""Delay of one record's clock behind another's, from a signal that both have.

*Correlation.* Both signals are brought to one rate, their means taken away; the delay is where

    c(d) = sum x(t) y(t - d) / sqrt(sum x(t)^2 sum y(t - d)^2)

over the samples both have is largest (C. H. Knapp, G. C. Carter 1976, IEEE Trans. ASSP 24, 320-327), refined by the
parabola through three points. *Phase.* For a motion at steady speed, the phases of one frequency f are compared; the
delay is known up to multiples of 1/f, and the one nearest to zero is returned.

The delay [s] is added to the times of the second record.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Delay:
    """Delay between two records.

    Attributes
    ----------
    value
        to be added to the times of the second record [s].
    agreement
        correlation at that delay, or the part of both signals' power that lies at the frequency: at most 1.
    rival
        largest correlation at a delay apart from it; as large as the agreement where the signal repeats itself.
    """

    value: float
    agreement: float
    rival: float = 0.0


def delay_by_correlation(first: Array, second: Array, interval: float, bounds: tuple[float, float]) -> Delay:
    """Return the delay at which two signals agree best.

    Parameters
    ----------
    first, second
        (N,), (M,) samples from the same nominal time on, at one rate.
    interval
        between samples [s].
    bounds
        least and largest delay looked for [s].
    """
    from scipy.signal import fftconvolve

    # products of the signals, and their powers, at every lag
    x, y = first - first.mean(), second - second.mean()
    flipped = y[::-1]
    n = x.size
    m = y.size
    lags = np.arange(-(m - 1), n)  # second moved by lag samples
    product = fftconvolve(x, flipped)
    own = fftconvolve(x**2, np.ones(m))
    other = fftconvolve(np.ones(n), flipped**2)
    shared = np.minimum(n, lags + m) - np.maximum(0, lags)
    scale = np.sqrt(np.clip(own, 0.0, None) * np.clip(other, 0.0, None))
    # lags within the bounds at which enough samples are shared
    usable = (lags * interval >= bounds[0]) & (lags * interval <= bounds[1])
    usable &= (2 * shared >= min(n, m)) & (scale > 1e-12 * scale.max())
    if not usable.any():
        return Delay(0.0, 0.0)
    # the largest correlation, refined by a parabola
    c = np.where(usable, product / np.where(scale > 0.0, scale, 1.0), -np.inf)
    best = int(np.argmax(c))
    fine = 0.0
    if 0 < best < c.size - 1 and np.isfinite(c[best - 1]) and np.isfinite(c[best + 1]):
        bend = c[best - 1] - 2.0 * c[best] + c[best + 1]
        fine = 0.5 * (c[best - 1] - c[best + 1]) / bend if bend < 0.0 else 0.0
    # the largest other peak
    peaks = (c[1:-1] >= c[:-2]) & (c[1:-1] >= c[2:]) & (np.arange(1, c.size - 1) != best)
    rival = float(c[1:-1][peaks].max(initial=0.0))
    return Delay(float(lags[best] + fine) * interval, float(c[best]), rival)


def delay_by_phase(first: tuple[Array, Array], second: tuple[Array, Array], frequency: float) -> Delay:
    """Return the delay nearest to zero at which the phases of one frequency agree.

    Parameters
    ----------
    first, second
        times [s] and values of each signal; each spans a period or more.
    frequency
        at which both are compared [Hz].
    """
    one, share = _component(*first, frequency)
    two, other = _component(*second, frequency)
    turn = float(np.angle(two * np.conj(one)))  # x = Re(z exp(i w t)): behind by d means z exp(-i w d)
    return Delay(turn / (2.0 * np.pi * frequency), min(share, other))


def _component(time: Array, values: Array, frequency: float) -> tuple[complex, float]:
    """Return the complex amplitude of one frequency by least squares with a mean, and its part of the power."""
    angle = 2.0 * np.pi * frequency * time
    basis = np.stack([np.cos(angle), np.sin(angle), np.ones_like(angle)], axis=1)
    (a, b, _), *_ = np.linalg.lstsq(basis, values, rcond=None)
    swing = values - values.mean()
    power = float(swing @ swing)
    wave = basis[:, :2] @ np.array([a, b])
    return complex(a, -b), float(wave @ wave) / power if power > 0.0 else 0.0
