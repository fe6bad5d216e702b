"""Confidence limits of averaged spectra: densities, coherences and transfer functions.

*Averages.* K segments of one record, D samples apart, tapered by w, are worth

    n = K / (1 + 2 sum_(j=1)^(K-1) (1 - j/K) r_j),    r_j = [sum_k w_k w_(k+jD)]^2 / [sum_k w_k^2]^2

segments that do not overlap (P. D. Welch 1967, IEEE Trans. Audio Electroacoust. AU-15, 70-73), where the spectrum is
flat across a taper's lobe. Hann and half a segment: n is 36/37 K for two segments and 18/19 K for many.

*Density.* 2 n S'/S is distributed as chi-square with 2 n degrees of freedom, n at zero and at half the rate.

*Coherence.* For Gaussian signals of coherence C the estimate x has the distribution of N. R. Goodman (1957, thesis,
Princeton; G. C. Carter, C. H. Knapp, A. H. Nuttall 1973, IEEE Trans. Audio Electroacoust. AU-21, 337-344),

    P(x | C, n) = sum_k (n)_k / k! C^k (1 - C)^n I_x(k + 1, n - 1),

I the incomplete beta function. It is integrated from its density over artanh sqrt(x), where it is nearly normal. Its
limits for C are those of an equal-tailed test; the better known normal approximation of artanh sqrt(x) (L. D. Enochson,
N. R. Goodman 1965, AFFDL-TR-65-57) is good for n > 20 only.

*Transfer function.* H = S_xy / S_xx lies with probability p within a circle about its estimate of the relative radius

    r^2 = ((1 - p)^(-1 / (n - 1)) - 1) (1 - x) / x

(J. S. Bendat, A. G. Piersol, Random Data, 4th ed. 2010, sec. 9.2: the F quantile of 2 and 2 n - 2 degrees of freedom in
closed form); gain and phase lie within |H| (1 +- r) and arcsin r both at once, so the probability of each is above p.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEVEL = 0.95
"""Default probability of limits."""
_PANEL = 40  # nodes in each of three panels of the integral over the estimate
_TABLE = 97  # coherences of which quantiles are worked out; limits of others are interpolated
_STEPS = 40
_FARTHEST = 9.0  # artanh sqrt of the largest coherence: 1 - 6e-8


def averages(window: Array, step: int, segments: int) -> float:
    """Return the number of segments without overlap that overlapping ones are worth.

    Parameters
    ----------
    window
        (L,) the taper.
    step
        samples from one segment to the next, at least 1.
    segments
        how many, at least 1.
    """
    shared = 0.0
    power = float(window @ window)
    for j in range(1, min(segments, -(-window.size // step))):
        common = float(window[j * step :] @ window[: window.size - j * step])
        shared += (1.0 - j / segments) * (common / power) ** 2
    return segments / (1.0 + 2.0 * shared)


def density_factors(count: float, level: float = LEVEL) -> tuple[float, float]:
    """Return the factors of a density's lower and upper limit.

    ``count`` is that of the averages (see ``averages``); half of them at frequency zero and at half the sampling rate.
    """
    from scipy.special import gammaincinv

    tail = 0.5 * (1.0 - level)  # chi-square of 2 n degrees of freedom is twice a gamma of shape n
    return count / float(gammaincinv(count, 1.0 - tail)), count / float(gammaincinv(count, tail))


def coherence_below(value: Array, truth: Array, count: float) -> Array:
    """Return the probability that an estimated coherence is at most ``value``.

    Parameters
    ----------
    value, truth
        estimated and true coherence, from 0 to below 1, of shapes that broadcast.
    count
        averages, above 1.
    """
    y = np.arctanh(np.sqrt(np.asarray(value, np.float64)))
    eta = np.arctanh(np.sqrt(np.asarray(truth, np.float64)))
    y, eta = np.broadcast_arrays(y, eta)
    return _below(y, eta, count)


def coherence_limits(value: Array, count: float, level: float = LEVEL) -> tuple[Array, Array]:
    """Return lower and upper limits of coherences, from 0 to 1, within 1e-3.

    Quantiles of the estimate are worked out for 97 coherences and read backwards, straight between them.

    Parameters
    ----------
    value
        (f,) estimates; NaN gives NaN.
    count
        averages, above 1; at 1 nothing is known, and the limits are 0 and 1.
    """
    value = np.asarray(value, np.float64)
    known = np.isfinite(value)
    if count <= 1.0 + 1e-9:
        return np.where(known, 0.0, np.nan), np.where(known, 1.0, np.nan)
    y = np.minimum(np.arctanh(np.sqrt(np.clip(value, 0.0, np.tanh(_FARTHEST) ** 2))), _FARTHEST)
    spread = 1.0 / np.sqrt(2.0 * (count - 1.0))
    reach = float(y[known].max(initial=0.0)) + 8.0 * spread + 4.0 / (count - 1.0)
    eta = reach * np.linspace(0.0, 1.0, _TABLE) ** 2
    limits = []
    for probability in (0.5 + 0.5 * level, 0.5 - 0.5 * level):  # the least truth makes so large an estimate rare
        quantile = _quantiles(eta, count, probability)
        limits.append(np.where(known, np.tanh(np.interp(y, quantile, eta)) ** 2, np.nan))
    return limits[0], limits[1]


def _below(y: Array, eta: Array, count: float) -> Array:
    """Return the distribution over y = artanh sqrt(x), eta that of C, by quadrature in three panels."""
    nodes, weights = np.polynomial.legendre.leggauss(_PANEL)
    spread = 1.0 / np.sqrt(2.0 * (count - 1.0))
    stops = [np.maximum(eta - 12.0 * spread, 0.0), eta, eta + 6.0 * spread, eta + 6.0 * spread + 16.0 / (count - 1.0)]
    total = np.zeros(y.shape)
    for begin, end in pairwise(stops):
        low = np.minimum(begin, y)
        high = np.minimum(end, y)
        half = 0.5 * (high - low)
        at = (0.5 * (low + high))[..., None] + half[..., None] * nodes
        total += half * (_density(at, eta[..., None], count) @ weights)
    return np.asarray(np.clip(total, 0.0, 1.0))


def _density(y: Array, eta: Array, count: float) -> Array:
    """Return Goodman's density over y; its hypergeometric function as the Legendre function it is.

    2F1(n, n; 1; z) = (1 - z)^-n P_(n-1)((1 + z) / (1 - z)), and by Laplace's integral the mean over an angle p of
    |1 + sqrt(z) exp(i p)|^(2 n - 2) is (1 - z)^(n - 1) P_(n-1): periodic and smooth, so equal steps do.
    """
    angles = np.pi * (np.arange(int(32 + 4.0 * np.sqrt(count))) + 0.5) / int(32 + 4.0 * np.sqrt(count))
    # 1 - x, 1 - C
    left = np.cosh(y) ** -2.0
    right = np.cosh(eta) ** -2.0
    root = np.tanh(y) * np.tanh(eta)
    gap = left + right - left * right  # 1 - x C, without cancellation
    top = 2.0 * np.log1p(root)  # at angle zero, where the mean is largest
    shape = np.log1p(root**2)[..., None] + np.log1p((2.0 * root / (1.0 + root**2))[..., None] * np.cos(angles))
    mean = np.mean(np.exp((count - 1.0) * (shape - top[..., None])), axis=-1)
    exponent = count * np.log(right) + (count - 1.0) * np.log(left) - (2.0 * count - 1.0) * np.log(gap)
    return np.asarray(2.0 * (count - 1.0) * np.tanh(y) * np.exp(exponent + (count - 1.0) * top) * mean)


def _quantiles(eta: Array, count: float, probability: float) -> Array:
    """Return the quantiles y of an estimate: Newton's method kept within brackets."""
    low = np.zeros(eta.size)
    high = eta + 12.0 / np.sqrt(2.0 * (count - 1.0)) + 20.0 / (count - 1.0)
    y = eta + 0.5 / (count - 1.0)
    for _ in range(_STEPS):
        excess = _below(y, eta, count) - probability
        low = np.where(excess < 0.0, y, low)
        high = np.where(excess < 0.0, high, y)
        slope = _density(y[:, None], eta[:, None], count)[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            better = y - excess / slope
        inside = (better > low) & (better < high)
        new = np.where(inside, better, 0.5 * (low + high))
        settled = np.abs(new - y).max() < 1e-9
        y = new
        if settled:
            break
    return y


def coherence_threshold(count: float, level: float = LEVEL) -> float:
    """Return the coherence below which independent signals stay with a probability of ``level``."""
    return 1.0 - (1.0 - level) ** (1.0 / (count - 1.0)) if count > 1.0 + 1e-9 else 1.0


def response_radius(coherence: Array, count: float, level: float = LEVEL) -> Array:
    """Return the radius of the circle about a transfer function, relative to its modulus; infinite without power.

    Parameters
    ----------
    coherence
        (f,) estimates.
    count
        averages; at 1 nothing is known, and the radius is infinite.
    """
    coherence = np.asarray(coherence, np.float64)
    if count <= 1.0 + 1e-9:
        return np.full(coherence.shape, np.inf)
    quantile = (1.0 - level) ** (-1.0 / (count - 1.0)) - 1.0
    with np.errstate(divide="ignore"):
        return np.asarray(np.sqrt(quantile * np.clip(1.0 - coherence, 0.0, None) / coherence))
